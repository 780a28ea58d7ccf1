/* print.c - into a buffer that doubles; the first failure sticks. */
#include "json/print.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/number.h"

enum { FIRST_SIZE = 256 };

struct printer {
    char *text;
    size_t n, size, limit;
    enum status status;
};

static void put_bytes(struct printer *p, const char *bytes, size_t n)
{
    if (p->status != STATUS_OK)
        return;
    if (n > p->limit - p->n) {
        p->status = STATUS_RANGE;
        return;
    }
    size_t size = p->size > 0 ? p->size : FIRST_SIZE;
    while (size <= p->n + n)
        size *= 2;
    char *text = size > p->size ? realloc(p->text, size) : p->text;
    if (text == NULL) {
        p->status = STATUS_NO_MEMORY;
        return;
    }
    p->text = text;
    p->size = size;
    memcpy(p->text + p->n, bytes, n);
    p->n += n;
}

static void put(struct printer *p, const char *text)
{
    put_bytes(p, text, strlen(text));
}

static void put_escaped(struct printer *p, unsigned char c)
{
    static const char plain[] = "\"\\\b\f\n\r\t", letter[] = "\"\\bfnrt";
    char text[8];
    const char *at = strchr(plain, c);
    if (at != NULL)
        snprintf(text, sizeof text, "\\%c", letter[at - plain]);
    else
        snprintf(text, sizeof text, "\\u%04x", c);
    put(p, text);
}

static void put_string(struct printer *p, const char *text)
{
    put(p, "\"");
    while (*text != '\0') {
        const char *plain = text;
        while ((unsigned char)*text >= 0x20 && *text != '"' && *text != '\\')
            text++;
        put_bytes(p, plain, (size_t)(text - plain));
        if (*text != '\0')
            put_escaped(p, (unsigned char)*text++);
    }
    put(p, "\"");
}

static void put_number(struct printer *p, double x)
{
    char text[NUMBER_TEXT_SIZE];
    if (isfinite(x))
        put(p, number_format_exact(x, text));
    else if (p->status == STATUS_OK)
        p->status = STATUS_FORMAT;
}

static void put_value(struct printer *p, const cJSON *value);

static void put_members(struct printer *p, const cJSON *value)
{
    put(p, cJSON_IsObject(value) ? "{" : "[");
    for (const cJSON *one = value->child; one != NULL; one = one->next) {
        if (one != value->child)
            put(p, ",");
        if (cJSON_IsObject(value)) {
            put_string(p, one->string);
            put(p, ":");
        }
        put_value(p, one);
    }
    put(p, cJSON_IsObject(value) ? "}" : "]");
}

static void put_value(struct printer *p, const cJSON *value)
{
    if (cJSON_IsObject(value) || cJSON_IsArray(value))
        put_members(p, value);
    else if (cJSON_IsNumber(value))
        put_number(p, value->valuedouble);
    else if (cJSON_IsString(value))
        put_string(p, value->valuestring);
    else if (cJSON_IsRaw(value))
        put(p, value->valuestring);
    else if (cJSON_IsBool(value))
        put(p, cJSON_IsTrue(value) ? "true" : "false");
    else
        put(p, "null");
}

enum status json_print(const cJSON *value, size_t limit, char **ret, size_t *length)
{
    struct printer p = { .limit = limit, .status = value != NULL ? STATUS_OK : STATUS_NO_MEMORY };
    put(&p, ""); /* room for the NUL, whatever follows */
    if (value != NULL)
        put_value(&p, value);
    if (p.status != STATUS_OK) {
        free(p.text);
        return p.status;
    }
    p.text[p.n] = '\0';
    *ret = p.text;
    if (length != NULL)
        *length = p.n;
    return STATUS_OK;
}
