/* match.h - the answer: a measured SCE spectrum -> the nearest skin of a table,
 * and how well it fits. */
#ifndef SKINSPEC_MATCH_MATCH_H
#define SKINSPEC_MATCH_MATCH_H

#include <stddef.h>

#include "base/spectrum.h"
#include "base/status.h"
#include "match/nearest.h"
#include "match/table.h"

/* What to know about an answer; a set of bits. */
enum match_flag {
    MATCH_CM_AT_LIMIT = 1 << 0, /* at an end of the table's axis: the truth may lie beyond */
    MATCH_BM_AT_LIMIT = 1 << 1,
    MATCH_CH_AT_LIMIT = 1 << 2,
    MATCH_BM_UNDETERMINED = 1 << 3, /* Cm is 0: there is nothing to blend */
    MATCH_TIE = 1 << 4,             /* another row is just as near; the lower id was taken */
    MATCH_POOR_FIT = 1 << 5,     /* rms (without spectra: dE00) above MATCH_POOR_*: not explained */
    MATCH_NO_COLOUR = 1 << 6,    /* these bands give no colour, so there is no dE00 */
    MATCH_BANDS_ZEROED = 1 << 7, /* the stated surface exceeded the reading in some band */
};

enum { MATCH_FLAG_COUNT = 8 };

/* Token of bit 1 << i: "Cm_at_limit" ... "bands_zeroed". */
const char *match_flag_name(size_t i);

/* More than two-layer's own error explains from 0.06 mm of epidermis up (0.0192 at
 * worst); for tables without spectra, plainly another colour. */
#define MATCH_POOR_RMS 0.02
#define MATCH_POOR_DE00 5.0

struct match {
    struct table_row row; /* the nearest: its parameters and colour */
    size_t row_index;     /* from 0; its id is one more */
    double distance;      /* by `by`, see match/nearest.h */
    enum match_by by;
    double dE00; /* measured colour - row's colour, table's illuminant; NAN without colour */
    double rms;  /* measured - row's spectrum over common bands; NAN without spectra */
    unsigned flags;
    size_t found; /* entries of hits[] */
};

struct xyz_weights;

struct matcher {
    const struct table *table;
    enum match_by by;
    struct nearest *nearest;
    struct xyz_weights *weights; /* for the table's own bands; NULL for a table without */
};

/* The default way for a table: by spectrum where it has spectra, else by rgb. */
enum match_by matcher_default_by(const struct table *table);

/* The table must outlive the matcher, which many threads may use at a time.
 * STATUS_UNSUPPORTED for spectra of a table without; STATUS_NO_MEMORY. */
enum status matcher_open(const struct table *table, enum match_by by, struct matcher *ret);
void matcher_close(struct matcher *matcher);

/* The colour that a spectrum is compared by: Lab and linear sRGB under the
 * table's illuminant and observer, over the table's own bands where the spectrum
 * has them all, so that both are folded alike.  Statuses of colour/xyz.h. */
enum status matcher_colour(const struct table *table, const struct spectrum *spectrum,
                           double Lab[3], double rgb[3]);

/* What is asked beside the nearest row. */
struct match_ask {
    bool no_colour; /* by spectrum: no colour is computed; dE00 is NAN, and nothing is said of it */
    bool no_spectra; /* by colour: the table's spectra are not looked at; rms is NAN */
    const struct nearest_range *range; /* NULL: all rows */
    struct nearest_work *work;         /* NULL: not counted */
};

/* Nearest row and the k nearest into hits[k], k >= 1.  STATUS_UNSUPPORTED where
 * the spectrum is not SCE or lacks what `by` needs (colour, common bands). */
enum status matcher_match(const struct matcher *matcher, const struct spectrum *spectrum, size_t k,
                          struct nearest_hit *hits, struct match *ret);

/* The same as asked; statuses also as nearest_find() for a range.  A row at an end of the range
 * is not at_limit for that: such flags are about the table. */
enum status matcher_match_asked(const struct matcher *matcher, const struct match_ask *ask,
                                const struct spectrum *spectrum, size_t k, struct nearest_hit *hits,
                                struct match *ret);

#endif
