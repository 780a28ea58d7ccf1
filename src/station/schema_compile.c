/* schema_compile.c - a tree of nodes made from the schema, keyword by keyword. */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "station/schema_private.h"
#include "station/strict_json.h"

enum { MAX_NESTED = 32 };

struct compiler {
    const cJSON *defs;
    bool closed;
    struct schema_error *error;
    enum status status;
    int depth;
};

/* The first cause counts. */
static bool refuse(struct compiler *c, const struct schema_place *place, const char *why)
{
    c->status = STATUS_FORMAT;
    return schema_fail(c->error, place, "%s", why);
}

static void *allocate(struct compiler *c, size_t n, size_t size)
{
    void *memory = calloc(n > 0 ? n : 1, size);
    if (memory == NULL)
        c->status = STATUS_NO_MEMORY;
    return memory;
}

static struct schema *compile(struct compiler *c, const cJSON *json,
                              const struct schema_place *place);

typedef bool keyword_read(struct compiler *c, struct schema *s, const cJSON *json,
                          const struct schema_place *place);

static bool read_type(struct compiler *c, struct schema *s, const cJSON *json,
                      const struct schema_place *place)
{
    static const char *const names[SCHEMA_TYPES] = { "string",  "integer", "number",
                                                     "boolean", "object",  "array" };
    for (size_t i = 0; cJSON_IsString(json) && i < SCHEMA_TYPES; i++) {
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
                      const struct schema_place *place)
{
    s->choices = json;
    return (all_strings(json) && json->child != NULL) || refuse(c, place, "must list strings");
}

static bool read_format(struct compiler *c, struct schema *s, const cJSON *json,
                        const struct schema_place *place)
{
    if (cJSON_IsString(json))
        s->format = schema_format_of(json->valuestring);
    return s->format != NULL || refuse(c, place, "no such format");
}

static bool read_count(struct compiler *c, const cJSON *json, const struct schema_place *place,
                       size_t *ret)
{
    double x = cJSON_IsNumber(json) ? json->valuedouble : -1.0;
    if (!(x >= 0.0 && x <= SCHEMA_MAX_INTEGER) || floor(x) != x)
        return refuse(c, place, "must be a count");
    *ret = (size_t)x;
    return true;
}

static bool read_limit(struct compiler *c, const cJSON *json, const struct schema_place *place,
                       double *ret)
{
    if (!cJSON_IsNumber(json))
        return refuse(c, place, "must be a number");
    *ret = json->valuedouble;
    return true;
}

static bool read_min_length(struct compiler *c, struct schema *s, const cJSON *json,
                            const struct schema_place *place)
{
    return read_count(c, json, place, &s->min_length);
}

static bool read_max_length(struct compiler *c, struct schema *s, const cJSON *json,
                            const struct schema_place *place)
{
    return read_count(c, json, place, &s->max_length);
}

static bool read_max_bytes(struct compiler *c, struct schema *s, const cJSON *json,
                           const struct schema_place *place)
{
    return read_count(c, json, place, &s->max_bytes);
}

static bool read_minimum(struct compiler *c, struct schema *s, const cJSON *json,
                         const struct schema_place *place)
{
    return read_limit(c, json, place, &s->minimum);
}

static bool read_maximum(struct compiler *c, struct schema *s, const cJSON *json,
                         const struct schema_place *place)
{
    return read_limit(c, json, place, &s->maximum);
}

static bool read_min_items(struct compiler *c, struct schema *s, const cJSON *json,
                           const struct schema_place *place)
{
    return read_count(c, json, place, &s->min_items);
}

static bool read_max_items(struct compiler *c, struct schema *s, const cJSON *json,
                           const struct schema_place *place)
{
    return read_count(c, json, place, &s->max_items);
}

static bool read_unique(struct compiler *c, struct schema *s, const cJSON *json,
                        const struct schema_place *place)
{
    s->unique = cJSON_IsTrue(json) && s->items != NULL && s->items->type == TYPE_STRING;
    return s->unique || refuse(c, place, "must be true, beside items that are strings");
}

static bool read_additional(struct compiler *c, struct schema *s, const cJSON *json,
                            const struct schema_place *place)
{
    s->closed = true;
    return cJSON_IsFalse(json) || refuse(c, place, "must be false");
}

static bool read_items(struct compiler *c, struct schema *s, const cJSON *json,
                       const struct schema_place *place)
{
    s->items = compile(c, json, place);
    return s->items != NULL;
}

static bool read_properties(struct compiler *c, struct schema *s, const cJSON *json,
                            const struct schema_place *place)
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
        struct schema_place here = { place, one->string, 0 };
        struct schema_property *p = &s->properties[s->n];
        p->name = one->string;
        p->schema = compile(c, one, &here);
        if (p->schema == NULL)
            return false;
        s->n++;
    }
    return true;
}

/* After properties: keywords are taken in the order of the table below. */
static bool read_required(struct compiler *c, struct schema *s, const cJSON *json,
                          const struct schema_place *place)
{
    if (!all_strings(json))
        return refuse(c, place, "must list strings");
    const cJSON *one;
    cJSON_ArrayForEach(one, json)
    {
        struct schema_property *p = schema_property_of(s, one->valuestring);
        if (p == NULL)
            return refuse(c, place, "names a member that is no property");
        p->required = true;
    }
    return true;
}

/* Different types, so that a value that is wrong is wrong in one way only. */
static bool read_any(struct compiler *c, struct schema *s, const cJSON *json,
                     const struct schema_place *place)
{
    if (!cJSON_IsArray(json) || cJSON_GetArraySize(json) < 2)
        return refuse(c, place, "must list two schemas or more");
    s->any = allocate(c, (size_t)cJSON_GetArraySize(json), sizeof(struct schema *));
    if (s->any == NULL)
        return false;
    const cJSON *one;
    cJSON_ArrayForEach(one, json)
    {
        struct schema_place here = { place, NULL, s->any_n };
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
                        const struct schema_place *place)
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
    FOR_ALL = (1 << SCHEMA_TYPES) - 1
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
static bool knows_all(struct compiler *c, const cJSON *json, const struct schema_place *place,
                      const char *instead)
{
    const cJSON *one;
    cJSON_ArrayForEach(one, json)
    {
        struct schema_place here = { place, one->string, 0 };
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

static struct schema *compile_ref(struct compiler *c, const cJSON *ref,
                                  const struct schema_place *place)
{
    static const char prefix[] = "#/$defs/";
    size_t n = sizeof prefix - 1;
    struct schema_place here = { place, "$ref", 0 };
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
                          const struct schema_place *place)
{
    const cJSON *any = strict_json_member(json, "anyOf");
    struct schema_place any_here = { place, "anyOf", 0 };
    if (any != NULL)
        return read_any(c, s, any, &any_here);
    if (strict_json_member(json, "type") == NULL)
        return refuse(c, place, "has no type");
    for (size_t i = 0; i < KEYWORDS; i++) {
        const cJSON *value = strict_json_member(json, keywords[i].name);
        struct schema_place here = { place, keywords[i].name, 0 };
        if (value == NULL)
            continue;
        if (i > 0 && !(keywords[i].types & 1 << s->type))
            return refuse(c, &here, "not for this type");
        if (!keywords[i].read(c, s, value, &here))
            return false;
    }
    return true;
}

static struct schema *compile_here(struct compiler *c, const cJSON *json,
                                   const struct schema_place *place)
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

static struct schema *compile(struct compiler *c, const cJSON *json,
                              const struct schema_place *place)
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
    struct schema_place root = { NULL, "#", 0 };
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
