/* protocol_lines.c - what is sent, as lines: replies, refusals, notifications, requests. */
#include "station/protocol.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/utf8.h"
#include "json/memory.h"
#include "json/print.h"
#include "station/protocol_rules.h"
#include "station/strict_json.h"

/* ---- replies ------------------------------------------------------------------------ */

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

/* ---- refusals ----------------------------------------------------------------------- */

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
        add(line, "error", error_json(protocol_reason_rules(protocol, refusal->reason), refusal)))
        return finish(line, PROTOCOL_MAX_LINE - 1, ret);
    return give_up(line, NULL);
}

/* ---- notifications and requests ----------------------------------------------------- */

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
    return call(NULL, notification_name(notification), params, PROTOCOL_MAX_LINE - 1, ret);
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

enum status protocol_ask(int64_t id, enum method method, cJSON *params, struct line *ret)
{
    struct request_id number = { .kind = REQUEST_ID_INTEGER, .integer = id };
    return call(&number, method_name(method), params != NULL ? params : cJSON_CreateObject(),
                PROTOCOL_MAX_REQUEST, ret);
}
