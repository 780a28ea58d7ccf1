/* refine_many.h - many spectra, each to the continuous skin of its own: as match/refine.h, for
 * pictures and long files.
 *
 * One replicate a skin, one fit, one band grid and one noise for all; any fit that
 * match/refine.h takes.  A fit of Cm, Bm and Ch by the half space or two layers runs by vectors,
 * a skin a lane (match/refine_lanes.h); other fits, and what lanes give up, go one by one
 * through refiner_run(), and the caller need not care.  Answers are refiner_run()'s without
 * start, intervals and second solution: by lanes within 1e-3 standard errors of the minimum, chi^2
 * within 1e-6 of itself (1e-5 at least), the same flags, but that lanes come to rest where steps
 * one by one tire (REFINE_NOT_CONVERGED); where there are several minima (dark skin, where Ch
 * hardly shows; spectra that no skin of the model explains) at times another one, lower or higher.
 * Each depends on its own spectrum alone: the same bits for any order, number and threads, and any
 * vectors that fuse (optics/quick.h).
 */
#ifndef SKINSPEC_MATCH_REFINE_MANY_H
#define SKINSPEC_MATCH_REFINE_MANY_H

#include <stddef.h>
#include <stdint.h>

#include "base/status.h"
#include "match/fit.h"
#include "match/noise.h"
#include "match/refine.h"

/* Beside those of enum refine_flag. */
enum refine_many_flag {
    /* Not fitted, all values NAN: a band is not a number, infinite or beyond +-REFINE_R_MAX, or
     * the model takes no such skin. */
    REFINE_MANY_REFUSED = 1 << 25,
};

/* Rows of values on the band grid, SCE: band k of row i at R[i * stride + k * band_stride].  Either
 * the bands of a row lie together (stride >= bands, band_stride 1 or 0, which stands for 1), or
 * the rows of a band do (stride 1, band_stride >= n), which takes less time. */
struct refine_rows {
    const float *R_float; /* one of the two, the other NULL */
    const double *R;
    size_t stride, n, band_stride;
};

/* Arrays of n, one element a row; those that are NULL are not wanted, and not computed where that
 * saves time.  value[] and se[] by enum skin_parameter; of one that is held its value, and 0. */
struct refine_answers {
    double *value[SKIN_PARAMETERS], *se[SKIN_PARAMETERS];
    double *chi_square, *rms; /* as struct refined has them */
    uint32_t *flags;          /* enum refine_flag, enum refine_many_flag */
};

struct refine_many;

/* As refiner_open() and noise_check().  *why (may be NULL) as in fit_check(). */
enum status refine_many_open(const struct fit *fit, double first_nm, double step_nm, size_t bands,
                             const struct noise *noise, struct refine_many **ret, const char **why);
void refine_many_close(struct refine_many *many); /* takes NULL */

/* All rows, on so many threads (1: the caller's own).  The same refine_many serves many callers at
 * a time. STATUS_RANGE: other strides than those, both or none of the rows' pointers. */
enum status refine_many_run(const struct refine_many *many, const struct refine_rows *rows,
                            unsigned threads, const struct refine_answers *ret);

#endif
