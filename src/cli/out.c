/* out.c - cJSON objects and CSV fields to standard output. */
#include "cli/out.h"

#include <errno.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "base/number.h"
#include "json/print.h"

void out_begin(struct out *out, enum out_format format)
{
    *out = (struct out){ .format = format };
    if (format == OUT_JSON)
        fputs("[", stdout);
}

void out_of_memory(void)
{
    log_error("%s", status_text(STATUS_NO_MEMORY));
    exit(EXIT_FAILURE);
}

void out_object(struct out *out, cJSON *object)
{
    char *text;
    if (json_print(object, SIZE_MAX, &text, NULL) != STATUS_OK)
        out_of_memory();
    if (out->format == OUT_JSON)
        fputs(out->objects > 0 ? ",\n" : "\n", stdout);
    fputs(text, stdout);
    if (out->format == OUT_NDJSON)
        fputs("\n", stdout);
    out->objects++;
    free(text);
    cJSON_Delete(object);
}

void out_item(struct out *out, cJSON *object, void (*print)(const cJSON *object))
{
    if (out->format != OUT_PLAIN) {
        out_object(out, object);
        return;
    }
    print(object);
    cJSON_Delete(object);
}

void out_one(cJSON *object)
{
    struct out out;
    out_begin(&out, OUT_NDJSON);
    out_object(&out, object);
}

void out_all(enum out_format format, cJSON *array)
{
    struct out out;
    cJSON *one;
    out_begin(&out, format);
    while ((one = cJSON_DetachItemFromArray(array, 0)) != NULL)
        out_object(&out, one);
    cJSON_Delete(array);
    out_end(&out);
}

void out_text(struct out *out, const char *text)
{
    if (out->fields++ > 0)
        putchar(',');
    if (strpbrk(text, ",\"\r\n") == NULL && *text != '#') {
        fputs(text, stdout);
        return;
    }
    putchar('"');
    for (; *text != '\0'; text++) {
        if (*text == '"')
            putchar('"');
        putchar(*text);
    }
    putchar('"');
}

void out_number(struct out *out, double x, int digits)
{
    char text[NUMBER_TEXT_SIZE];
    out_text(out, isnan(x) ? "" : number_format(x, digits, text));
}

void out_row(struct out *out)
{
    putchar('\n');
    out->fields = 0;
}

enum status out_end(struct out *out)
{
    if (out->format == OUT_JSON)
        fputs(out->objects > 0 ? "\n]\n" : "]\n", stdout);
    return out_exit(true) == EXIT_SUCCESS ? STATUS_OK : STATUS_IO;
}

int out_exit(bool done)
{
    static bool told;
    if (fflush(stdout) == 0 && !ferror(stdout))
        return done ? EXIT_SUCCESS : EXIT_FAILURE;
    if (!told)
        log_error("cannot write the results: %s", strerror(errno));
    told = true;
    return EXIT_FAILURE;
}

cJSON *out_numbers(const double *x, size_t n)
{
    cJSON *array = cJSON_CreateArray();
    for (size_t i = 0; i < n; i++) {
        cJSON *item = isfinite(x[i]) ? cJSON_CreateNumber(x[i]) : cJSON_CreateNull();
        if (item == NULL || !cJSON_AddItemToArray(array, item))
            out_of_memory();
    }
    return array;
}

void out_member(cJSON *object, const char *name, double x)
{
    if (isfinite(x) && cJSON_AddNumberToObject(object, name, x) == NULL)
        out_of_memory();
}
