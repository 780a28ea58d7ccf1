/* json_line.c - where values end, in JSON that is known to be right. */
#include "cli/json_line.h"

#include <string.h>

#include "cli/out.h"

static char *past_space(char *at)
{
    while (*at == ' ' || *at == '\t' || *at == '\n' || *at == '\r')
        at++;
    return at;
}

/* Past a string that begins at its opening quote. */
static const char *past_string(const char *at)
{
    for (at++; *at != '"'; at++)
        if (*at == '\\')
            at++;
    return at + 1;
}

static const char *past_nested(const char *at)
{
    int depth = 0;
    do {
        if (*at == '"') {
            at = past_string(at);
            continue;
        }
        depth += *at == '{' || *at == '[';
        depth -= *at == '}' || *at == ']';
        at++;
    } while (depth > 0);
    return at;
}

static const char *past_value(const char *at)
{
    if (*at == '"')
        return past_string(at);
    if (*at == '{' || *at == '[')
        return past_nested(at);
    return at + strcspn(at, ",]} \t\r\n");
}

/* The text of a string of n bytes, quotes among them, put where the string stands. */
static const char *resolve(char *text, size_t n)
{
    enum strict_json_fault fault;
    cJSON *made = NULL;
    text[n - 1] = '\0';
    if (memchr(text, '\\', n - 1) == NULL)
        return text + 1;
    text[n - 1] = '"';
    if (strict_json_parse(text, n, &made, &fault, NULL) != STATUS_OK)
        out_of_memory();
    strcpy(text, made->valuestring); /* escapes are longer than what they stand for */
    cJSON_Delete(made);
    return text;
}

/* What is found is only then ended by NULs: they stand where the structure was read. */
static void end_texts(struct json_line *line, char *const *name, const size_t *name_n)
{
    for (size_t i = 0; i < line->n; i++) {
        line->member[i].name = resolve(name[i], name_n[i]);
        line->member[i].value[line->member[i].n] = '\0';
    }
}

bool json_line_split(char *text, size_t n, struct json_line *ret)
{
    char *name[STRICT_JSON_MAX_MEMBERS];
    size_t name_n[STRICT_JSON_MAX_MEMBERS];
    text[n] = '\0';
    char *at = past_space(text);
    if (*at != '{')
        return false;
    ret->n = 0;
    for (at = past_space(at + 1); *at != '}'; at = past_space(at)) {
        struct json_member *member = &ret->member[ret->n];
        name[ret->n] = at;
        name_n[ret->n] = (size_t)(past_string(at) - at);
        at = past_space(at + name_n[ret->n]);
        member->value = past_space(at + 1); /* the colon */
        member->n = (size_t)(past_value(member->value) - member->value);
        at = past_space(member->value + member->n);
        at += *at == ',';
        ret->n++;
    }
    end_texts(ret, name, name_n);
    return true;
}

struct json_member *json_line_member(struct json_line *line, const char *name)
{
    for (size_t i = 0; i < line->n; i++)
        if (strcmp(line->member[i].name, name) == 0)
            return &line->member[i];
    return NULL;
}

bool json_member_is_text(const struct json_member *member)
{
    return *member->value == '"';
}

bool json_member_is_number(const struct json_member *member)
{
    return *member->value == '-' || (*member->value >= '0' && *member->value <= '9');
}

const char *json_member_text(struct json_member *member)
{
    return resolve(member->value, member->n);
}

const char *json_item_next(const char **at, size_t *n)
{
    const char *from = *at + strspn(*at, " \t\r\n");
    if (*from == '[' ||
        *from == ',') /* an item that is an array itself stands behind one of them */
        from++;
    from += strspn(from, " \t\r\n");
    if (*from == ']' || *from == '\0')
        return NULL;
    *at = past_value(from);
    *n = (size_t)(*at - from);
    return from;
}
