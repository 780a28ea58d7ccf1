/* study_layers.c - the closed-form models of skin, band by band, and their derivatives. */
#include <math.h>

#include "optics/dipole.h"
#include "optics/half_space.h"
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

/* x: sigma_a1, sigma_a2, sigma_s1', eta. */
static bool half_space_ours(const double *x, double *y)
{
    double own[6] = { x[0], x[2], x[1], x[2], 0.08, x[3] };
    struct medium m = medium_of(own);
    return half_space_reflectance(&m, y) == STATUS_OK;
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
};

const struct study_room study_layers = {
    "models of skin, by band (optics/half_space, optics/two_layer)", studies,
    sizeof studies / sizeof *studies
};
