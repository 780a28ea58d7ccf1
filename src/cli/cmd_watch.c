/* cmd_watch.c - the station's events as they come. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cli/command.h"
#include "cli/member.h"
#include "cli/options.h"
#include "cli/record_out.h"
#include "cli/refined_out.h"
#include "cli/remote.h"
#include "cli/stop.h"

enum { OPTION_TOPICS = OPTION_OWN };

static const struct argp_option options[] = {
    { "topics", OPTION_TOPICS, "A,B", 0,
      "Of instrument, calibration, lease, measurement, store (all)", 0 },
    { "since", OPTION_SINCE, "SEQ", 0, "First those after this event, where they are kept", 0 },
    OPTION_ROW_SOCKET,
    { "json", OPTION_JSON, NULL, 0, "Print one JSON object a line", 0 },
    { "ndjson", OPTION_NDJSON, NULL, 0, "The same", 0 },
    { 0 },
};

struct arguments {
    struct option_station station;
    unsigned topics;
    int64_t since_seq; /* -1: none from before */
};

static unsigned topics_of(struct argp_state *state, char *text)
{
    unsigned topics = 0;
    char *rest = NULL;
    for (char *name = strtok_r(text, ",", &rest); name != NULL; name = strtok_r(NULL, ",", &rest)) {
        enum event_topic topic = EVENT_TOPICS;
        if (event_topic_parse(name, &topic) != STATUS_OK)
            argp_error(state,
                       "--topics: '%s' is none of instrument, calibration, lease, measurement, "
                       "store",
                       name);
        topics |= 1u << topic;
    }
    if (topics == 0)
        argp_error(state, "--topics: which? --help lists them");
    return topics;
}

static error_t parse(int key, char *text, struct argp_state *state)
{
    struct arguments *a = state->input;
    if (key == OPTION_TOPICS)
        a->topics = topics_of(state, text);
    else if (key == OPTION_SINCE)
        a->since_seq = option_seq(state, "since", text);
    else
        return option_station(key, text, state, &a->station);
    return 0;
}

/* The members that tell a person what happened, in this order. */
static const char *const told[] = {
    "instrument", "model", "serial",     "state",  "step",   "due",     "cause", "place", "fence",
    "position",   "shot",  "replicates", "prompt", "reason", "message", "tile",  "dE00",  "limit",
    "passed",     "drift", "store",      "sound",  "table",  "error",   "uuid",  "id",    "seq"
};

static void print_members(const cJSON *data)
{
    for (size_t i = 0; i < sizeof told / sizeof *told; i++) {
        const cJSON *one = member(data, told[i]);
        if (cJSON_IsString(one))
            printf("  %s %s", told[i], one->valuestring);
        else if (cJSON_IsNumber(one))
            printf("  %s %.15g", told[i], one->valuedouble);
        else if (cJSON_IsTrue(one))
            printf("  %s", told[i]);
    }
    const cJSON *calibration = member(data, "calibration");
    if (cJSON_IsObject(calibration)) /* of calibration/due; elsewhere an array */
        print_members(calibration);
}

static void print_event(const cJSON *event)
{
    char flags[RECORD_FLAGS_SIZE];
    const cJSON *data = member(event, "data");
    printf("%6" PRId64 "  %s/%s", member_integer(event, "seq"), member_text(event, "topic"),
           member_text(event, "type"));
    print_members(data);
    record_out_flags(member(data, "flags"), flags);
    printf("%s%s\n", *flags != '\0' ? "  flags " : "", flags);
}

static void print_lost(const cJSON *lost)
{
    const cJSON *now = member(lost, "snapshot");
    printf("events after %" PRId64 " and before %" PRId64 " are lost; now: store %s, table %s, "
           "last record %" PRId64 "\n",
           member_integer(lost, "since_seq"), member_integer(lost, "next_seq"),
           member_text(now, "store"), member_text(now, "table"), member_integer(now, "last_seq"));
}

/* A record that was measured is asked for: its skin is no news for everybody, so that the event
 * does not have it. */
static void ask_for_record(struct remote *remote, const cJSON *event)
{
    const cJSON *id = member(member(event, "data"), "id");
    int64_t asked;
    if (strcmp(member_text(event, "topic"), "measurement") != 0 ||
        strcmp(member_text(event, "type"), "done") != 0 || !cJSON_IsString(id))
        return;
    cJSON *params = cJSON_CreateObject();
    cJSON_AddStringToObject(params, "id", id->valuestring);
    (void)remote_send(remote, METHOD_RECORD_GET, params, &asked); /* logged */
}

/* Where it is not ours to see, or has no interval, nothing is said. */
static void print_record(const cJSON *record)
{
    const cJSON *match = member(record, "match");
    struct wire_match m;
    if (match == NULL || wire_read_match(match, &m) != STATUS_OK || !m.is_refined)
        return;
    printf("        record %" PRId64 "  ", member_integer(record, "seq"));
    refined_out_line(match, &m.refined);
}

/* A notification, or a record that was asked for; others come with later versions and are passed
 * over. */
static void print_line(struct remote *remote, struct answer *answer, enum out_format format)
{
    bool lost = answer->method != NULL && strcmp(answer->method, "events.lost") == 0;
    bool event = answer->method != NULL && strcmp(answer->method, "event") == 0;
    if (format == OUT_PLAIN && event) {
        print_event(answer->params);
        ask_for_record(remote, answer->params);
    } else if (format == OUT_PLAIN && answer->method == NULL) {
        print_record(answer->result);
    } else if (format == OUT_PLAIN && lost) {
        print_lost(answer->params);
    } else if (event) {
        out_one(cJSON_DetachItemFromObjectCaseSensitive(answer->tree, "params"));
    } else if (lost) {
        cJSON *object = cJSON_CreateObject();
        cJSON_AddItemToObject(object, "lost",
                              cJSON_DetachItemFromObjectCaseSensitive(answer->tree, "params"));
        out_one(object);
    }
}

/* Until a signal (true), or until the station goes or nobody reads. */
static bool watch(struct remote *remote, struct stop *stop, enum out_format format)
{
    const struct remote_watch watch = { -1, stop->fd, -1 };
    struct answer answer;
    for (;;) {
        enum remote_news news = remote_next(remote, &watch, &answer);
        if (news == REMOTE_STOP)
            stop_take(stop); /* else it would end the program at stop_end() */
        if (news != REMOTE_LINE)
            return news == REMOTE_STOP;
        print_line(remote, &answer, format);
        remote_done(&answer);
        if (out_exit(true) != EXIT_SUCCESS)
            return false;
    }
}

int cmd_watch(int argc, char **argv)
{
    static const struct argp argp = {
        options,
        parse,
        "",
        "The station's events, a line each as they come, until Ctrl-C; after a measurement that "
        "was "
        "refined a line with its skin, and how sure that is.\v"
        "With --json each line is an event {\"seq\",\"topic\",\"type\",\"data\"} as "
        "docs/protocol.md "
        "has it, or {\"lost\":..} where --since lies before what the station still keeps.  Events "
        "are numbered from 1 with each start of the station.  Exit status 1 where the "
        "station goes away: it does not connect again.\n\n"
        "Example: skinspec watch --topics measurement,store --json\n",
        NULL,
        NULL,
        NULL
    };
    struct arguments a = { { NULL, OUT_PLAIN }, (1u << EVENT_TOPICS) - 1, -1 };
    struct remote *remote;
    struct stop stop;
    option_parse(&argp, "watch", argc, argv, &a);
    if (remote_open(a.station.socket, NULL, &remote) != STATUS_OK)
        return EXIT_FAILURE;
    cJSON *subscribed = remote_subscribe(remote, a.topics, a.since_seq);
    bool good = subscribed != NULL && stop_begin(&stop) == STATUS_OK;
    cJSON_Delete(subscribed);
    if (good) {
        good = watch(remote, &stop, a.station.format);
        stop_end(&stop);
    }
    remote_close(remote);
    return out_exit(good);
}
