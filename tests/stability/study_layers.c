/* study_layers.c - the closed-form models of skin, band by band, and their derivatives. */
#include <math.h>

#include "optics/dipole.h"
#include "optics/half_space.h"
#include "optics/kubelka_munk.h"
#include "optics/two_layer.h"
#include "tests/stability/extremes.h"
#include "tests/stability/rooms.h"
#include "tests/stability/twins.h"

/* ---- ours ----------------------------------------------------------------------- */

/* x: sigma_a1, sigma_s1', sigma_a2, sigma_s2', d, eta. */
static struct medium medium_of(double *x)
{
    return (struct medium){ 1, x[4], x[5], &x[0], &x[2], &x[1], &x[3] };
}

static bool two_layer_ours(const double *x, double *y)
{
    double own[6] = { x[0], x[1], x[2], x[3], x[4], x[5] };
    struct medium m = medium_of(own);
    return two_layer_reflectance(&m, y) == STATUS_OK;
}

/* y: the derivatives in the order of x, without eta's. */
static bool two_layer_slopes_ours(const double *x, double *y)
{
    double own[6] = { x[0], x[1], x[2], x[3], x[4], x[5] }, R;
    struct medium m = medium_of(own);
    struct slopes dR = { y, y + 2, y + 1, y + 3, y + 4 };
    return two_layer_slopes(&m, &R, &dR) == STATUS_OK;
}

static bool kubelka_munk_ours(const double *x, double *y)
{
    double own[6] = { x[0], x[1], x[2], x[3], x[4], x[5] };
    struct medium m = medium_of(own);
    return kubelka_munk_reflectance(&m, y) == STATUS_OK;
}

static bool kubelka_munk_slopes_ours(const double *x, double *y)
{
    double own[6] = { x[0], x[1], x[2], x[3], x[4], x[5] }, R;
    struct medium m = medium_of(own);
    struct slopes dR = { y, y + 2, y + 1, y + 3, y + 4 };
    return kubelka_munk_slopes(&m, &R, &dR) == STATUS_OK;
}

/* x: sigma_a1, sigma_a2, sigma_s1', eta. */
static bool half_space_ours(const double *x, double *y)
{
    double own[6] = { x[0], x[2], x[1], x[2], 0.08, x[3] };
    struct medium m = medium_of(own);
    return half_space_reflectance(&m, y) == STATUS_OK;
}

static bool half_space_slopes_ours(const double *x, double *y)
{
    double own[6] = { x[0], x[2], x[1], x[2], 0.08, x[3] }, other[2], R;
    struct medium m = medium_of(own);
    struct slopes dR = { y, &other[0], y + 1, &other[1], y + 2 };
    return half_space_slopes(&m, &R, &dR) == STATUS_OK && other[0] == y[0] && other[1] == 0.0;
}

/* ---- twins ---------------------------------------------------------------------- */

static void half_space_twin(const wide *x, wide *y)
{
    wide entering = w_sub(w_int(1), twin_Rs(x[3]));
    y[0] = w_mul(entering, twin_half_space(w_add(x[0], x[1]), x[2], x[3]));
}

static void two_layer_twin(const wide *x, wide *y)
{
    y[0] = twin_two_layer(x);
}

static wide half_space_R(const wide *x)
{
    wide entering = w_sub(w_int(1), twin_Rs(x[3]));
    return w_mul(entering, twin_half_space(w_add(x[0], x[1]), x[2], x[3]));
}

/* By an absorption that R falls with the root of: without end at 0, unless so little comes
 * back from there that it counts as nothing. */
static wide slope_of_root(twin_of_one *R, const wide *x, size_t n, size_t i, wide scale)
{
    wide by_root = twin_root_slope(R, x, n, i, scale), slope = w_int(0);
    if (fabs(w_double(by_root)) >= 1e-300)
        mpfr_set_inf(slope, -1);
    return slope;
}

static void half_space_slopes_twin(const wide *x, wide *y)
{
    wide sum[4] = { w_add(x[0], x[1]), w_int(0), x[2], x[3] };
    bool none = w_is_zero(sum[0]);
    y[0] = none ? slope_of_root(half_space_R, sum, 4, 0, x[2])
                : twin_slope(half_space_R, sum, 4, 0, sum[0]);
    y[1] = none ? w_int(0) : twin_slope(half_space_R, sum, 4, 2, x[2]);
    y[2] = w_int(0);
}

static void layers_slopes(twin_of_one *R, const wide *x, wide *y)
{
    /* R is smooth in the epidermis's absorption: next to nothing is as good as 0. */
    bool clear = w_less(x[0], w_mul(x[1], w_two_to(-200)));
    y[0] = clear ? twin_slope_from_0(R, x, 6, 0, x[1]) : twin_slope(R, x, 6, 0, x[0]);
    y[1] = twin_slope(R, x, 6, 1, x[1]);
    y[2] = w_is_zero(x[2]) ? slope_of_root(R, x, 6, 2, x[3]) : twin_slope(R, x, 6, 2, x[2]);
    y[3] = twin_slope(R, x, 6, 3, x[3]);
    wide free_path = w_div(w_int(1), w_add(x[0], x[1]));
    y[4] = twin_slope(R, x, 6, 4, w_is_zero(x[4]) ? free_path : x[4]);
}

static void two_layer_slopes_twin(const wide *x, wide *y)
{
    layers_slopes(twin_two_layer, x, y);
}

static void kubelka_munk_twin(const wide *x, wide *y)
{
    y[0] = twin_kubelka_munk(x);
}

static void kubelka_munk_slopes_twin(const wide *x, wide *y)
{
    layers_slopes(twin_kubelka_munk, x, y);
}

/* ---- cases ---------------------------------------------------------------------- */

static void half_space_cases(struct cases *c)
{
    struct axis_of_cases axis[] = { extreme_sigma_a(), extreme_sigma_a(), extreme_sigma_s_prime(),
                                    extreme_eta() };
    cases_product(c, axis);
}

static const double sigma_a[] = {
    0.0, 1e-290, 1e-30, 1e-16, 1e-7, 1e-3, 0.1, 1.5, 30.0, 1e4, 1e12
};
static const double sigma_s[] = { 1e-6, 0.01, 3.0, 50.0, 1e6 };
static const double d_mm[] = { 0.0, 1e-12, 1e-6, 1e-3, 0.02, 0.08, 0.3, 1.0, 10.0 };
static const double eta[] = { 0.2600001, 0.5, 1.0, 1.4, 3.0, 3.84, 3.8479999 };

/* A layer's absorption so that its reduced albedo is 2/3, or a neighbour of it among doubles. */
static double at_two_thirds(struct cases *c, double sigma_s_prime)
{
    return extreme_beside(sigma_s_prime / 2.0, (int)dice_below(&c->dice, 3) - 1);
}

static void random_layers(struct cases *c, int i)
{
    double x[6];
    for (int l = 0; l < 2; l++) {
        x[2 * l] = cases_decades(c, -20.0, 12.0);
        x[2 * l + 1] = cases_decades(c, -6.0, 6.0);
    }
    x[4] = fmin(cases_decades(c, -9.0, 3.0) / (x[0] + x[1]), 10.0);
    x[5] = i % 2 == 0 ? 1.4 : dice_between(&c->dice, 0.2601, 3.8479);
    if (i % 4 >= 2) { /* like skin */
        x[1] = cases_decades(c, 0.0, 2.0);
        x[0] = cases_decades(c, -3.0, 3.0);
        x[3] = cases_decades(c, 0.0, 2.0);
        x[2] = cases_decades(c, -3.0, 2.0);
        x[4] = cases_decades(c, -3.0, 0.0);
    }
    if (i % 8 == 3 || i % 8 == 4)
        x[0] = at_two_thirds(c, x[1]);
    if (i % 8 == 3 || i % 8 == 5)
        x[2] = at_two_thirds(c, x[3]);
    cases_add(c, x);
}

/* Where the closed form changes its expression: x = sigma_t' d and y = k d about the edges. */
static void edge_layers(struct cases *c)
{
    static const double xs[] = { 1e-6, 1e-3, 0.1, 0.5, 0.99999, 1.0, 1.00001, 2.0, 30.0 };
    static const double ys[] = { 1e-12, 1e-6,    1e-3, 0.05, 0.1, 0.2, 0.24999,
                                 0.25,  0.25001, 0.3,  0.5,  1.0, 4.0 };
    for (size_t i = 0; i < sizeof xs / sizeof *xs; i++)
        for (size_t j = 0; j < sizeof ys / sizeof *ys; j++)
            for (int k = 0; k < 8; k++) {
                double absorbed = (ys[j] / xs[i]) * (ys[j] / xs[i]) / 3.0;
                double d = cases_decades(c, -2.0, 1.0), sigma_t = xs[i] / d;
                if (absorbed < 1.0) {
                    double x[6] = { absorbed * sigma_t,
                                    (1.0 - absorbed) * sigma_t,
                                    cases_decades(c, -3.0, 2.0),
                                    cases_decades(c, -1.0, 2.0),
                                    d,
                                    1.4 };
                    cases_add(c, x);
                }
            }
}

static void two_layer_cases(struct cases *c)
{
    struct axis_of_cases axis[] = { { 11, sigma_a }, { 5, sigma_s }, { 11, sigma_a },
                                    { 5, sigma_s },  { 9, d_mm },    { 1, &eta[3] } };
    cases_product(c, axis);
    struct axis_of_cases indices[] = { { 3, &sigma_a[5] }, { 1, &sigma_s[2] }, { 5, &sigma_a[4] },
                                       { 2, &sigma_s[2] }, { 4, &d_mm[3] },    { 7, eta } };
    cases_product(c, indices);
    edge_layers(c);
    for (int i = 0; i < 8000; i++)
        random_layers(c, i);
}

static void half_space_slope_cases(struct cases *c)
{
    static const double own_eta[] = { 0.2601, 1.0, 1.4, 3.847 };
    struct axis_of_cases axis[] = {
        extreme_sigma_a(), { 5, &sigma_a[2] }, extreme_sigma_s_prime(), { 4, own_eta }
    };
    cases_product(c, axis);
    axis[1] = (struct axis_of_cases){ 1, sigma_a };
    cases_product(c, axis);
}

static void two_layer_slope_cases(struct cases *c)
{
    static const double own_sigma_a[] = { 0.0, 1e-290, 1e-16, 1e-3, 1.5, 30.0, 1e12 };
    static const double own_sigma_s[] = { 1e-6, 3.0, 1e6 };
    static const double own_d[] = { 0.0, 1e-9, 0.02, 0.3, 10.0 };
    struct axis_of_cases axis[] = { { 7, own_sigma_a }, { 3, own_sigma_s }, { 7, own_sigma_a },
                                    { 3, own_sigma_s }, { 5, own_d },       { 1, &eta[3] } };
    cases_product(c, axis);
    struct axis_of_cases indices[] = { { 2, &sigma_a[6] }, { 1, &sigma_s[2] }, { 2, &sigma_a[5] },
                                       { 1, &sigma_s[2] }, { 3, &d_mm[3] },    { 7, eta } };
    cases_product(c, indices);
    edge_layers(c);
    for (int i = 0; i < 3000; i++)
        random_layers(c, i);
}

static const struct study studies[] = {
    { "half_space_reflectance",
      { "sigma_a1", "sigma_a2", "sigma_s'", "eta" },
      4,
      { "R" },
      8.0,
      half_space_ours,
      half_space_twin,
      half_space_cases,
      NULL },
    { "two_layer_reflectance",
      { "sigma_a1", "sigma_s1'", "sigma_a2", "sigma_s2'", "d", "eta" },
      6,
      { "R" },
      64.0,
      two_layer_ours,
      two_layer_twin,
      two_layer_cases,
      NULL },
    { "half_space_slopes",
      { "sigma_a1", "sigma_a2", "sigma_s'", "eta" },
      4,
      { "by sigma_a", "by sigma_s'", "by d" },
      8.0,
      half_space_slopes_ours,
      half_space_slopes_twin,
      half_space_slope_cases,
      NULL },
    { "two_layer_slopes",
      { "sigma_a1", "sigma_s1'", "sigma_a2", "sigma_s2'", "d", "eta" },
      6,
      { "by sigma_a1", "by sigma_s1'", "by sigma_a2", "by sigma_s2'", "by d" },
      64.0,
      two_layer_slopes_ours,
      two_layer_slopes_twin,
      two_layer_slope_cases,
      NULL },
    { "kubelka_munk_reflectance",
      { "sigma_a1", "sigma_s1'", "sigma_a2", "sigma_s2'", "d", "eta" },
      6,
      { "R" },
      64.0,
      kubelka_munk_ours,
      kubelka_munk_twin,
      two_layer_cases,
      NULL },
    { "kubelka_munk_slopes",
      { "sigma_a1", "sigma_s1'", "sigma_a2", "sigma_s2'", "d", "eta" },
      6,
      { "by sigma_a1", "by sigma_s1'", "by sigma_a2", "by sigma_s2'", "by d" },
      64.0,
      kubelka_munk_slopes_ours,
      kubelka_munk_slopes_twin,
      two_layer_slope_cases,
      NULL },
};

const struct study_room study_layers = {
    "models of skin, by band (optics/half_space, two_layer, kubelka_munk)", studies,
    sizeof studies / sizeof *studies
};
