/* radiometry.h - from counts to reflectance, pixel by pixel.
 *
 *   level         counts become counts x full scale / level (slot 17), at most full scale; a raw
 *                 count at or above the level is saturated
 *   black         B, the mean of the optically dark pixels of the same frame; x = counts - B
 *   linear        x / (n0 + n1 x + ... + nm x^m), m from slot 14, at most 7
 *   dark          D(t), with the black trap at the port and the lamp on
 *   reflectance   R = (S - D) / (W - D) x Rstd, all at one integration time
 *
 * D is measured before the white tile says which integration time is wanted.  Once B
 * is off it is what the dark current and the sphere's stray light leave: linear in time.  So
 * it is measured at two times, and D(t) is the line through both; where the integration time is
 * known from an earlier white, D is measured at it.
 *
 * Noise is taken as at most 400 + 8 sqrt(x) counts of 65535 from the truth, six times that of
 * these detectors (50 in the dark and 260 at full scale, one sigma, by the data sheets).  What
 * is further off than that is no noise: a damaged frame, or a scene that moved.
 *
 * Everything here is pure; n is the number of active pixels, arrays are of n. */
#ifndef SKINSPEC_DRIVERS_OCEAN_OOI_RADIOMETRY_H
#define SKINSPEC_DRIVERS_OCEAN_OOI_RADIOMETRY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/status.h"
#include "drivers/ocean_ooi/models.h"

enum { OOI_NONLINEARITY = 8 };

struct ooi_detector {
    const struct ooi_model *model;
    uint16_t level;                        /* of saturation, raw */
    double nonlinearity[OOI_NONLINEARITY]; /* n0 .. n7; those above the order are 0 */
};

/* level 0 (none stored) and 65535 (erased) stand for the full scale.  All n0..n7 zero: the detector
 * was never calibrated for this and counts as linear.  STATUS_RANGE for a level below a quarter
 * of the full scale or above it, an order above 7, a polynomial that leaves 0.5 .. 1.5
 * between 0 and full scale; *ret is untouched then. */
enum status ooi_detector_init(const struct ooi_model *model, uint16_t level, size_t order,
                              const double nonlinearity[OOI_NONLINEARITY],
                              struct ooi_detector *ret);

/* What the active pixels saw, linear[n].  *fill: the largest raw count of these over the level;
 * 1 and above: saturated.  STATUS_RANGE, with linear[] untouched, where a black pixel is further
 * than noise from their median or the median is above a fifth of the full scale. */
enum status ooi_linearise(const struct ooi_detector *detector, const uint16_t *counts,
                          double *linear, double *fill);

/* How far from the truth x a count may be, see above. */
double ooi_noise(const struct ooi_model *model, double x);

/* ---- means -------------------------------------------------------------------------- */

/* Frames of one scene. */
struct ooi_mean {
    size_t frames;
    double sum[OOI_MAX_PIXELS], least[OOI_MAX_PIXELS], most[OOI_MAX_PIXELS];
};

void ooi_mean_clear(struct ooi_mean *mean);
void ooi_mean_add(struct ooi_mean *mean, size_t n, const double *linear);
void ooi_mean_take(const struct ooi_mean *mean, size_t n, double *ret);

/* The first pixel in which two frames differ by more than noise allows (1.5 times the above), or
 * n: all frames are of the same scene. */
size_t ooi_mean_unlike(const struct ooi_mean *mean, const struct ooi_model *model, size_t n);

/* ---- dark, white, sample ------------------------------------------------------------ */

struct ooi_dark {
    double at_us[2]; /* both the same: D was measured at that time alone */
    double value[2][OOI_MAX_PIXELS];
};

/* D(t).  Cannot fail. */
void ooi_dark_at(const struct ooi_dark *dark, size_t n, double t_us, double *ret);

/* gain = Rstd / (W - D), so that R = (S - D) x gain.  Cannot fail: the caller has seen that
 * W - D > 0. */
void ooi_gain(size_t n, const double *white, const double *dark, const double *rstd, double *gain);

void ooi_reflectance(size_t n, const double *sample, const double *dark, const double *gain,
                     double *R);

/* The first pixel of a sample frame whose reflectance is further from the mean of its two
 * neighbours than noise allows, or n.  No spectrum is that narrow: an optical resolution is four
 * pixels or more.  In reflectance, so that pixels of different sensitivity do not show. */
size_t ooi_spike(const struct ooi_model *model, size_t n, const double *sample, const double *dark,
                 const double *gain);

#endif
