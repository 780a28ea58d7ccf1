/* xyz.c - reflectance to tristimulus values: weights laid on a band grid. */
#include "colour/xyz.h"

#include <math.h>
#include <stdbool.h>

enum { CMF_LAST_NM = CIE_CMF_FIRST_NM + CIE_CMF_N - 1 };

/* Every grid must cover this; [E308] wants no less of a reflectance. */
static const double must_reach_down_nm = 400.0;
static const double must_reach_up_nm = 700.0;

/* Grids come from text; the same slack as spectrum_band(). */
static const double slack_nm = 1e-6;

/* A checked grid in whole nm. */
struct grid {
    int first_nm, step_nm, last_nm;
};

static enum status grid_init(double first_nm, double step_nm, size_t n, struct grid *ret)
{
    static const int steps_nm[] = { 1, 5, 10 };
    int step = 0;
    double last_nm;

    if (!isfinite(first_nm) || !isfinite(step_nm) || n == 0 || n > SPECTRUM_MAX_BANDS)
        return STATUS_RANGE;
    for (size_t i = 0; i < sizeof steps_nm / sizeof *steps_nm; i++)
        if (fabs(step_nm - steps_nm[i]) <= slack_nm)
            step = steps_nm[i];
    if (step == 0 || fabs(remainder(first_nm, step)) > slack_nm)
        return STATUS_UNSUPPORTED;
    last_nm = first_nm + (double)(n - 1) * step;
    if (first_nm > must_reach_down_nm + slack_nm || last_nm < must_reach_up_nm - slack_nm)
        return STATUS_RANGE;

    ret->first_nm = (int)lround(first_nm);
    ret->step_nm = step;
    ret->last_nm = ret->first_nm + (int)(n - 1) * step;
    return STATUS_OK;
}

/* [CIE15] Where the illuminant is published.  Asked instead of looking for 0 in
 * the table, because a lamp may have a true 0 in its range: LED-B3 does. */
static bool illuminant_published(enum illuminant illuminant, int nm)
{
    switch (illuminant) {
    case ILLUMINANT_E:
        return true;
    case ILLUMINANT_FL2:
    case ILLUMINANT_FL7:
    case ILLUMINANT_FL11:
    case ILLUMINANT_LED_B3:
        return nm >= 380 && nm <= 780;
    default:
        return nm <= 780;
    }
}

/* [CIE15] Illuminant A is Planck's law at 2848 K with c2 = 1.435e7 nm K, 100 at
 * 560 nm; its table holds six digits of it. */
static double planckian_A(int nm)
{
    return 100.0 * pow(560.0 / nm, 5.0) * expm1(1.435e7 / (2848.0 * 560.0)) /
           expm1(1.435e7 / (2848.0 * nm));
}

/* Relative power at a whole nm: straight lines between the 5 nm points, which is
 * also how the E2022 tables are made; no ramp into the 0 beyond them. */
static double illuminant_at(enum illuminant illuminant, int nm)
{
    int i = (nm - CIE_ILLUMINANT_FIRST_NM) / CIE_ILLUMINANT_STEP_NM;
    int past = (nm - CIE_ILLUMINANT_FIRST_NM) % CIE_ILLUMINANT_STEP_NM;
    double low = cie_illuminant[i][illuminant];

    if (!illuminant_published(illuminant, nm))
        return 0.0;
    if (past == 0)
        return low;
    if (illuminant == ILLUMINANT_A)
        return planckian_A(nm);
    return low + (cie_illuminant[i + 1][illuminant] - low) * past / CIE_ILLUMINANT_STEP_NM;
}

/* [E308] folding: what lies beyond the bands goes to the first and last one. */
static double *band_at(struct xyz_weights *w, const struct grid *g, int nm)
{
    if (nm < g->first_nm)
        nm = g->first_nm;
    if (nm > g->last_nm)
        nm = g->last_nm;
    return w->weight[(nm - g->first_nm) / g->step_nm];
}

static void lay_table(enum illuminant illuminant, enum observer observer, const struct grid *g,
                      struct xyz_weights *w)
{
    for (int i = 0; i < CIE_WEIGHTS_N; i++) {
        const double *from = cie_weights_10nm[illuminant][observer][i];
        double *to = band_at(w, g, CIE_WEIGHTS_FIRST_NM + i * CIE_WEIGHTS_STEP_NM);
        for (int k = 0; k < 3; k++)
            to[k] += from[k];
    }
}

/* Sums of hundreds of terms go by blocks, whose own sums are then added: one long sum
 * loses a digit and more by 1 nm.  Spectra by 10 nm are one block. */
enum { BLOCK = 64 };

/* sum(S ybar) over all that is tabulated. */
static double luminance(enum illuminant illuminant, enum observer observer, int step_nm)
{
    const int block = 16; /* every weight has this sum's error */
    double sum = 0.0;

    for (int first = 0; first < CIE_CMF_N; first += block * step_nm) {
        double part = 0.0;
        for (int i = first; i < first + block * step_nm && i < CIE_CMF_N; i += step_nm)
            part += illuminant_at(illuminant, CIE_CMF_FIRST_NM + i) * cie_cmf[observer][i][1];
        sum += part;
    }
    return sum;
}

/* [CIE15] 7.1: X = k sum(S xbar R), k = 100 / sum(S ybar), over all that is
 * tabulated, whatever the grid: so folding cannot move the white. */
static void lay_sum(enum illuminant illuminant, enum observer observer, const struct grid *g,
                    struct xyz_weights *w)
{
    double sum_Y = luminance(illuminant, observer, g->step_nm);

    for (int nm = CIE_CMF_FIRST_NM; nm <= CMF_LAST_NM; nm += g->step_nm) {
        double S = illuminant_at(illuminant, nm) * 100.0 / sum_Y;
        double *to = band_at(w, g, nm);
        for (int k = 0; k < 3; k++)
            to[k] += S * cie_cmf[observer][nm - CIE_CMF_FIRST_NM][k];
    }
}

/* As a measurement of R = 1, which then gives it to the last bit. */
static void set_white(struct xyz_weights *w)
{
    double ones[SPECTRUM_MAX_BANDS];

    for (size_t i = 0; i < w->n; i++)
        ones[i] = 1.0;
    xyz_from_reflectance(w, ones, w->white);
}

enum status xyz_weights_init(enum illuminant illuminant, enum observer observer, double first_nm,
                             double step_nm, size_t n, struct xyz_weights *ret)
{
    struct grid g;
    enum status s;

    if ((size_t)illuminant >= ILLUMINANT_COUNT || (size_t)observer >= OBSERVER_COUNT)
        return STATUS_RANGE;
    s = grid_init(first_nm, step_nm, n, &g);
    if (s != STATUS_OK)
        return s;

    ret->n = n;
    for (size_t i = 0; i < n; i++)
        for (int k = 0; k < 3; k++)
            ret->weight[i][k] = 0.0;
    if (g.step_nm == CIE_WEIGHTS_STEP_NM)
        lay_table(illuminant, observer, &g, ret);
    else
        lay_sum(illuminant, observer, &g, ret);
    set_white(ret);
    return STATUS_OK;
}

void xyz_from_reflectance(const struct xyz_weights *w, const double *value, double XYZ[3])
{
    double X = 0.0, Y = 0.0, Z = 0.0;

    for (size_t first = 0; first < w->n; first += BLOCK) {
        size_t past = w->n - first < BLOCK ? w->n : first + BLOCK;
        double x = 0.0, y = 0.0, z = 0.0;
        for (size_t i = first; i < past; i++) {
            x += w->weight[i][0] * value[i];
            y += w->weight[i][1] * value[i];
            z += w->weight[i][2] * value[i];
        }
        X += x;
        Y += y;
        Z += z;
    }
    XYZ[0] = X;
    XYZ[1] = Y;
    XYZ[2] = Z;
}
