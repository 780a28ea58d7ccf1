/* cmd_history.c - records of the station: the newest as a table, or one in full. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "cli/command.h"
#include "cli/member.h"
#include "cli/options.h"
#include "cli/record_out.h"
#include "cli/remote.h"

enum { OPTION_SUBJECT = OPTION_OWN, OPTION_RECOMPUTE, DEFAULT_LIMIT = 20, MAX_LIMIT = 100000 };

static const struct argp_option options[] = {
    { "limit", OPTION_LIMIT, "N", 0, "The newest N, 1..100000 (20; all with --since)", 0 },
    { "since", OPTION_SINCE, "SEQ", 0, "Only those after this record", 0 },
    { "subject", OPTION_SUBJECT, "ID", 0, "Only those of this subject", 0 },
    { "recompute", OPTION_RECOMPUTE, NULL, 0, "Compute record ID anew from its spectrum", 0 },
    OPTION_ROW_SOCKET,
    OPTION_ROWS_JSON,
    { 0 },
};

struct arguments {
    struct option_station station;
    const char *id, *subject;
    size_t limit;      /* 0: not given */
    int64_t since_seq; /* -1: not given */
    bool recompute;
};

static error_t parse(int key, char *text, struct argp_state *state)
{
    struct arguments *a = state->input;
    switch (key) {
    case OPTION_LIMIT:
        a->limit = option_count(state, "limit", text, 1, MAX_LIMIT);
        break;
    case OPTION_SINCE:
        a->since_seq = option_seq(state, "since", text);
        break;
    case OPTION_SUBJECT:
        a->subject = option_uuid(state, "--subject", text);
        break;
    case OPTION_RECOMPUTE:
        a->recompute = true;
        break;
    case ARGP_KEY_ARG:
        if (a->id != NULL)
            argp_error(state, "one ID at a time");
        a->id = option_uuid(state, "ID", text);
        break;
    case ARGP_KEY_END:
        if (a->recompute && a->id == NULL)
            argp_error(state, "--recompute: which record? Give its ID");
        if (a->id != NULL && (a->limit > 0 || a->since_seq >= 0 || a->subject != NULL))
            argp_error(state,
                       "an ID is one record: --limit, --since and --subject have no meaning");
        break;
    default:
        return option_station(key, text, state, &a->station);
    }
    return 0;
}

/* ---- one record --------------------------------------------------------------------- */

static void print_recomputed(const cJSON *result)
{
    if (member_true(result, "same_bits"))
        puts("computed anew: the same to the last bit");
    else
        printf("computed anew: the largest relative difference of a number is %.3g\n",
               member_number(result, "difference"));
    puts("stored");
    record_out_match(member(result, "stored"));
    puts("computed anew");
    record_out_match(member(result, "recomputed"));
}

static bool show_one(struct remote *remote, const struct arguments *a)
{
    bool good = true;
    cJSON *params = cJSON_CreateObject();
    cJSON_AddStringToObject(params, "id", a->id);
    cJSON *result =
        remote_ask(remote, a->recompute ? METHOD_RECORD_RECOMPUTE : METHOD_RECORD_GET, params);
    if (result == NULL)
        return false;
    if (a->station.format != OUT_PLAIN) {
        out_one(result);
        return true;
    }
    if (a->recompute)
        print_recomputed(result);
    else
        good = record_out(result) == STATUS_OK;
    cJSON_Delete(result);
    return good;
}

/* ---- many --------------------------------------------------------------------------- */

/* The newest `limit` records of those that came by; with limit 0 each is printed at once. */
struct tail {
    struct out out;
    size_t limit, n;
    cJSON *records; /* [n] */
};

static void add(void *context, cJSON *record)
{
    struct tail *tail = context;
    if (tail->limit == 0) {
        out_item(&tail->out, record, record_out_line);
        return;
    }
    cJSON_AddItemToArray(tail->records, record);
    if (tail->n == tail->limit)
        cJSON_DeleteItemFromArray(tail->records, 0);
    else
        tail->n++;
}

static void print_tail(struct tail *tail)
{
    cJSON *record;
    while ((record = cJSON_DetachItemFromArray(tail->records, 0)) != NULL)
        out_item(&tail->out, record, record_out_line);
    cJSON_Delete(tail->records);
}

/* Where to begin: whoever sees all records needs no more than the newest.  -1: logged. */
static int64_t first_since(struct remote *remote, const struct arguments *a, size_t limit)
{
    bool own_only = strcmp(member_text(remote_session(remote), "right"), "kiosk") == 0;
    if (a->since_seq >= 0 || a->subject != NULL || own_only)
        return a->since_seq > 0 ? a->since_seq : 0;
    cJSON *status = remote_ask(remote, METHOD_STATUS_GET, NULL);
    if (status == NULL)
        return -1;
    int64_t last = member_integer(status, "last_seq"), since = last - (int64_t)limit;
    cJSON_Delete(status);
    return since > 0 ? since : 0;
}

static bool read_pages(struct remote *remote, const struct arguments *a, struct tail *tail)
{
    int64_t since = first_since(remote, a, tail->limit);
    bool more = since >= 0;
    if (!more)
        return false;
    while (more) {
        cJSON *params = cJSON_CreateObject();
        cJSON_AddNumberToObject(params, "since_seq", (double)since);
        if (a->subject != NULL)
            cJSON_AddStringToObject(params, "subject", a->subject);
        cJSON *page = remote_page(remote, METHOD_RECORD_LIST, params, "records", add, tail);
        if (page == NULL)
            return false;
        since = member_integer(page, "next_seq");
        more = member_true(page, "more");
        cJSON_Delete(page);
    }
    return true;
}

static bool show_many(struct remote *remote, const struct arguments *a)
{
    struct tail tail = { .limit = a->limit, .records = cJSON_CreateArray() };
    if (tail.limit == 0 && a->since_seq < 0)
        tail.limit = DEFAULT_LIMIT;
    out_begin(&tail.out, a->station.format);
    if (a->station.format == OUT_PLAIN)
        record_out_head();
    bool good = read_pages(remote, a, &tail);
    print_tail(&tail);
    return out_end(&tail.out) == STATUS_OK && good;
}

int cmd_history(int argc, char **argv)
{
    static const struct argp argp = {
        options,
        parse,
        "[ID]",
        "The records of the station, newest last; with ID that one in full, its spectrum drawn.\v"
        "Times are UTC.  A kiosk sees the records it made.  --recompute computes colour and match "
        "of a record anew from its spectrum, by the table it was matched with, and says whether "
        "every number is the same.  With --json the objects (docs/protocol.md); 'skinspec export' "
        "writes files for other programs.\n\n"
        "Examples:\n"
        "  skinspec history --limit 5\n"
        "  skinspec history 018f2c3a-5b6d-7e8f-9a0b-1c2d3e4f5a6b --recompute\n",
        NULL,
        NULL,
        NULL
    };
    struct arguments a = { .station = { NULL, OUT_PLAIN }, .since_seq = -1 };
    struct remote *remote;
    option_parse(&argp, "history", argc, argv, &a);
    if (remote_open(a.station.socket, NULL, &remote) != STATUS_OK)
        return EXIT_FAILURE;
    bool good = a.id != NULL ? show_one(remote, &a) : show_many(remote, &a);
    remote_close(remote);
    return out_exit(good);
}
