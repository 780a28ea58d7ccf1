/* serve_check.c - check.take, check.set.
 *
 * The uuid is looked up first, on the worker, and with it the reference or the limit that holds;
 * then the rest has to be in order, and shots are taken (check_taking.c) or a row is written. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "station/check_compare.h"
#include "station/check_json.h"
#include "station/check_taking.h"
#include "station/params.h"
#include "station/parking.h"
#include "station/reading.h"
#include "station/run.h"
#include "station/serve.h"
#include "station/station_store.h"
#include "station/strict_json.h"
#include "station/ticket.h"
#include "station/wire.h"

enum { REPLICATES = 3 };
enum found { FOUND_NOTHING, FOUND_ANSWER, FOUND_REASON };

struct lookup {
    struct request request; /* ours now */
    struct check_order order;
    bool measures, has_bench; /* has_bench: the two below are those of the lease */
    struct store_instrument instrument;
    double aperture_mm;
    enum found found;
    struct refusal refusal;
};

/* ---- on the worker ------------------------------------------------------------------ */

static enum found refuse_with(struct lookup *lookup, enum reason reason, const char *detail)
{
    refusal_set(&lookup->refusal, reason, "%s", detail);
    return FOUND_REASON;
}

static enum found refuse_status(struct lookup *lookup, enum status s)
{
    return refuse_with(lookup, s == STATUS_NO_MEMORY ? REASON_NO_MEMORY : REASON_STORE_FAILED, "");
}

static bool is_set(const struct lookup *lookup)
{
    return lookup->request.method == METHOD_CHECK_SET;
}

/* The one of this uuid, as its object.  STATUS_NOT_FOUND; STATUS_EXISTS: asked otherwise. */
static enum status find_retry(struct lookup *lookup, struct store_reader *reader, cJSON **result)
{
    const struct check_order *order = &lookup->order;
    struct store_check_tile tile;
    struct store_check check;
    enum status s = is_set(lookup) ? store_get_check_tile(reader, order->tile.uuid, &tile)
                                   : store_get_check(reader, order->check.uuid, &check);
    if (s != STATUS_OK)
        return s;
    /* The lease is not among the parameters of a retry, and yet tells what was asked for. */
    if (strcmp(is_set(lookup) ? tile.parameters_sha256 : check.parameters_sha256,
               order->tile.parameters_sha256) != 0 ||
        (is_set(lookup) && tile.source != order->tile.source))
        return STATUS_EXISTS;
    *result = is_set(lookup) ? check_tile_json(&tile) : check_json(&check);
    return STATUS_OK;
}

static enum found lacks_reference(struct lookup *lookup, bool known)
{
    const char *tile = lookup->order.tile.tile;
    if (!known)
        refusal_set(&lookup->refusal, REASON_REFERENCE_MISSING, "nothing is known of a tile '%s'",
                    tile);
    else
        refusal_set(&lookup->refusal, REASON_REFERENCE_MISSING,
                    "there is none of '%s' for this instrument through %g mm", tile,
                    lookup->aperture_mm);
    return FOUND_REASON;
}

/* The limit that holds, and for a check the reference. */
static enum found look_at_tile(struct lookup *lookup, struct store_reader *reader)
{
    struct check_order *order = &lookup->order;
    struct store_check_tile found;
    enum status s = store_last_check_tile(reader, order->tile.tile, &found);
    bool known = s == STATUS_OK;
    if (!known && s != STATUS_NOT_FOUND)
        return refuse_status(lookup, s);
    double limit_dE00 = known ? found.limit_dE00 : CHECK_LIMIT_DE00;
    if (is_set(lookup)) {
        if (isnan(order->tile.limit_dE00))
            order->tile.limit_dE00 = limit_dE00;
        return order->tile.source == STORE_TILE_LIMIT && !known ? lacks_reference(lookup, false)
                                                                : FOUND_NOTHING;
    }
    order->check.limit_dE00 = limit_dE00;
    if (!lookup->has_bench) /* the lease is at fault, and told so */
        return FOUND_NOTHING;
    s = known ? store_find_check_reference(reader, order->tile.tile, lookup->aperture_mm,
                                           &lookup->instrument, &found)
              : STATUS_NOT_FOUND;
    if (s == STATUS_NOT_FOUND)
        return lacks_reference(lookup, known);
    if (s != STATUS_OK)
        return refuse_status(lookup, s);
    memcpy(found.parameters_sha256, order->tile.parameters_sha256, sizeof found.parameters_sha256);
    order->tile = found;
    return FOUND_NOTHING;
}

static enum found look_up(struct lookup *lookup, struct store_reader *reader, cJSON **result)
{
    enum status s = find_retry(lookup, reader, result);
    if (s == STATUS_OK)
        return FOUND_ANSWER;
    if (s == STATUS_EXISTS)
        return refuse_with(lookup, REASON_UUID_REUSED, "");
    return s == STATUS_NOT_FOUND ? look_at_tile(lookup, reader) : refuse_status(lookup, s);
}

static void look_up_on_worker(struct job *job, void *thread)
{
    struct reading *reading = (struct reading *)job;
    struct lookup *lookup = reading->own;
    cJSON *result = NULL;
    refusal_set(&lookup->refusal, REASON_NO_MEMORY, NULL);
    struct store_reader *reader = reading_store(thread, &lookup->refusal);
    lookup->found = reader != NULL ? look_up(lookup, reader, &result) : FOUND_REASON;
    if (lookup->found == FOUND_ANSWER &&
        protocol_reply(reading->station->protocol, &reading->ticket.id, result, &reading->line) !=
            STATUS_OK)
        lookup->found = refuse_with(lookup, REASON_NO_MEMORY, "");
}

/* ---- written at once ---------------------------------------------------------------- */

struct setting {
    struct write_job write;
    struct station *station;
    struct ticket ticket;
    struct store_check_tile tile;
};

static void set(struct job *job)
{
    struct setting *setting = (struct setting *)job;
    struct station *station = setting->station;
    enum status s = setting->write.status;
    station_note_write(station, s);
    if (s == STATUS_OK) {
        station_answer(station, &setting->ticket, check_tile_json(&setting->tile));
    } else {
        struct refusal refusal = station_store_refusal(station, s, setting->write.bad_member);
        station_refuse(station, &setting->ticket, &refusal);
    }
    free(setting);
}

static void write_tile(struct station *station, const struct check_order *order)
{
    if (!station_can_write(station, &order->ticket))
        return;
    struct setting *setting = calloc(1, sizeof *setting);
    if (setting == NULL) {
        station_refuse_for(station, &order->ticket, REASON_NO_MEMORY, NULL);
        return;
    }
    setting->write.job.done = set;
    setting->write.kind = WRITE_CHECK_TILE;
    setting->write.tile = &setting->tile;
    setting->station = station;
    setting->ticket = order->ticket;
    setting->tile = order->tile;
    writer_ask(station->writer, &setting->write);
}

/* ---- on the loop -------------------------------------------------------------------- */

/* Whose reference is wanted.  False: no such lease, which start() refuses. */
static struct bench *note_bench(struct station *station, struct client *client,
                                struct lookup *lookup)
{
    struct refusal ignored;
    struct bench *bench =
        lookup->measures ? bench_of_lease(station, client, &lookup->request, &ignored) : NULL;
    lookup->has_bench = bench != NULL && bench->known;
    if (!lookup->has_bench)
        return NULL;
    lookup->instrument = bench_instrument(bench);
    lookup->aperture_mm = bench_bands(bench).aperture_mm;
    return bench;
}

static bool measures_sce(const struct bench *bench, struct refusal *refusal)
{
    if (bench->identity.has_sce)
        return true;
    refusal_set(refusal, REASON_INSTRUMENT_UNSUPPORTED, "it does not measure sce");
    return false;
}

/* The uuid is new: all the rest has to be in order. */
static void start(struct station *station, struct client *client, struct lookup *lookup)
{
    struct check_order *order = &lookup->order;
    struct refusal refusal;
    if (!lookup->measures) {
        write_tile(station, order);
        return;
    }
    struct bench *bench = bench_of_lease(station, client, &lookup->request, &refusal);
    if (bench != NULL && bench_is_ending(bench)) {
        station_park(station, client, &lookup->request);
        return;
    }
    bool may = bench != NULL && bench_is_free(bench, &refusal) && measures_sce(bench, &refusal) &&
               run_is_calibrated(bench, &refusal);
    if (!may)
        station_refuse(station, &order->ticket, &refusal);
    else if (station_can_write(station, &order->ticket))
        check_take(bench, order);
}

/* Another instrument or port than the reference was looked for, since then. */
static bool is_outdated(struct station *station, struct client *client, struct lookup *lookup)
{
    bool had_bench = lookup->has_bench;
    const struct store_instrument then = lookup->instrument;
    double aperture_mm = lookup->aperture_mm;
    if (is_set(lookup) || note_bench(station, client, lookup) == NULL)
        return false;
    const struct store_instrument *now = &lookup->instrument;
    return !had_bench || aperture_mm != lookup->aperture_mm ||
           strcmp(then.driver, now->driver) != 0 || strcmp(then.maker, now->maker) != 0 ||
           strcmp(then.model, now->model) != 0 || strcmp(then.serial, now->serial) != 0;
}

static void looked_up(struct job *job)
{
    struct reading *reading = (struct reading *)job;
    struct lookup *lookup = reading->own;
    struct station *station = reading->station;
    struct client *client = clients_find(station->clients, reading->ticket.client);
    if (lookup->found == FOUND_ANSWER) {
        station_answer_line(station, &reading->ticket, &reading->line);
    } else if (client != NULL && !station->stopping && is_outdated(station, client, lookup)) {
        reading_ask(reading, station->reader);
        return;
    } else if (lookup->found == FOUND_REASON) {
        station_refuse(station, &reading->ticket, &lookup->refusal);
    } else if (station->stopping) {
        station_refuse_for(station, &reading->ticket, REASON_SHUTTING_DOWN, NULL);
    } else if (client != NULL) {
        start(station, client, lookup);
    }
    reading_free(reading);
}

static void free_lookup(struct reading *reading)
{
    request_done(&((struct lookup *)reading->own)->request);
}

/* ---- what is asked ------------------------------------------------------------------ */

static bool refuse_member(struct refusal *refusal, const char *path, const char *what)
{
    refusal_set(refusal, REASON_PARAMS_INVALID, "%s %s", path, what);
    snprintf(refusal->path, sizeof refusal->path, "%s", path);
    return false;
}

/* With spectrum: all of a certificate; with lease: nothing of it; else a limit. */
static bool fits_together(const struct request *request, struct refusal *refusal)
{
    bool certificate = params_has(request, "spectrum"), lease = params_has(request, "lease");
    if (certificate && lease)
        return refuse_member(refusal, "/params/spectrum",
                             "is a certificate's: leave out lease, or leave out spectrum to "
                             "measure the tile");
    if (params_has(request, "specular") != certificate)
        return refuse_member(refusal, "/params/specular",
                             "goes with spectrum: say that it is sce, and only then");
    if (params_has(request, "aperture_mm") != certificate)
        return refuse_member(refusal, "/params/aperture_mm",
                             "goes with spectrum: say the port it holds for, and only then");
    if (params_has(request, "replicates") && !lease)
        return refuse_member(refusal, "/params/replicates", "goes with lease");
    if (!certificate && !lease && !params_has(request, "limit"))
        return refuse_member(refusal, "/params",
                             "must have lease, or spectrum, specular and aperture_mm, or limit");
    return true;
}

/* A certificate no check could be compared with is refused. */
static bool read_certificate(const struct request *request, struct store_check_tile *tile,
                             struct refusal *refusal)
{
    struct check_difference none;
    enum status s =
        wire_read_spectrum(strict_json_member(request->params, "spectrum"), &tile->spectrum);
    tile->source = STORE_TILE_CERTIFICATE;
    tile->aperture_mm = tile->spectrum.aperture_mm =
        params_number(request, "aperture_mm", (double)NAN);
    tile->spectrum.specular = SPECULAR_SCE;
    if (s == STATUS_OK)
        s = check_compare(&tile->spectrum, &tile->spectrum, &none);
    if (s == STATUS_OK)
        return true;
    refusal_set(refusal, s == STATUS_NO_MEMORY ? REASON_NO_MEMORY : REASON_SPECTRUM_UNSUITABLE,
                "%s",
                s == STATUS_NO_MEMORY ? ""
                                      : "a certificate needs bands by 10, 5 or 1 nm that "
                                        "cover 400..700 nm");
    snprintf(refusal->path, sizeof refusal->path, "/params/spectrum");
    return false;
}

static bool read_set(const struct client *client, struct lookup *lookup, struct refusal *refusal)
{
    const struct request *request = &lookup->request;
    struct store_check_tile *tile = &lookup->order.tile;
    if (!fits_together(request, refusal))
        return false;
    lookup->order.sets_reference = lookup->measures = params_has(request, "lease");
    params_copy(request, "uuid", tile->uuid, sizeof tile->uuid);
    client_who(client, tile->who, sizeof tile->who);
    tile->limit_dE00 = params_number(request, "limit", (double)NAN);
    tile->source = STORE_TILE_LIMIT;
    tile->aperture_mm = (double)NAN;
    return !params_has(request, "spectrum") || read_certificate(request, tile, refusal);
}

static bool read_request(const struct client *client, struct lookup *lookup,
                         struct refusal *refusal)
{
    const struct request *request = &lookup->request;
    struct check_order *order = &lookup->order;
    order->ticket = ticket_of(client, request);
    order->replicates = (size_t)params_integer(request, "replicates", REPLICATES);
    params_copy(request, "tile", order->tile.tile, sizeof order->tile.tile);
    if (params_sha256(request, order->tile.parameters_sha256) != STATUS_OK) {
        refusal_set(refusal, REASON_NO_MEMORY, NULL);
        return false;
    }
    if (is_set(lookup)) {
        if (!read_set(client, lookup, refusal))
            return false;
        if (lookup->measures)
            order->tile.source = STORE_TILE_MEASURED;
        return true;
    }
    lookup->measures = true;
    params_copy(request, "uuid", order->check.uuid, sizeof order->check.uuid);
    memcpy(order->check.parameters_sha256, order->tile.parameters_sha256,
           sizeof order->check.parameters_sha256);
    snprintf(order->check.operator_name, sizeof order->check.operator_name, "%s",
             client->operator_name);
    return true;
}

static void serve_either(struct station *station, struct client *client, struct request *request)
{
    struct ticket ticket = ticket_of(client, request);
    struct refusal refusal;
    if (!station->store.told) {
        station_park(station, client, request);
        return;
    }
    struct reading *reading = reading_make(station, client, request, sizeof(struct lookup));
    if (reading == NULL)
        return;
    struct lookup *lookup = reading->own;
    lookup->request = *request;
    request->tree = NULL;
    reading->free = free_lookup;
    if (!read_request(client, lookup, &refusal)) {
        station_refuse(station, &ticket, &refusal);
        reading_free(reading);
        return;
    }
    (void)note_bench(station, client, lookup);
    reading->job.run = look_up_on_worker;
    reading->job.done = looked_up;
    reading_ask(reading, station->reader);
}

void serve_check_take(struct station *station, struct client *client, struct request *request)
{
    serve_either(station, client, request);
}

void serve_check_set(struct station *station, struct client *client, struct request *request)
{
    serve_either(station, client, request);
}
