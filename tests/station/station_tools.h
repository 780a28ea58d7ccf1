/* station_tools.h - a whole station within the test's own process, and visitors who talk with
 * it: the loop turns only when the test lets it. */
#ifndef SKINSPEC_TESTS_STATION_STATION_TOOLS_H
#define SKINSPEC_TESTS_STATION_STATION_TOOLS_H

#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "base/clock.h"
#include "station/bench.h"
#include "station/housekeeping.h"
#include "station/listener.h"
#include "station/run.h"
#include "station/strict_json.h"
#include "tests/support/folder.h"
#include "tests/support/heard.h"
#include "tests/support/table_files.h"
#include "unity.h"

/* What is waited for at most, and one look at the sockets meanwhile. */
enum { LONG_MS = 20000, LOOK_US = 2000, VISITOR_ROOM = 2 * PROTOCOL_MAX_LINE };

static char folder[FOLDER_PATH_SIZE];
static struct settings settings;
static struct station station;
static struct listener listener;
static int opened_times;
static bool was_hopeless;

/* ---- the station -------------------------------------------------------------------- */

static inline void on_store_opened(struct station *s, bool hopeless)
{
    (void)s;
    opened_times++;
    was_hopeless = hopeless;
}

static inline void turn(uint64_t wait_us)
{
    for (int i = 0; i < 64 && sd_event_run(station.event, i == 0 ? wait_us : 0) > 0; i++)
        continue;
}

/* Turn the loop until this is so; false: it did not become so. */
static inline bool comes(bool is_so(void))
{
    int64_t until_ms = clock_boottime_ms() + LONG_MS;
    while (!is_so() && clock_boottime_ms() < until_ms)
        turn(LOOK_US);
    return is_so();
}

/* In the folder, with a small table there and one instrument that answers at once. */
static inline void set_settings(void)
{
    settings = (struct settings){
        .tables = folder,
        .table = TABLES_DEFAULT,
        .instruments = { "simulated:speed=instant,calibration_shots=1000000,drain=0" },
        .instruments_n = 1,
        .kiosk_group = "skinspec",
        .clinic_group = "skinspec-clinic",
        .admin_group = "skinspec-admin",
        .max_clients = 64,
        .max_per_user = 64,
        .max_per_process = 64,
        .calibration_hours = 8.0,
        .wal_limit_mb = 1024,
        .calibration_blocks = true
    };
    snprintf(settings.state, sizeof settings.state, "%s", folder);
    snprintf(settings.socket, sizeof settings.socket, "/tmp/sk-%ld.sock", (long)getpid());
}

/* As main() does it; what is open is closed by station_tools_end(). */
static inline enum status open_station(void)
{
    station = (struct station){ .settings = &settings, .store_opened = on_store_opened };
    listener = (struct listener){ .fd = -1 };
    opened_times = 0;
    TEST_ASSERT_GREATER_OR_EQUAL_INT(0, sd_event_new(&station.event));
    enum status s = station_open(&station);
    if (s == STATUS_OK)
        s = listener_open(settings.socket, &listener);
    if (s == STATUS_OK)
        s = station_listen(&station, listener.fd);
    return s == STATUS_OK ? housekeeping_start(&station) : s;
}

static inline void close_station(void)
{
    listener_close(&listener);
    station_close(&station);
    housekeeping_stop(station.housekeeping);
    sd_event_unref(station.event);
    station = (struct station){ .event = NULL };
}

static inline bool station_is_up(void)
{
    return station.store.told && tables_look(station.tables, NULL) != TABLES_LOADING &&
           station.benches[0]->open && !inbox_has_jobs(&station.inbox);
}

static inline void begin_station(void)
{
    TEST_ASSERT_EQUAL_INT(STATUS_OK, open_station());
    TEST_ASSERT_TRUE(comes(station_is_up));
}

static inline void make_table(void)
{
    static char path[FOLDER_PATH_SIZE];
    const struct recipe recipe = small_recipe("two-layer");
    folder_path(folder, "table-two-layer.db", path);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, small_table(path, &recipe, false));
}

/* ---- visitors ----------------------------------------------------------------------- */

enum outcome { OUTCOME_RESULT, OUTCOME_ERROR, OUTCOME_CLOSED, OUTCOME_SILENCE };

/* Nothing is allocated for one: it may be used while memory is scarce. */
struct visitor {
    int fd; /* -1: not connected */
    int next_id;
    size_t used, looked;       /* bytes there; those among them that were looked at */
    char in[VISITOR_ROOM];     /* all that came since visitor_forget() */
    char answer[VISITOR_ROOM]; /* the line that visitor_ask() waited for, without its end */
};

static inline void copy_text(char *into, size_t size, const char *text)
{
    size_t n = strlen(text);
    TEST_ASSERT_LESS_THAN_size_t(size, n);
    memcpy(into, text, n + 1);
}

static inline void visitor_leave(struct visitor *v)
{
    if (v->fd >= 0)
        close(v->fd);
    v->fd = -1;
}

static inline void visitor_read(struct visitor *v)
{
    while (v->fd >= 0) {
        ssize_t n = recv(v->fd, v->in + v->used, sizeof v->in - v->used, MSG_DONTWAIT);
        if (n == 0)
            visitor_leave(v);
        if (n <= 0)
            return;
        v->used += (size_t)n;
    }
}

/* The next whole line, or NULL; valid until more is read. */
static inline const char *visitor_line(struct visitor *v, size_t *n)
{
    const char *line = v->in + v->looked;
    const char *feed = memchr(line, '\n', v->used - v->looked);
    if (feed == NULL)
        return NULL;
    *n = (size_t)(feed - line);
    v->looked += *n + 1;
    return line;
}

static inline void visitor_forget(struct visitor *v)
{
    visitor_read(v);
    v->used = v->looked = 0;
}

/* Connect and hear the greeting; false where it is hung up instead. */
static inline bool visitor_come(struct visitor *v)
{
    struct sockaddr_un address = { .sun_family = AF_UNIX };
    size_t n;
    copy_text(address.sun_path, sizeof address.sun_path, settings.socket);
    v->used = v->looked = 0;
    v->next_id = 1;
    v->fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (v->fd < 0 || connect(v->fd, (struct sockaddr *)&address, sizeof address) != 0)
        return false;
    int64_t until_ms = clock_boottime_ms() + LONG_MS;
    const char *hello = NULL;
    while (hello == NULL && v->fd >= 0 && clock_boottime_ms() < until_ms) {
        turn(LOOK_US);
        visitor_read(v);
        hello = visitor_line(v, &n);
    }
    return hello != NULL;
}

/* Send method and params as a request; its id. */
static inline int visitor_say(struct visitor *v, const char *method, const char *params)
{
    static char line[PROTOCOL_MAX_REQUEST];
    int n = snprintf(line, sizeof line,
                     "{\"jsonrpc\":\"2.0\",\"id\":%d,\"method\":\"%s\",\"params\":%s}\n",
                     v->next_id, method, params);
    if (v->fd >= 0)
        (void)send(v->fd, line, (size_t)n, MSG_NOSIGNAL);
    return v->next_id++;
}

/* An error without an id is an answer as well: the line was not understood. */
static inline bool is_answer_to(const char *line, size_t n, int id, enum outcome *ret)
{
    char start[2][64];
    snprintf(start[0], sizeof start[0], "{\"jsonrpc\":\"2.0\",\"id\":%d,", id);
    snprintf(start[1], sizeof start[1], "{\"jsonrpc\":\"2.0\",\"id\":null,");
    for (int i = 0; i < 2; i++) {
        size_t length = strlen(start[i]);
        if (n <= length || memcmp(line, start[i], length) != 0)
            continue;
        *ret = strncmp(line + length, "\"result\"", 8) == 0 ? OUTCOME_RESULT : OUTCOME_ERROR;
        return true;
    }
    return false;
}

static inline enum outcome visitor_wait(struct visitor *v, int id)
{
    int64_t until_ms = clock_boottime_ms() + LONG_MS;
    enum outcome outcome;
    while (clock_boottime_ms() < until_ms) {
        const char *line;
        size_t n;
        visitor_read(v);
        while ((line = visitor_line(v, &n)) != NULL) {
            if (!is_answer_to(line, n, id, &outcome))
                continue;
            snprintf(v->answer, sizeof v->answer, "%.*s", (int)n, line);
            return outcome;
        }
        if (v->fd < 0)
            return OUTCOME_CLOSED;
        turn(LOOK_US);
    }
    return OUTCOME_SILENCE;
}

static inline enum outcome visitor_ask(struct visitor *v, const char *method, const char *params)
{
    return visitor_wait(v, visitor_say(v, method, params));
}

/* "reason" of an error, or another text of an answer by the name of its member. */
static inline const char *visitor_text(const struct visitor *v, const char *name)
{
    static char text[512];
    char start[64];
    snprintf(start, sizeof start, "\"%s\":\"", name);
    const char *at = strstr(v->answer, start);
    if (at == NULL)
        return "";
    at += strlen(start);
    snprintf(text, sizeof text, "%.*s", (int)strcspn(at, "\""), at);
    return text;
}

static inline void visitor_open_session(struct visitor *v)
{
    TEST_ASSERT_TRUE(visitor_come(v));
    TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT, visitor_ask(v, "session.open",
                                                      "{\"major\":1,\"client\":\"test\","
                                                      "\"operator\":\"Zo\\u00eb\"}"));
}

#endif
