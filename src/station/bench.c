/* bench.c - what the thread of an instrument tells, and how the instrument stands. */
#include "station/bench.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/log.h"
#include "base/utf8.h"
#include "json/give.h"
#include "station/asked.h"
#include "station/run.h"
#include "station/serve.h"
#include "station/tell.h"

/* ---- calibration -------------------------------------------------------------------- */

struct calibration_state bench_calibration(const struct bench *bench)
{
    int64_t max_age_ms = (int64_t)(bench->station->settings->calibration_hours * 3600e3);
    struct calibration_now now = {
        .boot_id = bench->station->machine_boot,
        .boottime_ms = clock_boottime_ms(),
        .connection = bench->connection,
        .aperture_mm = bench->identity.aperture_mm[bench->setup.aperture],
    };
    for (size_t i = 0; i < CALIBRATION_STEPS; i++) {
        now.max_age_ms[i] = max_age_ms;
        now.instrument_asks[i] = bench->status.due[i];
    }
    return calibration_judge(bench->made, &now);
}

/* Where the instrument does not ask for the step itself. */
static const char *place_text(const struct bench *bench, size_t step)
{
    if (bench->status.place[step][0] != '\0')
        return bench->status.place[step];
    return step == DRIVER_CALIBRATION_ZERO ? "hold the port into the open air, or on the zero box"
                                           : "place the port on the white tile";
}

static cJSON *step_json(const struct bench *bench, const struct calibration_state *state, size_t i)
{
    cJSON *step = cJSON_CreateObject();
    bool due = state->due[i] != CALIBRATION_GOOD;
    cJSON_AddStringToObject(step, "step", driver_calibration_name((enum driver_calibration)i));
    cJSON_AddBoolToObject(step, "due", due);
    if (due) {
        cJSON_AddStringToObject(step, "place", place_text(bench, i));
        cJSON_AddStringToObject(step, "cause", calibration_due_name(state->due[i]));
    }
    if (bench->made[i].made) {
        cJSON_AddStringToObject(step, "calibration_id", bench->calibration_id[i]);
        cJSON_AddStringToObject(step, "taken_at", bench->calibrated_at[i]);
    }
    if (state->age_ms[i] >= 0)
        cJSON_AddNumberToObject(step, "age_s", (double)state->age_ms[i] / 1e3);
    if (!due && state->expires_in_ms[i] >= 0)
        cJSON_AddNumberToObject(step, "expires_in_s", (double)state->expires_in_ms[i] / 1e3);
    return step;
}

cJSON *bench_calibration_json(const struct bench *bench)
{
    struct calibration_state state = bench_calibration(bench);
    cJSON *steps = cJSON_CreateArray();
    for (size_t i = 0; i < CALIBRATION_STEPS; i++)
        json_give_item(steps, step_json(bench, &state, i));
    return steps;
}

/* ---- checks ------------------------------------------------------------------------- */

static double aperture_of(const struct bench *bench)
{
    return bench->identity.aperture_mm[bench->setup.aperture];
}

bool bench_drift(const struct bench *bench)
{
    return checks_drift(&bench->checks, aperture_of(bench));
}

static void add_checked(cJSON *object, const struct checked *checked)
{
    cJSON_AddStringToObject(object, "tile", checked->tile);
    cJSON_AddNumberToObject(object, "dE00", checked->dE00);
    cJSON_AddNumberToObject(object, "limit", checked->limit_dE00);
    cJSON_AddBoolToObject(object, "passed", checked->passed);
}

void bench_note_check(struct bench *bench, struct checked *checked)
{
    bool before = bench_drift(bench);
    cJSON *data = bench_named(bench), *change = bench_named(bench);
    cJSON_AddStringToObject(data, "id", checked->id);
    add_checked(data, checked);
    cJSON_AddStringToObject(change, "tile", checked->tile);
    checks_note(&bench->checks, checked);
    bool now = bench_drift(bench);
    station_tell(bench->station, EVENT_CALIBRATION, "checked", data);
    cJSON_AddBoolToObject(change, "drift", now);
    if (now != before)
        station_tell(bench->station, EVENT_CALIBRATION, "drift", change);
    else
        cJSON_Delete(change);
}

/* ---- how it stands ------------------------------------------------------------------ */

static const char *state_name(const struct bench *bench)
{
    if (!bench->open && bench->error.text[0] == '\0')
        return "opening";
    if (!bench->open)
        return bench->error.result == DRIVER_GONE ? "gone" : "failed";
    if (bench_is_at_work(bench))
        return "measuring";
    return bench_calibration(bench).good ? "ready" : "calibration_due";
}

static void add_known_text(cJSON *object, const char *name, const char *text)
{
    if (*text != '\0')
        cJSON_AddStringToObject(object, name, text);
}

static void add_identity(cJSON *object, const struct bench *bench)
{
    const struct driver_identity *is = &bench->identity;
    cJSON_AddStringToObject(object, "maker", is->maker);
    cJSON_AddStringToObject(object, "model", is->model);
    add_known_text(object, "serial", is->serial);
    add_known_text(object, "firmware", is->firmware);
    add_known_text(object, "white_tile", is->white_tile);
    cJSON_AddStringToObject(object, "geometry", driver_geometry_name(is->geometry));
    cJSON *speculars = cJSON_AddArrayToObject(object, "speculars");
    if (is->has_sce)
        json_give_item(speculars, cJSON_CreateString("sce"));
    if (is->has_sci)
        json_give_item(speculars, cJSON_CreateString("sci"));
    cJSON_AddBoolToObject(object, "has_button", is->has_button);
}

static void add_setup(cJSON *object, const struct bench *bench)
{
    const struct driver_identity *is = &bench->identity;
    cJSON *grids = cJSON_AddArrayToObject(object, "grids");
    for (size_t i = 0; i < is->grids; i++) {
        cJSON *grid = cJSON_CreateObject();
        cJSON_AddNumberToObject(grid, "first_nm", is->grid[i].first_nm);
        cJSON_AddNumberToObject(grid, "step_nm", is->grid[i].step_nm);
        cJSON_AddNumberToObject(grid, "bands", (double)is->grid[i].n);
        json_give_item(grids, grid);
    }
    cJSON_AddNumberToObject(object, "grid", (double)bench->setup.grid);
    json_give_member(object, "apertures_mm",
                     cJSON_CreateDoubleArray(is->aperture_mm, (int)is->apertures));
    cJSON_AddNumberToObject(object, "aperture_mm", is->aperture_mm[bench->setup.aperture]);
}

/* How a shot is taken, where there is a choice. */
static void add_shot(cJSON *object, const struct bench *bench)
{
    const struct driver_identity *is = &bench->identity;
    const struct driver_setup *set = &bench->setup;
    if (is->max_averages > 1) {
        cJSON_AddNumberToObject(object, "averages", set->averages > 1 ? set->averages : 1);
        cJSON_AddNumberToObject(object, "max_averages", is->max_averages);
    }
    if (is->max_delay_ms > 0) {
        cJSON_AddNumberToObject(object, "delay_ms", set->delay_ms);
        cJSON_AddNumberToObject(object, "max_delay_ms", is->max_delay_ms);
    }
    if (is->has_user_calibration)
        cJSON_AddBoolToObject(object, "user_calibration", set->user_calibration);
}

static void add_check(cJSON *object, const struct bench *bench)
{
    const struct checked *shown = checks_shown(&bench->checks, aperture_of(bench));
    if (shown == NULL)
        return;
    cJSON *check = cJSON_AddObjectToObject(object, "check");
    cJSON_AddStringToObject(check, "taken_at", shown->taken_at);
    add_checked(check, shown);
}

static void add_status(cJSON *object, const struct bench *bench)
{
    if (bench->status.battery_percent >= 0)
        cJSON_AddNumberToObject(object, "battery_percent", bench->status.battery_percent);
    cJSON_AddBoolToObject(object, "charging", bench->status.charging);
    if (isfinite(bench->status.temperature_C))
        cJSON_AddNumberToObject(object, "temperature_C", bench->status.temperature_C);
}

static void add_lease(cJSON *object, const struct bench *bench)
{
    int64_t left = bench->lease.expires_ms - clock_boottime_ms();
    cJSON_AddBoolToObject(object, "leased", bench->lease.holder != 0);
    if (bench->lease.holder != 0)
        cJSON_AddNumberToObject(object, "lease_expires_in_ms", left > 0 ? (double)left : 0.0);
    cJSON_AddNumberToObject(object, "queue", (double)bench->lease.waiting);
}

cJSON *bench_json(struct bench *bench)
{
    cJSON *object = cJSON_CreateObject();
    cJSON_AddStringToObject(object, "instrument", bench->name);
    cJSON_AddStringToObject(object, "driver", bench->driver->name);
    cJSON_AddStringToObject(object, "state", state_name(bench));
    if (!bench->open)
        add_known_text(object, "error", bench->error.text);
    if (bench->known) {
        add_identity(object, bench);
        add_setup(object, bench);
        add_shot(object, bench);
        json_give_member(object, "calibration", bench_calibration_json(bench));
        add_check(object, bench);
    }
    if (bench->open)
        add_status(object, bench);
    add_lease(object, bench);
    return object;
}

cJSON *bench_list_json(struct station *station)
{
    cJSON *list = cJSON_CreateArray();
    for (size_t i = 0; i < station->benches_n; i++)
        if (station->benches[i]->name[0] != '\0')
            json_give_item(list, bench_json(station->benches[i]));
    return list;
}

struct spectrum bench_bands(const struct bench *bench)
{
    const struct driver_grid *grid = &bench->identity.grid[bench->setup.grid];
    return (struct spectrum){ .first_nm = grid->first_nm,
                              .step_nm = grid->step_nm,
                              .n = grid->n,
                              .aperture_mm = bench->identity.aperture_mm[bench->setup.aperture] };
}

struct store_instrument bench_instrument(const struct bench *bench)
{
    struct store_instrument instrument;
    const struct driver_identity *is = &bench->identity;
    snprintf(instrument.driver, sizeof instrument.driver, "%s", bench->driver->name);
    snprintf(instrument.maker, sizeof instrument.maker, "%s", is->maker);
    snprintf(instrument.model, sizeof instrument.model, "%s", is->model);
    snprintf(instrument.serial, sizeof instrument.serial, "%s", is->serial);
    snprintf(instrument.firmware, sizeof instrument.firmware, "%s", is->firmware);
    return instrument;
}

/* ---- refusals ----------------------------------------------------------------------- */

struct refusal bench_refusal(const struct driver_error *error)
{
    static const enum reason reasons[] = {
        [DRIVER_OK] = REASON_INTERNAL,
        [DRIVER_CANCELLED] = REASON_MEASUREMENT_CANCELLED,
        [DRIVER_TIMEOUT] = REASON_INSTRUMENT_TIMEOUT,
        [DRIVER_GONE] = REASON_INSTRUMENT_GONE,
        [DRIVER_BUSY] = REASON_INSTRUMENT_BUSY,
        [DRIVER_REFUSED] = REASON_INSTRUMENT_REFUSED,
        [DRIVER_IMPLAUSIBLE] = REASON_MEASUREMENT_FAILED,
        [DRIVER_PROTOCOL] = REASON_INSTRUMENT_PROTOCOL,
        [DRIVER_BATTERY] = REASON_INSTRUMENT_BATTERY,
        [DRIVER_FAULT] = REASON_INSTRUMENT_FAULT,
        [DRIVER_UNSUPPORTED] = REASON_INSTRUMENT_UNSUPPORTED,
        [DRIVER_NO_PERMISSION] = REASON_INSTRUMENT_NO_PERMISSION,
    };
    struct refusal refusal;
    refusal_set(&refusal, reasons[error->result], "%s", error->text);
    snprintf(refusal.device_code, sizeof refusal.device_code, "%s", error->code);
    return refusal;
}

bool bench_is_at_work(const struct bench *bench)
{
    return bench->run != NULL || bench->at_work || bench->restoring;
}

bool bench_is_free(const struct bench *bench, struct refusal *refusal)
{
    if (!bench->open && bench->error.text[0] != '\0') {
        *refusal = bench_refusal(&bench->error);
        return false;
    }
    if (!bench->open) {
        refusal_set(refusal, REASON_INSTRUMENT_GONE, "it is still being opened");
        return false;
    }
    if (bench_is_at_work(bench)) {
        refusal_set(refusal, REASON_MEASUREMENT_RUNNING, NULL);
        return false;
    }
    return true;
}

bool bench_is_ending(const struct bench *bench)
{
    const struct run *run = bench->run;
    return run != NULL && (run->ended || run->record->fence != bench->lease.fence);
}

/* ---- events ------------------------------------------------------------------------- */

cJSON *bench_named(const struct bench *bench)
{
    cJSON *data = cJSON_CreateObject();
    cJSON_AddStringToObject(data, "instrument", bench->name);
    return data;
}

static void tell_due(struct bench *bench)
{
    struct calibration_state state = bench_calibration(bench);
    for (size_t i = 0; i < CALIBRATION_STEPS; i++) {
        bool due = state.due[i] != CALIBRATION_GOOD;
        if (due && !bench->was_due[i]) {
            cJSON *data = bench_named(bench);
            json_give_member(data, "calibration", step_json(bench, &state, i));
            station_tell(bench->station, EVENT_CALIBRATION, "due", data);
        }
        bench->was_due[i] = due;
    }
}

void bench_tell_changes(struct bench *bench)
{
    const char *state = state_name(bench);
    if (bench->open)
        tell_due(bench);
    if (bench->told_state == state) /* a constant each */
        return;
    bench->told_state = state;
    cJSON *data = bench_named(bench);
    cJSON_AddStringToObject(data, "state", state);
    station_tell(bench->station, EVENT_INSTRUMENT, "state", data);
}

void bench_opened(struct bench *bench, const struct driver_identity *identity,
                  const struct driver_status *status, uint64_t connection)
{
    log_info("station: instrument '%s' is there: %s %s, serial number '%s'", bench->name,
             identity->maker, identity->model, identity->serial);
    if (bench->known && strcmp(bench->identity.serial, identity->serial) != 0)
        bench_forget_calibrations(bench); /* another unit in its place */
    bench->known = bench->open = true;
    bench->identity = *identity;
    utf8_make_plain(bench->identity.maker);
    utf8_make_plain(bench->identity.model);
    utf8_make_plain(bench->identity.serial);
    utf8_make_plain(bench->identity.firmware);
    utf8_make_plain(bench->identity.white_tile);
    bench->status = *status;
    bench->connection = bench->connections = connection;
    bench->error = (struct driver_error){ .result = DRIVER_OK };
    asked_identity(bench);
    if (bench->station->store.told)
        bench_recall(bench);
    station_tell(bench->station, EVENT_INSTRUMENT, "connected", bench_json(bench));
    bench_tell_changes(bench);
}

void bench_lost(struct bench *bench, const struct driver_error *error)
{
    log_warning("station: instrument '%s': %s", bench->name, error->text);
    bench->open = false;
    bench->error = *error;
    utf8_make_plain(bench->error.text); /* it goes to clients */
    utf8_make_plain(bench->error.code);
    memset(bench->was_due, 0, sizeof bench->was_due); /* told again when it is back */
    cJSON *data = bench_named(bench);
    cJSON_AddStringToObject(data, "error", bench->error.text);
    station_tell(bench->station, EVENT_INSTRUMENT, "gone", data);
    bench_tell_changes(bench);
}

void bench_pressed(struct bench *bench)
{
    station_tell(bench->station, EVENT_INSTRUMENT, "button", bench_named(bench));
}

void bench_status_changed(struct bench *bench, const struct driver_status *status)
{
    bench->status = *status;
    bench_tell_changes(bench);
}

/* ---- asking ------------------------------------------------------------------------- */

void bench_ask(struct bench *bench, struct unit_job *job)
{
    if (bench->unit != NULL) {
        unit_ask(bench->unit, job);
        return;
    }
    job->result = DRIVER_GONE;
    job->error = bench->error;
    job->status_known = job->pressed = false;
    job->connection = 0;
    inbox_put(&bench->station->inbox, &job->job);
}

void bench_cancel(struct bench *bench)
{
    if (bench->unit != NULL)
        unit_cancel(bench->unit);
}

/* ---- life --------------------------------------------------------------------------- */

/* A place that was left, else one more; NULL: all are taken. */
static struct bench **free_place(struct station *station)
{
    for (size_t i = 0; i < station->benches_n; i++)
        if (station->benches[i]->name[0] == '\0')
            return &station->benches[i];
    return station->benches_n < SETTINGS_MAX_INSTRUMENTS ? &station->benches[station->benches_n]
                                                         : NULL;
}

enum status bench_make(struct station *station, const struct driver *driver, const char *name,
                       struct bench **ret)
{
    struct bench **place = free_place(station), *bench = calloc(1, sizeof *bench);
    if (place == NULL) {
        log_error("station: no room for instrument '%s': there are %d", name,
                  (int)SETTINGS_MAX_INSTRUMENTS);
        free(bench);
        return STATUS_FULL;
    }
    if (bench == NULL)
        return STATUS_NO_MEMORY;
    bench->station = station;
    bench->driver = driver;
    bench->told_state = state_name(bench);
    snprintf(bench->name, sizeof bench->name, "%s", name);
    enum status s = bench_lease_init(bench);
    if (s != STATUS_OK) {
        bench_close(bench);
        return s;
    }
    if (place == &station->benches[station->benches_n])
        station->benches_n++;
    else
        bench_close(*place);
    *place = *ret = bench;
    return STATUS_OK;
}

void bench_forget(struct bench *bench)
{
    cJSON *data = bench_named(bench);
    cJSON_AddStringToObject(data, "error", bench->error.text);
    station_tell(bench->station, EVENT_INSTRUMENT, "gone", data);
    bench->name[0] = '\0';
}

void bench_close(struct bench *bench)
{
    sd_event_source_disable_unref(bench->lease_timer);
    checks_forget(&bench->checks);
    free(bench);
}

struct bench *bench_find(struct station *station, const char *name)
{
    for (size_t i = 0; i < station->benches_n && *name != '\0'; i++)
        if (strcmp(station->benches[i]->name, name) == 0)
            return station->benches[i];
    return NULL;
}
