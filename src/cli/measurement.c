/* measurement.c - from measure.start to the record, following the events. */
#include "cli/measurement.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "base/log.h"
#include "cli/instrument.h"
#include "cli/member.h"
#include "cli/prompt.h"
#include "cli/record_out.h"
#include "cli/stop.h"
#include "json/give.h"

struct run {
    struct remote *remote;
    const struct measurement *measurement;
    struct stop stop;
    int64_t start_id, next_id, cancel_id; /* of the requests; 0: not sent */
    bool has_button, waiting;             /* for Enter or the button */
    bool input_ended;
    struct prompt prompt;
    cJSON *record;
};

/* ---- requests ----------------------------------------------------------------------- */

static void add_known(cJSON *params, const char *name, const char *text)
{
    if (text != NULL)
        cJSON_AddStringToObject(params, name, text);
}

/* What is asked beside the nearest row. */
static void add_wish(cJSON *params, const struct refine_wish *wish)
{
    cJSON *fix = cJSON_CreateObject();
    add_known(params, "refine", wish->kind != REFINE_NOT ? refine_kind_name(wish->kind) : NULL);
    if (!isnan(wish->white))
        cJSON_AddNumberToObject(params, "noise", wish->white);
    if (!isnan(wish->placement))
        cJSON_AddNumberToObject(params, "placement", wish->placement);
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        if (!isnan(wish->fix[i]))
            cJSON_AddNumberToObject(fix, skin_parameter_name(i), wish->fix[i]);
    if (fix != NULL && fix->child != NULL)
        json_give_member(params, "fix", fix);
    else
        cJSON_Delete(fix);
}

static bool send_start(struct run *run)
{
    const struct measurement *m = run->measurement;
    cJSON *params = remote_lease_params(run->remote);
    add_known(params, "uuid", m->uuid);
    add_known(params, "specular", m->specular);
    if (!isnan(m->surface))
        cJSON_AddNumberToObject(params, "surface", m->surface);
    cJSON_AddNumberToObject(params, "replicates", (double)m->replicates);
    add_known(params, "pace", m->pace);
    add_known(params, "subject", m->subject);
    add_known(params, "site", m->site);
    add_known(params, "table", m->table);
    add_known(params, "by", m->by);
    add_wish(params, &m->wish);
    return remote_send(run->remote, METHOD_MEASURE_START, params, &run->start_id) == STATUS_OK;
}

static bool send_uuid(struct run *run, enum method method, int64_t *id)
{
    cJSON *params = remote_lease_params(run->remote);
    add_known(params, "uuid", run->measurement->uuid);
    return remote_send(run->remote, method, params, id) == STATUS_OK;
}

/* ---- what comes --------------------------------------------------------------------- */

static void tell_shot(const cJSON *data)
{
    char flags[RECORD_FLAGS_SIZE];
    record_out_flags(member(data, "flags"), flags);
    fprintf(stderr, "shot %" PRId64 " of %" PRId64 " taken%s%s\n", member_integer(data, "shot"),
            member_integer(data, "replicates"), *flags != '\0' ? ": " : "", flags);
}

static void tell_waiting(const struct run *run, const cJSON *data)
{
    const char *prompt = member_text(data, "prompt");
    const char *how = run->input_ended  ? "press the instrument's button"
                      : run->has_button ? "press Enter or the instrument's button"
                                        : "press Enter";
    fprintf(stderr, "%s%sfor shot %" PRId64 " of %" PRId64 " %s\n", prompt,
            *prompt != '\0' ? "; " : "", member_integer(data, "shot"),
            member_integer(data, "replicates"), how);
}

static void take_event(struct run *run, const cJSON *event)
{
    const cJSON *data = member(event, "data");
    const char *type = member_text(event, "type");
    if (strcmp(member_text(event, "topic"), "measurement") != 0 ||
        strcmp(member_text(data, "uuid"), run->measurement->uuid) != 0)
        return;
    if (strcmp(type, "shot") == 0) {
        run->waiting = false;
        tell_shot(data);
    } else if (strcmp(type, "waiting") == 0) {
        run->waiting = true;
        prompt_forget();
        tell_waiting(run, data);
    }
}

enum { GOES_ON, ENDED };

/* A reply: the record, or a refusal of one of our requests. */
static int take_reply(struct run *run, struct answer *answer)
{
    enum reason reason = remote_reason(answer);
    if (answer->id.integer == run->start_id) {
        if (answer->result != NULL)
            run->record = cJSON_DetachItemFromObjectCaseSensitive(answer->tree, "result");
        else if (run->cancel_id == 0 || reason != REASON_MEASUREMENT_CANCELLED)
            remote_complain(answer);
        return ENDED;
    }
    /* The button may have been quicker than Enter, the last shot quicker than Ctrl-C. */
    if (answer->error != NULL && reason != REASON_MEASUREMENT_NOT_WAITING &&
        reason != REASON_MEASUREMENT_UNKNOWN)
        remote_complain(answer);
    return GOES_ON;
}

static int take_line(struct run *run, struct answer *answer)
{
    int next = GOES_ON;
    if (answer->method == NULL)
        next = take_reply(run, answer);
    else if (strcmp(answer->method, "event") == 0)
        take_event(run, answer->params);
    remote_done(answer);
    return next;
}

static int take_input(struct run *run)
{
    switch (prompt_read(&run->prompt)) {
    case PROMPT_PARTIAL:
        return GOES_ON;
    case PROMPT_ENTER:
        if (!run->waiting)
            return GOES_ON;
        run->waiting = false;
        return send_uuid(run, METHOD_MEASURE_NEXT, &run->next_id) ? GOES_ON : ENDED;
    default:
        run->input_ended = true;
        if (run->has_button)
            return GOES_ON;
        log_error("standard input has ended and the instrument has no button to go on with");
        return send_uuid(run, METHOD_MEASURE_CANCEL, &run->cancel_id) ? GOES_ON : ENDED;
    }
}

static int take_stop(struct run *run)
{
    stop_take(&run->stop);
    if (run->cancel_id != 0) /* asked twice: do not wait for the station */
        return ENDED;
    return send_uuid(run, METHOD_MEASURE_CANCEL, &run->cancel_id) ? GOES_ON : ENDED;
}

/* ---- the whole ---------------------------------------------------------------------- */

/* A cancelled measurement has this long to end. */
enum { CANCEL_MS = 10000 };

static bool wants_enter(const struct run *run)
{
    return run->waiting && !run->input_ended;
}

static enum remote_news follow(struct run *run)
{
    struct answer answer;
    int next = GOES_ON;
    enum remote_news news = REMOTE_LINE;
    while (next == GOES_ON) {
        const struct remote_watch watch = {
            .input_fd = wants_enter(run) ? STDIN_FILENO : -1,
            .stop_fd = run->stop.fd,
            .timeout_ms = run->cancel_id != 0 ? CANCEL_MS : -1,
        };
        news = remote_next(run->remote, &watch, &answer);
        if (news == REMOTE_LINE)
            next = take_line(run, &answer);
        else if (news == REMOTE_INPUT)
            next = take_input(run);
        else if (news == REMOTE_STOP)
            next = take_stop(run);
        else
            next = ENDED;
    }
    return news;
}

static void tell_end(const struct run *run, enum remote_news news)
{
    if (run->record != NULL && run->cancel_id != 0)
        log_info("it was stored before it could be cancelled");
    else if (news != REMOTE_LINE)
        log_error("whether the measurement was stored is not known: the same command with "
                  "--uuid %s gives its record, or takes it anew",
                  run->measurement->uuid);
    else if (run->record == NULL && run->cancel_id != 0)
        log_error("cancelled; nothing was stored");
}

cJSON *measurement_take(struct remote *remote, const cJSON *instrument,
                        const struct measurement *measurement)
{
    struct run run = { .remote = remote,
                       .measurement = measurement,
                       .has_button = member_true(instrument, "has_button") };
    if (stop_begin(&run.stop) != STATUS_OK)
        return NULL;
    if (send_start(&run))
        tell_end(&run, follow(&run));
    if (run.record == NULL && run.stop.signal != 0)
        instrument_release(remote);
    stop_end(&run.stop);
    if (run.record == NULL)
        stop_as_asked(&run.stop);
    return run.record;
}
