/* nearest.h - the k rows of a table nearest to a measured skin, exactly.
 *
 *   by         distance                                            unit
 *   rgb        Euclidean between 8-bit sRGB codes (the paper)      codes, 0..441
 *   rgb-float  the same before rounding and clipping               codes
 *   lab        dE*ab                                               -
 *   de2000     CIEDE2000                                           -
 *   spectrum   rms over the bands that both have                   reflectance
 *
 * Rows equally near come in the order of their ids. */
#ifndef SKINSPEC_MATCH_NEAREST_H
#define SKINSPEC_MATCH_NEAREST_H

#include <stdbool.h>
#include <stddef.h>

#include "base/spectrum.h"
#include "base/status.h"
#include "match/table.h"

enum match_by { MATCH_RGB, MATCH_RGB_FLOAT, MATCH_LAB, MATCH_DE2000, MATCH_SPECTRUM };

/* "rgb", "rgb-float", "lab", "de2000", "spectrum". */
const char *match_by_name(enum match_by by);

/* Fewer common bands than this are no basis for a comparison of spectra. */
enum { NEAREST_MIN_BANDS = 10 };

/* Rows that may be answers: their Cm, Bm and Ch, in this order, from lo to hi, ends
 * included; -INFINITY and INFINITY where nothing is asked of one. */
struct nearest_range {
    double lo[3], hi[3];
};

/* What an answer took; searches add to it. */
struct nearest_work {
    size_t rows;   /* whose distance was taken */
    size_t judged; /* points and boxes around many that a bound or a range was held against */
};

struct nearest_query {
    bool has_colour; /* Lab and rgb below are set; under the table's illuminant */
    double Lab[3], rgb[3];
    const struct spectrum *spectrum;
    const struct nearest_range *range; /* NULL: all rows */
    struct nearest_work *work;         /* NULL: not counted */
};

struct nearest_hit {
    size_t row;
    double distance;
};

/* What one way of searching needs beside the table, made once and then only
 * read, so that many threads may search at a time.  The table must outlive it. */
struct nearest;

/* STATUS_UNSUPPORTED for spectra of a table without them; STATUS_NO_MEMORY. */
enum status nearest_open(const struct table *table, enum match_by by, struct nearest **ret);
void nearest_close(struct nearest *nearest); /* takes NULL */

/* The min(k, rows in the range) nearest into hits[k], nearest first, their number in *found.
 * The index leaves out what lies outside the range; nothing is found first and dropped afterwards.
 * STATUS_RANGE for k = 0 and for a range that ends before it begins or is not a number;
 * STATUS_NOT_FOUND where no row lies in it; STATUS_UNSUPPORTED where the query lacks the colour,
 * or has fewer than NEAREST_MIN_BANDS measured bands in common with the table. */
enum status nearest_find(const struct nearest *nearest, const struct nearest_query *query, size_t k,
                         struct nearest_hit *hits, size_t *found);

/* nearest_find() of n questions query[n], to the same answers, but quicker: while one search waits
 * for memory others go on.  Question i has its hits at hits + i k, k places each, their number in
 * found[i], 0 where none were found, and its status in status[i]. */
void nearest_find_many(const struct nearest *nearest, size_t n, const struct nearest_query *query,
                       size_t k, struct nearest_hit *hits, size_t *found, enum status *status);

/* The same answer from looking at every row: what nearest_find() is tested and measured
 * against. */
enum status nearest_scan(const struct nearest *nearest, const struct nearest_query *query, size_t k,
                         struct nearest_hit *hits, size_t *found);

/* Bands that the spectrum and the table both have and that were measured. */
size_t nearest_common_bands(const struct table *table, const struct spectrum *spectrum);

/* Root mean square difference between the spectrum and a row over those bands;
 * NAN where there are none or the table has no spectra. */
double nearest_rms(const struct table *table, size_t row, const struct spectrum *spectrum);

#endif
