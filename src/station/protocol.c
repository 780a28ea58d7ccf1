/* protocol.c - the description compiled; a line read. */
#include "station/protocol.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "station/protocol_rules.h"
#include "station/protocol_schema.h"
#include "station/strict_json.h"

/* ---- names -------------------------------------------------------------------------- */

#define TEXT(name, text) text,
static const char *const method_names[METHODS] = { PROTOCOL_METHODS(TEXT) };
static const char *const reason_names[REASONS] = { PROTOCOL_REASONS(TEXT) };
static const char *const notification_names[NOTIFICATIONS] = { PROTOCOL_NOTIFICATIONS(TEXT) };
static const char *const right_names[RIGHTS] = { "kiosk", "clinic", "admin" };
#undef TEXT

static const char *name_of(const char *const *names, size_t n, size_t i)
{
    return i < n ? names[i] : "unknown";
}

/* n where there is none. */
static size_t find_name(const char *const *names, size_t n, const char *name)
{
    size_t i = 0;
    while (i < n && strcmp(names[i], name) != 0)
        i++;
    return i;
}

const char *method_name(enum method method)
{
    return name_of(method_names, METHODS, (size_t)method);
}

const char *reason_name(enum reason reason)
{
    return name_of(reason_names, REASONS, (size_t)reason);
}

const char *right_name(enum right right)
{
    return name_of(right_names, RIGHTS, (size_t)right);
}

const char *notification_name(enum notification notification)
{
    return name_of(notification_names, NOTIFICATIONS, (size_t)notification);
}

/* ---- the description, compiled ------------------------------------------------------ */

enum { MAX_EVENT_TYPES = 16 };

struct method_rules {
    struct schema *params, *result;
    enum right right;
    bool session;
};

struct event_rules {
    const char *type;
    struct schema *data;
};

struct protocol {
    cJSON *json; /* the schemas borrow from it */
    char *text;  /* on one line */
    struct method_rules methods[METHODS];
    struct reason_rules reasons[REASONS];
    struct schema *notifications[NOTIFICATIONS];
    struct event_rules events[EVENT_TOPICS][MAX_EVENT_TYPES];
};

/* Members of a part of the description, in the order of names, all of them. */
static const cJSON *part_of(const cJSON *json, const char *part, const char *const *names, size_t n)
{
    const cJSON *object = strict_json_member(json, part);
    size_t i = 0;
    const cJSON *one;
    cJSON_ArrayForEach(one, object)
    {
        if (i == n || strcmp(one->string, names[i]) != 0)
            break;
        i++;
    }
    if (i == n && one == NULL)
        return object;
    log_error("protocol: '%s' of the description: '%s' where '%s' was expected", part,
              one != NULL ? one->string : "nothing", i < n ? names[i] : "nothing");
    return NULL;
}

static enum status compile(const struct protocol *p, const cJSON *owner, const char *member,
                           bool closed, struct schema **ret)
{
    struct schema_error error;
    enum status s = schema_compile(strict_json_member(owner, member),
                                   strict_json_member(p->json, "$defs"), closed, ret, &error);
    if (s == STATUS_FORMAT)
        log_error("protocol: %s of '%s' in the description: %s: %s", member, owner->string,
                  error.path, error.what);
    return s;
}

static bool read_flag(const cJSON *owner, const char *name, bool *ret)
{
    const cJSON *value = strict_json_member(owner, name);
    *ret = cJSON_IsTrue(value);
    return cJSON_IsBool(value);
}

static enum status bad_member(const cJSON *owner, const char *what)
{
    log_error("protocol: '%s' of the description lacks its %s", owner->string, what);
    return STATUS_FORMAT;
}

static enum status read_methods(struct protocol *p)
{
    const cJSON *part = part_of(p->json, "methods", method_names, METHODS), *one;
    size_t i = 0;
    if (part == NULL)
        return STATUS_FORMAT;
    cJSON_ArrayForEach(one, part)
    {
        struct method_rules *m = &p->methods[i++];
        const char *right = cJSON_GetStringValue(strict_json_member(one, "right"));
        size_t r = find_name(right_names, RIGHTS, right != NULL ? right : "");
        if (r == RIGHTS || !read_flag(one, "session", &m->session))
            return bad_member(one, "right or session");
        m->right = (enum right)r;
        enum status s = compile(p, one, "params", false, &m->params);
        if (s == STATUS_OK)
            s = compile(p, one, "result", true, &m->result);
        if (s != STATUS_OK)
            return s;
    }
    return STATUS_OK;
}

static enum status read_reasons(struct protocol *p)
{
    const cJSON *part = part_of(p->json, "errors", reason_names, REASONS), *one;
    size_t i = 0;
    if (part == NULL)
        return STATUS_FORMAT;
    cJSON_ArrayForEach(one, part)
    {
        struct reason_rules *r = &p->reasons[i++];
        const cJSON *code = strict_json_member(one, "code");
        r->meaning = cJSON_GetStringValue(strict_json_member(one, "meaning"));
        r->hint = cJSON_GetStringValue(strict_json_member(one, "hint"));
        if (!cJSON_IsNumber(code) || r->meaning == NULL || r->hint == NULL ||
            !read_flag(one, "retryable", &r->retryable))
            return bad_member(one, "code, meaning, hint or retryable");
        r->code = code->valueint;
    }
    return STATUS_OK;
}

static enum status read_notifications(struct protocol *p)
{
    const cJSON *part = part_of(p->json, "notifications", notification_names, NOTIFICATIONS), *one;
    size_t i = 0;
    if (part == NULL)
        return STATUS_FORMAT;
    cJSON_ArrayForEach(one, part)
    {
        enum status s = compile(p, one, "params", true, &p->notifications[i++]);
        if (s != STATUS_OK)
            return s;
    }
    return STATUS_OK;
}

static enum status read_events(struct protocol *p)
{
    const char *names[EVENT_TOPICS];
    size_t t;
    for (t = 0; t < EVENT_TOPICS; t++)
        names[t] = event_topic_name((enum event_topic)t);
    const cJSON *part = part_of(p->json, "events", names, EVENT_TOPICS), *topic, *one;
    if (part == NULL)
        return STATUS_FORMAT;
    t = 0;
    cJSON_ArrayForEach(topic, part)
    {
        size_t i = 0;
        cJSON_ArrayForEach(one, topic)
        {
            if (i == MAX_EVENT_TYPES)
                return bad_member(topic, "end: it has too many types");
            p->events[t][i].type = one->string;
            enum status s = compile(p, one, "data", true, &p->events[t][i++].data);
            if (s != STATUS_OK)
                return s;
        }
        t++;
    }
    return STATUS_OK;
}

static enum status read_description(struct protocol *p, const char *text)
{
    p->json = cJSON_Parse(text);
    p->text = strdup(text);
    if (p->json == NULL || p->text == NULL)
        return STATUS_NO_MEMORY;
    cJSON_Minify(p->text);
    enum status s = read_methods(p);
    if (s == STATUS_OK)
        s = read_reasons(p);
    if (s == STATUS_OK)
        s = read_notifications(p);
    if (s == STATUS_OK)
        s = read_events(p);
    return s;
}

enum status protocol_open(struct protocol **ret)
{
    return protocol_open_text(protocol_schema_text, ret);
}

enum status protocol_open_text(const char *text, struct protocol **ret)
{
    struct protocol *p = calloc(1, sizeof *p);
    if (p == NULL)
        return STATUS_NO_MEMORY;
    enum status s = read_description(p, text);
    if (s != STATUS_OK) {
        protocol_close(p);
        return s;
    }
    *ret = p;
    return STATUS_OK;
}

void protocol_close(struct protocol *protocol)
{
    if (protocol == NULL)
        return;
    for (size_t i = 0; i < METHODS; i++) {
        schema_close(protocol->methods[i].params);
        schema_close(protocol->methods[i].result);
    }
    for (size_t i = 0; i < NOTIFICATIONS; i++)
        schema_close(protocol->notifications[i]);
    for (size_t t = 0; t < EVENT_TOPICS; t++)
        for (size_t i = 0; i < MAX_EVENT_TYPES; i++)
            schema_close(protocol->events[t][i].data);
    cJSON_Delete(protocol->json);
    free(protocol->text);
    free(protocol);
}

const struct reason_rules *protocol_reason_rules(const struct protocol *protocol,
                                                 enum reason reason)
{
    return &protocol->reasons[reason];
}

const char *protocol_describe(const struct protocol *protocol)
{
    return protocol->text;
}

bool protocol_check_result(const struct protocol *protocol, enum method method, const cJSON *result,
                           struct schema_error *error)
{
    return schema_check(protocol->methods[method].result, result, "/result", error);
}

bool protocol_check_notification(const struct protocol *protocol, enum notification notification,
                                 const cJSON *params, struct schema_error *error)
{
    return schema_check(protocol->notifications[notification], params, "/params", error);
}

bool protocol_check_event(const struct protocol *protocol, enum event_topic topic, const char *type,
                          const cJSON *data, struct schema_error *error)
{
    for (size_t i = 0; i < MAX_EVENT_TYPES; i++) {
        const struct event_rules *e = &protocol->events[topic][i];
        if (e->type != NULL && strcmp(e->type, type) == 0)
            return schema_check(e->data, data, "/params/data", error);
    }
    *error = (struct schema_error){ "/params/type", "is no type of this topic" };
    return false;
}

/* ---- requests ----------------------------------------------------------------------- */

void refusal_set(struct refusal *refusal, enum reason reason, const char *format, ...)
{
    *refusal = (struct refusal){ .reason = reason };
    if (format == NULL)
        return;
    va_list list;
    va_start(list, format);
    vsnprintf(refusal->detail, sizeof refusal->detail, format, list);
    va_end(list);
}

static bool refuse(struct refusal *refusal, enum reason reason, const char *path,
                   const char *detail)
{
    refusal_set(refusal, reason, "%s", detail);
    snprintf(refusal->path, sizeof refusal->path, "%s", path);
    return false;
}

/* STATUS_FORMAT for what cannot be an id. */
static enum status read_id(const cJSON *value, struct request_id *ret)
{
    if (cJSON_IsString(value) && strlen(value->valuestring) <= PROTOCOL_MAX_ID) {
        ret->kind = REQUEST_ID_STRING;
        strcpy(ret->text, value->valuestring);
        return STATUS_OK;
    }
    if (!cJSON_IsNumber(value))
        return STATUS_FORMAT;
    double x = value->valuedouble;
    if (floor(x) != x || fabs(x) > (double)PROTOCOL_MAX_INTEGER)
        return STATUS_FORMAT;
    ret->kind = REQUEST_ID_INTEGER;
    ret->integer = (int64_t)x;
    return STATUS_OK;
}

static bool read_json(const char *line, size_t n, cJSON **ret, struct refusal *refusal)
{
    static const enum reason reasons[] = {
        [STRICT_JSON_FINE] = REASON_NO_MEMORY,
        [STRICT_JSON_UTF8] = REASON_UTF8_INVALID,
        [STRICT_JSON_NUL] = REASON_NUL_REFUSED,
        [STRICT_JSON_SYNTAX] = REASON_JSON_INVALID,
        [STRICT_JSON_DUPLICATE] = REASON_DUPLICATE_MEMBER,
        [STRICT_JSON_DEPTH] = REASON_TOO_DEEP,
        [STRICT_JSON_MEMBERS] = REASON_TOO_MANY_MEMBERS,
        [STRICT_JSON_NUMBER] = REASON_NUMBER_RANGE,
    };
    enum strict_json_fault fault;
    size_t offset;
    if (n > PROTOCOL_MAX_REQUEST)
        return refuse(refusal, REASON_LINE_TOO_LONG, "", "");
    if (strict_json_parse(line, n, ret, &fault, &offset) == STATUS_OK)
        return true;
    refusal_set(refusal, reasons[fault], NULL);
    if (fault != STRICT_JSON_FINE && fault != STRICT_JSON_UTF8)
        snprintf(refusal->detail, sizeof refusal->detail, "at byte %zu", offset);
    return false;
}

/* {"jsonrpc":"2.0","id":..,"method":..} with "params" at most; the id first, so that what
 * is wrong otherwise can be told under it. */
static bool read_envelope(struct request *r, struct refusal *refusal)
{
    if (cJSON_IsArray(r->tree))
        return refuse(refusal, REASON_BATCH_REFUSED, "", "");
    if (!cJSON_IsObject(r->tree))
        return refuse(refusal, REASON_REQUEST_INVALID, "", "it is not an object");
    const cJSON *id = strict_json_member(r->tree, "id");
    if (id == NULL)
        return refuse(refusal, REASON_ID_MISSING, "", "");
    if (read_id(id, &r->id) != STATUS_OK)
        return refuse(refusal, REASON_ID_INVALID, "/id", "");
    const char *version = cJSON_GetStringValue(strict_json_member(r->tree, "jsonrpc"));
    if (version == NULL || strcmp(version, "2.0") != 0)
        return refuse(refusal, REASON_REQUEST_INVALID, "/jsonrpc", "jsonrpc must be \"2.0\"");
    if (!cJSON_IsString(strict_json_member(r->tree, "method")))
        return refuse(refusal, REASON_REQUEST_INVALID, "/method", "method must be a string");
    static const char *const known[] = { "jsonrpc", "id", "method", "params" };
    const cJSON *one;
    cJSON_ArrayForEach(one, r->tree)
    {
        char echo[STRICT_JSON_ECHO_SIZE];
        if (find_name(known, 4, one->string) < 4)
            continue;
        refusal_set(refusal, REASON_REQUEST_INVALID, "it has a member %s that is not known",
                    strict_json_echo(one->string, echo));
        return false;
    }
    return true;
}

static bool read_method(const struct protocol *p, struct request *r, struct refusal *refusal)
{
    const char *name = strict_json_member(r->tree, "method")->valuestring;
    size_t i = find_name(method_names, METHODS, name);
    if (i == METHODS) {
        char echo[STRICT_JSON_ECHO_SIZE];
        return refuse(refusal, REASON_METHOD_UNKNOWN, "/method", strict_json_echo(name, echo));
    }
    r->method = (enum method)i;
    r->right = p->methods[i].right;
    r->needs_session = p->methods[i].session;
    return true;
}

static bool read_params(const struct protocol *p, struct request *r, struct refusal *refusal)
{
    struct schema_error error;
    r->params = strict_json_member(r->tree, "params");
    if (r->params == NULL)
        r->params = cJSON_AddObjectToObject(r->tree, "params");
    if (r->params == NULL)
        return refuse(refusal, REASON_NO_MEMORY, "", "");
    if (schema_check(p->methods[r->method].params, r->params, "/params", &error))
        return true;
    refusal_set(refusal, REASON_PARAMS_INVALID, "%s %.400s", error.path, error.what);
    snprintf(refusal->path, sizeof refusal->path, "%s", error.path);
    return false;
}

bool protocol_read(const struct protocol *protocol, const char *line, size_t n, struct request *ret,
                   struct refusal *refusal)
{
    struct request r = { .id = { .kind = REQUEST_ID_NONE } };
    bool good = read_json(line, n, &r.tree, refusal) && read_envelope(&r, refusal) &&
                read_method(protocol, &r, refusal) && read_params(protocol, &r, refusal);
    if (!good)
        request_done(&r);
    *ret = r;
    return good;
}

void request_done(struct request *request)
{
    cJSON_Delete(request->tree);
    request->tree = NULL;
    request->params = NULL;
}

/* ---- for clients -------------------------------------------------------------------- */

static bool read_answer(struct answer *a)
{
    const cJSON *id = strict_json_member(a->tree, "id");
    a->result = strict_json_member(a->tree, "result");
    a->error = strict_json_member(a->tree, "error");
    a->params = strict_json_member(a->tree, "params");
    a->method = cJSON_GetStringValue(strict_json_member(a->tree, "method"));
    if (id == NULL)
        return a->method != NULL && cJSON_IsObject(a->params);
    if (read_id(id, &a->id) != STATUS_OK && !(cJSON_IsNull(id) && a->error != NULL))
        return false;
    return cJSON_IsObject(a->result) != cJSON_IsObject(a->error) && a->method == NULL;
}

enum status protocol_read_answer(const char *line, size_t n, struct answer *ret)
{
    struct answer a = { .tree = cJSON_ParseWithLength(line, n) };
    if (!read_answer(&a)) {
        cJSON_Delete(a.tree);
        return STATUS_FORMAT;
    }
    *ret = a;
    return STATUS_OK;
}
