/* quality.h - is this a measurement of skin?  The gate every shot passes.
 *
 * Some findings refuse a shot: it is not kept as a measurement.  The others are
 * flags that stay on the record; two of them ask the operator to do something
 * before the next replicate.  Thresholds and their sources stand at each flag. */
#ifndef SKINSPEC_STATION_QUALITY_H
#define SKINSPEC_STATION_QUALITY_H

#include <stdbool.h>
#include <stddef.h>

#include "base/spectrum.h"
#include "base/status.h"

enum quality_flag {
    /* Refused. */
    QUALITY_WRONG_BANDS = 1 << 0, /* other bands than the instrument was set to */
    QUALITY_NOT_FINITE = 1 << 1,
    QUALITY_OUT_OF_RANGE = 1 << 2,        /* a band below -0.02 or above 1.2 */
    QUALITY_ALL_ZERO = 1 << 3,            /* no band above 0.001: nothing under the port */
    QUALITY_WHITE_BLACK_SWAPPED = 1 << 4, /* most bands below -0.02 or above 1.2 */
    /* Kept and flagged. */
    QUALITY_SCI_BELOW_SCE = 1 << 5,    /* by more than 0.005 in some band */
    QUALITY_SPREAD = 1 << 6,           /* kept replicates lie too far from their mean */
    QUALITY_OUTLIER = 1 << 7,          /* a replicate was left out of the mean */
    QUALITY_REDNESS_FALLS = 1 << 8,    /* a* falls from shot to shot: the probe blanches */
    QUALITY_SINGLE = 1 << 9,           /* one replicate: nothing is known of its spread */
    QUALITY_CALIBRATION_OLD = 1 << 10, /* set by the station: measured under policy `warn` */
    QUALITY_DRIFT = 1 << 11,           /* set by the station: a check tile says so (checks.h) */
};
enum { QUALITY_FLAGS = 12 };
#define QUALITY_REFUSED \
    (QUALITY_WRONG_BANDS | QUALITY_NOT_FINITE | QUALITY_OUT_OF_RANGE | QUALITY_ALL_ZERO | \
     QUALITY_WHITE_BLACK_SWAPPED)

const char *quality_flag_name(size_t i); /* token of bit 1 << i: "wrong_bands" ... */
const char *quality_flag_text(size_t i); /* for a person: what it means and what to do */

/* Both from 100 people measured three times on one arm (Cooksey, Allen, Tsai, J. Res.
 * NIST 122:26, 2017): single shots spread by 0.0081 in the median and 0.0164 at the
 * 95th percentile; 6 of 100 people have a shot further than three medians from the
 * band-wise median. */
#define QUALITY_OUTLIER_RMS 0.0255
#define QUALITY_SPREAD_RMS 0.0165
/* Fall of a* over three shots or more that is not chance: repeats differ by a dE of
 * 0.73 in the mean. */
#define QUALITY_REDNESS_FALL 1.0

enum { QUALITY_MAX_REPLICATES = 32 };

/* One shot against the bands the instrument was set to; sci may be NULL.  Bits of
 * enum quality_flag. */
unsigned quality_shot(const struct spectrum *bands, const struct spectrum *sce,
                      const struct spectrum *sci);

struct quality_set {
    unsigned flags;
    bool left_out[QUALITY_MAX_REPLICATES]; /* of the mean */
    size_t kept;
    double spread_rms;    /* of the kept ones about their mean; NAN for one */
    bool lift_probe;      /* ask the operator to lift the probe before the next shot */
    struct spectrum mean; /* of the kept ones */
};

/* Replicates of one site, all on the same bands, 1 .. QUALITY_MAX_REPLICATES, and
 * their a*.  With three or more, those further than QUALITY_OUTLIER_RMS from the
 * band-wise median are left out, as long as more than half remain.
 * STATUS_RANGE for a wrong number or unlike bands. */
enum status quality_of_set(const struct spectrum *replicate, const double *a_star, size_t n,
                           struct quality_set *ret);

#endif
