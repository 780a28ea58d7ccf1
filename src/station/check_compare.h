/* check_compare.h - how far a check tile is from its reference.
 *
 * Both spectra on the bands they have in common, so that ends beyond 400..700 nm, which one of
 * them may lack, make no difference; then the colour difference CIEDE2000 under D65 and the 10
 * degree observer, as colours of records hold. */
#ifndef SKINSPEC_STATION_CHECK_COMPARE_H
#define SKINSPEC_STATION_CHECK_COMPARE_H

#include "base/spectrum.h"
#include "base/status.h"

/* The limit of a tile of which none was said: well above what a sound handheld shows (short-term
 * repeatability about 0.04 dE*ab on white, agreement of two of a model about 0.2), and below
 * the difference of about 1 that people begin to see; docs/decisions/0010. */
#define CHECK_LIMIT_DE00 0.5
#define CHECK_LIMIT_MIN 0.01
#define CHECK_LIMIT_MAX 20.0

struct check_difference {
    double dE00;
    double rms; /* of reflectance over the common bands */
};

/* The bands of the coarser one that the other has as well must be one run that gives a colour:
 * by 10, 5 or 1 nm, from 400 or below to 700 or above.  STATUS_UNSUPPORTED where they are not, or
 * a value is not finite; STATUS_NO_MEMORY. */
enum status check_compare(const struct spectrum *reference, const struct spectrum *measured,
                          struct check_difference *ret);

#endif
