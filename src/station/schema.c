/* schema.c - a tree of nodes made from the schema, walked beside the value. */
#include "station/schema.h"

#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/number.h"
#include "base/uuid.h"
#include "station/strict_json.h"

enum schema_type { TYPE_STRING, TYPE_INTEGER, TYPE_NUMBER, TYPE_BOOLEAN, TYPE_OBJECT, TYPE_ARRAY };
enum { TYPES = 6, MAX_NESTED = 32, SHA256_DIGITS = 64 };

/* Integers beyond are not told apart by a double. */
static const double max_integer = 9007199254740991.0;

typedef bool format_check(const char *text);
struct format {
    const char *name;
    format_check *check;
    const char *expected;
};

struct schema {
    enum schema_type type;
    const cJSON *choices;                     /* array of strings, or NULL */
    size_t min_length, max_length, max_bytes; /* strings */
    const struct format *format;              /* or NULL */
    double minimum, maximum;                  /* numbers */
    struct schema *items;                     /* arrays */
    size_t min_items, max_items;
    bool unique;
    struct property *properties; /* objects; [n] */
    size_t n;
    bool closed;         /* no other members */
    struct schema **any; /* [any_n], of different types; then nothing above is looked at */
    size_t any_n;
};

struct property {
    const char *name;
    bool required;
    struct schema *schema;
};

/* ---- the place in a value, for messages --------------------------------------------- */

struct place {
    const struct place *above;
    const char *name; /* NULL: an index */
    size_t index;
};

static size_t put_path(const struct place *place, char *path, size_t size)
{
    size_t n = place->above != NULL ? put_path(place->above, path, size) : 0;
    if (n >= size)
        return n;
    int more = place->above == NULL  ? snprintf(path, size, "%s", place->name)
               : place->name != NULL ? snprintf(path + n, size - n, "/%s", place->name)
                                     : snprintf(path + n, size - n, "/%zu", place->index);
    return n + (more > 0 ? (size_t)more : 0);
}

static bool fail(struct schema_error *error, const struct place *place, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

static bool fail(struct schema_error *error, const struct place *place, const char *format, ...)
{
    va_list list;
    put_path(place, error->path, sizeof error->path);
    va_start(list, format);
    vsnprintf(error->what, sizeof error->what, format, list);
    va_end(list);
    return false;
}

/* ---- formats ------------------------------------------------------------------------ */

static bool only(const char *text, const char *allowed)
{
    return text[strspn(text, allowed)] == '\0';
}

#define LETTERS "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
#define DIGITS "0123456789"

static bool is_sha256(const char *text)
{
    return strlen(text) == SHA256_DIGITS && only(text, DIGITS "abcdef");
}

static bool is_token(const char *text)
{
    return only(text, LETTERS DIGITS "_");
}

static bool is_name(const char *text)
{
    return only(text, LETTERS DIGITS "_-") && *text != '-';
}

/* U+0000..U+001F, U+007F..U+009F but those allowed; the text is valid UTF-8. */
static bool has_control(const char *text, const char *allowed)
{
    for (const unsigned char *p = (const unsigned char *)text; *p != '\0'; p++)
        if (((*p < 0x20 || *p == 0x7f) && strchr(allowed, *p) == NULL) ||
            (*p == 0xc2 && p[1] < 0xa0))
            return true;
    return false;
}

static bool is_text(const char *text)
{
    return !has_control(text, "");
}

static bool is_notes(const char *text)
{
    return !has_control(text, "\n\t");
}

/* Of two digits. */
static int two(const char *text)
{
    return (text[0] - '0') * 10 + (text[1] - '0');
}

/* Digits at their places, and no month 13; days are not counted. */
static bool is_date_time(const char *text)
{
    static const char shape[] = "0000-00-00T00:00:00";
    size_t n = strlen(shape);
    for (size_t i = 0; i < n; i++)
        if (shape[i] == '0' ? strchr(DIGITS, text[i]) == NULL || text[i] == '\0'
                            : text[i] != shape[i])
            return false;
    int month = two(text + 5), day = two(text + 8), hour = two(text + 11);
    int minute = two(text + 14), second = two(text + 17);
    if (text[n] == '.') {
        size_t digits = strspn(text + n + 1, DIGITS);
        n += 1 + digits;
        if (digits == 0)
            return false;
    }
    return strcmp(text + n, "Z") == 0 && month >= 1 && month <= 12 && day >= 1 && day <= 31 &&
           hour < 24 && minute < 60 && second <= 60;
}

static const struct format formats[] = {
    { "uuid", uuid_is_text, "a UUID" },
    { "sha256", is_sha256, "64 hexadecimal digits in lower case" },
    { "date-time", is_date_time, "a time of RFC 3339 in UTC" },
    { "token", is_token, "made of letters, digits and _" },
    { "name", is_name, "made of letters, digits, - and _, not beginning with -" },
    { "text", is_text, "one line without control characters" },
    { "notes", is_notes, "text without control characters but line feeds and tabs" },
};

/* ---- compiling ---------------------------------------------------------------------- */

struct compiler {
    const cJSON *defs;
    bool closed;
    struct schema_error *error;
    enum status status;
    int depth;
};

/* The first cause counts. */
static bool refuse(struct compiler *c, const struct place *place, const char *why)
{
    c->status = STATUS_FORMAT;
    return fail(c->error, place, "%s", why);
}

static void *allocate(struct compiler *c, size_t n, size_t size)
{
    void *memory = calloc(n > 0 ? n : 1, size);
    if (memory == NULL)
        c->status = STATUS_NO_MEMORY;
    return memory;
}

static struct schema *compile(struct compiler *c, const cJSON *json, const struct place *place);

typedef bool keyword_read(struct compiler *c, struct schema *s, const cJSON *json,
                          const struct place *place);

static bool read_type(struct compiler *c, struct schema *s, const cJSON *json,
                      const struct place *place)
{
    static const char *const names[TYPES] = { "string",  "integer", "number",
                                              "boolean", "object",  "array" };
    for (size_t i = 0; cJSON_IsString(json) && i < TYPES; i++) {
        if (strcmp(json->valuestring, names[i]) == 0) {
            s->type = (enum schema_type)i;
            return true;
        }
    }
    return refuse(c, place, "no such type");
}

static bool all_strings(const cJSON *array)
{
    const cJSON *one;
    cJSON_ArrayForEach(one, array) if (!cJSON_IsString(one)) return false;
    return cJSON_IsArray(array);
}

static bool read_enum(struct compiler *c, struct schema *s, const cJSON *json,
                      const struct place *place)
{
    s->choices = json;
    return (all_strings(json) && json->child != NULL) || refuse(c, place, "must list strings");
}

static bool read_format(struct compiler *c, struct schema *s, const cJSON *json,
                        const struct place *place)
{
    for (size_t i = 0; cJSON_IsString(json) && i < sizeof formats / sizeof *formats; i++) {
        if (strcmp(json->valuestring, formats[i].name) == 0) {
            s->format = &formats[i];
            return true;
        }
    }
    return refuse(c, place, "no such format");
}

static bool read_count(struct compiler *c, const cJSON *json, const struct place *place,
                       size_t *ret)
{
    double x = cJSON_IsNumber(json) ? json->valuedouble : -1.0;
    if (!(x >= 0.0 && x <= max_integer) || floor(x) != x)
        return refuse(c, place, "must be a count");
    *ret = (size_t)x;
    return true;
}

static bool read_limit(struct compiler *c, const cJSON *json, const struct place *place,
                       double *ret)
{
    if (!cJSON_IsNumber(json))
        return refuse(c, place, "must be a number");
    *ret = json->valuedouble;
    return true;
}

static bool read_min_length(struct compiler *c, struct schema *s, const cJSON *json,
                            const struct place *place)
{
    return read_count(c, json, place, &s->min_length);
}

static bool read_max_length(struct compiler *c, struct schema *s, const cJSON *json,
                            const struct place *place)
{
    return read_count(c, json, place, &s->max_length);
}

static bool read_max_bytes(struct compiler *c, struct schema *s, const cJSON *json,
                           const struct place *place)
{
    return read_count(c, json, place, &s->max_bytes);
}

static bool read_minimum(struct compiler *c, struct schema *s, const cJSON *json,
                         const struct place *place)
{
    return read_limit(c, json, place, &s->minimum);
}

static bool read_maximum(struct compiler *c, struct schema *s, const cJSON *json,
                         const struct place *place)
{
    return read_limit(c, json, place, &s->maximum);
}

static bool read_min_items(struct compiler *c, struct schema *s, const cJSON *json,
                           const struct place *place)
{
    return read_count(c, json, place, &s->min_items);
}

static bool read_max_items(struct compiler *c, struct schema *s, const cJSON *json,
                           const struct place *place)
{
    return read_count(c, json, place, &s->max_items);
}

static bool read_unique(struct compiler *c, struct schema *s, const cJSON *json,
                        const struct place *place)
{
    s->unique = cJSON_IsTrue(json) && s->items != NULL && s->items->type == TYPE_STRING;
    return s->unique || refuse(c, place, "must be true, beside items that are strings");
}

static bool read_additional(struct compiler *c, struct schema *s, const cJSON *json,
                            const struct place *place)
{
    s->closed = true;
    return cJSON_IsFalse(json) || refuse(c, place, "must be false");
}

static bool read_items(struct compiler *c, struct schema *s, const cJSON *json,
                       const struct place *place)
{
    s->items = compile(c, json, place);
    return s->items != NULL;
}

static bool read_properties(struct compiler *c, struct schema *s, const cJSON *json,
                            const struct place *place)
{
    if (!cJSON_IsObject(json))
        return refuse(c, place, "must be an object");
    s->closed = s->closed || c->closed;
    s->properties = allocate(c, (size_t)cJSON_GetArraySize(json), sizeof *s->properties);
    if (s->properties == NULL)
        return false;
    const cJSON *one;
    cJSON_ArrayForEach(one, json)
    {
        struct place here = { place, one->string, 0 };
        struct property *p = &s->properties[s->n];
        p->name = one->string;
        p->schema = compile(c, one, &here);
        if (p->schema == NULL)
            return false;
        s->n++;
    }
    return true;
}

static struct property *find_property(const struct schema *s, const char *name)
{
    for (size_t i = 0; i < s->n; i++)
        if (strcmp(s->properties[i].name, name) == 0)
            return &s->properties[i];
    return NULL;
}

/* After properties: keywords are taken in the order of the table below. */
static bool read_required(struct compiler *c, struct schema *s, const cJSON *json,
                          const struct place *place)
{
    if (!all_strings(json))
        return refuse(c, place, "must list strings");
    const cJSON *one;
    cJSON_ArrayForEach(one, json)
    {
        struct property *p = find_property(s, one->valuestring);
        if (p == NULL)
            return refuse(c, place, "names a member that is no property");
        p->required = true;
    }
    return true;
}

/* Different types, so that a value that is wrong is wrong in one way only. */
static bool read_any(struct compiler *c, struct schema *s, const cJSON *json,
                     const struct place *place)
{
    if (!cJSON_IsArray(json) || cJSON_GetArraySize(json) < 2)
        return refuse(c, place, "must list two schemas or more");
    s->any = allocate(c, (size_t)cJSON_GetArraySize(json), sizeof(struct schema *));
    if (s->any == NULL)
        return false;
    const cJSON *one;
    cJSON_ArrayForEach(one, json)
    {
        struct place here = { place, NULL, s->any_n };
        struct schema *made = compile(c, one, &here);
        if (made == NULL)
            return false;
        s->any[s->any_n++] = made;
        for (size_t i = 0; i + 1 < s->any_n; i++)
            if (made->any_n > 0 || s->any[i]->any_n > 0 || made->type == s->any[i]->type)
                return refuse(c, &here, "must be of a type of its own");
    }
    return true;
}

static bool read_people(struct compiler *c, struct schema *s, const cJSON *json,
                        const struct place *place)
{
    (void)s;
    return cJSON_IsString(json) || refuse(c, place, "must be a string");
}

/* Which types a keyword is for, as bits. */
enum {
    FOR_STRING = 1 << TYPE_STRING,
    FOR_NUMBER = 1 << TYPE_INTEGER | 1 << TYPE_NUMBER,
    FOR_OBJECT = 1 << TYPE_OBJECT,
    FOR_ARRAY = 1 << TYPE_ARRAY,
    FOR_ALL = (1 << TYPES) - 1
};

static const struct keyword {
    const char *name;
    int types;
    keyword_read *read;
} keywords[] = {
    { "type", FOR_ALL, read_type }, /* first: the others depend on it */
    { "enum", FOR_STRING, read_enum },
    { "format", FOR_STRING, read_format },
    { "minLength", FOR_STRING, read_min_length },
    { "maxLength", FOR_STRING, read_max_length },
    { "maxBytes", FOR_STRING, read_max_bytes },
    { "minimum", FOR_NUMBER, read_minimum },
    { "maximum", FOR_NUMBER, read_maximum },
    { "items", FOR_ARRAY, read_items },
    { "minItems", FOR_ARRAY, read_min_items },
    { "maxItems", FOR_ARRAY, read_max_items },
    { "uniqueItems", FOR_ARRAY, read_unique },
    { "properties", FOR_OBJECT, read_properties },
    { "required", FOR_OBJECT, read_required },
    { "additionalProperties", FOR_OBJECT, read_additional },
    { "description", FOR_ALL, read_people },
    { "unit", FOR_ALL, read_people },
    { "when", FOR_ALL, read_people },
    { "title", FOR_ALL, read_people },
};
enum { KEYWORDS = sizeof keywords / sizeof *keywords };

/* Every keyword of a schema is known, or beside $ref and anyOf one for people. */
static bool knows_all(struct compiler *c, const cJSON *json, const struct place *place,
                      const char *instead)
{
    const cJSON *one;
    cJSON_ArrayForEach(one, json)
    {
        struct place here = { place, one->string, 0 };
        bool known = instead != NULL && strcmp(one->string, instead) == 0;
        for (size_t i = 0; i < KEYWORDS && !known; i++)
            known = strcmp(one->string, keywords[i].name) == 0 &&
                    (instead == NULL || keywords[i].read == read_people);
        if (!known && instead == NULL)
            return refuse(c, &here, "no such keyword");
        if (!known)
            return refuse(c, &here, *instead == '$' ? "not beside $ref" : "not beside anyOf");
    }
    return true;
}

static struct schema *compile_ref(struct compiler *c, const cJSON *ref, const struct place *place)
{
    static const char prefix[] = "#/$defs/";
    size_t n = sizeof prefix - 1;
    struct place here = { place, "$ref", 0 };
    const cJSON *target = NULL;
    if (cJSON_IsString(ref) && strncmp(ref->valuestring, prefix, n) == 0)
        target = strict_json_member(c->defs, ref->valuestring + n);
    if (target == NULL) {
        refuse(c, &here, "points nowhere");
        return NULL;
    }
    return compile(c, target, &here);
}

static bool read_keywords(struct compiler *c, struct schema *s, const cJSON *json,
                          const struct place *place)
{
    const cJSON *any = strict_json_member(json, "anyOf");
    struct place any_here = { place, "anyOf", 0 };
    if (any != NULL)
        return read_any(c, s, any, &any_here);
    if (strict_json_member(json, "type") == NULL)
        return refuse(c, place, "has no type");
    for (size_t i = 0; i < KEYWORDS; i++) {
        const cJSON *value = strict_json_member(json, keywords[i].name);
        struct place here = { place, keywords[i].name, 0 };
        if (value == NULL)
            continue;
        if (i > 0 && !(keywords[i].types & 1 << s->type))
            return refuse(c, &here, "not for this type");
        if (!keywords[i].read(c, s, value, &here))
            return false;
    }
    return true;
}

static struct schema *compile_here(struct compiler *c, const cJSON *json, const struct place *place)
{
    const cJSON *ref = strict_json_member(json, "$ref");
    if (!cJSON_IsObject(json)) {
        refuse(c, place, "must be an object");
        return NULL;
    }
    const char *instead = ref != NULL                                 ? "$ref"
                          : strict_json_member(json, "anyOf") != NULL ? "anyOf"
                                                                      : NULL;
    if (!knows_all(c, json, place, instead))
        return NULL;
    if (ref != NULL)
        return compile_ref(c, ref, place);
    struct schema *s = allocate(c, 1, sizeof *s);
    if (s == NULL)
        return NULL;
    *s = (struct schema){ .minimum = -INFINITY, .maximum = INFINITY };
    s->max_length = s->max_bytes = s->max_items = SIZE_MAX;
    if (read_keywords(c, s, json, place))
        return s;
    schema_close(s);
    return NULL;
}

static struct schema *compile(struct compiler *c, const cJSON *json, const struct place *place)
{
    if (c->depth == MAX_NESTED) { /* a $ref that leads back to itself */
        refuse(c, place, "nested too deep");
        return NULL;
    }
    c->depth++;
    struct schema *s = compile_here(c, json, place);
    c->depth--;
    return s;
}

enum status schema_compile(const cJSON *json, const cJSON *defs, bool closed, struct schema **ret,
                           struct schema_error *error)
{
    struct compiler c = { .defs = defs, .closed = closed, .error = error };
    struct place root = { NULL, "#", 0 };
    struct schema *s = compile(&c, json, &root);
    if (s == NULL)
        return c.status;
    *ret = s;
    return STATUS_OK;
}

void schema_close(struct schema *schema)
{
    if (schema == NULL)
        return;
    for (size_t i = 0; i < schema->n; i++)
        schema_close(schema->properties[i].schema);
    free(schema->properties);
    schema_close(schema->items);
    for (size_t i = 0; i < schema->any_n; i++)
        schema_close(schema->any[i]);
    free(schema->any);
    free(schema);
}

/* ---- checking ----------------------------------------------------------------------- */

static bool check(const struct schema *s, const cJSON *value, const struct place *place,
                  struct schema_error *error);

/* "one of a, b, c" */
static bool fail_choices(const struct schema *s, const cJSON *value, const struct place *place,
                         struct schema_error *error)
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
    return fail(error, place, "must be one of %s, not %.200s", list,
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

static bool check_string(const struct schema *s, const cJSON *value, const struct place *place,
                         struct schema_error *error)
{
    const char *text = value->valuestring;
    char echo[STRICT_JSON_ECHO_SIZE];
    size_t n = characters(text);
    if (s->choices != NULL && !is_choice(s, text))
        return fail_choices(s, value, place, error);
    if (n < s->min_length)
        return n == 0 ? fail(error, place, "must not be empty")
                      : fail(error, place, "must have %zu characters or more", s->min_length);
    if (n > s->max_length)
        return fail(error, place, "must have at most %zu characters", s->max_length);
    if (strlen(text) > s->max_bytes)
        return fail(error, place, "must have at most %zu bytes", s->max_bytes);
    if (s->format != NULL && !s->format->check(text))
        return fail(error, place, "must be %s, not %s", s->format->expected,
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

static bool check_number(const struct schema *s, const cJSON *value, const struct place *place,
                         struct schema_error *error)
{
    double x = value->valuedouble;
    char range[96], text[NUMBER_TEXT_SIZE];
    bool whole = s->type != TYPE_INTEGER || (floor(x) == x && fabs(x) <= max_integer);
    if (whole && x >= s->minimum && x <= s->maximum && isfinite(x))
        return true;
    return fail(error, place, "must be %s%s, not %s",
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

static bool check_array(const struct schema *s, const cJSON *value, const struct place *place,
                        struct schema_error *error)
{
    size_t n = (size_t)cJSON_GetArraySize(value), i = 0;
    if (n < s->min_items || n > s->max_items)
        return s->min_items == s->max_items
                   ? fail(error, place, "must have %zu items, not %zu", s->min_items, n)
               : n < s->min_items
                   ? fail(error, place, "must have %zu items or more, not %zu", s->min_items, n)
                   : fail(error, place, "must have at most %zu items, not %zu", s->max_items, n);
    const cJSON *one;
    cJSON_ArrayForEach(one, value)
    {
        struct place here = { place, NULL, i++ };
        if (s->items != NULL && !check(s->items, one, &here, error))
            return false;
    }
    return !s->unique || unique_strings(value) || fail(error, place, "must name each item once");
}

static bool check_object(const struct schema *s, const cJSON *value, const struct place *place,
                         struct schema_error *error)
{
    char echo[STRICT_JSON_ECHO_SIZE];
    const cJSON *one;
    cJSON_ArrayForEach(one, value)
    {
        const struct property *p = find_property(s, one->string);
        if (p == NULL && s->closed)
            return fail(error, place, "has a member %s that is not known",
                        strict_json_echo(one->string, echo));
        struct place here = { place, p != NULL ? p->name : "", 0 };
        if (p != NULL && !check(p->schema, one, &here, error))
            return false;
    }
    for (size_t i = 0; i < s->n; i++)
        if (s->properties[i].required && strict_json_member(value, s->properties[i].name) == NULL)
            return fail(error, place, "lacks the member \"%s\"", s->properties[i].name);
    return true;
}

static bool check_boolean(const struct schema *s, const cJSON *value, const struct place *place,
                          struct schema_error *error)
{
    (void)s, (void)value, (void)place, (void)error;
    return true;
}

static const struct kind {
    const char *expected;
    cJSON_bool (*is)(const cJSON *value);
    bool (*check)(const struct schema *s, const cJSON *value, const struct place *place,
                  struct schema_error *error);
} kinds[TYPES] = {
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
    for (size_t i = 0; i < TYPES; i++)
        if (i != TYPE_INTEGER && kinds[i].is(value))
            return kinds[i].expected;
    return "null";
}

/* "an array or an object" */
static bool fail_any(const struct schema *s, const cJSON *value, const struct place *place,
                     struct schema_error *error)
{
    char list[96];
    size_t n = 0;
    for (size_t i = 0; i < s->any_n && n < sizeof list; i++)
        n += (size_t)snprintf(list + n, sizeof list - n, "%s%s", i > 0 ? " or " : "",
                              kinds[s->any[i]->type].expected);
    return fail(error, place, "must be %s, not %s", list, article_of(value));
}

static bool check(const struct schema *s, const cJSON *value, const struct place *place,
                  struct schema_error *error)
{
    for (size_t i = 0; i < s->any_n; i++)
        if (kinds[s->any[i]->type].is(value))
            return check(s->any[i], value, place, error);
    if (s->any_n > 0)
        return fail_any(s, value, place, error);
    const struct kind *kind = &kinds[s->type];
    if (!kind->is(value))
        return fail(error, place, "must be %s, not %s", kind->expected, article_of(value));
    return kind->check(s, value, place, error);
}

bool schema_check(const struct schema *schema, const cJSON *value, const char *at,
                  struct schema_error *error)
{
    struct place root = { NULL, at, 0 };
    return check(schema, value, &root, error);
}
