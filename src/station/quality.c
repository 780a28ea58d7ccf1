/* quality.c - checks of one shot, and what a set of replicates tells. */
#include "station/quality.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const struct {
    const char *name, *text;
} flags[QUALITY_FLAGS] = {
    { "wrong_bands", "the instrument sent other bands than it was set to; set it up again" },
    { "not_finite", "a band is no number; measure again" },
    { "out_of_range", "a band lies outside -0.02..1.2; calibrate, then measure again" },
    { "all_zero", "no light came back; put the port on the skin and measure again" },
    { "white_black_swapped",
      "white tile and black trap were swapped at calibration; calibrate again" },
    { "sci_below_sce", "less light with the mirror reflection than without; check the port" },
    { "spread", "the replicates differ more than skin does; lift the probe between shots" },
    { "outlier", "a replicate was left out: it lies far from the others" },
    { "redness_falls", "the skin blanches under the probe; lift it and press more lightly" },
    { "single", "only one replicate: take three to know the spread" },
    { "calibration_old", "the calibration was due when this was measured" },
    { "drift", "the instrument's last check against its tile failed; calibrate, then check again" },
};

const char *quality_flag_name(size_t i)
{
    return i < QUALITY_FLAGS ? flags[i].name : "unknown";
}

const char *quality_flag_text(size_t i)
{
    return i < QUALITY_FLAGS ? flags[i].text : "unknown";
}

static const double lowest = -0.02, highest = 1.2, dark = 0.001, sci_slack = 0.005;

static bool same_bands(const struct spectrum *x, const struct spectrum *y)
{
    return x->n == y->n && x->first_nm == y->first_nm && x->step_nm == y->step_nm;
}

static unsigned check_values(const struct spectrum *s)
{
    size_t outside = 0, lit = 0;
    for (size_t i = 0; i < s->n; i++) {
        if (!isfinite(s->value[i]))
            return QUALITY_NOT_FINITE;
        outside += s->value[i] < lowest || s->value[i] > highest;
        lit += fabs(s->value[i]) > dark;
    }
    if (2 * outside > s->n)
        return QUALITY_WHITE_BLACK_SWAPPED;
    if (outside > 0)
        return QUALITY_OUT_OF_RANGE;
    return lit == 0 ? QUALITY_ALL_ZERO : 0u;
}

unsigned quality_shot(const struct spectrum *bands, const struct spectrum *sce,
                      const struct spectrum *sci)
{
    if (!same_bands(bands, sce) || (sci != NULL && !same_bands(bands, sci)))
        return QUALITY_WRONG_BANDS;
    unsigned found = check_values(sce);
    if (sci == NULL)
        return found;
    found |= check_values(sci);
    if (found != 0)
        return found;
    for (size_t i = 0; i < sce->n; i++)
        if (sci->value[i] < sce->value[i] - sci_slack)
            return QUALITY_SCI_BELOW_SCE;
    return 0;
}

static int compare_doubles(const void *left, const void *right)
{
    double x = *(const double *)left, y = *(const double *)right;
    return (x > y) - (x < y);
}

static double median(double *x, size_t n)
{
    qsort(x, n, sizeof *x, compare_doubles);
    return n % 2 == 1 ? x[n / 2] : 0.5 * (x[n / 2 - 1] + x[n / 2]);
}

/* The spectrum of band-wise medians: one wild replicate does not move it. */
static void median_spectrum(const struct spectrum *replicate, size_t n, struct spectrum *ret)
{
    double at_band[QUALITY_MAX_REPLICATES];
    *ret = replicate[0];
    for (size_t i = 0; i < ret->n; i++) {
        for (size_t r = 0; r < n; r++)
            at_band[r] = replicate[r].value[i];
        ret->value[i] = median(at_band, n);
    }
}

static double rms_between(const struct spectrum *x, const struct spectrum *y)
{
    double sum = 0.0;
    for (size_t i = 0; i < x->n; i++)
        sum += (x->value[i] - y->value[i]) * (x->value[i] - y->value[i]);
    return sqrt(sum / (double)x->n);
}

/* Mark the outliers; where half or more would go there is no saying which half is
 * right, and none goes. */
static void leave_out(const struct spectrum *replicate, size_t n, struct quality_set *set)
{
    struct spectrum middle;
    size_t far = 0;
    median_spectrum(replicate, n, &middle);
    for (size_t r = 0; r < n; r++) {
        set->left_out[r] = rms_between(&replicate[r], &middle) > QUALITY_OUTLIER_RMS;
        far += set->left_out[r];
    }
    if (2 * far >= n)
        memset(set->left_out, 0, sizeof set->left_out);
    else if (far > 0)
        set->flags |= QUALITY_OUTLIER;
}

static void average(const struct spectrum *replicate, size_t n, struct quality_set *set)
{
    set->mean = replicate[0];
    memset(set->mean.flag, 0, sizeof set->mean.flag);
    for (size_t r = 0; r < n; r++)
        set->kept += !set->left_out[r];
    for (size_t i = 0; i < set->mean.n; i++) {
        double sum = 0.0;
        for (size_t r = 0; r < n; r++) {
            if (set->left_out[r])
                continue;
            sum += replicate[r].value[i];
            set->mean.flag[i] |= replicate[r].flag[i];
        }
        set->mean.value[i] = sum / (double)set->kept;
    }
}

/* Root of the summed squares over kept - 1: the spread of single shots. */
static double spread_about_mean(const struct spectrum *replicate, size_t n,
                                const struct quality_set *set)
{
    double sum = 0.0;
    if (set->kept < 2)
        return NAN;
    for (size_t r = 0; r < n; r++) {
        double rms = set->left_out[r] ? 0.0 : rms_between(&replicate[r], &set->mean);
        sum += rms * rms;
    }
    return sqrt(sum / (double)(set->kept - 1));
}

static bool redness_falls(const double *a_star, size_t n)
{
    for (size_t r = 1; r < n; r++)
        if (!(a_star[r] < a_star[r - 1]))
            return false;
    return n >= 3 && a_star[0] - a_star[n - 1] > QUALITY_REDNESS_FALL;
}

enum status quality_of_set(const struct spectrum *replicate, const double *a_star, size_t n,
                           struct quality_set *ret)
{
    if (n < 1 || n > QUALITY_MAX_REPLICATES)
        return STATUS_RANGE;
    for (size_t r = 0; r < n; r++)
        if (!same_bands(&replicate[0], &replicate[r]) || replicate[r].n == 0)
            return STATUS_RANGE;
    memset(ret, 0, sizeof *ret);
    if (n >= 3)
        leave_out(replicate, n, ret);
    average(replicate, n, ret);
    ret->spread_rms = spread_about_mean(replicate, n, ret);
    if (n == 1)
        ret->flags |= QUALITY_SINGLE;
    if (ret->spread_rms > QUALITY_SPREAD_RMS)
        ret->flags |= QUALITY_SPREAD;
    if (redness_falls(a_star, n))
        ret->flags |= QUALITY_REDNESS_FALLS;
    ret->lift_probe = (ret->flags & (QUALITY_SPREAD | QUALITY_REDNESS_FALLS)) != 0;
    return STATUS_OK;
}
