/* store_record.c - a record into its rows.
 *
 * Numbers in blobs are little-endian whatever the machine. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "db/sql.h"
#include "db/store_private.h"

/* ---- what fits together ------------------------------------------------------------- */

static bool same_grid(const struct spectrum *a, const struct spectrum *b)
{
    return a->n == b->n && a->first_nm == b->first_nm && a->step_nm == b->step_nm;
}

/* All replicates on the grid, or none measured so. */
static bool fits(const struct store_record *r, const struct spectrum *replicate)
{
    for (size_t i = 0; i < r->replicates; i++)
        if (replicate[0].n == 0 ? replicate[i].n != 0 : !same_grid(&replicate[i], &r->spectrum))
            return false;
    return true;
}

const char *store_record_misfit(const struct store_record *r)
{
    if (r->spectrum.n < 1 || r->spectrum.n > SPECTRUM_MAX_BANDS ||
        !isfinite(r->spectrum.first_nm) || !isfinite(r->spectrum.step_nm))
        return "spectrum";
    if (r->replicates > STORE_MAX_REPLICATES)
        return "replicates";
    if (!fits(r, r->replicate))
        return "replicate";
    if (!fits(r, r->replicate_sci))
        return "replicate_sci";
    if (r->raw != NULL && r->raw_n > (size_t)2 * STORE_MAX_REPLICATES * SPECTRUM_MAX_BANDS)
        return "raw";
    return NULL;
}

/* ---- blobs -------------------------------------------------------------------------- */

struct writer {
    unsigned char *at;
};

static void put(struct writer *w, uint64_t bits, size_t bytes)
{
    for (size_t i = 0; i < bytes; i++)
        *w->at++ = (unsigned char)(bits >> (8 * i));
}

static void put_values(struct writer *w, const struct spectrum *s)
{
    for (size_t i = 0; i < s->n; i++) {
        uint64_t bits;
        memcpy(&bits, &s->value[i], sizeof bits);
        put(w, bits, sizeof bits);
    }
}

void store_values_write(const struct spectrum *s, unsigned char *bytes)
{
    struct writer w = { bytes };
    put_values(&w, s);
}

static bool put_flags(struct writer *w, const struct spectrum *s)
{
    bool any = false;
    for (size_t i = 0; i < s->n; i++) {
        any = any || s->flag[i] != 0;
        *w->at++ = s->flag[i];
    }
    return any;
}

/* Offsets of the blobs in one piece of memory; where one ends the next begins. */
struct blobs {
    unsigned char *memory;
    size_t sce, sci, flags, raw, end; /* the spectrum at 0 */
    bool flagged;
};

static enum status make_blobs(const struct store_record *r, struct blobs *ret)
{
    size_t bands = r->spectrum.n;
    size_t sce = r->replicate[0].n > 0 ? r->replicates : 0;
    size_t sci = r->replicate_sci[0].n > 0 ? r->replicates : 0;
    struct blobs b = { .sce = 8 * bands };
    b.sci = b.sce + 8 * bands * sce;
    b.flags = b.sci + 8 * bands * sci;
    b.raw = b.flags + bands * (1 + sce + sci);
    b.end = b.raw + (r->raw != NULL ? 4 * r->raw_n : 0);
    b.memory = malloc(b.end);
    if (b.memory == NULL)
        return STATUS_NO_MEMORY;
    struct writer w = { b.memory };
    put_values(&w, &r->spectrum);
    for (size_t i = 0; i < sce; i++)
        put_values(&w, &r->replicate[i]);
    for (size_t i = 0; i < sci; i++)
        put_values(&w, &r->replicate_sci[i]);
    b.flagged = put_flags(&w, &r->spectrum);
    for (size_t i = 0; i < sce; i++)
        b.flagged = put_flags(&w, &r->replicate[i]) || b.flagged;
    for (size_t i = 0; i < sci; i++)
        b.flagged = put_flags(&w, &r->replicate_sci[i]) || b.flagged;
    for (size_t i = 0; r->raw != NULL && i < r->raw_n; i++)
        put(&w, (uint32_t)r->raw[i], 4);
    *ret = b;
    return STATUS_OK;
}

/* ---- writing ------------------------------------------------------------------------ */

/* In the order of the table. */
static void put_origin(struct store_row *row, const struct store_record *r,
                       const struct store_record_keys *keys)
{
    store_row_integer(row, "seq", keys->seq);
    store_row_text(row, "id", keys->id);
    store_row_text(row, "taken_at", keys->taken_at);
    store_row_text(row, "boot_id", r->boot_id);
    store_row_integer(row, "boottime_ms", r->boottime_ms);
    store_row_text(row, "uuid", r->uuid);
    store_row_text(row, "parameters_sha256", r->parameters_sha256);
    store_row_text(row, "operator", r->operator_name);
    store_row_integer_unless(row, "instrument", keys->instrument, keys->instrument == 0);
    store_row_text(row, "calibration", r->calibration_id);
    store_row_integer(row, "fence", r->fence);
    store_row_text(row, "subject", r->subject);
    store_row_integer_unless(row, "site", keys->site, keys->site == 0);
    store_row_text(row, "corrects", r->corrects);
}

static void put_spectra(struct store_row *row, const struct store_record *r, const struct blobs *b)
{
    store_row_text(row, "specular", specular_name(r->specular));
    store_row_number(row, "aperture_mm", r->aperture_mm);
    store_row_number(row, "first_nm", r->spectrum.first_nm);
    store_row_number(row, "step_nm", r->spectrum.step_nm);
    store_row_integer(row, "bands", (int64_t)r->spectrum.n);
    store_row_blob(row, "spectrum", b->memory, b->sce);
    store_row_number(row, "surface", r->surface);
    store_row_integer(row, "replicates", (int64_t)r->replicates);
    store_row_blob(row, "sce", b->memory + b->sce, b->sci - b->sce);
    store_row_blob(row, "sci", b->memory + b->sci, b->flags - b->sci);
    store_row_blob(row, "band_flags", b->memory + b->flags, b->flagged ? b->raw - b->flags : 0);
    store_row_blob(row, "raw", b->memory + b->raw, b->end - b->raw);
    store_row_number(row, "raw_unit", r->raw_unit);
}

static void put_colour(struct store_row *row, const struct store_record *r)
{
    static const char *const XYZ[] = { "X", "Y", "Z" }, *const Lab[] = { "L", "a", "b" };
    static const char *const sRGB[] = { "red", "green", "blue" };
    for (int i = 0; i < 3; i++)
        store_row_number(row, XYZ[i], r->XYZ[i]);
    for (int i = 0; i < 3; i++)
        store_row_number(row, Lab[i], r->Lab[i]);
    for (int i = 0; i < 3; i++)
        store_row_integer(row, sRGB[i], r->sRGB[i]);
    store_row_number(row, "ITA", r->ITA);
    store_row_text(row, "ita_scheme", r->ita_scheme);
    store_row_text(row, "illuminant", r->illuminant);
    store_row_text(row, "observer", r->observer);
    store_row_text(row, "flags", r->flags);
}

enum status store_record_insert(sqlite3_stmt *insert, const struct store_record *record,
                                const struct store_record_keys *keys, struct audit_digests *digests)
{
    struct blobs blobs;
    struct store_row row;
    enum status s = make_blobs(record, &blobs);
    if (s != STATUS_OK)
        return s;
    store_row_begin(&row, insert, "measurement");
    put_origin(&row, record, keys);
    put_spectra(&row, record, &blobs);
    put_colour(&row, record);
    store_row_integer_unless(&row, "owner_uid", record->owner_uid, record->owner_uid < 0);
    s = store_row_insert(&row, digests);
    free(blobs.memory);
    return s;
}

enum status store_match_insert(sqlite3_stmt *insert, const struct store_record *record, int64_t seq,
                               struct audit_digests *digests)
{
    struct store_row row;
    store_row_begin(&row, insert, "match");
    store_row_integer(&row, "measurement", seq);
    store_row_text(&row, "table_name", record->table_name);
    store_row_text(&row, "table_sha256", record->table_sha256);
    store_row_text(&row, "method", record->method);
    store_row_text(&row, "result", record->match_json);
    store_row_text(&row, "refined", record->refined_json);
    return store_row_insert(&row, digests);
}
