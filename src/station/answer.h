/* answer.h - from a spectrum to what a record says of it: colour, match, the refined skin, and all
 * of it again.
 *
 * Colours of records hold under D65 and the 10 degree observer. */
#ifndef SKINSPEC_STATION_ANSWER_H
#define SKINSPEC_STATION_ANSWER_H

#include <cjson/cJSON.h>
#include <stdbool.h>

#include "colour/xyz.h"
#include "db/store.h"
#include "match/refined_match.h"
#include "station/tables.h"

/* Weights for the bands seen last: one for each thread that asks, zeroed before. */
struct answer_weights {
    double first_nm, step_nm;
    size_t n;
    bool usable;
    struct xyz_weights weights;
};

struct answer_colour {
    double XYZ[3], Lab[3], ITA;
    int sRGB[3];
};

/* False, with numbers that say so, where there is none: bands that do not do, or one of them not
 * measured. */
bool answer_colour_of(struct answer_weights *weights, const struct spectrum *s,
                      struct answer_colour *ret);

/* XYZ, Lab, sRGB, ITA, ita_scheme, illuminant and observer of record->spectrum; where its bands
 * give no colour the numbers are NAN (sRGB 0) and ita_scheme is "". */
void answer_colour(struct answer_weights *weights, struct store_record *record);

/* Whether matching takes well under a millisecond, so that the loop may do it itself: the
 * matcher is made, and `by` and k are of the quick kind. */
bool answer_is_quick(struct loaded_table *table, enum match_by by, size_t k);

/* The nearest row alone: statuses of loaded_matcher() and matcher_match(). */
enum status answer_find(struct loaded_table *table, enum match_by by, size_t k,
                        const struct spectrum *spectrum, struct nearest_hit *hits,
                        struct match *ret);

/* The match object of an SCE spectrum; hits[] has room for max(k, 1).  Sets table_name,
 * table_sha256, method and match_json of the record (without `nearest`: that is for the
 * reply alone) and *ret (with `nearest` where k > 0).  STATUS_UNSUPPORTED where the spectrum or
 * the table lacks what `by` needs; STATUS_NO_MEMORY.  ret may be NULL: match_json is all that is
 * wanted. */
enum status answer_match(struct loaded_table *table, enum match_by by, size_t k,
                         struct nearest_hit *hits, struct store_record *record, cJSON **ret);

/* The skin between the rows, fitted to the record's replicates as far as its mean is of them (to
 * its spectrum where it has none), from the rows that the mean is nearest to.  Statuses of
 * refined_match(); STATUS_RANGE also where the surface is more than a replicate's own reading.
 * *why as there: never for the status of a match.  hits[] has room for max(k, REFINE_STARTS).
 * A matter of tens of microseconds to seconds, as the model is: not for the loop. */
enum status answer_fit(struct loaded_table *table, enum match_by by, const struct refine_wish *wish,
                       size_t k, struct nearest_hit *hits, const struct store_record *record,
                       struct refined_match *ret, const char **why);

/* The same as an object, after answer_match(): sets refined_json of the record, and *ret (may be
 * NULL), with the `rows` of `nearest` where k > 0. */
enum status answer_refine(struct loaded_table *table, enum match_by by,
                          const struct refine_wish *wish, size_t k, struct nearest_hit *hits,
                          struct store_record *record, cJSON **ret, const char **why);

/* The spectra that the record's mean is of, SCE: malloc'ed, n of them; where there is one spectrum
 * alone, that.  STATUS_RANGE where the surface is more than a replicate's own reading. */
enum status answer_replicates(const struct store_record *record, struct spectrum **ret, size_t *n);

/* The result of record.recompute: colour, match and refined skin computed again from the record's
 * spectra and compared, number by number, with what is stored.  The table must be the one of the
 * record's hash.  STATUS_FORMAT where the stored match cannot be read; STATUS_UNSUPPORTED where the
 * spectrum or the table lacks what it was matched by; STATUS_NO_MEMORY. */
enum status answer_recompute(struct answer_weights *weights, struct loaded_table *table,
                             const struct store_record *record, cJSON **ret);

#endif
