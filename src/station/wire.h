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

/* raw, table_name, method, boot_id, boottime_ms and parameters_sha256 stay in the store.
 * `instrument` is maker and model; after reading, the model holds both (cut where it is
 * too long).  A record that came from reading gives the same object again. */
enum status wire_record(const struct store_record *record, cJSON **ret);
enum status wire_read_record(const cJSON *object, struct store_record *ret);

#endif
