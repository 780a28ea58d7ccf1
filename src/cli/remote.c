/* remote.c - requests, replies and events over one connection. */
#include "cli/remote.h"

#include <errno.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/log.h"
#include "cli/member.h"
#include "cli/out.h"
#include "cli/remote_socket.h"

enum { HELLO_MS = 5000, REPLY_MS = 30000, LEASE_SIZE = 64 };

/* A line that was read while another was waited for. */
struct kept {
    struct answer answer;
    struct kept *next;
};

struct remote {
    struct remote_socket socket;
    cJSON *session;
    struct kept *first, **end;
    int64_t last_id;
    char lease[LEASE_SIZE];
    int64_t renew_ms, renew_at_ms, renew_id; /* renew_id 0: no renewal under way */
};

/* ---- requests ----------------------------------------------------------------------- */

enum status remote_send(struct remote *r, enum method method, cJSON *params, int64_t *id)
{
    struct line line;
    enum status status = protocol_ask(r->last_id + 1, method, params, &line);
    if (status != STATUS_OK) {
        if (status == STATUS_RANGE)
            log_error("%s: a request takes at most %d bytes in all: shorten the texts in it",
                      method_name(method), PROTOCOL_MAX_REQUEST);
        else
            log_error("%s: %s", method_name(method),
                      status == STATUS_FORMAT ? "a text is not UTF-8" : status_text(status));
        return status;
    }
    line.text[line.n++] = '\n'; /* over the NUL */
    status = remote_socket_write(&r->socket, line.text, line.n);
    free(line.text);
    if (status == STATUS_OK)
        *id = ++r->last_id;
    return status;
}

enum reason remote_reason(const struct answer *answer)
{
    const char *name = member_text(member(answer->error, "data"), "reason");
    enum reason reason = 0;
    while (reason < REASONS && strcmp(reason_name(reason), name) != 0)
        reason++;
    return reason;
}

void remote_complain(const struct answer *answer)
{
    const cJSON *data = member(answer->error, "data");
    const char *code = member_text(data, "device_code");
    log_error("%s (%s%s%s) - %s", member_text(answer->error, "message"),
              member_text(data, "reason"), *code != '\0' ? ", instrument says " : "", code,
              member_text(data, "hint"));
}

void remote_done(struct answer *answer)
{
    cJSON_Delete(answer->tree);
    *answer = (struct answer){ 0 };
}

/* ---- the lease ---------------------------------------------------------------------- */

void remote_hold(struct remote *r, const char *lease, double lasts_ms)
{
    snprintf(r->lease, sizeof r->lease, "%s", lease != NULL ? lease : "");
    r->renew_ms =
        lasts_ms > 0.0 && lasts_ms < REMOTE_LEASE_MS ? (int64_t)lasts_ms / 3 : REMOTE_LEASE_MS / 3;
    r->renew_at_ms = clock_monotonic_ms() + r->renew_ms;
}

bool remote_holds(const struct remote *r)
{
    return *r->lease != '\0';
}

cJSON *remote_lease_params(const struct remote *r)
{
    cJSON *params = cJSON_CreateObject();
    cJSON_AddStringToObject(params, "lease", r->lease);
    return params;
}

/* One at a time. */
static enum status renew(struct remote *r)
{
    r->renew_at_ms = clock_monotonic_ms() + r->renew_ms;
    if (r->renew_id != 0)
        return STATUS_OK;
    cJSON *params = remote_lease_params(r);
    cJSON_AddNumberToObject(params, "ttl_ms", REMOTE_LEASE_MS);
    return remote_send(r, METHOD_INSTRUMENT_RENEW, params, &r->renew_id);
}

/* ---- lines -------------------------------------------------------------------------- */

static bool answers(const struct answer *a, int64_t id)
{
    return a->id.kind == REQUEST_ID_INTEGER && a->id.integer == id;
}

/* A line that is there already and not the reply to a renewal: what is wrong with the lease
 * is told by the next request that needs it.  STATUS_NOT_FOUND, STATUS_FORMAT. */
static enum status take_line(struct remote *r, struct answer *ret)
{
    const char *line;
    size_t n;
    while ((line = remote_socket_line(&r->socket, &n)) != NULL) {
        enum status status = protocol_read_answer(line, n, ret);
        if (status != STATUS_OK || r->renew_id == 0 || !answers(ret, r->renew_id))
            return status;
        remote_done(ret);
        r->renew_id = 0;
    }
    return STATUS_NOT_FOUND;
}

static int earlier(int64_t left_ms, int timeout_ms)
{
    if (left_ms < 0)
        left_ms = 0;
    return timeout_ms < 0 || left_ms < timeout_ms ? (int)left_ms : timeout_ms;
}

/* Wait for one of them, and renew the lease in between.  A signal handler that ran
 * (cli/progress_bar) ends the wait as a stop. */
static enum remote_news wait_for(struct remote *r, const struct remote_watch *w)
{
    struct pollfd fds[] = { { r->socket.fd, POLLIN, 0 },
                            { w->input_fd, POLLIN, 0 },
                            { w->stop_fd, POLLIN, 0 } };
    int64_t deadline = clock_monotonic_ms() + w->timeout_ms;
    for (;;) {
        int64_t now = clock_monotonic_ms();
        bool holds = remote_holds(r);
        if (holds && now >= r->renew_at_ms && renew(r) != STATUS_OK)
            return REMOTE_GONE;
        int timeout = w->timeout_ms < 0 ? -1 : earlier(deadline - now, -1);
        int ready = poll(fds, 3, holds ? earlier(r->renew_at_ms - now, timeout) : timeout);
        if (ready < 0)
            return REMOTE_STOP;
        if (fds[2].revents != 0)
            return REMOTE_STOP;
        if (fds[0].revents != 0)
            return REMOTE_LINE;
        if (fds[1].revents != 0)
            return REMOTE_INPUT;
        if (ready == 0 && w->timeout_ms >= 0 && clock_monotonic_ms() >= deadline)
            return REMOTE_SILENT;
    }
}

static void gone(enum status status)
{
    if (status == STATUS_FORMAT)
        log_error("what the station says is not the protocol of a skinspec station");
    else
        log_error("the connection to the station ended%s%s", status == STATUS_IO ? ": " : "",
                  status == STATUS_IO ? strerror(errno) : "");
}

/* An error about a line whose id could not be read, or about the connection itself. */
static bool is_about_all(const struct answer *a)
{
    return a->error != NULL && a->id.kind == REQUEST_ID_NONE;
}

/* The next line of the socket, past those that are kept. */
static enum remote_news read_line(struct remote *r, const struct remote_watch *w,
                                  struct answer *ret)
{
    enum status status;
    while ((status = take_line(r, ret)) == STATUS_NOT_FOUND) {
        enum remote_news news = wait_for(r, w);
        if (news != REMOTE_LINE)
            return news;
        status = remote_socket_read(&r->socket);
        if (status != STATUS_OK)
            break;
    }
    if (status != STATUS_OK) {
        gone(status);
        return REMOTE_GONE;
    }
    if (!is_about_all(ret))
        return REMOTE_LINE;
    remote_complain(ret);
    remote_done(ret);
    return REMOTE_GONE;
}

enum remote_news remote_next(struct remote *r, const struct remote_watch *watch, struct answer *ret)
{
    struct kept *kept = r->first;
    if (kept == NULL)
        return read_line(r, watch, ret);
    *ret = kept->answer;
    r->first = kept->next;
    if (r->first == NULL)
        r->end = &r->first;
    free(kept);
    return REMOTE_LINE;
}

/* ---- replies ------------------------------------------------------------------------ */

static void keep(struct remote *r, const struct answer *answer)
{
    struct kept *kept = malloc(sizeof *kept);
    if (kept == NULL)
        out_of_memory();
    *kept = (struct kept){ *answer, NULL };
    *r->end = kept;
    r->end = &kept->next;
}

static enum status await(struct remote *r, int64_t id, int timeout_ms, struct answer *ret)
{
    const struct remote_watch watch = { -1, -1, timeout_ms };
    struct answer answer;
    for (;;) {
        enum remote_news news = read_line(r, &watch, &answer);
        if (news == REMOTE_SILENT)
            log_error("the station did not answer within %d s", timeout_ms / 1000);
        if (news != REMOTE_LINE)
            return news == REMOTE_STOP     ? STATUS_CANCELLED
                   : news == REMOTE_SILENT ? STATUS_TIMEOUT
                                           : STATUS_IO;
        if (answers(&answer, id)) {
            *ret = answer;
            return STATUS_OK;
        }
        keep(r, &answer);
    }
}

/* Those that read the whole store take as long as they take. */
static int patience_ms(enum method method)
{
    return method == METHOD_STORE_VERIFY ? -1 : REPLY_MS;
}

bool remote_try(struct remote *r, enum method method, cJSON *params, struct answer *ret)
{
    int64_t id;
    return remote_send(r, method, params, &id) == STATUS_OK && await(r, id, -1, ret) == STATUS_OK;
}

cJSON *remote_ask(struct remote *r, enum method method, cJSON *params)
{
    struct answer answer;
    int64_t id;
    if (remote_send(r, method, params, &id) != STATUS_OK ||
        await(r, id, patience_ms(method), &answer) != STATUS_OK)
        return NULL;
    cJSON *result = NULL;
    if (answer.error != NULL)
        remote_complain(&answer);
    else
        result = cJSON_DetachItemFromObjectCaseSensitive(answer.tree, "result");
    remote_done(&answer);
    return result;
}

cJSON *remote_page(struct remote *r, enum method method, cJSON *params, const char *list,
                   void (*take)(void *context, cJSON *item), void *context)
{
    cJSON *page = remote_ask(r, method, params), *item;
    cJSON *items = cJSON_GetObjectItemCaseSensitive(page, list);
    while ((item = cJSON_DetachItemFromArray(items, 0)) != NULL)
        take(context, item);
    return page;
}

cJSON *remote_subscribe(struct remote *r, unsigned topics, int64_t since_seq)
{
    cJSON *params = cJSON_CreateObject(), *names = cJSON_AddArrayToObject(params, "topics");
    for (enum event_topic t = 0; t < EVENT_TOPICS; t++)
        if (topics & 1u << t)
            cJSON_AddItemToArray(names, cJSON_CreateString(event_topic_name(t)));
    if (since_seq >= 0)
        cJSON_AddNumberToObject(params, "since_seq", (double)since_seq);
    return remote_ask(r, METHOD_EVENTS_SUBSCRIBE, params);
}

/* ---- opening ------------------------------------------------------------------------ */

static enum status hear_hello(struct remote *r)
{
    const struct remote_watch watch = { -1, -1, HELLO_MS };
    struct answer answer;
    enum remote_news news = read_line(r, &watch, &answer);
    if (news == REMOTE_SILENT)
        log_error("no hello within %d s: what listens there is no skinspec station",
                  HELLO_MS / 1000);
    if (news != REMOTE_LINE)
        return STATUS_IO;
    enum status status = STATUS_FORMAT;
    double major = member_number(member(answer.params, "protocol"), "major");
    if (answer.method == NULL || strcmp(answer.method, "hello") != 0) {
        gone(STATUS_FORMAT);
    } else if (major != PROTOCOL_MAJOR) {
        log_error("the station (%s) speaks version %g of the protocol, this program %d; use the "
                  "skinspec that came with it",
                  member_text(answer.params, "server"), major, PROTOCOL_MAJOR);
        status = STATUS_VERSION;
    } else {
        status = STATUS_OK;
    }
    remote_done(&answer);
    return status;
}

static enum status open_session(struct remote *r, const char *operator_name)
{
    cJSON *params = cJSON_CreateObject();
    cJSON_AddNumberToObject(params, "major", PROTOCOL_MAJOR);
    cJSON_AddStringToObject(params, "client", "skinspec");
    if (operator_name != NULL)
        cJSON_AddStringToObject(params, "operator", operator_name);
    r->session = remote_ask(r, METHOD_SESSION_OPEN, params);
    return r->session != NULL ? STATUS_OK : STATUS_IO;
}

enum status remote_open(const char *socket, const char *operator_name, struct remote **ret)
{
    struct remote *r = calloc(1, sizeof *r);
    if (r == NULL)
        out_of_memory();
    r->end = &r->first;
    enum status status = remote_socket_open(socket, &r->socket);
    if (status != STATUS_OK) {
        free(r);
        return status;
    }
    status = hear_hello(r);
    if (status == STATUS_OK)
        status = open_session(r, operator_name);
    if (status != STATUS_OK) {
        remote_close(r);
        return status;
    }
    *ret = r;
    return STATUS_OK;
}

void remote_close(struct remote *r)
{
    while (r->first != NULL) {
        struct kept *kept = r->first;
        r->first = kept->next;
        remote_done(&kept->answer);
        free(kept);
    }
    remote_socket_close(&r->socket);
    cJSON_Delete(r->session);
    free(r);
}

const cJSON *remote_session(const struct remote *r)
{
    return r->session;
}
