/* substitution.h - the sample is part of the sphere that lights it.
 *
 * In a sphere with one beam a darker sample darkens the whole sphere, and it looks darker
 * than it is.  At each wavelength the light in the sphere goes as 1 / (1 - m), m the mean
 * reflectance of its inside at that wavelength, of which the port has the share f and all the rest
 * (walls, other ports) contributes a.  Against a white tile of Rstd, a sample of R is read as
 *
 *     Rm = R (1 - a - f Rstd) / (1 - a - f R) = R (1 - k Rstd) / (1 - k R),   k = f / (1 - a)
 *
 * which turns round without approximation:
 *
 *     R = Rm / (1 - k Rstd + k Rm)
 *
 * k is found from grey tiles measured without the correction.  Each band of each gives
 * Rm - R = k R (Rm - Rstd), and k is the straight line in wavelength (walls absorb a little more in
 * the blue) that fits all of them best.
 *
 * Trust: flat, matt, opaque samples that fill the port.  Skin lets light wander out beside the
 * port; that loss is not in this model, nor is fluorescence.  The correction is as good as the
 * greys span the samples: skin wants one of about 0.1 to 0.2 and one of 0.4 to 0.6.  A file is
 * refused where k leaves 0..0.9 or the greys do not come out within 0.01 rms. */
#ifndef SKINSPEC_DRIVERS_OCEAN_OOI_SUBSTITUTION_H
#define SKINSPEC_DRIVERS_OCEAN_OOI_SUBSTITUTION_H

#include <stddef.h>

#include "base/status.h"
#include "drivers/ocean_ooi/bands.h"

struct ooi_substitution {
    double k[OOI_BANDS];
    double residual; /* rms of corrected less certified, all bands of all greys */
};

#define OOI_SUBSTITUTION_MAX_K 0.9
#define OOI_SUBSTITUTION_MAX_RESIDUAL 0.01

/* n >= 1 greys, each 31 bands; rstd of the white tile.  *ret is filled even where it is
 * STATUS_RANGE, for the message: k outside 0..0.9 or the residual too large, or no
 * grey differs from the tile (k is 0 then). */
enum status ooi_substitution_fit(size_t n, double (*measured)[OOI_BANDS],
                                 double (*certified)[OOI_BANDS], const double rstd[OOI_BANDS],
                                 struct ooi_substitution *ret);

/* R[31] in place.  Cannot fail for R >= 0 and k as fitted. */
void ooi_substitution_correct(const struct ooi_substitution *substitution,
                              const double rstd[OOI_BANDS], double R[OOI_BANDS]);

#endif
