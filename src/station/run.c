/* run.c - shots, the match, the record: one step after the other, each told by events. */
#include "station/run.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/log.h"
#include "json/give.h"
#include "station/answer_scene.h"
#include "station/asked.h"
#include "station/params.h"
#include "station/parking.h"
#include "station/reading.h"
#include "station/station_record.h"
#include "station/station_store.h"
#include "station/station_table.h"
#include "station/tell.h"
#include "station/ticket.h"
#include "station/wire.h"

enum { WAIT_MS = 600000 }; /* then asked again */

static void shoot(struct run *run);
static void store(struct run *run);

/* ---- its end ------------------------------------------------------------------------ */

static cJSON *about(const struct run *run, bool with_instrument)
{
    cJSON *data = cJSON_CreateObject();
    if (with_instrument)
        cJSON_AddStringToObject(data, "instrument", run->bench->name);
    cJSON_AddStringToObject(data, "uuid", run->record->uuid);
    return data;
}

static void run_free(struct run *run)
{
    struct bench *bench = run->bench;
    bench->run = NULL;
    measuring_done(&run->measuring);
    station_record_back(bench->station, run->record);
    free(run);
    bench_tell_changes(bench);
    station_serve_parked(bench->station); /* what waits for the bench */
}

static void refuse_askers(struct run *run, const struct refusal *refusal)
{
    for (size_t i = 0; i < run->askers_n; i++)
        station_refuse(run->bench->station, &run->askers[i], refusal);
}

static void fail(struct run *run, const struct refusal *refusal)
{
    cJSON *data = about(run, false);
    asked_refused(run->bench, "measure", refusal);
    cJSON_AddStringToObject(data, "reason", reason_name(refusal->reason));
    cJSON_AddStringToObject(data, "message", refusal->detail);
    station_tell(run->bench->station, EVENT_MEASUREMENT, "failed", data);
    refuse_askers(run, refusal);
    run_free(run);
}

static const char *const cause_names[] = { "asked", "released", "expired", "disconnected",
                                           "stopping" };
static const enum reason cause_reasons[] = { REASON_MEASUREMENT_CANCELLED,
                                             REASON_MEASUREMENT_CANCELLED, REASON_LEASE_EXPIRED,
                                             REASON_MEASUREMENT_CANCELLED, REASON_SHUTTING_DOWN };

static void answer_canceller(const struct run *run)
{
    cJSON *result = about(run, false);
    cJSON_AddFalseToObject(result, "stored");
    cJSON_AddNumberToObject(result, "discarded", (double)run->measuring.taken);
    station_answer(run->bench->station, &run->canceller, result);
}

static void finish_early(struct run *run)
{
    struct refusal refusal;
    cJSON *data = about(run, false);
    cJSON_AddStringToObject(data, "cause", cause_names[run->cause]);
    asked_cancelled(run->bench, cause_names[run->cause]);
    station_tell(run->bench->station, EVENT_MEASUREMENT, "cancelled", data);
    refusal_set(&refusal, cause_reasons[run->cause], NULL);
    refuse_askers(run, &refusal);
    if (run->has_canceller)
        answer_canceller(run);
    run_free(run);
}

void run_end(struct bench *bench, int64_t fence, enum run_cause cause)
{
    struct run *run = bench->run;
    if (run == NULL || run->record->fence != fence || run->ended || run->phase == RUN_STORING)
        return;
    if (run->phase == RUN_MATCHING && cause == RUN_STOPPING && !run->under_way)
        store(run); /* the table does not come any more */
    if (run->phase >= RUN_MATCHING && cause != RUN_ASKED)
        return; /* the reading is there: it is kept, and a retry gets it */
    if (run->phase == RUN_SHOOTING && cause == RUN_EXPIRED) {
        run->expired = true;
        return;
    }
    run->ended = true;
    run->cause = cause;
    if (!run->under_way)
        finish_early(run);
    else if (run->phase != RUN_MATCHING)
        bench_cancel(bench);
}

/* ---- stored ------------------------------------------------------------------------- */

static void answer_askers(struct run *run)
{
    struct station *station = run->bench->station;
    for (size_t i = 0; i < run->askers_n; i++) {
        cJSON *result = NULL;
        (void)wire_record(run->record, &result); /* NULL is refused as it should be */
        station_answer(station, &run->askers[i], result);
    }
}

static void refuse_expired(struct run *run)
{
    struct refusal refusal;
    refusal_set(&refusal, REASON_LEASE_EXPIRED,
                "during a shot; what was taken is kept as record %s, which a request with the "
                "same uuid gets",
                run->record->id);
    refuse_askers(run, &refusal);
}

static void stored(struct job *job)
{
    struct run *run = (struct run *)job;
    struct station *station = run->bench->station;
    enum status s = run->write.status;
    station_note_write(station, s);
    if (s == STATUS_OK && run->write.known) /* by another way in the meantime */
        s = STATUS_EXISTS;
    if (s != STATUS_OK) {
        struct refusal refusal = station_store_refusal(station, s, run->write.bad_member);
        fail(run, &refusal);
        return;
    }
    asked_record(run->bench, run->record);
    if (run->expired)
        refuse_expired(run);
    else
        answer_askers(run);
    cJSON *data = about(run, false);
    cJSON_AddStringToObject(data, "id", run->record->id);
    cJSON_AddNumberToObject(data, "seq", (double)run->record->seq);
    station_tell(station, EVENT_MEASUREMENT, "done", data);
    station_tell_record(station, run->record);
    run_free(run);
}

/* ["a","b"] and one more token. */
static void add_flag(struct store_record *record, const char *token)
{
    size_t n = strlen(record->flags), room = sizeof record->flags;
    if (n < 2)
        n = (size_t)snprintf(record->flags, room, "[]");
    snprintf(record->flags + n - 1, room - n + 1, "%s\"%s\"]", n > 2 ? "," : "", token);
}

static void store(struct run *run)
{
    bool refined =
        run->has_scene ? (run->scene.wanted & SCENE_REFINED) != 0 : run->wish.kind != REFINE_NOT;
    if (refined && run->record->refined_json[0] == '\0')
        add_flag(run->record, "not_refined");
    run->phase = RUN_STORING;
    run->write = (struct write_job){ .job.done = stored, .kind = WRITE_RECORD };
    run->write.record = run->record;
    writer_ask(run->bench->station->writer, &run->write);
}

/* ---- matched ------------------------------------------------------------------------ */

/* As below, what cannot be done leaves a record without a match. */
static void match_by_scene(struct run *run)
{
    cJSON *match = NULL;
    char why[SCENE_WHY_SIZE];
    if (answer_scene(run->loaded, &run->scene, true, run->record, &match, why) != STATUS_OK &&
        why[0] != '\0')
        log_warning("station: '%s': the scene is not matched: %s", run->bench->name, why);
    cJSON_Delete(match);
}

static void match_with(struct run *run)
{
    if (run->has_scene) {
        match_by_scene(run);
        return;
    }
    struct nearest_hit hits[REFINE_STARTS];
    enum match_by by = run->has_by ? run->by : matcher_default_by(loaded_table(run->loaded));
    const char *why;
    /* A spectrum that cannot be matched so is a record all the same, without a match; one that
     * cannot be refined keeps its nearest row, and a flag says so. */
    enum status s = answer_match(run->loaded, by, 0, hits, run->record, NULL);
    if (s == STATUS_OK && run->wish.kind != REFINE_NOT &&
        answer_refine(run->loaded, by, &run->wish, 0, hits, run->record, NULL, &why) != STATUS_OK &&
        why != NULL)
        log_warning("station: '%s': the match is not refined: %s", run->bench->name, why);
}

static void match_on_worker(struct job *job, void *thread)
{
    (void)thread;
    match_with((struct run *)job);
}

static void matched(struct job *job)
{
    struct run *run = (struct run *)job;
    run->under_way = false;
    if (run->ended)
        finish_early(run);
    else
        store(run);
}

/* A fit by a model without formulas of its own takes as long as clients should not have to wait
 * for a look at the store. */
static bool refines_long(const struct run *run)
{
    return (run->has_scene || run->wish.kind != REFINE_NOT) &&
           loaded_table(run->loaded)->recipe.model->quick == MODEL_QUICK_NONE;
}

static void match(struct run *run)
{
    struct station *station = run->bench->station;
    struct refusal refusal;
    const char *name = run->table[0] != '\0' ? run->table : NULL;
    if (run->has_scene && !scene_wants_skin(&run->scene)) { /* a record has its colours anyway */
        store(run);
        return;
    }
    enum status s = station_table(station, name, &run->loaded, &refusal);
    if (s == STATUS_CANCELLED)
        return; /* run_table_changed() comes here again */
    if (s != STATUS_OK) {
        store(run);
        return;
    }
    enum match_by by = run->has_by ? run->by : matcher_default_by(loaded_table(run->loaded));
    if (!run->has_scene && run->wish.kind == REFINE_NOT && answer_is_quick(run->loaded, by, 0)) {
        match_with(run);
        store(run);
        return;
    }
    run->job = (struct job){ .run = match_on_worker, .done = matched };
    run->under_way = true;
    worker_ask(refines_long(run) ? station->chores : station->reader, &run->job);
}

void run_table_changed(struct bench *bench)
{
    struct run *run = bench->run;
    if (run != NULL && run->phase == RUN_MATCHING && !run->under_way)
        match(run);
}

static void finish(struct run *run)
{
    struct bench *bench = run->bench;
    struct calibration_state state = bench_calibration(bench);
    struct refusal refusal;
    unsigned extra =
        (state.good ? 0 : QUALITY_CALIBRATION_OLD) | (bench_drift(bench) ? QUALITY_DRIFT : 0);
    if (!measuring_finish(&run->measuring, extra, run->record, &refusal)) {
        fail(run, &refusal);
        return;
    }
    if (run->expired)
        add_flag(run->record, "lease_expired");
    answer_colour(&bench->station->weights, run->record);
    run->phase = RUN_MATCHING;
    match(run);
}

/* ---- shots -------------------------------------------------------------------------- */

static void waited(struct job *job);

static void wait_for_operator(struct run *run)
{
    run->phase = RUN_WAITING;
    run->next = false;
    if (run->no_button)
        return;
    run->unit =
        (struct unit_job){ .job.done = waited, .command = UNIT_WAIT, .timeout_ms = WAIT_MS };
    run->under_way = true;
    bench_ask(run->bench, &run->unit);
}

static void waited(struct job *job)
{
    struct run *run = (struct run *)job;
    run->under_way = false;
    if (run->ended) {
        finish_early(run);
    } else if (run->next || run->unit.pressed) {
        if (!run->next)
            asked_button(run->bench);
        shoot(run);
    } else if (run->unit.result == DRIVER_OK || run->unit.result == DRIVER_CANCELLED) {
        wait_for_operator(run);
    } else if (run->unit.result == DRIVER_GONE) {
        struct refusal refusal = bench_refusal(&run->unit.error);
        fail(run, &refusal);
    } else { /* the shots that are there are not lost with the button */
        log_warning("station: the button of '%s' fails: %s", run->bench->name,
                    run->unit.error.text);
        run->no_button = true;
    }
}

static void tell_waiting(const struct run *run)
{
    cJSON *data = about(run, true);
    cJSON_AddNumberToObject(data, "shot", (double)(run->measuring.taken + 1));
    cJSON_AddNumberToObject(data, "replicates", (double)run->measuring.replicates);
    cJSON_AddStringToObject(data, "prompt", measuring_prompt(&run->measuring));
    station_tell(run->bench->station, EVENT_MEASUREMENT, "waiting", data);
}

static void tell_shot(const struct run *run, unsigned flags)
{
    cJSON *data = about(run, true);
    cJSON_AddNumberToObject(data, "shot", (double)run->measuring.taken);
    cJSON_AddNumberToObject(data, "replicates", (double)run->measuring.replicates);
    cJSON *list = cJSON_AddArrayToObject(data, "flags");
    for (size_t i = 0; i < QUALITY_FLAGS; i++)
        if (flags & 1u << i)
            json_give_item(list, cJSON_CreateString(quality_flag_name(i)));
    station_tell(run->bench->station, EVENT_MEASUREMENT, "shot", data);
}

/* The instrument said no: for want of a calibration, as its status shows? */
static void asked_why(struct job *job)
{
    struct run *run = (struct run *)job;
    struct bench *bench = run->bench;
    struct refusal refusal = bench_refusal(&run->error);
    run->under_way = false;
    if (run->ended) {
        finish_early(run);
        return;
    }
    if (run->unit.result == DRIVER_OK)
        bench->status = run->unit.status;
    for (size_t i = 0; i < CALIBRATION_STEPS; i++)
        if (bench->status.due[i])
            refusal.reason = REASON_CALIBRATION_DUE;
    fail(run, &refusal);
}

static void refused(struct run *run)
{
    if (run->unit.error.result != DRIVER_REFUSED || run->bench->station->stopping) {
        struct refusal refusal = bench_refusal(&run->unit.error);
        fail(run, &refusal);
        return;
    }
    run->error = run->unit.error;
    run->unit = (struct unit_job){ .job.done = asked_why, .command = UNIT_STATUS };
    run->under_way = true;
    bench_ask(run->bench, &run->unit);
}

static void take(struct run *run)
{
    struct refusal refusal;
    unsigned flags = 0;
    enum measuring_step step =
        measuring_take(&run->measuring, &run->unit.reading, &flags, &refusal);
    if (step == MEASURING_REFUSE) {
        fail(run, &refusal);
        return;
    }
    tell_shot(run, flags);
    if (step == MEASURING_FINISH || run->expired) {
        finish(run);
    } else if (step == MEASURING_SHOOT) {
        shoot(run);
    } else {
        tell_waiting(run);
        wait_for_operator(run);
    }
}

static void shot(struct job *job)
{
    struct run *run = (struct run *)job;
    run->under_way = false;
    if (run->ended)
        finish_early(run);
    else if (run->unit.result == DRIVER_OK)
        take(run);
    else
        refused(run);
}

static void shoot(struct run *run)
{
    run->phase = RUN_SHOOTING;
    run->unit = (struct unit_job){ .job.done = shot, .command = UNIT_MEASURE };
    run->under_way = true;
    bench_ask(run->bench, &run->unit);
}

void run_next(struct run *run)
{
    run->next = true;
    asked_next(run->bench);
    if (run->under_way)
        bench_cancel(run->bench); /* the wait for the button */
    else
        shoot(run);
}

/* ---- its beginning ------------------------------------------------------------------ */

/* Whether every due step is one that the policy `warn` measures under. */
static bool calibration_allows(const struct bench *bench, const struct calibration_state *state)
{
    if (state->good || bench->station->settings->calibration_blocks)
        return state->good;
    for (size_t i = 0; i < CALIBRATION_STEPS; i++)
        if (state->due[i] != CALIBRATION_GOOD && state->due[i] != CALIBRATION_EXPIRED &&
            state->due[i] != CALIBRATION_EARLIER_STEP)
            return false;
    return true;
}

bool run_is_calibrated(const struct bench *bench, struct refusal *refusal)
{
    struct calibration_state state = bench_calibration(bench);
    if (calibration_allows(bench, &state))
        return true;
    for (size_t i = 0; i < CALIBRATION_STEPS; i++) {
        if (state.due[i] == CALIBRATION_GOOD)
            continue;
        refusal_set(refusal, REASON_CALIBRATION_DUE, "%s: %s",
                    driver_calibration_name((enum driver_calibration)i),
                    calibration_due_text(state.due[i]));
        break;
    }
    return false;
}

static void take_circumstances(struct run *run, const struct client *client,
                               const struct request *request, const char *sha256)
{
    struct bench *bench = run->bench;
    struct store_record *r = run->record;
    params_copy(request, "uuid", r->uuid, sizeof r->uuid);
    params_copy(request, "subject", r->subject, sizeof r->subject);
    params_copy(request, "site", r->site, sizeof r->site);
    params_copy(request, "corrects", r->corrects, sizeof r->corrects);
    snprintf(r->parameters_sha256, sizeof r->parameters_sha256, "%s", sha256);
    snprintf(r->operator_name, sizeof r->operator_name, "%s", client->operator_name);
    snprintf(r->calibration_id, sizeof r->calibration_id, "%s",
             bench->calibration_id[DRIVER_CALIBRATION_WHITE]);
    snprintf(r->boot_id, sizeof r->boot_id, "%s", bench->station->machine_boot);
    r->boottime_ms = clock_boottime_ms();
    r->instrument = bench_instrument(bench);
    r->fence = bench->lease.fence;
    r->owner_uid = client->peer.uid;
}

static bool set_up(struct run *run, const struct request *request)
{
    struct measuring *m = &run->measuring;
    struct refusal refusal;
    (void)params_wish(request, &run->wish, &refusal); /* both were looked at before */
    (void)params_scene(request, &run->scene, &run->has_scene, &refusal);
    const char *pace = params_text(request, "pace");
    m->specular = params_specular(request);
    m->surface = params_number(request, "surface", NAN);
    m->replicates = (size_t)params_integer(request, "replicates", 1);
    m->prompt = strcmp(pace, "prompt") == 0;
    m->bands = bench_bands(run->bench);
    params_copy(request, "table", run->table, sizeof run->table);
    run->has_by = params_by(request, &run->by);
    return measuring_init(m) == STATUS_OK;
}

struct run *run_begin(struct bench *bench, const struct client *client,
                      const struct request *request, const char *sha256)
{
    struct run *run = calloc(1, sizeof *run);
    if (run == NULL)
        return NULL;
    run->bench = bench;
    run->record = station_record(bench->station);
    if (run->record == NULL || !set_up(run, request)) {
        station_record_back(bench->station, run->record);
        free(run);
        return NULL;
    }
    take_circumstances(run, client, request, sha256);
    run->askers[run->askers_n++] = ticket_of(client, request);
    bench->run = run;
    asked_measure(bench, request);
    cJSON *data = about(run, true);
    cJSON_AddNumberToObject(data, "replicates", (double)run->measuring.replicates);
    station_tell(bench->station, EVENT_MEASUREMENT, "started", data);
    bench_tell_changes(bench);
    shoot(run);
    return run;
}

bool run_join(struct run *run, const struct ticket *asker)
{
    if (run->askers_n == RUN_ASKERS)
        return false;
    run->askers[run->askers_n++] = *asker;
    return true;
}
