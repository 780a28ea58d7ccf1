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

static void put_bytes(const struct out *out, const char *bytes, size_t n)
{
    if (out->into != NULL)
        text_add(out->into, bytes, n);
    else
        fwrite(bytes, 1, n, stdout); /* a failure is seen at the end */
}

static void put(const struct out *out, const char *text)
{
    put_bytes(out, text, strlen(text));
}

void out_begin(struct out *out, enum out_format format)
{
    *out = (struct out){ .format = format };
    if (format == OUT_JSON)
        put(out, "[");
}

void out_begin_part(struct out *out, enum out_format format, size_t objects, struct text *into)
{
    *out = (struct out){ .format = format, .objects = objects, .into = into };
}

void out_of_memory(void)
{
    log_error("%s", status_text(STATUS_NO_MEMORY));
    exit(EXIT_FAILURE);
}

void out_object(struct out *out, cJSON *object)
{
    char *text;
    size_t n;
    if (json_print(object, SIZE_MAX, &text, &n) != STATUS_OK)
        out_of_memory();
    if (out->format == OUT_JSON)
        put(out, out->objects > 0 ? ",\n" : "\n");
    put_bytes(out, text, n);
    if (out->format == OUT_NDJSON)
        put(out, "\n");
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
        put(out, ",");
    if (strpbrk(text, ",\"\r\n") == NULL && *text != '#') {
        put(out, text);
        return;
    }
    put(out, "\"");
    for (; *text != '\0'; text++) {
        size_t n = strcspn(text, "\"");
        put_bytes(out, text, n);
        text += n;
        if (*text == '\0')
            break;
        put(out, "\"\"");
    }
    put(out, "\"");
}

void out_number(struct out *out, double x, int digits)
{
    char text[NUMBER_TEXT_SIZE];
    if (out->fields++ > 0)
        put(out, ",");
    if (!isnan(x))
        put(out, number_format(x, digits, text));
}

void out_row(struct out *out)
{
    put(out, "\n");
    out->fields = 0;
}

enum status out_end(struct out *out)
{
    if (out->format == OUT_JSON)
        put(out, out->objects > 0 ? "\n]\n" : "]\n");
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
