/* wire.h - spectra, matches and records <-> the objects of the protocol.
 *
 * Making: STATUS_RANGE where a number that is always present is not finite, or a text
 * that is JSON in the record is none; STATUS_NO_MEMORY; *ret untouched.  Members that are
 * not measured (NAN, "") are left out.
 *
 * Reading: the object was checked against the description, or comes from our own station;
 * what is missing or does not fit all the same is STATUS_FORMAT, *ret untouched. */
#ifndef SKINSPEC_STATION_WIRE_H
#define SKINSPEC_STATION_WIRE_H

#include <cjson/cJSON.h>
#include <stddef.h>

#include "base/spectrum.h"
#include "base/status.h"
#include "db/store.h"
#include "match/match.h"
#include "match/refined_match.h"
#include "plan/plan_run.h"

/* Flags of bands, specular and aperture do not travel with the spectrum: after reading
 * they are 0, SPECULAR_UNKNOWN and NAN. */
enum status wire_spectrum(const struct spectrum *spectrum, cJSON **ret);
enum status wire_read_spectrum(const cJSON *object, struct spectrum *ret);

/* k: how many of hits[] to list as `nearest`; 0: none. */
enum status wire_match(const struct table *table, const struct match *match,
                       const struct nearest_hit *hits, size_t k, cJSON **ret);

/* The same refined: Cm, Bm, Ch of the fitted skin, how sure they are, and `nearest`, the row,
 * with k of hits[] as its `rows`. */
enum status wire_refined_match(const struct table *table, const struct refined_match *match,
                               const struct nearest_hit *hits, size_t k, cJSON **ret);

/* One that was fitted without a table: neither `table` nor `nearest`. */
enum status wire_refined_fit(const struct model *model, const struct refined_match *match,
                             cJSON **ret);

/* Either.  match.row.rgb is NAN and row_index (from `nearest`, else 0) is all that is known of the
 * row's place.  Of a refined one what is absent is NAN, `free` says which have se and interval,
 * the slope of the noise and the number of steps are not known; wish is what gives it again.
 * Flags that are not known here are passed over. */
struct wire_match {
    struct match match; /* the nearest row */
    bool is_refined;
    struct refined_match refined;
    char table[TABLE_NAME_SIZE], table_sha256[TABLE_SHA256_SIZE];
};
enum status wire_read_match(const cJSON *object, struct wire_match *ret);

/* Scenes: docs/scenes.md.  Reading: STATUS_FORMAT for what is no scene, members that are not known
 * among it; STATUS_RANGE as scene_check() and scene_check_use(), but the latter not of a kept one,
 * that of a plan; why[] says what is wrong and what to do. */
enum status wire_read_scene(const cJSON *object, struct scene *ret, char why[SCENE_WHY_SIZE]);
enum status wire_read_kept_scene(const cJSON *object, struct scene *ret, char why[SCENE_WHY_SIZE]);
enum status wire_scene(const struct scene *scene, cJSON **ret);

/* What ran, what was left out and why, what was to be expected; with what it took (work may be
 * NULL, us NAN), and the scene with all that was chosen said in it. */
enum status wire_plan(const struct plan *plan, const struct plan_work *work, double us,
                      cJSON **ret);

/* `colour`, and the members of a match as far as they were wanted; without `plan`.  table: NULL
 * where the plan takes none. */
enum status wire_plan_answer(const struct plan *plan, const struct table *table,
                             const struct plan_answer *answer, const struct nearest_hit *hits,
                             size_t k, cJSON **ret);

/* raw, table_name, method, boot_id, boottime_ms and parameters_sha256 stay in the store.
 * `instrument` is maker and model; after reading, the model holds both (cut where it is
 * too long).  A record that came from reading gives the same object again. */
enum status wire_record(const struct store_record *record, cJSON **ret);
enum status wire_read_record(const cJSON *object, struct store_record *ret);

#endif
