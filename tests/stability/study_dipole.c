/* study_dipole.c - Eqs. 7-9 and what they are made of, against the equations as printed
 * (docs/physics.md), in wide numbers. */
#include <math.h>

#include "optics/dipole.h"
#include "tests/stability/extremes.h"
#include "tests/stability/rooms.h"
#include "tests/stability/twins.h"

/* ---- twins ---------------------------------------------------------------------- */

wide twin_F_dr(wide eta)
{
    wide one = w_div(w_int(1), eta), two = w_square(one);
    if (!w_less(eta, w_int(1)))
        return w_add(w_add(w_mul(w_dec("-1.440"), two), w_mul(w_dec("0.710"), one)),
                     w_add(w_dec("0.668"), w_mul(w_dec("0.0636"), eta)));
    return w_add(w_add(w_dec("-0.4399"), w_mul(w_dec("0.7099"), one)),
                 w_add(w_mul(w_dec("-0.3319"), two), w_mul(w_dec("0.0636"), w_mul(two, one))));
}

wide twin_A(wide eta)
{
    wide F = twin_F_dr(eta);
    return w_div(w_add(w_int(1), F), w_sub(w_int(1), F));
}

wide twin_Rs(wide eta)
{
    return w_square(w_div(w_sub(eta, w_int(1)), w_add(eta, w_int(1))));
}

struct wide_dipole {
    wide mu, absorbed, sigma_tr, z_r, z_v, A;
};

static struct wide_dipole dipole_of(wide sigma_a, wide sigma_s, wide eta)
{
    struct wide_dipole d;
    wide sigma_t = w_add(sigma_a, sigma_s), D = w_div(w_int(1), w_mul(w_int(3), sigma_t));
    d.mu = w_div(sigma_s, sigma_t);
    d.absorbed = w_div(sigma_a, sigma_t);
    d.sigma_tr = w_sqrt(w_mul(w_int(3), w_mul(sigma_a, sigma_t)));
    d.A = twin_A(eta);
    d.z_r = w_div(w_int(1), sigma_t);
    d.z_v = w_add(d.z_r, w_mul(w_int(4), w_mul(d.A, D)));
    return d;
}

/* Eq. 9: the two sources' e^(-sigma_tr z), halved. */
wide twin_half_space(wide sigma_a, wide sigma_s, wide eta)
{
    struct wide_dipole d = dipole_of(sigma_a, sigma_s, eta);
    wide real = w_exp(w_neg(w_mul(d.sigma_tr, d.z_r)));
    wide image = w_exp(w_neg(w_mul(d.sigma_tr, d.z_v)));
    return w_div(w_mul(d.mu, w_add(real, image)), w_int(2));
}

static void F_dr_twin(const wide *x, wide *y)
{
    y[0] = twin_F_dr(x[0]);
}

static void A_twin(const wide *x, wide *y)
{
    y[0] = twin_A(x[0]);
    y[1] = twin_Rs(x[0]);
}

static void init_twin(const wide *x, wide *y)
{
    struct wide_dipole d = dipole_of(x[0], x[1], x[2]);
    y[0] = d.mu;
    y[1] = d.absorbed;
    y[2] = d.sigma_tr;
    y[3] = d.z_r;
    y[4] = d.z_v;
    y[5] = d.A;
}

static void total_twin(const wide *x, wide *y)
{
    y[0] = twin_half_space(x[0], x[1], x[2]);
}

/* By subtraction, with bits to spare: sigma_a/sigma_s' may be 1e-200 and its root 1e-100. */
static void absorbed_twin(const wide *x, wide *y)
{
    mpfr_prec_t narrow = wide_bits;
    wide_bits += 1500;
    y[0] = w_sub(w_int(1), twin_half_space(x[0], x[1], x[2]));
    wide_bits = narrow;
}

/* Eq. 7. */
static wide source_profile(wide z, wide sigma_tr, wide r)
{
    wide d = w_sqrt(w_add(w_square(z), w_square(r))), x = w_mul(sigma_tr, d);
    wide top = w_mul(w_mul(z, w_add(w_int(1), x)), w_exp(w_neg(x)));
    return w_div(top, w_mul(d, w_square(d)));
}

static void profile_twin(const wide *x, wide *y)
{
    struct wide_dipole d = dipole_of(x[0], x[1], x[2]);
    wide both =
        w_add(source_profile(d.z_r, d.sigma_tr, x[3]), source_profile(d.z_v, d.sigma_tr, x[3]));
    y[0] = w_div(w_mul(d.mu, both), w_mul(w_int(4), w_pi()));
}

/* Eq. 7 summed up to r, as it stands; r/z may be 1e-20, so its square needs bits. */
static wide source_cumulative(wide z, wide sigma_tr, wide r)
{
    wide d = w_sqrt(w_add(w_square(z), w_square(r)));
    return w_sub(w_exp(w_neg(w_mul(sigma_tr, z))),
                 w_mul(w_div(z, d), w_exp(w_neg(w_mul(sigma_tr, d)))));
}

static void cumulative_twin(const wide *x, wide *y)
{
    mpfr_prec_t narrow = wide_bits;
    wide_bits += 300;
    struct wide_dipole d = dipole_of(x[0], x[1], x[2]);
    wide both = w_add(source_cumulative(d.z_r, d.sigma_tr, x[3]),
                      source_cumulative(d.z_v, d.sigma_tr, x[3]));
    y[0] = w_div(w_mul(d.mu, both), w_int(2));
    wide_bits = narrow;
}

/* ---- ours ----------------------------------------------------------------------- */

static bool F_dr_ours(const double *x, double *y)
{
    y[0] = dipole_F_dr(x[0]);
    return true;
}

static bool A_ours(const double *x, double *y)
{
    y[1] = dipole_Rs(x[0]);
    return dipole_A(x[0], &y[0]) == STATUS_OK;
}

static bool init_ours(const double *x, double *y)
{
    struct dipole d;
    if (dipole_init(x[0], x[1], x[2], &d) != STATUS_OK)
        return false;
    y[0] = d.alpha_prime;
    y[1] = d.absorbed;
    y[2] = d.sigma_tr;
    y[3] = d.z_r;
    y[4] = d.z_v;
    y[5] = d.A;
    return true;
}

static bool total_ours(const double *x, double *y)
{
    struct dipole d;
    if (dipole_init(x[0], x[1], x[2], &d) != STATUS_OK)
        return false;
    y[0] = dipole_total(&d);
    return true;
}

static bool absorbed_ours(const double *x, double *y)
{
    struct dipole d;
    if (dipole_init(x[0], x[1], x[2], &d) != STATUS_OK)
        return false;
    y[0] = dipole_absorbed_share(&d);
    return true;
}

static bool profile_ours(const double *x, double *y)
{
    struct dipole d;
    if (dipole_init(x[0], x[1], x[2], &d) != STATUS_OK)
        return false;
    dipole_profile(&d, 1, &x[3], y);
    return true;
}

static bool cumulative_ours(const double *x, double *y)
{
    struct dipole d;
    if (dipole_init(x[0], x[1], x[2], &d) != STATUS_OK)
        return false;
    dipole_cumulative(&d, 1, &x[3], y);
    return true;
}

/* ---- cases ---------------------------------------------------------------------- */

static void eta_cases(struct cases *c)
{
    struct axis_of_cases axis[] = { extreme_eta() };
    cases_product(c, axis);
    for (int i = 0; i < 4000; i++) {
        double eta = dice_between(&c->dice, 0.2601, 3.8479);
        cases_add(c, &eta);
    }
}

/* A random medium of any stiffness, and media whose reduced albedo is 2/3 or next to it,
 * or 1 and next to it. */
static void medium_at(struct cases *c, int i, double *x)
{
    x[0] = cases_decades(c, -20.0, 12.0);
    x[1] = cases_decades(c, -6.0, 6.0);
    x[2] = i % 2 == 0 ? 1.4 : dice_between(&c->dice, 0.2601, 3.8479);
    switch (i % 8) {
    case 1:
        x[0] = extreme_beside(x[1] / 2.0, (int)dice_below(&c->dice, 3) - 1);
        break;
    case 3:
        x[0] = x[1] * 1e-16;
        break;
    case 5:
        x[0] = x[1] * cases_decades(c, -3.0, 3.0);
        break;
    default:
        break;
    }
}

static void medium_cases(struct cases *c)
{
    struct axis_of_cases axis[] = { extreme_sigma_a(), extreme_sigma_s_prime(), extreme_eta() };
    cases_product(c, axis);
    for (int i = 0; i < 8000; i++) {
        double x[3];
        medium_at(c, i, x);
        cases_add(c, x);
    }
}

static void profile_cases(struct cases *c)
{
    static const double eta[] = { 0.2601, 0.5, 1.0, 1.4, 3.0, 3.8479 };
    static const double r_mm[] = { 0.0, 1e-12, 1e-6,  1e-3, 0.01, 0.1, 0.7,
                                   1.0, 10.0,  100.0, 1e3,  1e4,  1e6 };
    struct axis_of_cases axis[] = {
        extreme_sigma_a(), extreme_sigma_s_prime(), { 6, eta }, { 13, r_mm }
    };
    cases_product(c, axis);
    for (int i = 0; i < 20000; i++) {
        double x[4];
        medium_at(c, i, x);
        /* From far below to far above the depth of the source, and within the grid. */
        x[3] = fmin(cases_decades(c, -9.0, 4.0) / (x[0] + x[1]), 1e6);
        cases_add(c, x);
    }
}

static const struct study studies[] = {
    { "dipole_F_dr", { "eta" }, 1, { "F_dr" }, 8.0, F_dr_ours, F_dr_twin, eta_cases, NULL },
    { "dipole_A, dipole_Rs", { "eta" }, 1, { "A", "Rs" }, 8.0, A_ours, A_twin, eta_cases, NULL },
    { "dipole_init",
      { "sigma_a", "sigma_s'", "eta" },
      3,
      { "alpha'", "absorbed", "sigma_tr", "z_r", "z_v", "A" },
      8.0,
      init_ours,
      init_twin,
      medium_cases,
      NULL },
    { "dipole_total",
      { "sigma_a", "sigma_s'", "eta" },
      3,
      { "R" },
      8.0,
      total_ours,
      total_twin,
      medium_cases,
      NULL },
    { "dipole_absorbed_share",
      { "sigma_a", "sigma_s'", "eta" },
      3,
      { "1-R" },
      8.0,
      absorbed_ours,
      absorbed_twin,
      medium_cases,
      NULL },
    { "dipole_profile",
      { "sigma_a", "sigma_s'", "eta", "r" },
      4,
      { "R_d" },
      8.0,
      profile_ours,
      profile_twin,
      profile_cases,
      NULL },
    { "dipole_cumulative",
      { "sigma_a", "sigma_s'", "eta", "r" },
      4,
      { "P" },
      8.0,
      cumulative_ours,
      cumulative_twin,
      profile_cases,
      NULL },
};

const struct study_room study_dipole = { "one medium (optics/dipole)", studies,
                                         sizeof studies / sizeof *studies };
