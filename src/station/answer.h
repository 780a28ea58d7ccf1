/* answer.h - from a spectrum to what a record says of it: colour, match, and both again.
 *
 * Colours of records hold under D65 and the 10 degree observer. */
#ifndef SKINSPEC_STATION_ANSWER_H
#define SKINSPEC_STATION_ANSWER_H

#include <cjson/cJSON.h>
#include <stdbool.h>

#include "colour/xyz.h"
#include "db/store.h"
#include "station/tables.h"

/* Weights for the bands seen last: one for each thread that asks, zeroed before. */
struct answer_weights {
    double first_nm, step_nm;
    size_t n;
    bool usable;
    struct xyz_weights weights;
};

/* XYZ, Lab, sRGB, ITA, ita_scheme, illuminant and observer of record->spectrum; where its bands
 * give no colour the numbers are NAN (sRGB 0) and ita_scheme is "". */
void answer_colour(struct answer_weights *weights, struct store_record *record);

/* Whether matching takes well under a millisecond, so that the loop may do it itself: the
 * matcher is made, and `by` and k are of the quick kind. */
bool answer_is_quick(struct loaded_table *table, enum match_by by, size_t k);

/* The match object of an SCE spectrum; hits[] has room for max(k, 1).  Sets table_name,
 * table_sha256, method and match_json of the record (without `nearest`: that is for the
 * reply alone) and *ret (with `nearest` where k > 0).  STATUS_UNSUPPORTED where the spectrum or
 * the table lacks what `by` needs; STATUS_NO_MEMORY.  ret may be NULL: match_json is all that is
 * wanted. */
enum status answer_match(struct loaded_table *table, enum match_by by, size_t k,
                         struct nearest_hit *hits, struct store_record *record, cJSON **ret);

/* The result of record.recompute: colour and match computed again from record->spectrum and
 * compared, number by number, with what is stored.  The table must be the one of the record's
 * hash.  STATUS_FORMAT where the stored match cannot be read; STATUS_UNSUPPORTED where the
 * spectrum or the table lacks what it was matched by; STATUS_NO_MEMORY. */
enum status answer_recompute(struct answer_weights *weights, struct loaded_table *table,
                             const struct store_record *record, cJSON **ret);

#endif
