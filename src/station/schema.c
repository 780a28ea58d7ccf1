/* schema.c - a value walked beside the tree that its schema was compiled to. */
#include "station/schema.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "base/number.h"
#include "station/schema_private.h"
#include "station/strict_json.h"

/* ---- what its files share ----------------------------------------------------------- */

static size_t put_path(const struct schema_place *place, char *path, size_t size)
{
    size_t n = place->above != NULL ? put_path(place->above, path, size) : 0;
    if (n >= size)
        return n;
    int more = place->above == NULL  ? snprintf(path, size, "%s", place->name)
               : place->name != NULL ? snprintf(path + n, size - n, "/%s", place->name)
                                     : snprintf(path + n, size - n, "/%zu", place->index);
    return n + (more > 0 ? (size_t)more : 0);
}

bool schema_fail(struct schema_error *error, const struct schema_place *place, const char *format,
                 ...)
{
    va_list list;
    put_path(place, error->path, sizeof error->path);
    va_start(list, format);
    vsnprintf(error->what, sizeof error->what, format, list);
    va_end(list);
    return false;
}

struct schema_property *schema_property_of(const struct schema *s, const char *name)
{
    for (size_t i = 0; i < s->n; i++)
        if (strcmp(s->properties[i].name, name) == 0)
            return &s->properties[i];
    return NULL;
}

/* ---- checking ----------------------------------------------------------------------- */

static bool check(const struct schema *s, const cJSON *value, const struct schema_place *place,
                  struct schema_error *error);

/* "one of a, b, c" */
static bool fail_choices(const struct schema *s, const cJSON *value,
                         const struct schema_place *place, struct schema_error *error)
{
    char list[256], echo[STRICT_JSON_ECHO_SIZE];
    size_t n = 0;
    const cJSON *one;
    list[0] = '\0';
    cJSON_ArrayForEach(one, s->choices)
    {
        if (n < sizeof list)
            n += (size_t)snprintf(list + n, sizeof list - n, "%s%s", n > 0 ? ", " : "",
                                  one->valuestring);
    }
    return schema_fail(error, place, "must be one of %s, not %.200s", list,
                       strict_json_echo(value->valuestring, echo));
}

static bool is_choice(const struct schema *s, const char *text)
{
    const cJSON *one;
    cJSON_ArrayForEach(one, s->choices) if (strcmp(one->valuestring, text) == 0) return true;
    return false;
}

static size_t characters(const char *text)
{
    size_t n = 0;
    for (; *text != '\0'; text++)
        n += ((unsigned char)*text & 0xc0) != 0x80;
    return n;
}

static bool check_string(const struct schema *s, const cJSON *value,
                         const struct schema_place *place, struct schema_error *error)
{
    const char *text = value->valuestring;
    char echo[STRICT_JSON_ECHO_SIZE];
    size_t n = characters(text);
    if (s->choices != NULL && !is_choice(s, text))
        return fail_choices(s, value, place, error);
    if (n < s->min_length)
        return n == 0
                   ? schema_fail(error, place, "must not be empty")
                   : schema_fail(error, place, "must have %zu characters or more", s->min_length);
    if (n > s->max_length)
        return schema_fail(error, place, "must have at most %zu characters", s->max_length);
    if (strlen(text) > s->max_bytes)
        return schema_fail(error, place, "must have at most %zu bytes", s->max_bytes);
    if (s->format != NULL && !s->format->check(text))
        return schema_fail(error, place, "must be %s, not %s", s->format->expected,
                           strict_json_echo(text, echo));
    return true;
}

/* "from 1 to 32", "of at least 0", or nothing. */
static const char *range_text(const struct schema *s, char text[96])
{
    char low[NUMBER_TEXT_SIZE], high[NUMBER_TEXT_SIZE];
    text[0] = '\0';
    number_format_exact(s->minimum, low);
    number_format_exact(s->maximum, high);
    if (isfinite(s->minimum) && isfinite(s->maximum))
        snprintf(text, 96, " from %s to %s", low, high);
    else if (isfinite(s->minimum))
        snprintf(text, 96, " of at least %s", low);
    else if (isfinite(s->maximum))
        snprintf(text, 96, " of at most %s", high);
    return text;
}

static bool check_number(const struct schema *s, const cJSON *value,
                         const struct schema_place *place, struct schema_error *error)
{
    double x = value->valuedouble;
    char range[96], text[NUMBER_TEXT_SIZE];
    bool whole = s->type != TYPE_INTEGER || (floor(x) == x && fabs(x) <= SCHEMA_MAX_INTEGER);
    if (whole && x >= s->minimum && x <= s->maximum && isfinite(x))
        return true;
    return schema_fail(error, place, "must be %s%s, not %s",
                       s->type == TYPE_INTEGER ? "an integer" : "a number", range_text(s, range),
                       number_format_exact(x, text));
}

static bool unique_strings(const cJSON *array)
{
    for (const cJSON *a = array->child; a != NULL; a = a->next)
        for (const cJSON *b = a->next; b != NULL; b = b->next)
            if (strcmp(a->valuestring, b->valuestring) == 0)
                return false;
    return true;
}

static bool check_array(const struct schema *s, const cJSON *value,
                        const struct schema_place *place, struct schema_error *error)
{
    size_t n = (size_t)cJSON_GetArraySize(value), i = 0;
    if (n < s->min_items || n > s->max_items)
        return s->min_items == s->max_items
                   ? schema_fail(error, place, "must have %zu items, not %zu", s->min_items, n)
               : n < s->min_items
                   ? schema_fail(error, place, "must have %zu items or more, not %zu", s->min_items,
                                 n)
                   : schema_fail(error, place, "must have at most %zu items, not %zu", s->max_items,
                                 n);
    const cJSON *one;
    cJSON_ArrayForEach(one, value)
    {
        struct schema_place here = { place, NULL, i++ };
        if (s->items != NULL && !check(s->items, one, &here, error))
            return false;
    }
    return !s->unique || unique_strings(value) ||
           schema_fail(error, place, "must name each item once");
}

static bool check_object(const struct schema *s, const cJSON *value,
                         const struct schema_place *place, struct schema_error *error)
{
    char echo[STRICT_JSON_ECHO_SIZE];
    const cJSON *one;
    cJSON_ArrayForEach(one, value)
    {
        const struct schema_property *p = schema_property_of(s, one->string);
        if (p == NULL && s->closed)
            return schema_fail(error, place, "has a member %s that is not known",
                               strict_json_echo(one->string, echo));
        struct schema_place here = { place, p != NULL ? p->name : "", 0 };
        if (p != NULL && !check(p->schema, one, &here, error))
            return false;
    }
    for (size_t i = 0; i < s->n; i++)
        if (s->properties[i].required && strict_json_member(value, s->properties[i].name) == NULL)
            return schema_fail(error, place, "lacks the member \"%s\"", s->properties[i].name);
    return true;
}

static bool check_boolean(const struct schema *s, const cJSON *value,
                          const struct schema_place *place, struct schema_error *error)
{
    (void)s, (void)value, (void)place, (void)error;
    return true;
}

static const struct kind {
    const char *expected;
    cJSON_bool (*is)(const cJSON *value);
    bool (*check)(const struct schema *s, const cJSON *value, const struct schema_place *place,
                  struct schema_error *error);
} kinds[SCHEMA_TYPES] = {
    [TYPE_STRING] = { "a string", cJSON_IsString, check_string },
    [TYPE_INTEGER] = { "an integer", cJSON_IsNumber, check_number },
    [TYPE_NUMBER] = { "a number", cJSON_IsNumber, check_number },
    [TYPE_BOOLEAN] = { "true or false", cJSON_IsBool, check_boolean },
    [TYPE_OBJECT] = { "an object", cJSON_IsObject, check_object },
    [TYPE_ARRAY] = { "an array", cJSON_IsArray, check_array },
};

static const char *article_of(const cJSON *value)
{
    if (cJSON_IsBool(value))
        return cJSON_IsTrue(value) ? "true" : "false";
    for (size_t i = 0; i < SCHEMA_TYPES; i++)
        if (i != TYPE_INTEGER && kinds[i].is(value))
            return kinds[i].expected;
    return "null";
}

/* "an array or an object" */
static bool fail_any(const struct schema *s, const cJSON *value, const struct schema_place *place,
                     struct schema_error *error)
{
    char list[96];
    size_t n = 0;
    for (size_t i = 0; i < s->any_n && n < sizeof list; i++)
        n += (size_t)snprintf(list + n, sizeof list - n, "%s%s", i > 0 ? " or " : "",
                              kinds[s->any[i]->type].expected);
    return schema_fail(error, place, "must be %s, not %s", list, article_of(value));
}

static bool check(const struct schema *s, const cJSON *value, const struct schema_place *place,
                  struct schema_error *error)
{
    for (size_t i = 0; i < s->any_n; i++)
        if (kinds[s->any[i]->type].is(value))
            return check(s->any[i], value, place, error);
    if (s->any_n > 0)
        return fail_any(s, value, place, error);
    const struct kind *kind = &kinds[s->type];
    if (!kind->is(value))
        return schema_fail(error, place, "must be %s, not %s", kind->expected, article_of(value));
    return kind->check(s, value, place, error);
}

bool schema_check(const struct schema *schema, const cJSON *value, const char *at,
                  struct schema_error *error)
{
    struct schema_place root = { NULL, at, 0 };
    return check(schema, value, &root, error);
}
