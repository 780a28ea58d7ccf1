/* radiometry.c - plain loops over pixels. */
#include "drivers/ocean_ooi/radiometry.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* ---- one frame ---------------------------------------------------------------------- */

static double polynomial(const double n[OOI_NONLINEARITY], double x)
{
    double sum = 0.0;
    for (size_t i = OOI_NONLINEARITY; i-- > 0;)
        sum = sum * x + n[i];
    return sum;
}

enum status ooi_detector_init(const struct ooi_model *model, uint16_t level, size_t order,
                              const double nonlinearity[OOI_NONLINEARITY], struct ooi_detector *ret)
{
    struct ooi_detector d = { .model = model, .level = level };
    bool all_zero = true;
    if (order >= OOI_NONLINEARITY)
        return STATUS_RANGE;
    if (level == 0 || level == UINT16_MAX)
        d.level = model->full_scale;
    if (d.level > model->full_scale || d.level < model->full_scale / 4)
        return STATUS_RANGE;
    for (size_t i = 0; i < OOI_NONLINEARITY; i++) {
        all_zero = all_zero && nonlinearity[i] == 0.0;
        d.nonlinearity[i] = i <= order ? nonlinearity[i] : 0.0;
    }
    if (all_zero)
        d.nonlinearity[0] = 1.0;
    for (int i = 0; i <= 64; i++) {
        double at = polynomial(d.nonlinearity, model->full_scale * (i / 64.0));
        if (!(at >= 0.5 && at <= 1.5))
            return STATUS_RANGE;
    }
    *ret = d;
    return STATUS_OK;
}

double ooi_noise(const struct ooi_model *model, double x)
{
    double scale = 65535.0 / model->full_scale;
    return (400.0 + 8.0 * sqrt(fmax(x * scale, 0.0))) / scale;
}

static double scaled(const struct ooi_detector *d, uint16_t raw)
{
    double full_scale = d->model->full_scale;
    return fmin(raw * full_scale / d->level, full_scale);
}

/* Sorts; there are a dozen. */
static double median(double *value, size_t n)
{
    assert(n > 0);
    for (size_t i = 1; i < n; i++) {
        double v = value[i];
        size_t at = i;
        for (; at > 0 && value[at - 1] > v; at--)
            value[at] = value[at - 1];
        value[at] = v;
    }
    return 0.5 * (value[(n - 1) / 2] + value[n / 2]);
}

/* Mean of the black pixels; NAN where one of them cannot be black. */
static double black_level(const struct ooi_detector *d, const uint16_t *counts)
{
    const struct ooi_model *m = d->model;
    double black[32], sum = 0.0;
    size_t n = m->black_last - m->black_first + 1;
    for (size_t i = 0; i < n; i++)
        sum += black[i] = scaled(d, counts[m->black_first + i]);
    double middle = median(black, n), most = ooi_noise(m, 0.0);
    if (middle > m->full_scale / 5.0 || middle - black[0] > most || black[n - 1] - middle > most)
        return NAN;
    return sum / (double)n;
}

enum status ooi_linearise(const struct ooi_detector *d, const uint16_t *counts, double *linear,
                          double *fill)
{
    const struct ooi_model *m = d->model;
    double black = black_level(d, counts);
    uint16_t most = 0;
    if (isnan(black))
        return STATUS_RANGE;
    for (size_t p = m->active_first; p <= m->active_last; p++) {
        double x = scaled(d, counts[p]) - black;
        linear[p - m->active_first] = x / polynomial(d->nonlinearity, x);
        most = counts[p] > most ? counts[p] : most;
    }
    *fill = (double)most / d->level;
    return STATUS_OK;
}

/* ---- means -------------------------------------------------------------------------- */

void ooi_mean_clear(struct ooi_mean *mean)
{
    mean->frames = 0;
}

void ooi_mean_add(struct ooi_mean *mean, size_t n, const double *linear)
{
    bool first = mean->frames == 0;
    for (size_t p = 0; p < n; p++) {
        double x = linear[p];
        mean->sum[p] = first ? x : mean->sum[p] + x;
        mean->least[p] = first ? x : fmin(mean->least[p], x);
        mean->most[p] = first ? x : fmax(mean->most[p], x);
    }
    mean->frames++;
}

void ooi_mean_take(const struct ooi_mean *mean, size_t n, double *ret)
{
    for (size_t p = 0; p < n; p++)
        ret[p] = mean->sum[p] / (double)mean->frames;
}

size_t ooi_mean_unlike(const struct ooi_mean *mean, const struct ooi_model *model, size_t n)
{
    for (size_t p = 0; p < n; p++) {
        double noise = ooi_noise(model, mean->sum[p] / (double)mean->frames);
        if (mean->most[p] - mean->least[p] > 1.5 * noise)
            return p;
    }
    return n;
}

/* ---- dark, white, sample ------------------------------------------------------------ */

void ooi_dark_at(const struct ooi_dark *dark, size_t n, double t_us, double *ret)
{
    double span = dark->at_us[1] - dark->at_us[0];
    double part = span != 0.0 ? (t_us - dark->at_us[0]) / span : 0.0;
    for (size_t p = 0; p < n; p++)
        ret[p] = dark->value[0][p] + part * (dark->value[1][p] - dark->value[0][p]);
}

void ooi_gain(size_t n, const double *white, const double *dark, const double *rstd, double *gain)
{
    for (size_t p = 0; p < n; p++)
        gain[p] = rstd[p] / (white[p] - dark[p]);
}

void ooi_reflectance(size_t n, const double *sample, const double *dark, const double *gain,
                     double *R)
{
    for (size_t p = 0; p < n; p++)
        R[p] = (sample[p] - dark[p]) * gain[p];
}

size_t ooi_spike(const struct ooi_model *model, size_t n, const double *sample, const double *dark,
                 const double *gain)
{
    double left, here = (sample[0] - dark[0]) * gain[0], right = (sample[1] - dark[1]) * gain[1];
    for (size_t p = 1; p + 1 < n; p++) {
        left = here;
        here = right;
        right = (sample[p + 1] - dark[p + 1]) * gain[p + 1];
        double around = 0.5 * (sample[p - 1] + sample[p + 1]);
        if (fabs(here - 0.5 * (left + right)) > ooi_noise(model, around) * gain[p])
            return p;
    }
    return n;
}
