/* csource.c - text of plan/costs.h, a string a line. */
#include "trial/csource.h"

#include <stdlib.h>
#include <string.h>

enum { COLUMNS = 91 }; /* of a string: with indent, quotes, \n and a comma a line has 100 */

/* A line of text as one string or several, quotes and backslashes kept from ending it. */
static void string_of(FILE *stream, const char *line, size_t n)
{
    for (size_t begin = 0; begin < n || n == 0;) {
        size_t length = n - begin < COLUMNS ? n - begin : COLUMNS;
        fputs("    \"", stream);
        for (size_t i = begin; i < begin + length; i++) {
            if (line[i] == '"' || line[i] == '\\')
                fputc('\\', stream);
            fputc(line[i], stream);
        }
        begin += length;
        fputs(begin == n ? "\\n\"" : "\"\n", stream);
        if (n == 0)
            break;
    }
}

enum status trial_csource(FILE *stream, const struct costs *costs)
{
    char *text = NULL;
    size_t size = 0;
    FILE *memory = open_memstream(&text, &size);
    if (memory == NULL)
        return STATUS_NO_MEMORY;
    costs_print(memory, costs);
    if (fclose(memory) != 0) {
        free(text);
        return STATUS_NO_MEMORY;
    }
    fputs(
        "/* costs_default.c - made by `skinspec bench --c-source` (make error-vs-time); not to be "
        "edited. */\n#include \"plan/costs_default.h\"\n\n#include <stddef.h>\n\nconst char *const "
        "costs_default_lines[] = {\n",
        stream);
    for (const char *at = text; *at != '\0';) {
        size_t n = strcspn(at, "\n");
        string_of(stream, at, n);
        at += n + 1;
        fputs(",\n", stream);
    }
    fputs("    NULL,\n};\n", stream);
    free(text);
    return STATUS_OK;
}
