/* study_match.c - the numbers that matching adds: a grid's values, distances, probabilities. */
#include <math.h>
#include <string.h>

#include "match/chi_square.h"
#include "match/grid.h"
#include "match/nearest.h"
#include "match/table.h"
#include "tests/stability/rooms.h"

/* ---- an axis: lo, hi, n, i, log --------------------------------------------------------- */

static bool axis_ours(const double *x, double *y)
{
    struct axis axis = { x[0], x[1], (size_t)x[2], x[4] != 0.0 };
    y[0] = axis_value(&axis, (size_t)x[3]);
    return true;
}

static void axis_twin(const wide *x, wide *y)
{
    wide share = w_div(x[3], w_sub(x[2], w_int(1)));
    if (!w_is_zero(x[4]))
        y[0] = w_mul(x[0], w_pow(w_div(x[1], x[0]), share));
    else
        y[0] = w_add(x[0], w_mul(w_sub(x[1], x[0]), share));
}

static void axes(struct cases *c)
{
    static const double end[][3] = { { 0.001, 0.5, 1 }, { 0.0, 1.0, 0 },   { 0.001, 0.1, 1 },
                                     { 1e-9, 0.5, 1 },  { 0.001, 0.1, 0 }, { 1e-100, 0.1, 1 } };
    for (size_t i = 0; i < sizeof end / sizeof *end; i++)
        for (double n = 2; n <= 10000; n = 2 * n + 1)
            for (double at = 0; at < n; at += fmax(1.0, floor(n / 50)))
                cases_add(c, (double[]){ end[i][0], end[i][1], n, at, end[i][2] });
}

/* ---- distance from a row: seed, how near, missing bands ----------------------------------- */

static void bands_of(const double *x, size_t n, float *row, double *value)
{
    struct dice dice = { (uint64_t)x[0] };
    for (size_t i = 0; i < n; i++) {
        row[i] = (float)dice_between(&dice, 0.0, 1.0);
        value[i] = (double)row[i] + pow(10.0, -x[1]) * dice_between(&dice, -1.0, 1.0);
        if ((double)i < x[2])
            value[i] = NAN;
    }
}

static bool rms_ours(const double *x, double *y)
{
    struct recipe recipe = recipe_default(model_find("two-layer"));
    struct table_row values = { 0 };
    struct spectrum s = { .first_nm = 400.0, .step_nm = 10.0, .n = recipe.bands };
    struct table t;
    float row[SPECTRUM_MAX_BANDS];
    bands_of(x, recipe.bands, row, s.value);
    if (table_init(&recipe, 1, &t) != STATUS_OK)
        return false;
    table_set(&t, 0, &values, row);
    y[0] = nearest_rms(&t, 0, &s);
    table_done(&t);
    return true;
}

static void rms_of(const wide *x, wide *rms, wide *sensitivity)
{
    enum { N = 31 };
    double chosen[3], value[SPECTRUM_MAX_BANDS];
    float row[SPECTRUM_MAX_BANDS];
    for (int i = 0; i < 3; i++)
        chosen[i] = w_double(x[i]);
    bands_of(chosen, N, row, value);
    wide squares = w_int(0), by = w_int(0);
    long n = 0;
    for (int i = 0; i < N; i++) {
        if (isnan(value[i]))
            continue;
        wide difference = w_sub(w((double)row[i]), w(value[i]));
        squares = w_add(squares, w_square(difference));
        by = w_add(by, w_abs(w_mul(w(value[i]), difference)));
        n++;
    }
    *rms = w_sqrt(w_div(squares, w_int(n)));
    *sensitivity = w_is_zero(*rms) ? by : w_div(by, w_mul(w_int(n), *rms));
}

static void rms_twin(const wide *x, wide *y)
{
    wide unused;
    rms_of(x, &y[0], &unused);
}

static void rms_sensitivity(const wide *x, wide *sum)
{
    wide unused;
    rms_of(x, &unused, &sum[0]);
}

static void spectra(struct cases *c)
{
    for (double seed = 0; seed < 200; seed++)
        for (double near = 0; near <= 16; near += 2)
            for (double missing = 0; missing <= 21; missing += 7)
                cases_add(c, (double[]){ seed, near, missing });
}

/* ---- chi-square: value, degrees -------------------------------------------------------------- */

static bool chi_ours(const double *x, double *y)
{
    y[0] = chi_square_above(x[0], (size_t)x[1]);
    return true;
}

static void chi_twin(const wide *x, wide *y)
{
    wide half = w_div(x[1], w_int(2)), value = w_div(x[0], w_int(2));
    wide above = w_int(0), all = w_int(0);
    mpfr_gamma_inc(above, half, value, MPFR_RNDN);
    mpfr_gamma(all, half, MPFR_RNDN);
    y[0] = w_div(above, all);
}

static void chi_squares(struct cases *c)
{
    static const double degrees[] = { 1, 2, 3, 5, 26, 28, 31, 100, 300, 1000 };
    for (size_t i = 0; i < sizeof degrees / sizeof *degrees; i++)
        for (int k = 0; k < 60; k++) {
            double value = degrees[i] * cases_decades(c, k % 3 == 0 ? -8.0 : -0.7, 0.4);
            cases_add(c, (double[]){ value, degrees[i] });
        }
}

/* What the header promises is 1e-12. */
#define CHI_SQUARE_BAR (1e-12 / 0x1p-53)

static const struct study studies[] = {
    { "axis_value",
      { "lo", "hi", "n", "i", "log" },
      2,
      { "value" },
      8.0,
      axis_ours,
      axis_twin,
      axes,
      NULL },
    { "nearest_rms",
      { "seed", "near", "missing" },
      0,
      { "rms" },
      8.0,
      rms_ours,
      rms_twin,
      spectra,
      rms_sensitivity },
    { "chi_square_above",
      { "value", "degrees" },
      1,
      { "p" },
      CHI_SQUARE_BAR,
      chi_ours,
      chi_twin,
      chi_squares,
      NULL },
};

const struct study_room study_match = { "matching (match/grid, nearest, chi_square)", studies,
                                        sizeof studies / sizeof *studies };
