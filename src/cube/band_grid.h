/* band_grid.h - the bands of a cube, laid on the even grid that a fit takes.
 *
 * Bands within the wished range that are not bad are used.  Where they stand evenly by
 * BAND_GRID_FINEST to BAND_GRID_COARSEST nm they are the grid.  Else the grid is of multiples of
 * BAND_GRID_STEP (of 15, 20 or 30 nm where the bands stand wider than that), within the first and
 * last, and a value there is the straight line between bands, seen through a triangle:
 *     R(g) = integral of line(l) t(l - g) dl,  t a triangle of half width h and area 1
 *     h^2 = step^2 - spacing^2, spacing that of the bands (their mean), and h = 0 where that is
 *     negative or the first or last band is nearer than h: then h is that distance
 * Bands up to a step beyond the range have a part in that.  So a spectrum that is straight comes
 * out as it is, and fine bands are blurred as by the band of 10 nm full width that
 * spectrophotometers have. */
#ifndef SKINSPEC_CUBE_BAND_GRID_H
#define SKINSPEC_CUBE_BAND_GRID_H

#include <stdbool.h>
#include <stddef.h>

#include "base/status.h"
#include "cube/envi_header.h"

#define BAND_GRID_STEP 10.0
#define BAND_GRID_FINEST 5.0
#define BAND_GRID_COARSEST 30.0
#define BAND_GRID_LO 400.0
#define BAND_GRID_HI 700.0
enum { BAND_GRID_LEAST = 10, BAND_GRID_MOST = 128 };

struct band_grid {
    double first_nm, step_nm;
    size_t n;
    bool as_is;                  /* grid band i is used band i */
    size_t used;                 /* of the cube's bands */
    size_t band[ENVI_MAX_BANDS]; /* [used], increasing */
    /* Grid band i: the sum of weight[first[i] ...] times used bands from[i] .. from[i] + count[i].
     */
    size_t from[BAND_GRID_MOST], count[BAND_GRID_MOST], first[BAND_GRID_MOST];
    float weight[4 * ENVI_MAX_BANDS]; /* a band has a part in three values, seldom four */
};

/* For the cube's bands within lo_nm..hi_nm.  STATUS_RANGE where fewer than BAND_GRID_LEAST are
 * left, of the cube or of the grid, or two neighbours are farther apart than BAND_GRID_COARSEST;
 * *fault (line 0) then says so. */
enum status band_grid_init(const struct envi_header *h, double lo_nm, double hi_nm,
                           struct band_grid *ret, struct envi_fault *fault);

/* n pixels: in[used] and out[n of the grid], rows of pixels, so many floats apart; values times
 * `factor`.  The same operations for each pixel, whatever n. */
void band_grid_apply(const struct band_grid *g, const float *in, size_t n, size_t in_row,
                     size_t out_row, float factor, float *out);

#endif
