/* reference.c - from top to bottom: frames, zero, white, sample. */
#include "drivers/ocean_ooi/reference.h"

#include <math.h>
#include <string.h>

enum {
    FIRST_US = 10000,
    LONGEST_US = 500000,
    LIGHT_US = 1000000, /* of a calibration's mean, roughly */
    LEAST_FRAMES = 4,
    MOST_FRAMES = 16,
    SEARCHES = 12, /* for an integration time; from 10 us to 500 ms by factors of 8 takes 6 */
};

#define FILL_LEAST 0.70
#define FILL_MOST 0.90
#define FILL_WANTED 0.80
#define BRIGHT_ZERO 0.20 /* fill at 10 ms that no black trap gives */
#define DARK_WANTED 0.25 /* fill of the longer zero */
#define CONTRAST_LEAST 10.0
#define DRIFT_MOST 0.01
#define LEAST_COUNTS 2000.0 /* of 65535 */
#define LEAST_PIXEL 200.0

/* ---- frames ------------------------------------------------------------------------- */

/* The next frame, linear; a damaged one is taken again once. */
static enum driver_result take(struct ooi_reference *ref, size_t stale, double *fill,
                               struct driver_error *error)
{
    for (int i = 0; i < 2; i++) {
        enum driver_result r = ooi_take_frame(ref->session, stale, ref->counts, error);
        if (r != DRIVER_OK)
            return r;
        if (ooi_linearise(&ref->detector, ref->counts, ref->linear, fill) == STATUS_OK)
            return DRIVER_OK;
        stale = 0;
    }
    return driver_fail(error, DRIVER_PROTOCOL, NULL,
                       "the detector's black pixels are not black: keep light from the "
                       "spectrometer's housing, or connect it again");
}

static enum driver_result refuse_saturated(const char *what, struct driver_error *error)
{
    return driver_fail(error, DRIVER_IMPLAUSIBLE, NULL,
                       "%s saturates the detector: is the port covered, and no other light on it? "
                       "Then calibrate white again",
                       what);
}

/* The mean of so many frames of one scene, in ref->mean.  *fill: of the brightest. */
static enum driver_result collect(struct ooi_reference *ref, size_t frames, size_t stale,
                                  double *fill, struct driver_error *error)
{
    *fill = 0.0;
    ooi_mean_clear(&ref->mean);
    for (size_t i = 0; i < frames; i++) {
        double of_one;
        enum driver_result r = take(ref, i == 0 ? stale : 0, &of_one, error);
        if (r != DRIVER_OK)
            return r;
        *fill = fmax(*fill, of_one);
        ooi_mean_add(&ref->mean, ref->n, ref->linear);
    }
    if (ooi_mean_unlike(&ref->mean, ref->detector.model, ref->n) < ref->n)
        return driver_fail(error, DRIVER_IMPLAUSIBLE, NULL,
                           "the light changes from one spectrum to the next: do not move anything "
                           "at the port, let the lamp warm up, then calibrate again");
    return DRIVER_OK;
}

static size_t frames_for(const struct ooi_reference *ref, unsigned averages)
{
    size_t n = LIGHT_US / (ref->session->integration_us > 0 ? ref->session->integration_us : 1);
    n = n < LEAST_FRAMES ? LEAST_FRAMES : n > MOST_FRAMES ? MOST_FRAMES : n;
    return averages > n ? averages : n;
}

/* Of the pixels that count. */
static double sum_used(const struct ooi_reference *ref, const double *value)
{
    double sum = 0.0;
    for (size_t p = ref->first_used; p < ref->end_used; p++)
        sum += value[p];
    return sum;
}

/* ---- zero --------------------------------------------------------------------------- */

static enum driver_result refuse_bright_zero(struct driver_error *error)
{
    return driver_fail(error, DRIVER_IMPLAUSIBLE, NULL,
                       "there is light at the port: put the black trap there, not the white tile, "
                       "then calibrate zero again");
}

/* One of the two darks. */
static enum driver_result take_dark(struct ooi_reference *ref, size_t which, double us,
                                    unsigned averages, double *fill, struct driver_error *error)
{
    enum driver_result r = ooi_set_integration(ref->session, us, error);
    if (r == DRIVER_OK)
        r = collect(ref, frames_for(ref, averages), OOI_STALE_FRAMES, fill, error);
    if (r != DRIVER_OK)
        return r;
    ref->new_dark.at_us[which] = ref->session->integration_us;
    ooi_mean_take(&ref->mean, ref->n, ref->new_dark.value[which]);
    return DRIVER_OK;
}

/* A longer time at which a quarter of the range is filled at most. */
static double longer_us(const struct ooi_reference *ref)
{
    double peak = 1.0;
    for (size_t p = 0; p < ref->n; p++)
        peak = fmax(peak, ref->new_dark.value[0][p]);
    double us = ref->new_dark.at_us[0] * DARK_WANTED * ref->detector.model->full_scale / peak;
    return fmin(fmax(us, 2.0 * ref->new_dark.at_us[0]), LONGEST_US);
}

static enum driver_result take_two_darks(struct ooi_reference *ref, unsigned averages,
                                         struct driver_error *error)
{
    double fill;
    enum driver_result r = take_dark(ref, 0, FIRST_US, averages, &fill, error);
    if (r != DRIVER_OK)
        return r;
    if (fill > BRIGHT_ZERO)
        return refuse_bright_zero(error);
    r = take_dark(ref, 1, longer_us(ref), averages, &fill, error);
    return r == DRIVER_OK && fill >= 1.0 ? refuse_bright_zero(error) : r;
}

static enum driver_result take_dark_as_white(struct ooi_reference *ref, unsigned averages,
                                             struct driver_error *error)
{
    double fill;
    enum driver_result r = take_dark(ref, 0, ref->white_us, averages, &fill, error);
    if (r != DRIVER_OK)
        return r;
    double rate = sum_used(ref, ref->new_dark.value[0]) / ref->white_us;
    if (fill >= 1.0 || rate * CONTRAST_LEAST > ref->rate)
        return refuse_bright_zero(error);
    ref->new_dark.at_us[1] = ref->new_dark.at_us[0];
    memcpy(ref->new_dark.value[1], ref->new_dark.value[0], sizeof ref->new_dark.value[0]);
    return DRIVER_OK;
}

enum driver_result ooi_calibrate_zero(struct ooi_reference *ref, unsigned averages,
                                      struct driver_error *error)
{
    enum driver_result r = ref->white_us > 0 ? take_dark_as_white(ref, averages, error)
                                             : take_two_darks(ref, averages, error);
    if (r != DRIVER_OK)
        return r;
    ref->dark = ref->new_dark;
    ref->zero = true;
    if (ref->white) {
        ooi_dark_at(&ref->dark, ref->n, ref->white_us, ref->dark_now);
        ooi_gain(ref->n, ref->white_now, ref->dark_now, ref->rstd, ref->gain);
    }
    return DRIVER_OK;
}

/* ---- white -------------------------------------------------------------------------- */

/* The next integration time to try, from one that gave this fill. */
static double next_us(double us, double fill)
{
    if (fill >= 1.0)
        return us / 8.0;
    return us * fmin(FILL_WANTED / fmax(fill, 0.01), 8.0);
}

static enum driver_result find_integration(struct ooi_reference *ref, struct driver_error *error)
{
    const struct ooi_model *m = ref->detector.model;
    double us = ref->white_us > 0 ? ref->white_us : FIRST_US, fill = 0.0;
    for (int i = 0; i < SEARCHES; i++) {
        enum driver_result r = ooi_set_integration(ref->session, us, error);
        if (r == DRIVER_OK)
            r = take(ref, OOI_STALE_FRAMES, &fill, error);
        if (r != DRIVER_OK || (fill >= FILL_LEAST && fill <= FILL_MOST))
            return r;
        if (fill > FILL_MOST && ooi_model_integration_us(m, us) == m->shortest_us)
            return driver_fail(error, DRIVER_IMPLAUSIBLE, NULL,
                               "the white tile is too bright even at the shortest integration "
                               "time: dim the lamp or use a thinner fibre");
        if (fill < FILL_LEAST && us >= LONGEST_US)
            break;
        us = fmin(next_us(us, fill), LONGEST_US);
    }
    return driver_fail(error, DRIVER_IMPLAUSIBLE, NULL,
                       "the white tile fills %.0f %% of the range, not 70 to 90: is it at the "
                       "port, is the lamp on and steady, is the fibre connected?",
                       100.0 * fill);
}

static enum driver_result refuse_drift(double drift, const char *since, struct driver_error *error)
{
    return driver_fail(error, DRIVER_REFUSED, NULL,
                       "the lamp's light changed by %.1f %% %s: let it warm up for half an hour, "
                       "clean the white tile, then calibrate white again",
                       100.0 * drift, since);
}

/* Two means; the mean of both goes to first_mean. */
static enum driver_result take_white(struct ooi_reference *ref, unsigned averages,
                                     struct driver_error *error)
{
    double fill;
    enum driver_result r = collect(ref, frames_for(ref, averages), 0, &fill, error);
    if (r == DRIVER_OK && fill >= 1.0)
        return refuse_saturated("the white tile", error);
    if (r == DRIVER_OK) {
        ooi_mean_take(&ref->mean, ref->n, ref->first_mean);
        r = collect(ref, frames_for(ref, averages), 0, &fill, error);
    }
    if (r == DRIVER_OK && fill >= 1.0)
        return refuse_saturated("the white tile", error);
    if (r != DRIVER_OK)
        return r;
    ooi_mean_take(&ref->mean, ref->n, ref->linear);
    double drift = sum_used(ref, ref->linear) / sum_used(ref, ref->first_mean) - 1.0;
    if (!(fabs(drift) <= DRIFT_MOST))
        return refuse_drift(drift, "within this calibration", error);
    for (size_t p = 0; p < ref->n; p++)
        ref->first_mean[p] = 0.5 * (ref->first_mean[p] + ref->linear[p]);
    return DRIVER_OK;
}

/* Whether there is enough light in each band over `dark`. */
static enum driver_result check_light(struct ooi_reference *ref, const double *dark,
                                      struct driver_error *error)
{
    double band[OOI_BANDS], scale = ref->detector.model->full_scale / 65535.0;
    double least_pixel = INFINITY;
    for (size_t p = 0; p < ref->n; p++)
        ref->linear[p] = ref->first_mean[p] - dark[p];
    for (size_t p = ref->first_used; p < ref->end_used; p++)
        least_pixel = fmin(least_pixel, ref->linear[p]);
    ooi_bands_apply(ref->bands, ref->linear, band);
    for (size_t b = 0; b < OOI_BANDS; b++)
        if (!(band[b] >= LEAST_COUNTS * scale))
            return driver_fail(error, DRIVER_IMPLAUSIBLE, NULL,
                               "too little light at %.0f nm (%.0f counts of 65535, 2000 are "
                               "needed): use a lamp with more of this colour, or a filter that "
                               "takes off the others",
                               OOI_FIRST_NM + (double)b * OOI_STEP_NM, band[b] / scale);
    if (!(least_pixel >= LEAST_PIXEL * scale))
        return driver_fail(error, DRIVER_FAULT, NULL,
                           "a pixel of the detector sees nothing: have the spectrometer serviced");
    return DRIVER_OK;
}

/* A good white of this rate; keep it if the lamp is still what it was. */
static enum driver_result keep_white(struct ooi_reference *ref, double rate,
                                     struct driver_error *error)
{
    double before = ref->rate;
    ref->rate = rate;
    ref->white_us = ref->session->integration_us;
    if (before > 0.0 && !(fabs(rate / before - 1.0) <= DRIFT_MOST)) {
        ref->white = false;
        return refuse_drift(rate / before - 1.0,
                            "since the last white, and readings since then "
                            "are in doubt",
                            error);
    }
    memcpy(ref->white_now, ref->first_mean, sizeof ref->white_now);
    ooi_dark_at(&ref->dark, ref->n, ref->white_us, ref->dark_now);
    ooi_gain(ref->n, ref->white_now, ref->dark_now, ref->rstd, ref->gain);
    ref->white = true;
    return DRIVER_OK;
}

enum driver_result ooi_calibrate_white(struct ooi_reference *ref, unsigned averages,
                                       struct driver_error *error)
{
    double *dark = ref->new_dark.value[0]; /* scratch here */
    enum driver_result r = find_integration(ref, error);
    if (r == DRIVER_OK)
        r = take_white(ref, averages, error);
    if (r != DRIVER_OK)
        return r;
    ooi_dark_at(&ref->dark, ref->n, ref->session->integration_us, dark);
    double black = sum_used(ref, dark), light = sum_used(ref, ref->first_mean) - black;
    if (light < (CONTRAST_LEAST - 1.0) * black) {
        ref->zero = ref->white = false;
        return driver_fail(error, DRIVER_IMPLAUSIBLE, NULL,
                           "the white is not much brighter than the zero was: were black trap and "
                           "white tile swapped?  Calibrate zero again, then white");
    }
    r = check_light(ref, dark, error);
    return r == DRIVER_OK ? keep_white(ref, light / ref->session->integration_us, error) : r;
}

/* ---- sample ------------------------------------------------------------------------- */

/* The next frame of a sample; one with a spike is taken again once. */
static enum driver_result take_sample(struct ooi_reference *ref, size_t stale,
                                      struct driver_error *error)
{
    for (int i = 0; i < 2; i++) {
        double fill;
        enum driver_result r = take(ref, stale, &fill, error);
        if (r != DRIVER_OK)
            return r;
        if (fill >= 1.0)
            return refuse_saturated("the sample", error);
        size_t first = ref->first_used;
        if (ooi_spike(ref->detector.model, ref->end_used - first, ref->linear + first,
                      ref->dark_now + first, ref->gain + first) == ref->end_used - first)
            return DRIVER_OK;
        stale = 0;
    }
    return driver_fail(error, DRIVER_PROTOCOL, NULL,
                       "the spectrum has spikes that no sample has: keep other light from the "
                       "port, then measure again");
}

enum driver_result ooi_measure_sample(struct ooi_reference *ref, unsigned averages,
                                      double R[OOI_BANDS], struct driver_error *error)
{
    enum driver_result r = ooi_set_integration(ref->session, ref->white_us, error);
    ooi_mean_clear(&ref->mean);
    for (unsigned i = 0; r == DRIVER_OK && i < averages; i++) {
        r = take_sample(ref, i == 0 ? OOI_STALE_FRAMES : 0, error);
        if (r == DRIVER_OK)
            ooi_mean_add(&ref->mean, ref->n, ref->linear);
    }
    if (r != DRIVER_OK)
        return r;
    ooi_mean_take(&ref->mean, ref->n, ref->linear);
    ooi_reflectance(ref->n, ref->linear, ref->dark_now, ref->gain, ref->linear);
    ooi_bands_apply(ref->bands, ref->linear, R);
    return DRIVER_OK;
}
