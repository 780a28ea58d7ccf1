/* reference.h - dark, white and sample with one sphere: what is taken when, and what is refused.
 *
 *   zero    the black trap at the port, lamp on: holds the sphere's stray light as well as the
 *           detector's dark.  At 10 ms and at a longer time (up to 500 ms, less where there is
 *           much stray light); once a white has settled the integration time, at that alone
 *   white   the white tile at the port.  The integration time is chosen so that the brightest
 *           pixel fills 70 to 90 % of the range, and kept for all that follows; then two means,
 *           one after the other, which must agree
 *   sample  at the white's integration time
 *
 * Calibrations average 4 to 16 frames, about a second of light (more where setup.averages says
 * so); a sample takes setup.averages.  Refused is
 *
 *   a zero with light in it; a white not ten times as bright as the zero: swapped
 *   a white below 2000 counts of 65535 over zero in any band, or that cannot be brought to 70 %
 *   lamp drift above 1 % between the two means, or since the last white: there, readings since then
 *     are in doubt; the white after the next agrees with it, or the lamp is not warm yet
 *   whatever saturates; frames of one scene that differ, samples with spikes (radiometry.h),
 *     where the next frame is no better */
#ifndef SKINSPEC_DRIVERS_OCEAN_OOI_REFERENCE_H
#define SKINSPEC_DRIVERS_OCEAN_OOI_REFERENCE_H

#include "drivers/ocean_ooi/bands.h"
#include "drivers/ocean_ooi/radiometry.h"
#include "drivers/ocean_ooi/session.h"

struct ooi_reference {
    struct ooi_session *session;
    struct ooi_detector detector;
    size_t n;                    /* active pixels */
    size_t first_used, end_used; /* those that are part of a band */
    const struct ooi_bands *bands;
    const double *rstd; /* [n], of the white tile */

    bool zero, white;  /* done */
    uint32_t white_us; /* integration time that the last white chose; 0: none yet */
    double rate;       /* of the last white: counts in a microsecond, all used pixels; 0: none */
    struct ooi_dark dark;
    double dark_now[OOI_MAX_PIXELS], white_now[OOI_MAX_PIXELS], gain[OOI_MAX_PIXELS];

    /* Scratch. */
    struct ooi_mean mean;
    struct ooi_dark new_dark;
    uint16_t counts[OOI_MAX_PIXELS];
    double linear[OOI_MAX_PIXELS], first_mean[OOI_MAX_PIXELS];
};

/* DRIVER_IMPLAUSIBLE, DRIVER_REFUSED (drift) or DRIVER_PROTOCOL for what is refused above.  A call
 * that fails leaves the last good zero and white as they were; but whites that disagree make
 * white due again, and a white that looks swapped both. */
enum driver_result ooi_calibrate_zero(struct ooi_reference *reference, unsigned averages,
                                      struct driver_error *error);
enum driver_result ooi_calibrate_white(struct ooi_reference *reference, unsigned averages,
                                       struct driver_error *error);

/* R[OOI_BANDS], of the last white and zero, which the caller has seen to be done. */
enum driver_result ooi_measure_sample(struct ooi_reference *reference, unsigned averages,
                                      double R[OOI_BANDS], struct driver_error *error);

#endif
