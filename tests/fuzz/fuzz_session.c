/* fuzz_session.c - a whole station, four clients, and whatever they send.
 *
 * The input is text, a line each: a digit 0..3 says which client, the next byte what:
 *
 *   >TEXT   send TEXT and a line feed     +TEXT   send TEXT without one
 *   ~       wait for the answers          !       disconnect (it connects anew when it sends)
 *
 * A line that begins otherwise goes to client 0 as it is.  In TEXT, @L is the lease that the
 * client got last, @R the record stored last, @S the subject added last.  Whatever comes: each
 * line of the station is an answer as the description has it, and once all have left
 * nobody holds an instrument and nothing runs. */
#include <dirent.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "base/log.h"
#include "station/bench.h"
#include "station/listener.h"
#include "station/station.h"
#include "station/strict_json.h"
#include "tests/support/table_files.h"

enum { CLIENTS = 4, NAME_SIZE = 64, IDS = 64, BUFFER = 2 * PROTOCOL_MAX_LINE, MOST_WAITS = 2000 };

struct fuzz_client {
    int fd; /* -1: not connected */
    char *in;
    size_t used;
    int method[IDS]; /* of the request with this id; -1 */
    char lease[NAME_SIZE];
};

static char folder[] = "/dev/shm/fuzz-session-XXXXXX", elsewhere[] = "/tmp/fuzz-session-XXXXXX";
static char *home, socket_path[108];
static struct settings settings;
static struct station station;
static struct listener listener = { .fd = -1 };
static struct fuzz_client clients[CLIENTS];
static char record_id[NAME_SIZE], subject_id[NAME_SIZE];

static void must(bool condition, const char *what)
{
    if (condition)
        return;
    fprintf(stderr, "fuzz_session: %s\n", what);
    abort();
}

/* ---- the station -------------------------------------------------------------------- */

static void ignore_log(enum log_level level, const char *text, void *context)
{
    (void)level;
    (void)text;
    (void)context;
}

static void ignore_opened(struct station *s, bool hopeless)
{
    (void)s;
    must(!hopeless, "the store cannot be opened");
}

static void turn(int times, uint64_t wait_us)
{
    for (int i = 0; i < times; i++)
        if (sd_event_run(station.event, wait_us) <= 0)
            return;
}

static void remove_home(void)
{
    char path[512];
    DIR *dir = opendir(home);
    const struct dirent *entry;
    while (dir != NULL && (entry = readdir(dir)) != NULL) {
        snprintf(path, sizeof path, "%s/%s", home, entry->d_name);
        (void)unlink(path);
    }
    if (dir != NULL)
        closedir(dir);
    (void)rmdir(home);
}

static void start_station(void)
{
    static char table[256];
    const struct recipe recipe = small_recipe("two-layer");
    home = mkdtemp(folder);
    if (home == NULL)
        home = mkdtemp(elsewhere);
    must(home != NULL, "no folder for the state");
    log_set_sink(ignore_log, NULL);
    snprintf(table, sizeof table, "%s/table-two-layer.db", home);
    must(small_table(table, &recipe, false) == STATUS_OK, "no table");
    snprintf(socket_path, sizeof socket_path, "%s/socket", home);
    settings = (struct settings){ .tables = home,
                                  .table = TABLES_DEFAULT,
                                  .instruments = { "simulated:speed=instant" },
                                  .instruments_n = 1,
                                  .kiosk_group = "skinspec",
                                  .clinic_group = "skinspec-clinic",
                                  .admin_group = "skinspec-admin",
                                  .max_clients = 64,
                                  .max_per_user = 64,
                                  .max_per_process = 64,
                                  .calibration_hours = 8.0,
                                  .calibration_blocks = true };
    snprintf(settings.state, sizeof settings.state, "%s", home);
    station.settings = &settings;
    station.store_opened = ignore_opened;
    must(sd_event_default(&station.event) >= 0 && station_open(&station) == STATUS_OK &&
             listener_open(socket_path, &listener) == STATUS_OK &&
             station_listen(&station, listener.fd) == STATUS_OK,
         "the station does not start");
    while (!station.store.told || tables_look(station.tables, NULL) == TABLES_LOADING ||
           !station.benches[0]->open)
        turn(1, 1000);
    for (int i = 0; i < CLIENTS; i++) {
        clients[i] = (struct fuzz_client){ .fd = -1, .in = malloc(BUFFER) };
        must(clients[i].in != NULL, "memory");
    }
    atexit(remove_home);
}

/* ---- what the station says ---------------------------------------------------------- */

static void note(char into[NAME_SIZE], const cJSON *object, const char *name)
{
    const char *text = cJSON_GetStringValue(strict_json_member(object, name));
    if (text != NULL)
        snprintf(into, NAME_SIZE, "%s", text);
}

static void check_result(struct fuzz_client *c, const struct answer *answer)
{
    struct schema_error error = { .what = "" };
    bool ours = answer->id.kind == REQUEST_ID_INTEGER && answer->id.integer >= 0 &&
                answer->id.integer < IDS;
    int method = ours ? c->method[answer->id.integer] : -1;
    if (answer->result == NULL || method < 0)
        return;
    if (!protocol_check_result(station.protocol, (enum method)method, answer->result, &error)) {
        fprintf(stderr, "%s: %s: %s\n", method_name((enum method)method), error.path, error.what);
        must(false, "a result is not as described");
    }
    note(c->lease, answer->result, "lease");
    note(record_id, strict_json_member(answer->result, "record"), "id");
    if (method == METHOD_SUBJECT_ADD)
        note(subject_id, answer->result, "id");
}

static void check_notification(const struct answer *answer)
{
    struct schema_error error = { .what = "" };
    enum event_topic topic;
    enum notification kind = strcmp(answer->method, "hello") == 0   ? NOTIFICATION_HELLO
                             : strcmp(answer->method, "event") == 0 ? NOTIFICATION_EVENT
                                                                    : NOTIFICATION_EVENTS_LOST;
    bool good = protocol_check_notification(station.protocol, kind, answer->params, &error);
    if (good && kind == NOTIFICATION_EVENT) {
        const char *name = cJSON_GetStringValue(strict_json_member(answer->params, "topic"));
        const char *type = cJSON_GetStringValue(strict_json_member(answer->params, "type"));
        good = event_topic_parse(name, &topic) == STATUS_OK &&
               protocol_check_event(station.protocol, topic, type,
                                    strict_json_member(answer->params, "data"), &error);
    }
    if (!good)
        fprintf(stderr, "%s: %s: %s\n", answer->method, error.path, error.what);
    must(good, "a notification is not as described");
}

static void check_line(struct fuzz_client *c, const char *line, size_t n)
{
    struct answer answer;
    must(strict_json_check(line, n, NULL) == STRICT_JSON_FINE, "a line is not JSON");
    must(protocol_read_answer(line, n, &answer) == STATUS_OK, "a line is no answer");
    if (answer.method != NULL)
        check_notification(&answer);
    else
        check_result(c, &answer);
    cJSON_Delete(answer.tree);
}

static void hang_up(struct fuzz_client *c)
{
    if (c->fd >= 0)
        close(c->fd);
    c->fd = -1;
    c->used = 0;
}

static void listen_to(struct fuzz_client *c)
{
    char *feed;
    while (c->fd >= 0) {
        ssize_t n = recv(c->fd, c->in + c->used, BUFFER - c->used, MSG_DONTWAIT);
        if (n == 0)
            hang_up(c);
        if (n <= 0)
            return;
        c->used += (size_t)n;
        while ((feed = memchr(c->in, '\n', c->used)) != NULL) {
            size_t length = (size_t)(feed - c->in);
            check_line(c, c->in, length);
            c->used -= length + 1;
            memmove(c->in, feed + 1, c->used);
        }
        must(c->used < BUFFER, "a line without an end");
    }
}

static void add_open(void *context, struct client *client)
{
    *(size_t *)context += client->open_requests;
}

static void let_it_work(int most_waits)
{
    for (int i = 0; i < most_waits; i++) {
        size_t open = 0;
        turn(64, 0);
        for (int c = 0; c < CLIENTS; c++)
            listen_to(&clients[c]);
        clients_each(station.clients, add_open, &open);
        if (open == 0 && !inbox_has_jobs(&station.inbox))
            return;
        turn(1, 500);
    }
}

/* ---- what the clients say ----------------------------------------------------------- */

static void dial(struct fuzz_client *c)
{
    struct sockaddr_un address = { .sun_family = AF_UNIX };
    strcpy(address.sun_path, socket_path);
    c->fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    must(c->fd >= 0 && connect(c->fd, (struct sockaddr *)&address, sizeof address) == 0, "dial");
    for (int i = 0; i < IDS; i++)
        c->method[i] = -1;
    turn(4, 0);
}

static void note_request(struct fuzz_client *c, const char *text, size_t n)
{
    cJSON *request = cJSON_ParseWithLength(text, n);
    const cJSON *id = strict_json_member(request, "id");
    const char *name = cJSON_GetStringValue(strict_json_member(request, "method"));
    if (cJSON_IsNumber(id) && id->valuedouble >= 0 && id->valuedouble < IDS && name != NULL) {
        int *method = &c->method[(int)id->valuedouble];
        int before = *method;
        *method = -1;
        for (int i = 0; i < METHODS; i++)
            if (strcmp(method_name((enum method)i), name) == 0)
                *method = i;
        if (before >= 0 && before != *method)
            *method = -1; /* two requests with one id: whose answer comes? */
    }
    cJSON_Delete(request);
}

static const char *placeholder(const struct fuzz_client *c, char letter)
{
    return letter == 'L' ? c->lease : letter == 'R' ? record_id : letter == 'S' ? subject_id : NULL;
}

/* TEXT with placeholders filled; the caller's to free. */
static char *fill(const struct fuzz_client *c, const char *text, size_t n, size_t *length)
{
    char *filled = malloc(n * NAME_SIZE + 2);
    *length = 0;
    for (size_t i = 0; filled != NULL && i < n; i++) {
        const char *value = text[i] == '@' && i + 1 < n ? placeholder(c, text[i + 1]) : NULL;
        if (value == NULL) {
            filled[(*length)++] = text[i];
            continue;
        }
        memcpy(filled + *length, value, strlen(value));
        *length += strlen(value);
        i++;
    }
    return filled;
}

static void say(struct fuzz_client *c, const char *text, size_t n, bool whole)
{
    size_t length, sent = 0;
    char *filled = fill(c, text, n, &length);
    must(filled != NULL, "memory");
    if (c->fd < 0)
        dial(c);
    if (whole) {
        note_request(c, filled, length);
        filled[length++] = '\n';
    }
    while (sent < length && c->fd >= 0) {
        ssize_t now = send(c->fd, filled + sent, length - sent, MSG_DONTWAIT | MSG_NOSIGNAL);
        sent += now > 0 ? (size_t)now : 0;
        turn(4, 0);
        listen_to(c);
    }
    free(filled);
}

static void act(const char *line, size_t n)
{
    bool addressed = n >= 2 && line[0] >= '0' && line[0] < '0' + CLIENTS;
    struct fuzz_client *c = &clients[addressed ? line[0] - '0' : 0];
    char what = addressed ? line[1] : '>';
    if (addressed)
        line += 2, n -= 2;
    if (what == '!')
        hang_up(c);
    else if (what == '~')
        let_it_work(20);
    else
        say(c, line, n, what != '+');
}

int LLVMFuzzerTestOneInput(const unsigned char *data, size_t size);

int LLVMFuzzerTestOneInput(const unsigned char *data, size_t size)
{
    const char *from = (const char *)data, *end = from + size;
    if (station.event == NULL)
        start_station();
    while (from < end) {
        const char *feed = memchr(from, '\n', (size_t)(end - from));
        const char *stop = feed != NULL ? feed : end;
        act(from, (size_t)(stop - from));
        from = feed != NULL ? feed + 1 : end;
    }
    let_it_work(20);
    for (int c = 0; c < CLIENTS; c++)
        hang_up(&clients[c]);
    struct bench *bench = station.benches[0];
    int waits = 0;
    while ((clients_count(station.clients).now > 0 || bench->run != NULL || bench->at_work) &&
           waits++ < MOST_WAITS)
        turn(1, 2000);
    must(waits < MOST_WAITS, "something runs after all have left");
    must(bench->lease.holder == 0 && bench->lease.waiting == 0, "a lease outlives its client");
    return 0;
}
