/* maker.c - members put into cJSON's objects. */
#include "json/maker.h"

#include <math.h>

struct maker maker_begin(void)
{
    cJSON *object = cJSON_CreateObject();
    return (struct maker){ object, object != NULL ? STATUS_OK : STATUS_NO_MEMORY };
}

enum status maker_end(struct maker *m, cJSON **ret)
{
    if (m->status == STATUS_OK)
        *ret = m->object;
    else
        cJSON_Delete(m->object);
    return m->status;
}

void maker_fail(struct maker *m, enum status status)
{
    if (m->status == STATUS_OK)
        m->status = status;
}

void maker_put(struct maker *m, const char *name, cJSON *value)
{
    if (value != NULL && m->status == STATUS_OK && cJSON_AddItemToObject(m->object, name, value))
        return;
    cJSON_Delete(value);
    maker_fail(m, STATUS_NO_MEMORY);
}

void maker_number(struct maker *m, const char *name, double x)
{
    if (isfinite(x))
        maker_put(m, name, cJSON_CreateNumber(x));
    else
        maker_fail(m, STATUS_RANGE);
}

void maker_known_number(struct maker *m, const char *name, double x)
{
    if (isfinite(x))
        maker_put(m, name, cJSON_CreateNumber(x));
}

void maker_text(struct maker *m, const char *name, const char *text)
{
    maker_put(m, name, cJSON_CreateString(text));
}

void maker_known_text(struct maker *m, const char *name, const char *text)
{
    if (*text != '\0')
        maker_text(m, name, text);
}

void maker_numbers(struct maker *m, const char *name, const double *x, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (!isfinite(x[i]))
            maker_fail(m, STATUS_RANGE);
    maker_put(m, name, cJSON_CreateDoubleArray(x, (int)n)); /* no array of ours has 2^31 */
}

void maker_made(struct maker *m, const char *name, enum status s, cJSON *made)
{
    if (s == STATUS_OK)
        maker_put(m, name, made);
    else
        maker_fail(m, s);
}

struct maker maker_begin_array(void)
{
    cJSON *array = cJSON_CreateArray();
    return (struct maker){ array, array != NULL ? STATUS_OK : STATUS_NO_MEMORY };
}

void maker_append(struct maker *m, enum status s, cJSON *value)
{
    if (s == STATUS_OK && value != NULL && m->status == STATUS_OK &&
        cJSON_AddItemToArray(m->object, value))
        return;
    cJSON_Delete(value);
    maker_fail(m, s != STATUS_OK ? s : STATUS_NO_MEMORY);
}

void maker_nested(struct maker *m, const char *name, struct maker *filled)
{
    cJSON *made = NULL;
    enum status s = maker_end(filled, &made);
    maker_made(m, name, s, made);
}
