/* serve_instrument.c - instrument.list, configure, calibrate. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "json/give.h"
#include "station/asked.h"
#include "station/bench.h"
#include "station/params.h"
#include "station/parking.h"
#include "station/serve.h"
#include "station/station_store.h"
#include "station/tell.h"
#include "station/ticket.h"

void serve_instrument_list(struct station *station, struct client *client, struct request *request)
{
    struct ticket ticket = ticket_of(client, request);
    cJSON *result = cJSON_CreateObject();
    json_give_member(result, "instruments", bench_list_json(station));
    station_answer(station, &ticket, result);
}

/* Work on the instrument; what it gives is then kept by the writer. */
struct work {
    union {
        struct unit_job unit;
        struct write_job write;
    };
    struct bench *bench;
    struct ticket ticket;
    struct driver_setup setup;
    enum driver_calibration step;
    uint64_t connections_before; /* of the unit that does it */
    char operator_name[STORE_TEXT_SIZE];
    struct calibration_made made;
};

/* The bench is at work from here on.  NULL, and the ticket refused, where it cannot be. */
static struct work *make_work(struct bench *bench, const struct client *client,
                              const struct request *request, enum unit_command command,
                              void (*done)(struct job *job))
{
    struct ticket ticket = ticket_of(client, request);
    struct work *work = calloc(1, sizeof *work);
    if (work == NULL) {
        station_refuse_for(bench->station, &ticket, REASON_NO_MEMORY, NULL);
        return NULL;
    }
    work->unit.job.done = done;
    work->unit.command = command;
    work->bench = bench;
    work->connections_before = bench->connections_before;
    work->ticket = ticket;
    snprintf(work->operator_name, sizeof work->operator_name, "%s", client->operator_name);
    bench->at_work = true;
    bench_tell_changes(bench);
    return work;
}

static void end_work(struct work *work)
{
    work->bench->at_work = false;
    bench_tell_changes(work->bench);
    free(work);
}

/* The bench of the request's lease, free; else NULL, and the request refused or parked. */
static struct bench *free_bench(struct station *station, struct client *client,
                                struct request *request)
{
    struct ticket ticket = ticket_of(client, request);
    struct refusal refusal;
    struct bench *bench = bench_of_lease(station, client, request, &refusal);
    if (bench != NULL && bench_is_ending(bench)) {
        station_park(station, client, request);
        return NULL;
    }
    if (bench != NULL && bench_is_free(bench, &refusal))
        return bench;
    station_refuse(station, &ticket, &refusal);
    return NULL;
}

/* ---- configure ---------------------------------------------------------------------- */

static void configured(struct job *job)
{
    struct work *work = (struct work *)job;
    struct bench *bench = work->bench;
    if (work->unit.result != DRIVER_OK) {
        struct refusal refusal = bench_refusal(&work->unit.error);
        asked_refused(bench, "configure", &refusal);
        station_refuse(bench->station, &work->ticket, &refusal);
        end_work(work);
        return;
    }
    bench->setup = work->setup;
    if (work->unit.status_known)
        bench->status = work->unit.status;
    struct ticket ticket = work->ticket;
    end_work(work); /* first: the answer says how it stands now */
    station_answer(bench->station, &ticket, bench_json(bench));
    station_tell(bench->station, EVENT_INSTRUMENT, "configured", bench_json(bench));
}

/* False, with *error, where the instrument cannot be set like that. */
static bool read_setup(const struct bench *bench, const struct request *request,
                       struct driver_setup *setup, struct driver_error *error)
{
    const struct driver_identity *is = &bench->identity;
    double aperture_mm = params_number(request, "aperture_mm", NAN);
    size_t i = setup->aperture;
    setup->grid = (size_t)params_integer(request, "grid", (int64_t)setup->grid);
    if (!isnan(aperture_mm))
        for (i = 0; i < is->apertures && fabs(is->aperture_mm[i] - aperture_mm) > 1e-6; i++)
            ;
    setup->aperture = i;
    setup->averages = (unsigned)params_integer(request, "averages", setup->averages);
    setup->delay_ms = (int)params_integer(request, "delay_ms", setup->delay_ms);
    if (params_has(request, "user_calibration"))
        setup->user_calibration = params_is_true(request, "user_calibration");
    return driver_check_setup(is, setup, error) == DRIVER_OK;
}

void serve_instrument_configure(struct station *station, struct client *client,
                                struct request *request)
{
    struct ticket ticket = ticket_of(client, request);
    struct bench *bench = free_bench(station, client, request);
    if (bench == NULL)
        return;
    struct driver_setup setup = bench->setup;
    struct driver_error error;
    if (!read_setup(bench, request, &setup, &error)) {
        struct refusal refusal = bench_refusal(&error);
        station_refuse(station, &ticket, &refusal);
        return;
    }
    struct work *work = make_work(bench, client, request, UNIT_CONFIGURE, configured);
    if (work == NULL)
        return;
    work->setup = work->unit.setup = setup;
    asked_configure(bench, request);
    bench_ask(bench, &work->unit);
}

/* ---- calibrate ---------------------------------------------------------------------- */

static void refuse_calibration(struct work *work)
{
    struct refusal refusal = bench_refusal(&work->unit.error);
    if (work->unit.result == DRIVER_IMPLAUSIBLE)
        refusal.reason = REASON_CALIBRATION_IMPLAUSIBLE;
    asked_refused(work->bench, "calibrate", &refusal);
    station_refuse(work->bench->station, &work->ticket, &refusal);
    end_work(work);
}

static void answer_calibration(struct work *work)
{
    struct bench *bench = work->bench;
    struct ticket ticket = work->ticket;
    enum driver_calibration step = work->step;
    const char *name = driver_calibration_name(step);
    end_work(work); /* first: what it tells is an object of its own */
    cJSON *result = cJSON_CreateObject();
    cJSON_AddStringToObject(result, "calibration_id", bench->calibration_id[step]);
    cJSON_AddStringToObject(result, "step", name);
    cJSON_AddStringToObject(result, "taken_at", bench->calibrated_at[step]);
    if (bench->identity.white_tile[0] != '\0')
        cJSON_AddStringToObject(result, "tile", bench->identity.white_tile);
    json_give_member(result, "calibration", bench_calibration_json(bench));
    station_answer(bench->station, &ticket, result);
    cJSON *data = bench_named(bench);
    cJSON_AddStringToObject(data, "step", name);
    cJSON_AddStringToObject(data, "calibration_id", bench->calibration_id[step]);
    station_tell(bench->station, EVENT_CALIBRATION, "done", data);
}

static void kept(struct job *job)
{
    struct work *work = (struct work *)job;
    struct bench *bench = work->bench;
    struct station *station = bench->station;
    enum status s = work->write.status;
    station_note_write(station, s);
    if (s != STATUS_OK) {
        struct refusal refusal = station_store_refusal(station, s, "");
        station_refuse(station, &work->ticket, &refusal);
        end_work(work);
        return;
    }
    enum driver_calibration step = work->step;
    const struct store_calibration *c = &work->write.calibration;
    bench->made[step] = work->made;
    memcpy(bench->calibration_id[step], c->id, sizeof c->id);
    memcpy(bench->calibrated_at[step], c->taken_at, sizeof c->taken_at);
    answer_calibration(work);
}

static void calibrated(struct job *job)
{
    struct work *work = (struct work *)job;
    struct bench *bench = work->bench;
    struct station *station = bench->station;
    if (work->unit.status_known)
        bench->status = work->unit.status;
    if (work->unit.result != DRIVER_OK) {
        refuse_calibration(work);
        return;
    }
    work->made = (struct calibration_made){
        .made = true,
        .boottime_ms = clock_boottime_ms(),
        .connection = work->connections_before + work->unit.connection,
        .aperture_mm = bench->identity.aperture_mm[bench->setup.aperture],
    };
    memcpy(work->made.boot_id, station->machine_boot, sizeof work->made.boot_id);
    work->write = (struct write_job){ .job.done = kept, .kind = WRITE_CALIBRATION };
    struct store_calibration *c = &work->write.calibration;
    c->instrument = bench_instrument(bench);
    snprintf(c->step, sizeof c->step, "%s", driver_calibration_name(work->step));
    if (work->step == DRIVER_CALIBRATION_WHITE)
        snprintf(c->tile, sizeof c->tile, "%s", bench->identity.white_tile);
    memcpy(c->operator_name, work->operator_name, sizeof c->operator_name);
    memcpy(c->boot_id, work->made.boot_id, sizeof c->boot_id);
    c->boottime_ms = work->made.boottime_ms;
    c->aperture_mm = work->made.aperture_mm;
    writer_ask(station->writer, &work->write);
}

void serve_instrument_calibrate(struct station *station, struct client *client,
                                struct request *request)
{
    struct ticket ticket = ticket_of(client, request);
    struct bench *bench = free_bench(station, client, request);
    if (bench == NULL || !station_can_write(station, &ticket))
        return;
    struct calibration_state state = bench_calibration(bench);
    bool white = strcmp(params_text(request, "step"), "white") == 0;
    if (white && state.due[DRIVER_CALIBRATION_ZERO] != CALIBRATION_GOOD) {
        station_refuse_for(station, &ticket, REASON_CALIBRATION_ORDER, NULL);
        return;
    }
    struct work *work = make_work(bench, client, request, UNIT_CALIBRATE, calibrated);
    if (work == NULL)
        return;
    work->step = work->unit.step = white ? DRIVER_CALIBRATION_WHITE : DRIVER_CALIBRATION_ZERO;
    asked_calibrate(bench, work->step);
    bench_ask(bench, &work->unit);
}
