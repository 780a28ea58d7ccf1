/* bands.h - from pixels to 400..700 nm by 10, each band a triangle.
 *
 * A band at c weighs wavelengths by T(nm) = max(0, 1 - |nm - c| / 10), as CIE 15 has it for
 * a 10 nm bandpass.  Between pixels the spectrum is taken as straight lines; a pixel's weight
 * is the exact integral of T times that pixel's hat function, over that of T.  So
 *
 *   - the weights of a band are none negative and sum to 1;
 *   - a spectrum that is linear in nm comes out exactly, whatever the pixels' spacing;
 *   - with fine pixels (0.2 to 0.4 nm here) a weight is T times the pixel's width, over 10;
 *   - with coarse ones (above 10 nm) it passes into linear interpolation between the
 *     two pixels around c, smoothed: no band is left without pixels.
 *
 * What a triangle does to a curved spectrum (it adds 100/12 R'' for 10 nm) is the bandpass
 * that the certified values of tiles and the CIE's weights have as well: it stays. */
#ifndef SKINSPEC_DRIVERS_OCEAN_OOI_BANDS_H
#define SKINSPEC_DRIVERS_OCEAN_OOI_BANDS_H

#include <stddef.h>

#include "base/status.h"
#include "drivers/ocean_ooi/models.h"

enum { OOI_BANDS = 31 };
#define OOI_FIRST_NM 400.0
#define OOI_STEP_NM 10.0
/* What the triangles of the first and the last band reach to. */
#define OOI_LOWEST_NM 390.0
#define OOI_HIGHEST_NM 710.0

struct ooi_bands {
    size_t first[OOI_BANDS], n[OOI_BANDS]; /* pixels of each band */
    size_t at[OOI_BANDS];                  /* where their weights stand */
    /* Any pixel has a part in at most two bands, and each band takes one pixel more on both
     * sides of what its triangle covers. */
    double weight[2 * OOI_MAX_PIXELS + 4 * OOI_BANDS];
};

/* nm[n] rising, n <= OOI_MAX_PIXELS.  STATUS_RANGE, and *ret untouched, where they do not rise
 * or do not reach from 390 to 710 nm. */
enum status ooi_bands_init(size_t n, const double *nm, struct ooi_bands *ret);

/* value[n], one for each pixel, to band[OOI_BANDS].  Cannot fail. */
void ooi_bands_apply(const struct ooi_bands *bands, const double *value, double *band);

/* wavelengths: nm[i] = c[0] + c[1] p + c[2] p^2 + c[3] p^3 at p = first + i, 0 <= i < n.
 * Cannot fail. */
void ooi_wavelengths(const double c[4], size_t first, size_t n, double *nm);

#endif
