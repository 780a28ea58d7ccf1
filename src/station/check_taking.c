/* check_taking.c - shot after shot, the comparison, the row. */
#include "station/check_taking.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "station/check_compare.h"
#include "station/check_fit.h"
#include "station/check_json.h"
#include "station/measuring.h"
#include "station/station_store.h"
#include "station/ticket.h"

struct taking {
    union { /* one at a time */
        struct unit_job unit;
        struct write_job write;
    };
    struct bench *bench;
    struct check_order order;
    int64_t fence;
    struct measuring measuring;
    struct checked *checked; /* made before it is stored, so that it cannot be missed after */
};

/* ---- its end ------------------------------------------------------------------------ */

static void end(struct taking *taking)
{
    struct bench *bench = taking->bench;
    bench->at_work = false;
    measuring_done(&taking->measuring);
    free(taking->checked);
    free(taking);
    bench_tell_changes(bench);
}

static void refuse(struct taking *taking, const struct refusal *refusal)
{
    station_refuse(taking->bench->station, &taking->order.ticket, refusal);
    end(taking);
}

static void refuse_for(struct taking *taking, enum reason reason, const char *why)
{
    struct refusal refusal;
    refusal_set(&refusal, reason, "%s", why);
    refuse(taking, &refusal);
}

/* ---- stored ------------------------------------------------------------------------- */

static void tell_check(struct taking *taking)
{
    struct checked *checked = taking->checked;
    const struct store_check *check = &taking->order.check;
    taking->checked = NULL;
    checked->seq = check->seq;
    memcpy(checked->id, check->id, sizeof checked->id);
    memcpy(checked->taken_at, check->taken_at, sizeof checked->taken_at);
    bench_note_check(taking->bench, checked);
}

static void stored(struct job *job)
{
    struct taking *taking = (struct taking *)job;
    struct station *station = taking->bench->station;
    struct check_order *order = &taking->order;
    enum status s = taking->write.status;
    station_note_write(station, s);
    if (s != STATUS_OK) {
        struct refusal refusal = station_store_refusal(station, s, taking->write.bad_member);
        refuse(taking, &refusal);
        return;
    }
    if (!order->sets_reference && !taking->write.known)
        tell_check(taking); /* first: whoever has the answer may rely on the flag */
    station_answer(station, &order->ticket,
                   order->sets_reference ? check_tile_json(&order->tile)
                                         : check_json(&order->check));
    end(taking);
}

static void ask_writer(struct taking *taking)
{
    struct check_order *order = &taking->order;
    taking->write = (struct write_job){
        .job.done = stored,
        .kind = order->sets_reference ? WRITE_CHECK_TILE : WRITE_CHECK,
    };
    if (order->sets_reference)
        taking->write.tile = &order->tile;
    else
        taking->write.check = &order->check;
    writer_ask(taking->bench->station->writer, &taking->write);
}

static void store_reference(struct taking *taking, const struct spectrum *mean)
{
    const struct bench *bench = taking->bench;
    struct store_check_tile *tile = &taking->order.tile;
    tile->source = STORE_TILE_MEASURED;
    tile->spectrum = *mean;
    tile->aperture_mm = taking->measuring.bands.aperture_mm;
    tile->instrument = bench_instrument(bench);
    tile->replicates = taking->order.replicates;
    memcpy(tile->calibration_id, bench->calibration_id[DRIVER_CALIBRATION_WHITE],
           sizeof tile->calibration_id);
    ask_writer(taking);
}

static void store_check(struct taking *taking, const struct spectrum *mean,
                        const struct check_difference *difference)
{
    const struct bench *bench = taking->bench;
    struct store_check *check = &taking->order.check;
    check->instrument = bench_instrument(bench);
    memcpy(check->calibration_id, bench->calibration_id[DRIVER_CALIBRATION_WHITE],
           sizeof check->calibration_id);
    check->fence = taking->fence;
    memcpy(check->tile, taking->order.tile.tile, sizeof check->tile);
    memcpy(check->reference_id, taking->order.tile.id, sizeof check->reference_id);
    check->aperture_mm = taking->measuring.bands.aperture_mm;
    check->replicates = taking->order.replicates;
    check->spectrum = *mean;
    check->dE00 = difference->dE00;
    check->rms = difference->rms;
    check->passed = check->dE00 <= check->limit_dE00;
    taking->checked = checked_make(check);
    if (taking->checked == NULL)
        refuse_for(taking, REASON_NO_MEMORY, "");
    else
        ask_writer(taking);
}

/* A reference is compared with itself: what no check could be compared with is refused now. */
static void finish(struct taking *taking)
{
    const struct measuring *m = &taking->measuring;
    bool sets = taking->order.sets_reference;
    struct check_difference difference;
    struct refusal refusal;
    struct quality_set *set = malloc(sizeof *set);
    enum status s =
        set != NULL ? quality_of_set(m->matched, m->a_star, m->taken, set) : STATUS_NO_MEMORY;
    if (s == STATUS_OK)
        s = check_compare(sets ? &set->mean : &taking->order.tile.spectrum, &set->mean,
                          &difference);
    if (s == STATUS_NO_MEMORY)
        refuse_for(taking, REASON_NO_MEMORY, "");
    else if (s == STATUS_OK && !check_fit(m, set, &refusal))
        refuse(taking, &refusal);
    else if (s != STATUS_OK)
        refuse_for(taking, REASON_SPECTRUM_UNSUITABLE,
                   sets ? "the bands that are set give no colour"
                        : "the reference and the bands that are set have no 400..700 nm in common");
    else if (sets)
        store_reference(taking, &set->mean);
    else
        store_check(taking, &set->mean, &difference);
    free(set);
}

/* ---- shots -------------------------------------------------------------------------- */

static void shoot(struct taking *taking);

static void shot(struct job *job)
{
    struct taking *taking = (struct taking *)job;
    const struct bench *bench = taking->bench;
    struct refusal refusal;
    unsigned flags;
    if (taking->unit.result != DRIVER_OK) {
        refusal = bench_refusal(&taking->unit.error);
        refuse(taking, &refusal);
        return;
    }
    if (bench->station->stopping) {
        refuse_for(taking, REASON_SHUTTING_DOWN, "");
        return;
    }
    if (bench->lease.holder == 0 || bench->lease.fence != taking->fence) {
        refuse_for(taking, REASON_MEASUREMENT_CANCELLED, "its lease has ended");
        return;
    }
    switch (measuring_take(&taking->measuring, &taking->unit.reading, &flags, &refusal)) {
    case MEASURING_REFUSE:
        refuse(taking, &refusal);
        break;
    case MEASURING_FINISH:
        finish(taking);
        break;
    default:
        shoot(taking);
        break;
    }
}

static void shoot(struct taking *taking)
{
    taking->unit = (struct unit_job){ .job.done = shot, .command = UNIT_MEASURE };
    bench_ask(taking->bench, &taking->unit);
}

void check_take(struct bench *bench, const struct check_order *order)
{
    struct taking *taking = calloc(1, sizeof *taking);
    if (taking != NULL) {
        taking->measuring.specular = SPECULAR_SCE;
        taking->measuring.surface = (double)NAN;
        taking->measuring.replicates = order->replicates;
        taking->measuring.bands = bench_bands(bench);
    }
    if (taking == NULL || measuring_init(&taking->measuring) != STATUS_OK) {
        free(taking);
        station_refuse_for(bench->station, &order->ticket, REASON_NO_MEMORY, NULL);
        return;
    }
    taking->bench = bench;
    taking->order = *order;
    taking->fence = bench->lease.fence;
    bench->at_work = true;
    bench_tell_changes(bench);
    shoot(taking);
}
