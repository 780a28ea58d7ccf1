/* replay_run.c - configure, calibrate, measure, as they were asked then. */
#include "cli/replay_run.h"

#include <stdio.h>
#include <string.h>

#include "base/log.h"
#include "base/uuid.h"
#include "cli/instrument.h"
#include "cli/member.h"
#include "cli/out.h"
#include "cli/patient.h"
#include "cli/record_compare.h"
#include "json/give.h"

/* A replay waits for nothing but its own driver's pauses, and a table that is being loaded. */
enum { OPEN_MS = 60000, STEP_MS = 120000 };

struct replay {
    struct remote *remote;
    struct stop *stop;
    const struct replay_part *part;
    size_t at; /* the next step */
    cJSON *told;
    void (*tell)(const cJSON *step);
};

/* ---- telling ------------------------------------------------------------------------ */

static void add_difference(cJSON *differences, const char *what, const char *captured,
                           const char *here)
{
    cJSON *one = cJSON_CreateObject();
    cJSON_AddStringToObject(one, "member", what);
    cJSON_AddStringToObject(one, "captured", captured);
    cJSON_AddStringToObject(one, "here", here);
    json_give_item(differences, one);
}

static void name_step(const struct replay_step *step, char *name, size_t size)
{
    const cJSON *what = step->what;
    switch (step->kind) {
    case REPLAY_CALIBRATE:
        snprintf(name, size, "calibrate %s", member_text(what, "step"));
        return;
    case REPLAY_MEASURE:
        snprintf(name, size, "measure %s, %.0f shot%s", member_text(what, "specular"),
                 member_number(what, "replicates"),
                 member_integer(what, "replicates") == 1 ? "" : "s");
        return;
    default:
        snprintf(name, size, "configure");
    }
}

/* differences are given away; NULL: there is nothing to compare with. */
static void tell(const struct replay *r, const struct replay_step *step, const char *same,
                 cJSON *differences)
{
    char name[96];
    cJSON *one = cJSON_CreateObject();
    const char *outcome = differences == NULL                   ? "not compared"
                          : cJSON_GetArraySize(differences) > 0 ? "differs"
                                                                : same;
    name_step(step, name, sizeof name);
    cJSON_AddStringToObject(one, "step", name);
    if (step->line > 0)
        cJSON_AddNumberToObject(one, "line", step->line);
    cJSON_AddStringToObject(one, "outcome", outcome);
    if (differences != NULL && cJSON_GetArraySize(differences) > 0)
        json_give_member(one, "differences", differences);
    else
        cJSON_Delete(differences);
    if (one == NULL)
        out_of_memory();
    r->tell(one);
    json_give_item(r->told, one);
}

/* ---- what came of it then ----------------------------------------------------------- */

static const struct replay_step *next_step(const struct replay *r)
{
    return r->at < r->part->n ? &r->part->steps[r->at] : NULL;
}

/* The step that says it; NULL where the capture ends or goes on without. */
static const struct replay_step *take_outcome(struct replay *r)
{
    const struct replay_step *step = next_step(r);
    if (step == NULL || step->kind < REPLAY_REFUSED || step->kind > REPLAY_RECORD)
        return NULL;
    r->at++;
    return step;
}

/* "done", "refused: REASON", "cancelled" */
static void describe_outcome(const struct replay_step *outcome, char *text, size_t size)
{
    if (outcome == NULL)
        snprintf(text, size, "done");
    else if (outcome->kind == REPLAY_REFUSED)
        snprintf(text, size, "refused: %s", member_text(outcome->what, "reason"));
    else if (outcome->kind == REPLAY_CANCELLED)
        snprintf(text, size, "cancelled");
    else
        snprintf(text, size, "a record");
}

static void describe_answer(const struct answer *answer, bool record, char *text, size_t size)
{
    if (answer->error == NULL) {
        snprintf(text, size, record ? "a record" : "done");
        return;
    }
    const char *reason = member_text(member(answer->error, "data"), "reason");
    if (record && remote_reason(answer) == REASON_MEASUREMENT_CANCELLED)
        snprintf(text, size, "cancelled");
    else
        snprintf(text, size, "refused: %s", reason);
}

/* Differences of how it ended; with a message why, where it did not end so then. */
static cJSON *compare_ends(const struct answer *answer, const struct replay_step *outcome,
                           bool record)
{
    char was[96], is[96];
    cJSON *differences = cJSON_CreateArray();
    describe_outcome(outcome, was, sizeof was);
    describe_answer(answer, record, is, sizeof is);
    if (strcmp(was, is) != 0) {
        add_difference(differences, "how it ended", was, is);
        if (answer->error != NULL)
            log_error("%s", member_text(answer->error, "message"));
    }
    return differences;
}

/* ---- configure, calibrate ----------------------------------------------------------- */

static cJSON *with_lease(const struct replay *r, const cJSON *what)
{
    cJSON *params = remote_lease_params(r->remote);
    const cJSON *one;
    cJSON_ArrayForEach(one, what)
    {
        json_give_member(params, one->string, cJSON_Duplicate(one, true));
    }
    return params;
}

/* A driver whose bytes differ from the capture's is refused here, with file and line. */
static bool do_simple(struct replay *r, const struct replay_step *step, enum method method)
{
    struct answer answer;
    if (!patient_ask(r->remote, r->stop, method, with_lease(r, step->what), STEP_MS, &answer))
        return false;
    tell(r, step, "done", compare_ends(&answer, take_outcome(r), false));
    remote_done(&answer);
    return true;
}

/* ---- measure ------------------------------------------------------------------------ */

static bool send_about(const struct replay *r, enum method method, const char *uuid)
{
    int64_t id;
    cJSON *params = remote_lease_params(r->remote);
    cJSON_AddStringToObject(params, "uuid", uuid);
    return remote_send(r->remote, method, params, &id) == STATUS_OK;
}

/* A shot waits: for what it waited for then. */
static bool go_on(struct replay *r, const char *uuid)
{
    const struct replay_step *step = next_step(r);
    if (step != NULL && step->kind == REPLAY_BUTTON) {
        r->at++;
        return true; /* the press comes from the capture */
    }
    if (step != NULL && step->kind == REPLAY_NEXT) {
        r->at++;
        return send_about(r, METHOD_MEASURE_NEXT, uuid);
    }
    return send_about(r, METHOD_MEASURE_CANCEL, uuid);
}

static bool is_waiting(const struct answer *answer, const char *uuid)
{
    const cJSON *event = answer->params;
    return answer->method != NULL && strcmp(answer->method, "event") == 0 &&
           strcmp(member_text(event, "topic"), "measurement") == 0 &&
           strcmp(member_text(event, "type"), "waiting") == 0 &&
           strcmp(member_text(member(event, "data"), "uuid"), uuid) == 0;
}

/* Up to its answer. */
static bool follow(struct replay *r, const char *uuid, int64_t id, struct answer *ret)
{
    const struct remote_watch watch = { -1, r->stop->fd, STEP_MS };
    for (;;) {
        enum remote_news news = remote_next(r->remote, &watch, ret);
        if (news == REMOTE_STOP)
            stop_take(r->stop);
        if (news == REMOTE_SILENT)
            log_error("nothing came of the measurement within %d s: a press of the button that the "
                      "capture has did not reach the driver",
                      STEP_MS / 1000);
        if (news != REMOTE_LINE)
            return false;
        if (ret->method == NULL && ret->id.integer == id)
            return true;
        bool good = !is_waiting(ret, uuid) || go_on(r, uuid);
        remote_done(ret);
        if (!good)
            return false;
    }
}

static void skip_presses(struct replay *r)
{
    const struct replay_step *step;
    while ((step = next_step(r)) != NULL &&
           (step->kind == REPLAY_NEXT || step->kind == REPLAY_BUTTON))
        r->at++;
}

static bool do_measure(struct replay *r, const struct replay_step *step)
{
    char uuid[UUID_TEXT_SIZE];
    struct answer answer;
    int64_t id;
    if (uuid4_make(uuid) != STATUS_OK) {
        log_error("the system has no random numbers for a uuid");
        return false;
    }
    cJSON *params = with_lease(r, step->what);
    cJSON_AddStringToObject(params, "uuid", uuid);
    if (remote_send(r->remote, METHOD_MEASURE_START, params, &id) != STATUS_OK ||
        !follow(r, uuid, id, &answer))
        return false;
    skip_presses(r);
    const struct replay_step *outcome = take_outcome(r);
    cJSON *differences = NULL;
    if (outcome != NULL) {
        differences = compare_ends(&answer, outcome, true);
        if (outcome->kind == REPLAY_RECORD && answer.result != NULL) {
            cJSON_Delete(differences);
            differences = record_compare(outcome->what, answer.result);
        }
    }
    tell(r, step, "same", differences);
    remote_done(&answer);
    return true;
}

/* ---- all ---------------------------------------------------------------------------- */

static bool do_step(struct replay *r, const struct replay_step *step)
{
    switch (step->kind) {
    case REPLAY_CONFIGURE:
        return do_simple(r, step, METHOD_INSTRUMENT_CONFIGURE);
    case REPLAY_CALIBRATE:
        return do_simple(r, step, METHOD_INSTRUMENT_CALIBRATE);
    case REPLAY_MEASURE:
        return do_measure(r, step);
    default:
        return true; /* of a step whose beginning is not in the capture */
    }
}

static bool take_instrument(struct replay *r)
{
    cJSON *instrument = patient_instrument(r->remote, r->stop, OPEN_MS);
    bool open = instrument != NULL && member(instrument, "error") == NULL;
    if (instrument != NULL && !open)
        log_error("the driver does not open the capture: %s; options of its address, such as "
                  "tile=FILE, are given by --with",
                  member_text(instrument, "error"));
    open = open && instrument_acquire(r->remote, member_text(instrument, "instrument"), false);
    cJSON_Delete(instrument);
    return open;
}

bool replay_run(struct remote *remote, struct stop *stop, const struct replay_part *part,
                cJSON *told, void (*tell_step)(const cJSON *step))
{
    struct replay replay = { remote, stop, part, 0, told, tell_step };
    cJSON *subscribed = remote_subscribe(remote, 1u << EVENT_MEASUREMENT, -1);
    bool good = subscribed != NULL && take_instrument(&replay);
    cJSON_Delete(subscribed);
    while (good && replay.at < part->n) {
        const struct replay_step *step = &part->steps[replay.at++];
        good = do_step(&replay, step);
    }
    return good;
}
