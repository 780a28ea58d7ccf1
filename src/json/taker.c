/* taker.c - members taken out of cJSON's objects. */
#include "json/taker.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "json/print.h"

const cJSON *taker_member(const struct taker *t, const char *name)
{
    return cJSON_GetObjectItemCaseSensitive(t->object, name);
}

double taker_known_number(struct taker *t, const char *name)
{
    const cJSON *value = taker_member(t, name);
    if (value == NULL)
        return NAN;
    t->failed = t->failed || !cJSON_IsNumber(value);
    return value->valuedouble;
}

double taker_number(struct taker *t, const char *name)
{
    double x = taker_known_number(t, name);
    t->failed = t->failed || !isfinite(x);
    return x;
}

int64_t taker_integer(struct taker *t, const char *name)
{
    double x = taker_number(t, name);
    if (fabs(x) <= 9007199254740991.0)
        return (int64_t)x;
    t->failed = true;
    return 0;
}

void taker_known_text(struct taker *t, const char *name, char *into, size_t size)
{
    const cJSON *value = taker_member(t, name);
    const char *text = value != NULL ? cJSON_GetStringValue(value) : "";
    if (text == NULL || strlen(text) >= size)
        t->failed = true;
    else
        strcpy(into, text);
}

void taker_text(struct taker *t, const char *name, char *into, size_t size)
{
    t->failed = t->failed || taker_member(t, name) == NULL;
    taker_known_text(t, name, into, size);
}

size_t taker_numbers(struct taker *t, const char *name, double *into, size_t max)
{
    const cJSON *array = taker_member(t, name), *one;
    size_t n = 0;
    cJSON_ArrayForEach(one, array)
    {
        if (n == max || !cJSON_IsNumber(one)) {
            t->failed = true;
            break;
        }
        into[n++] = one->valuedouble;
    }
    return n;
}

void taker_json(struct taker *t, const char *name, char *into, size_t size)
{
    const cJSON *value = taker_member(t, name);
    char *text = NULL;
    if (value == NULL)
        return;
    if (json_print(value, size - 1, &text, NULL) == STATUS_OK)
        strcpy(into, text);
    else
        t->failed = true;
    free(text);
}
