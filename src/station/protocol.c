/* protocol.c - the description compiled; a line read; a line made. */
#include "station/protocol.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "base/utf8.h"
#include "json/memory.h"
#include "json/print.h"
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

struct reason_rules {
    int code;
    bool retryable;
    const char *meaning, *hint;
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

/* ---- what the station sends --------------------------------------------------------- */

/* What was made up to now, before more is made: members may be missing. */
static bool is_whole(void)
{
    bool whole = !json_memory_was_short();
    json_memory_begin();
    return whole;
}

/* The end of what could not be made; the next begins anew. */
static enum status give_up(cJSON *line, cJSON *part)
{
    cJSON_Delete(part);
    cJSON_Delete(line);
    json_memory_begin();
    return STATUS_NO_MEMORY;
}

/* {"jsonrpc":"2.0"}; NULL without memory. */
static cJSON *new_line(void)
{
    cJSON *line = cJSON_CreateObject();
    if (line == NULL || cJSON_AddStringToObject(line, "jsonrpc", "2.0") != NULL)
        return line;
    cJSON_Delete(line);
    return NULL;
}

/* Adds and gives away; a NULL value or no memory is false. */
static bool add(cJSON *object, const char *name, cJSON *value)
{
    if (value != NULL && cJSON_AddItemToObject(object, name, value))
        return true;
    cJSON_Delete(value);
    return false;
}

static cJSON *id_json(const struct request_id *id)
{
    if (id->kind == REQUEST_ID_INTEGER)
        return cJSON_CreateNumber((double)id->integer); /* below 2^53: exact */
    return id->kind == REQUEST_ID_STRING ? cJSON_CreateString(id->text) : cJSON_CreateNull();
}

/* Absent is absent: nothing that we send may be null. */
static bool holds_null(const cJSON *value)
{
    const cJSON *one;
    cJSON_ArrayForEach(one, value) if (cJSON_IsNull(one) || holds_null(one)) return true;
    return false;
}

/* The tree as a line; it is deleted. */
static enum status finish(cJSON *tree, size_t limit, struct line *ret)
{
    struct line line;
    enum status s = json_print(tree, limit, &line.text, &line.n);
    cJSON_Delete(tree);
    if (s != STATUS_OK)
        return s;
    /* A text that came from an instrument or a file might be anything. */
    if (!utf8_is_valid(line.text)) {
        free(line.text);
        return STATUS_FORMAT;
    }
    *ret = line;
    return STATUS_OK;
}

enum status protocol_result(const struct request_id *id, cJSON *result, struct line *ret)
{
    cJSON *line = is_whole() ? new_line() : NULL;
    bool good = line != NULL && add(line, "id", id_json(id));
    if (result != NULL && holds_null(result)) {
        cJSON_Delete(result);
        cJSON_Delete(line);
        return STATUS_FORMAT;
    }
    if (!good)
        return give_up(line, result);
    if (!add(line, "result", result))
        return give_up(line, NULL);
    return finish(line, PROTOCOL_MAX_LINE - 1, ret);
}

/* The line that reply() makes of a tree, of text: a tree of it would copy it twice. */
static enum status reply_text(const struct request_id *id, const char *result, struct line *ret)
{
    static const char head[] = "{\"jsonrpc\":\"2.0\",\"id\":", middle[] = ",\"result\":";
    cJSON *number = id_json(id);
    char *text;
    size_t id_n, n = strlen(result);
    enum status s = json_print(number, PROTOCOL_MAX_LINE, &text, &id_n);
    cJSON_Delete(number);
    if (s != STATUS_OK)
        return s;
    size_t size = sizeof head + id_n + sizeof middle + n; /* the brace for one NUL */
    struct line line = { .text = size <= PROTOCOL_MAX_LINE ? malloc(size) : NULL, .n = size - 1 };
    if (line.text == NULL)
        s = size <= PROTOCOL_MAX_LINE ? STATUS_NO_MEMORY : STATUS_RANGE;
    else
        snprintf(line.text, size, "%s%s%s%s}", head, text, middle, result);
    free(text);
    if (s == STATUS_OK && !utf8_is_valid_n(line.text, line.n)) {
        free(line.text);
        s = STATUS_FORMAT;
    }
    if (s == STATUS_OK)
        *ret = line;
    return s;
}

/* Instead of a reply that could not be made. */
static enum status refuse_reply(const struct protocol *protocol, const struct request_id *id,
                                enum status s, struct line *ret)
{
    struct refusal refusal;
    refusal_set(&refusal,
                s == STATUS_RANGE    ? REASON_REPLY_TOO_LARGE
                : s == STATUS_FORMAT ? REASON_INTERNAL
                                     : REASON_NO_MEMORY,
                NULL);
    return protocol_refuse(protocol, id, &refusal, ret);
}

enum status protocol_reply(const struct protocol *protocol, const struct request_id *id,
                           cJSON *result, struct line *ret)
{
    enum status s = protocol_result(id, result, ret);
    return s == STATUS_OK ? s : refuse_reply(protocol, id, s, ret);
}

enum status protocol_reply_text(const struct protocol *protocol, const struct request_id *id,
                                const char *result, struct line *ret)
{
    enum status s = reply_text(id, result, ret);
    return s == STATUS_OK ? s : refuse_reply(protocol, id, s, ret);
}
/* Text that was cut within a character, or is no UTF-8 at all, made valid. */
static void make_valid(char *text)
{
    size_t n = strlen(text);
    for (size_t cut = 0; cut < 4 && cut <= n; cut++) {
        if (utf8_is_valid_n(text, n - cut)) {
            text[n - cut] = '\0';
            return;
        }
    }
    for (; *text != '\0'; text++)
        if ((unsigned char)*text >= 0x80)
            *text = '?';
}

static bool add_text(cJSON *object, const char *name, const char *text)
{
    return *text == '\0' || add(object, name, cJSON_CreateString(text));
}

static cJSON *error_json(const struct reason_rules *rules, const struct refusal *refusal)
{
    struct refusal r = *refusal;
    make_valid(r.detail);
    make_valid(r.path);
    make_valid(r.device_code);
    char message[SCHEMA_WHAT_SIZE + 256];
    snprintf(message, sizeof message, "%.200s%s%s", rules->meaning, *r.detail != '\0' ? ": " : "",
             r.detail);
    cJSON *error = cJSON_CreateObject(), *data = cJSON_CreateObject();
    bool good = add(error, "code", cJSON_CreateNumber(rules->code)) &&
                add(error, "message", cJSON_CreateString(message)) &&
                add(data, "reason", cJSON_CreateString(reason_name(r.reason))) &&
                add(data, "hint", cJSON_CreateString(rules->hint)) &&
                add(data, "retryable", cJSON_CreateBool(rules->retryable)) &&
                add_text(data, "path", r.path) && add_text(data, "device_code", r.device_code);
    if (good && add(error, "data", data))
        return error;
    if (!good)
        cJSON_Delete(data);
    cJSON_Delete(error);
    return NULL;
}

enum status protocol_refuse(const struct protocol *protocol, const struct request_id *id,
                            const struct refusal *refusal, struct line *ret)
{
    json_memory_begin(); /* what was short before is what is told */
    cJSON *line = new_line();
    if (line != NULL && add(line, "id", id_json(id)) &&
        add(line, "error", error_json(&protocol->reasons[refusal->reason], refusal)))
        return finish(line, PROTOCOL_MAX_LINE - 1, ret);
    return give_up(line, NULL);
}

/* {"jsonrpc":"2.0",["id":..,]"method":..,"params":..}; params is given away. */
static enum status call(const struct request_id *id, const char *method, cJSON *params,
                        size_t limit, struct line *ret)
{
    cJSON *line = is_whole() ? new_line() : NULL;
    bool null = holds_null(params);
    if (line != NULL && (id == NULL || add(line, "id", id_json(id))) &&
        add(line, "method", cJSON_CreateString(method))) {
        if (add(line, "params", params) && !null)
            return finish(line, limit, ret);
        enum status s = give_up(line, NULL);
        return null ? STATUS_FORMAT : s;
    }
    return give_up(line, params);
}

enum status protocol_notify(enum notification notification, cJSON *params, struct line *ret)
{
    return call(NULL, notification_names[notification], params, PROTOCOL_MAX_LINE - 1, ret);
}

enum status protocol_event(const struct event *event, struct line *ret)
{
    cJSON *params = cJSON_CreateObject();
    if (add(params, "seq", cJSON_CreateNumber((double)event->seq)) &&
        add(params, "topic", cJSON_CreateString(event_topic_name(event->topic))) &&
        add(params, "type", cJSON_CreateString(event->type)) &&
        add(params, "data", cJSON_CreateRaw(event->data)))
        return protocol_notify(NOTIFICATION_EVENT, params, ret);
    return give_up(NULL, params);
}

/* An object of numbers, or NULL. */
static cJSON *numbers_json(size_t n, const char *const *names, const double *values)
{
    cJSON *object = cJSON_CreateObject();
    for (size_t i = 0; i < n; i++) {
        if (!add(object, names[i], cJSON_CreateNumber(values[i]))) {
            cJSON_Delete(object);
            return NULL;
        }
    }
    return object;
}

enum status protocol_hello(const struct hello *hello, struct line *ret)
{
    static const char *const version_names[] = { "major", "minor" };
    static const double version[] = { PROTOCOL_MAJOR, PROTOCOL_MINOR };
    static const char *const limit_names[] = { "request_bytes", "reply_bytes", "depth", "events" };
    static const double limits[] = { PROTOCOL_MAX_REQUEST, PROTOCOL_MAX_LINE, STRICT_JSON_MAX_DEPTH,
                                     EVENTS_KEPT };
    cJSON *params = cJSON_CreateObject();
    if (add(params, "protocol", numbers_json(2, version_names, version)) &&
        add(params, "server", cJSON_CreateString(hello->server)) &&
        add(params, "capabilities", cJSON_CreateArray()) &&
        add(params, "limits", numbers_json(4, limit_names, limits)) &&
        add_text(params, "station_id", hello->station_id) &&
        add(params, "boot", cJSON_CreateString(hello->boot)))
        return protocol_notify(NOTIFICATION_HELLO, params, ret);
    return give_up(NULL, params);
}

/* ---- for clients -------------------------------------------------------------------- */

enum status protocol_ask(int64_t id, enum method method, cJSON *params, struct line *ret)
{
    struct request_id number = { .kind = REQUEST_ID_INTEGER, .integer = id };
    return call(&number, method_name(method), params != NULL ? params : cJSON_CreateObject(),
                PROTOCOL_MAX_REQUEST, ret);
}

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
