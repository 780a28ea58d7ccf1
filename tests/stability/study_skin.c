/* study_skin.c - from pigments to coefficients and to the models' reflectance, and the
 * paper's own computation. */
#include <math.h>
#include <string.h>

#include "optics/chromophores.h"
#include "optics/model.h"
#include "optics/paper.h"
#include "optics/quick.h"
#include "optics/tissue.h"
#include "tests/stability/extremes.h"
#include "tests/stability/rooms.h"
#include "tests/stability/twins.h"

/* ---- pigments by wavelength ------------------------------------------------------- */

static bool pigments_ours(const double *x, double *y)
{
    y[0] = eumelanin_sigma_a(x[0]);
    y[1] = pheomelanin_sigma_a(x[0]);
    y[2] = base_sigma_a(x[0]);
    y[3] = skin_sigma_s_prime(x[0]);
    y[4] = oxyhaemoglobin_sigma_a(x[0]);
    y[5] = deoxyhaemoglobin_sigma_a(x[0]);
    return !isnan(y[4]);
}

static void pigments_twin(const wide *x, wide *y)
{
    y[0] = twin_eumelanin(x[0]);
    y[1] = twin_pheomelanin(x[0]);
    y[2] = twin_base(x[0]);
    y[3] = twin_scattering(x[0]);
    y[4] = twin_blood(x[0], true);
    y[5] = twin_blood(x[0], false);
}

static bool epsilon_ours(const double *x, double *y)
{
    y[0] = oxyhaemoglobin_epsilon(x[0]);
    y[1] = deoxyhaemoglobin_epsilon(x[0]);
    return !isnan(y[0]);
}

static void epsilon_twin(const wide *x, wide *y)
{
    y[0] = twin_epsilon(x[0], true);
    y[1] = twin_epsilon(x[0], false);
}

static void wavelengths(struct cases *c)
{
    for (int nm = (int)CHROMOPHORES_MIN_NM; nm <= (int)CHROMOPHORES_MAX_NM; nm++)
        for (int side = -1; side <= 1; side++) {
            double x = extreme_beside(nm, side);
            cases_add(c, &x);
        }
    for (int i = 0; i < 2000; i++) {
        double x = dice_between(&c->dice, CHROMOPHORES_MIN_NM, CHROMOPHORES_MAX_NM);
        cases_add(c, &x);
    }
}

/* x: first_nm, step_nm, n, band. */
static bool grid_ours(const double *x, double *y)
{
    static struct chromophores c; /* 57 kB */
    size_t i = (size_t)x[3];
    if (chromophores_init(x[0], x[1], (size_t)x[2], &c) != STATUS_OK)
        return false;
    y[0] = c.eumelanin[i];
    y[1] = c.base[i];
    y[2] = c.oxy[i];
    y[3] = c.sigma_s_prime[i];
    y[4] = c.log_nm[i];
    return true;
}

static void grid_twin(const wide *x, wide *y)
{
    wide nm = w_add(x[0], w_mul(x[3], x[1]));
    y[0] = twin_eumelanin(nm);
    y[1] = twin_base(nm);
    y[2] = twin_blood(nm, true);
    y[3] = twin_scattering(nm);
    y[4] = w_log(w_div(nm, w_int(500)));
}

static void grids(struct cases *c)
{
    static const double grid[][3] = { { 400, 10, 31 }, { 380, 10, 37 },     { 360, 5, 85 },
                                      { 360, 1, 471 }, { 250, 0.75, 1001 }, { 400.1, 3.3, 91 },
                                      { 1000, 1, 1 } };
    for (size_t i = 0; i < sizeof grid / sizeof *grid; i++)
        for (double band = 0; band < grid[i][2]; band++)
            cases_add(c, (double[]){ grid[i][0], grid[i][1], grid[i][2], band });
}

/* ---- a skin ---------------------------------------------------------------------- */

/* x: Cm, Bm, Ch, gamma, scattering_a, scattering_b, nm [, epidermis_mm, eta, f1 .. f4]
 * A model takes a skin's coefficients in as doubles: they are inputs on the way.  f1 .. f4, always
 * 1, multiply sigma_a1, sigma_s1', sigma_a2, sigma_s2' in the twin, so that they count. */
static struct tissue tissue_at(const double *x)
{
    struct tissue t = tissue_of(x[0], x[1], x[2]);
    t.gamma = x[3];
    t.scattering_a = x[4];
    t.scattering_b = x[5];
    return t;
}

static bool medium_ours(const double *x, double *y)
{
    static struct chromophores c;
    struct tissue t = tissue_at(x);
    double scratch[MEDIUM_SCRATCH(1)];
    struct medium m;
    if (chromophores_init(x[6], 10.0, 1, &c) != STATUS_OK ||
        tissue_medium(&t, &c, scratch, &m) != STATUS_OK)
        return false;
    y[0] = m.sigma_a_epidermis[0];
    y[1] = m.sigma_a_dermis[0];
    y[2] = m.sigma_s_prime_epidermis[0];
    y[3] = m.sigma_s_prime_dermis[0];
    return true;
}

static void medium_twin(const wide *x, wide *y)
{
    struct twin_skin s = twin_skin_of(x);
    y[0] = s.sigma_a1;
    y[1] = s.sigma_a2;
    y[2] = s.sigma_s1;
    y[3] = s.sigma_s2;
}

static bool model_ours(const char *name, const double *x, double *R)
{
    static struct chromophores c;
    struct tissue t = tissue_at(x);
    double scratch[MEDIUM_SCRATCH(1)];
    t.epidermis_mm = x[7];
    t.eta = x[8];
    return chromophores_init(x[6], 10.0, 1, &c) == STATUS_OK &&
           model_reflectance(model_find(name), &t, &c, scratch, R) == STATUS_OK;
}

static bool half_space_ours(const double *x, double *y)
{
    return model_ours("half-space", x, y);
}

static bool two_layer_ours(const double *x, double *y)
{
    return model_ours("two-layer", x, y);
}

static struct twin_skin factored_skin(const wide *x)
{
    struct twin_skin s = twin_skin_of(x);
    s.sigma_a1 = w_mul(s.sigma_a1, x[9]);
    s.sigma_s1 = w_mul(s.sigma_s1, x[10]);
    s.sigma_a2 = w_mul(s.sigma_a2, x[11]);
    s.sigma_s2 = w_mul(s.sigma_s2, x[12]);
    return s;
}

static void half_space_twin(const wide *x, wide *y)
{
    struct twin_skin s = factored_skin(x);
    wide entering = w_sub(w_int(1), twin_Rs(x[8]));
    y[0] = w_mul(entering, twin_half_space(w_add(s.sigma_a1, s.sigma_a2), s.sigma_s1, x[8]));
}

static void two_layer_twin(const wide *x, wide *y)
{
    struct twin_skin s = factored_skin(x);
    wide of[] = { s.sigma_a1, s.sigma_s1, s.sigma_a2, s.sigma_s2, x[7], x[8] };
    y[0] = twin_two_layer(of);
}

/* Derivatives by the first six of x and epidermis_mm; b's place: after a's. */
static bool slopes_ours(const char *name, const double *x, double *y)
{
    static struct chromophores c;
    struct tissue t = tissue_at(x);
    double scratch[MODEL_SLOPES_SCRATCH(1)], R, J[TISSUE_PARAMETERS];
    t.epidermis_mm = x[7];
    t.eta = x[8];
    if (chromophores_init(x[6], 10.0, 1, &c) != STATUS_OK ||
        model_slopes(model_find(name), &t, &c, scratch, &R, J) != STATUS_OK)
        return false;
    y[0] = J[TISSUE_CM];
    y[1] = J[TISSUE_BM];
    y[2] = J[TISSUE_CH];
    y[3] = J[TISSUE_GAMMA];
    y[4] = J[TISSUE_SCATTERING_A];
    y[5] = J[TISSUE_SCATTERING_B];
    y[6] = J[TISSUE_EPIDERMIS_MM];
    return true;
}

static bool half_space_slopes_ours(const double *x, double *y)
{
    return slopes_ours("half-space", x, y);
}

static bool two_layer_slopes_ours(const double *x, double *y)
{
    return slopes_ours("two-layer", x, y);
}

/* The vectors' formulas for inversion, where they apply. */
static bool quick_ours(const char *name, const double *x, double *y)
{
    static struct chromophores c;
    struct tissue t = tissue_at(x);
    double scratch[QUICK_SCRATCH(1)], R[QUICK_STRIDE(1)], J[TISSUE_PARAMETERS * QUICK_STRIDE(1)];
    static const enum tissue_parameter order[] = { TISSUE_CM,           TISSUE_BM,
                                                   TISSUE_CH,           TISSUE_GAMMA,
                                                   TISSUE_SCATTERING_A, TISSUE_SCATTERING_B,
                                                   TISSUE_EPIDERMIS_MM };
    t.epidermis_mm = x[7];
    t.eta = x[8];
    if (chromophores_init(x[6], 10.0, 1, &c) != STATUS_OK ||
        quick_slopes(model_find(name), &t, &c, QUICK_WANT_ALL, scratch, R, J) != STATUS_OK)
        return false;
    for (size_t i = 0; i < sizeof order / sizeof *order; i++)
        y[i] = J[(size_t)order[i] * QUICK_STRIDE(1)];
    y[7] = R[0];
    return true;
}

static bool quick_half_space_ours(const double *x, double *y)
{
    return quick_ours("half-space", x, y);
}

static bool quick_two_layer_ours(const double *x, double *y)
{
    return quick_ours("two-layer", x, y);
}

static wide half_space_R(const wide *x)
{
    wide y[1];
    half_space_twin(x, y);
    return y[0];
}

static wide two_layer_R(const wide *x)
{
    wide y[1];
    two_layer_twin(x, y);
    return y[0];
}

/* Fractions may leave 0..1 by next to nothing; a and b count only where a is not 0. */
static void slopes_twin(twin_of_one *R, const wide *x, wide *y)
{
    for (size_t i = 0; i < 4; i++)
        y[i] = twin_slope(R, x, 13, i, w_int(1));
    bool own = !w_is_zero(x[4]);
    y[4] = own ? twin_slope(R, x, 13, 4, x[4]) : w_int(0);
    y[5] = own ? twin_slope(R, x, 13, 5, w_int(1)) : w_int(0);
    y[6] = twin_slope(R, x, 13, 7, w_int(1));
}

static void half_space_slopes_twin(const wide *x, wide *y)
{
    slopes_twin(half_space_R, x, y);
}

static void two_layer_slopes_twin(const wide *x, wide *y)
{
    slopes_twin(two_layer_R, x, y);
}

static void quick_half_space_twin(const wide *x, wide *y)
{
    slopes_twin(half_space_R, x, y);
    y[7] = half_space_R(x);
}

static void quick_two_layer_twin(const wide *x, wide *y)
{
    slopes_twin(two_layer_R, x, y);
    y[7] = two_layer_R(x);
}

static double fraction(struct cases *c)
{
    static const double ends[] = { 0.0, 1.0, 0.5, 1e-20, 0x1p-53, 1.0 - 0x1p-53 };
    if (dice_below(&c->dice, 3) == 0)
        return ends[dice_below(&c->dice, sizeof ends / sizeof *ends)];
    if (dice_below(&c->dice, 2) == 0)
        return cases_decades(c, -6.0, 0.0);
    return dice_between(&c->dice, 0.0, 1.0);
}

static void one_skin(struct cases *c, double *x)
{
    for (int i = 0; i < 4; i++)
        x[i] = fraction(c);
    x[4] = dice_below(&c->dice, 2) == 0 ? 0.0 : cases_decades(c, -6.0, 6.0);
    x[5] = dice_between(&c->dice, -10.0, 10.0);
    x[6] = dice_between(&c->dice, CHROMOPHORES_MIN_NM, CHROMOPHORES_MAX_NM);
    if (dice_below(&c->dice, 2) == 0)
        x[6] = 10.0 * round(x[6] / 10.0);
}

static void skins(struct cases *c)
{
    for (int i = 0; i < 20000; i++) {
        double x[7];
        one_skin(c, x);
        cases_add(c, x);
    }
}

static void some_whole_skins(struct cases *c, int n)
{
    static const double d_mm[] = { 0.0, 1e-9, 0.02, 0.08, 0.15, 10.0 };
    static const double eta[] = { 0.2601, 1.0, 1.4, 1.4, 1.4, 3.8479 };
    for (int i = 0; i < n; i++) {
        double x[13] = { [9] = 1.0, 1.0, 1.0, 1.0 };
        one_skin(c, x);
        x[7] = d_mm[dice_below(&c->dice, 6)];
        x[8] = eta[dice_below(&c->dice, 6)];
        cases_add(c, x);
    }
}

static void whole_skins(struct cases *c)
{
    some_whole_skins(c, 6000);
}

static void fewer_whole_skins(struct cases *c)
{
    some_whole_skins(c, 400);
}

/* What people are like: where the quick formulas are meant for. */
static void people(struct cases *c)
{
    for (int i = 0; i < 300; i++) {
        double x[13] = { [9] = 1.0, 1.0, 1.0, 1.0 };
        x[0] = cases_decades(c, -3.0, -0.3);
        x[1] = dice_between(&c->dice, 0.0, 1.0);
        x[2] = cases_decades(c, -3.0, -1.0);
        x[3] = dice_between(&c->dice, 0.0, 1.0);
        x[4] = i % 2 == 0 ? 0.0 : dice_between(&c->dice, 3.0, 20.0);
        x[5] = dice_between(&c->dice, 0.0, 3.0);
        x[6] = dice_between(&c->dice, 380.0, 740.0);
        x[7] = dice_between(&c->dice, 0.03, 0.15);
        x[8] = 1.4;
        cases_add(c, x);
    }
}

/* ---- the paper's Table 2 ----------------------------------------------------------- */

/* The constants of optics/paper.c, as decimals: made by tests/reference/paper_constants.py. */
static const char *const pigment[6][3] = {
    { "24.23577298476", "51.09420167173", "103.92814137612" }, /* eumelanin */
    { "8.53105606770", "28.68573967648", "79.76086457641" },   /* pheomelanin */
    { "0.02242746617", "0.04626873616", "0.13536756601" },     /* base */
    { "7.91817658989", "26.97342444302", "129.60233280121" },  /* oxy */
    { "21.48488343511", "20.62771392261", "222.96143095639" }, /* deoxy */
    { "4.55420533884", "6.22089362088", "9.75595232572" },     /* scattering */
};

static wide coded(wide percent)
{
    wide x = w_div(percent, w_int(100));
    if (!w_less(w_dec("0.0031308"), x))
        return w_mul(w_dec("12.92"), x);
    wide root = w_pow(x, w_div(w_int(10), w_int(24)));
    return w_sub(w_mul(w_dec("1.055"), root), w_dec("0.055"));
}

/* x: Cm, Bm, Ch, gamma, eta */
static void paper_twin(const wide *x, wide *sigma_a, wide *sigma_s)
{
    wide one = w_int(1);
    wide share[5] = { w_mul(x[0], x[1]), w_mul(x[0], w_sub(one, x[1])),
                      w_sub(w_int(2), w_add(x[0], x[2])), w_mul(x[2], x[3]),
                      w_mul(x[2], w_sub(one, x[3])) };
    for (int i = 0; i < 3; i++) {
        wide sum = w_int(0);
        for (int j = 0; j < 5; j++)
            sum = w_add(sum, w_mul(share[j], w_dec(pigment[j][i])));
        sigma_a[i] = coded(sum);
        sigma_s[i] = coded(w_dec(pigment[5][i]));
    }
}

static void paper_coefficients_twin(const wide *x, wide *y)
{
    paper_twin(x, y, y + 3);
}

static void paper_rgb_twin(const wide *x, wide *y)
{
    wide sigma_a[3], sigma_s[3];
    paper_twin(x, sigma_a, sigma_s);
    for (int i = 0; i < 3; i++)
        y[i] = twin_half_space(sigma_a[i], sigma_s[i], x[4]);
}

static struct tissue paper_tissue(const double *x)
{
    struct tissue t = tissue_of(x[0], x[1], x[2]);
    t.gamma = x[3];
    t.eta = x[4];
    return t;
}

static bool paper_coefficients_ours(const double *x, double *y)
{
    struct tissue t = paper_tissue(x);
    return paper_coefficients(&t, y, y + 3) == STATUS_OK;
}

static bool paper_rgb_ours(const double *x, double *y)
{
    struct tissue t = paper_tissue(x);
    return paper_rgb(&t, y) == STATUS_OK;
}

static void paper_skins(struct cases *c)
{
    for (int i = 0; i < 8000; i++) {
        double x[5];
        for (int j = 0; j < 4; j++)
            x[j] = fraction(c);
        x[4] = i % 2 == 0 ? 1.4 : dice_between(&c->dice, 0.2601, 3.8479);
        cases_add(c, x);
    }
}

/* What its header promises is 1e-12 of the derivatives. */
#define QUICK_BAR (1e-12 / 0x1p-53)

#define SKIN "Cm", "Bm", "Ch", "gamma", "a", "b", "nm"
static const struct study studies[] = {
    { "sigma_a and sigma_s' of nm",
      { "nm" },
      1,
      { "eumelanin", "pheomelanin", "base", "sigma_s'", "oxy", "deoxy" },
      8.0,
      pigments_ours,
      pigments_twin,
      wavelengths,
      NULL },
    { "haemoglobin's epsilon",
      { "nm" },
      1,
      { "oxy", "deoxy" },
      8.0,
      epsilon_ours,
      epsilon_twin,
      wavelengths,
      NULL },
    { "chromophores_init",
      { "first_nm", "step_nm", "n", "band" },
      2,
      { "eumelanin", "base", "oxy", "sigma_s'", "log_nm" },
      8.0,
      grid_ours,
      grid_twin,
      grids,
      NULL },
    { "tissue_medium",
      { SKIN },
      7,
      { "sigma_a1", "sigma_a2", "sigma_s1'", "sigma_s2'" },
      8.0,
      medium_ours,
      medium_twin,
      skins,
      NULL },
    { "model_reflectance half-space",
      { SKIN, "d", "eta", "f1", "f2", "f3", "f4" },
      13,
      { "R" },
      8.0,
      half_space_ours,
      half_space_twin,
      whole_skins,
      NULL },
    { "model_reflectance two-layer",
      { SKIN, "d", "eta", "f1", "f2", "f3", "f4" },
      13,
      { "R" },
      64.0,
      two_layer_ours,
      two_layer_twin,
      whole_skins,
      NULL },
    { "model_slopes half-space",
      { SKIN, "d", "eta", "f1", "f2", "f3", "f4" },
      13,
      { "Cm", "Bm", "Ch", "gamma", "a", "b", "d" },
      8.0,
      half_space_slopes_ours,
      half_space_slopes_twin,
      fewer_whole_skins,
      NULL },
    { "model_slopes two-layer",
      { SKIN, "d", "eta", "f1", "f2", "f3", "f4" },
      13,
      { "Cm", "Bm", "Ch", "gamma", "a", "b", "d" },
      64.0,
      two_layer_slopes_ours,
      two_layer_slopes_twin,
      fewer_whole_skins,
      NULL },
    { "quick_slopes half-space",
      { SKIN, "d", "eta", "f1", "f2", "f3", "f4" },
      13,
      { "Cm", "Bm", "Ch", "gamma", "a", "b", "d", "R" },
      QUICK_BAR,
      quick_half_space_ours,
      quick_half_space_twin,
      people,
      NULL },
    { "quick_slopes two-layer",
      { SKIN, "d", "eta", "f1", "f2", "f3", "f4" },
      13,
      { "Cm", "Bm", "Ch", "gamma", "a", "b", "d", "R" },
      QUICK_BAR,
      quick_two_layer_ours,
      quick_two_layer_twin,
      people,
      NULL },
    { "paper_coefficients",
      { "Cm", "Bm", "Ch", "gamma", "eta" },
      5,
      { "sigma_a R", "sigma_a G", "sigma_a B", "sigma_s' R", "sigma_s' G", "sigma_s' B" },
      8.0,
      paper_coefficients_ours,
      paper_coefficients_twin,
      paper_skins,
      NULL },
    { "paper_rgb",
      { "Cm", "Bm", "Ch", "gamma", "eta" },
      5,
      { "R", "G", "B" },
      8.0,
      paper_rgb_ours,
      paper_rgb_twin,
      paper_skins,
      NULL },
};

const struct study_room study_skin = { "a skin (optics/chromophores, tissue, model, paper)",
                                       studies, sizeof studies / sizeof *studies };
