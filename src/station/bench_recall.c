/* bench_recall.c - calibrations and checks of earlier runs of the station, from the store.
 *
 * The calibrations are due (the instrument was connected again since), but when they were made is
 * worth knowing.  The checks count as they did: an instrument that has drifted has not come
 * back by a restart. */
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "station/bench.h"
#include "station/parking.h"

struct recall {
    struct job job;
    struct bench *bench;
    struct store_instrument instrument;
    struct store_calibration last[CALIBRATION_STEPS];
    bool found[CALIBRATION_STEPS];
    struct checks checks;
    enum status checks_status;
};

static bool add_check(void *context, const struct store_check *check)
{
    struct recall *recall = context;
    struct checked *checked = checked_make(check);
    if (checked == NULL) {
        recall->checks_status = STATUS_NO_MEMORY;
        return false;
    }
    checks_note(&recall->checks, checked);
    return true;
}

static void look_up(struct job *job, void *thread)
{
    struct recall *recall = (struct recall *)job;
    struct store_reader *reader;
    if (worker_reader(thread, &reader) != STATUS_OK)
        return; /* none is known, which is as due */
    for (size_t i = 0; i < CALIBRATION_STEPS; i++)
        recall->found[i] =
            store_last_calibration(reader, &recall->instrument,
                                   driver_calibration_name((enum driver_calibration)i),
                                   &recall->last[i]) == STATUS_OK;
    enum status s = store_last_checks(reader, &recall->instrument, add_check, recall);
    if (s != STATUS_OK)
        recall->checks_status = s;
}

static void take_checks(struct bench *bench, struct recall *recall)
{
    while (recall->checks.first != NULL) {
        struct checked *checked = recall->checks.first;
        recall->checks.first = checked->next;
        checks_note(&bench->checks, checked);
    }
    if (recall->checks_status != STATUS_OK && recall->checks_status != STATUS_CANCELLED)
        log_warning("station: whether '%s' had drifted cannot be read: %s", bench->name,
                    status_text(recall->checks_status));
}

static void looked_up(struct job *job)
{
    struct recall *recall = (struct recall *)job;
    struct bench *bench = recall->bench;
    const struct store_instrument now = bench_instrument(bench);
    bool same = strcmp(now.serial, recall->instrument.serial) == 0; /* it may have been changed */
    for (size_t i = 0; i < CALIBRATION_STEPS; i++) {
        const struct store_calibration *last = &recall->last[i];
        if (!same || !recall->found[i] || bench->made[i].made)
            continue;
        bench->made[i] = (struct calibration_made){ .made = true,
                                                    .boottime_ms = last->boottime_ms,
                                                    .aperture_mm = last->aperture_mm };
        memcpy(bench->made[i].boot_id, last->boot_id, sizeof bench->made[i].boot_id);
        memcpy(bench->calibration_id[i], last->id, sizeof last->id);
        memcpy(bench->calibrated_at[i], last->taken_at, sizeof last->taken_at);
    }
    if (same)
        take_checks(bench, recall);
    checks_forget(&recall->checks);
    free(recall);
    bench->recalls--;
    station_serve_parked(bench->station); /* what waits for this */
}

void bench_forget_calibrations(struct bench *bench)
{
    for (size_t i = 0; i < CALIBRATION_STEPS; i++) {
        bench->made[i] = (struct calibration_made){ .made = false };
        bench->calibration_id[i][0] = bench->calibrated_at[i][0] = '\0';
    }
    checks_forget(&bench->checks);
}

void bench_recall(struct bench *bench)
{
    struct recall *recall = bench->known ? calloc(1, sizeof *recall) : NULL;
    if (recall == NULL && bench->known)
        log_error("station: not enough memory to look for what is stored of '%s'", bench->name);
    if (recall == NULL)
        return;
    recall->job.run = look_up;
    recall->job.done = looked_up;
    recall->bench = bench;
    bench->recalls++;
    recall->instrument = bench_instrument(bench);
    worker_ask(bench->station->reader, &recall->job);
}
