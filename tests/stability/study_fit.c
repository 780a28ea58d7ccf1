/* study_fit.c - standard errors of a fit: what misfit and intervals make of a skin's curvature,
 * and refine() as a whole, beside the inverse of J^T C^-1 J and the priors in wide numbers, with J
 * by differences of the models' twins. */
#include <math.h>
#include <string.h>

#include "match/intervals.h"
#include "match/misfit.h"
#include "match/refine.h"
#include "tests/stability/rooms.h"
#include "tests/stability/twins.h"

/* layers, Cm, Bm, Ch, first_nm, step_nm, bands, placement, prior */
enum { LAYERS, CM, BM, CH, FIRST, STEP, BANDS, PLACEMENT, PRIOR, INPUTS };
enum { THREE = 3, MOST = 48 };

static const double white = 0.003, slope_ratio = 0.47;

static struct fit fit_of(const double *x)
{
    struct recipe recipe =
        recipe_default(model_find(x[LAYERS] == 1.0 ? "half-space" : "two-layer"));
    struct fit fit = fit_three(&recipe);
    if (x[PRIOR] > 0.0) {
        fit.role[SKIN_BM].prior_mean = x[BM];
        fit.role[SKIN_BM].prior_sd = x[PRIOR];
    }
    return fit;
}

/* ---- the curvature at a skin --------------------------------------------------------- */

struct bench {
    struct chromophores chromophores;
    struct quick quick;
    struct misfit_scratch scratch;
    double nm[SPECTRUM_MAX_BANDS], weight[SPECTRUM_MAX_BANDS], measured[SPECTRUM_MAX_BANDS];
    double directions[WHITENER_SCRATCH(SPECTRUM_MAX_BANDS)];
};

static bool errors_ours(const double *x, double *y)
{
    static _Alignas(MISFIT_ALIGNED) struct bench b;
    struct noise noise = { white, x[PLACEMENT], slope_ratio };
    struct fit fit = fit_of(x);
    size_t n = (size_t)x[BANDS];
    struct misfit m = { .fit = &fit,
                        .quick = &b.quick,
                        .chromophores = &b.chromophores,
                        .groups = 1,
                        .measured = { b.measured },
                        .weight = b.weight,
                        .whole = true,
                        .scratch = &b.scratch };
    struct minimum at = { .x = { x[CM], x[BM], x[CH] } };
    if (chromophores_init(x[FIRST], x[STEP], n, &b.chromophores) != STATUS_OK ||
        misfit_layout(&m) != STATUS_OK || m.n != THREE)
        return false;
    quick_init(fit.model, &b.chromophores, fit.eta, &b.quick);
    for (size_t i = 0; i < n; i++) {
        b.nm[i] = x[FIRST] + (double)i * x[STEP];
        b.weight[i] = 1.0;
        b.measured[i] = 0.3;
    }
    whitener_init(&noise, 1, b.nm, b.weight, n, b.directions, &m.whitener);
    misfit_evaluate(&m, at.x, &at.normal);
    minimum_covariance(&m, &at);
    for (size_t i = 0; i < THREE; i++)
        y[i] = minimum_se(&m, &at, (enum skin_parameter)i);
    return true;
}

/* Cm, Bm, Ch, nm, layers -> R of a skin whose other members are tissue_of()'s. */
static wide reflectance(const wide *x)
{
    wide eta = w(1.4), zero = w_int(0); /* the double that the tissue has */
    wide of[] = { x[0], x[1], x[2], w_dec("0.75"), zero, zero, x[3] };
    struct twin_skin s = twin_skin_of(of);
    if (w_double(x[4]) == 1.0) {
        wide entering = w_sub(w_int(1), twin_Rs(eta));
        return w_mul(entering, twin_half_space(w_add(s.sigma_a1, s.sigma_a2), s.sigma_s1, eta));
    }
    wide medium[] = { s.sigma_a1, s.sigma_s1, s.sigma_a2, s.sigma_s2, w(0.08), eta };
    return twin_two_layer(medium);
}

/* J, u = C^-1 J and the inverse P of J^T u + priors. */
struct curvature {
    size_t n;
    wide J[THREE][MOST], u[THREE][MOST], H[THREE][THREE], P[THREE][THREE];
};

static void slopes(const wide *x, struct curvature *c)
{
    c->n = (size_t)w_double(x[BANDS]);
    for (size_t b = 0; b < c->n; b++) {
        /* The double that the grid has. */
        double nm = w_double(x[FIRST]) + (double)b * w_double(x[STEP]);
        for (size_t i = 0; i < THREE; i++) {
            c->J[i][b] = w_int(0);
            size_t mark = wide_mark();
            wide at[] = { x[CM], x[BM], x[CH], w(nm), x[LAYERS] };
            w_add_to(c->J[i][b], twin_slope(reflectance, at, 5, i, w_int(1)));
            wide_release(mark);
        }
    }
}

static void whiten(const wide *x, struct curvature *c)
{
    static wide m[MOST * (MOST + THREE)];
    size_t n = c->n, columns = n + THREE;
    static wide slope[MOST];
    wide place2 = w_square(x[PLACEMENT]), ratio = w(slope_ratio);
    for (size_t b = 0; b < n; b++) {
        double nm = w_double(x[FIRST]) + (double)b * w_double(x[STEP]);
        wide off = w_div(w_sub(w(nm), w_int(550)), w_int(150));
        slope[b] = w_mul(ratio, w_mul(w_sqrt(w_int(3)), off));
    }
    for (size_t a = 0; a < n; a++) {
        for (size_t b = 0; b < n; b++) {
            wide c_ab = w_mul(place2, w_add(w_int(1), w_mul(slope[a], slope[b])));
            m[a * columns + b] = a == b ? w_add(c_ab, w_square(w(white))) : c_ab;
        }
        for (size_t i = 0; i < THREE; i++)
            m[a * columns + n + i] = w_copy(c->J[i][a]);
    }
    twin_eliminate(m, n, columns);
    for (size_t b = 0; b < n; b++)
        for (size_t i = 0; i < THREE; i++)
            c->u[i][b] = m[b * columns + n + i];
}

static void curvature_of(const wide *x, struct curvature *c)
{
    wide m[THREE * 2 * THREE];
    slopes(x, c);
    whiten(x, c);
    for (size_t i = 0; i < THREE; i++)
        for (size_t j = 0; j < THREE; j++) {
            c->H[i][j] = w_int(0);
            for (size_t b = 0; b < c->n; b++)
                w_add_to(c->H[i][j], w_mul(c->J[i][b], c->u[j][b]));
            m[i * 2 * THREE + THREE + j] = w_int(i == j ? 1 : 0);
        }
    if (!w_is_zero(x[PRIOR]))
        w_add_to(c->H[1][1], w_div(w_int(1), w_square(x[PRIOR])));
    for (size_t i = 0; i < THREE; i++)
        for (size_t j = 0; j < THREE; j++)
            m[i * 2 * THREE + j] = w_copy(c->H[i][j]);
    twin_eliminate(m, THREE, 2 * THREE);
    for (size_t i = 0; i < THREE; i++)
        for (size_t j = 0; j < THREE; j++)
            c->P[i][j] = m[i * 2 * THREE + THREE + j];
}

/* Sum of |J dP[i][i]/dJ| / 2. */
static wide by_slopes(const struct curvature *c, size_t i)
{
    wide sum = w_int(0);
    for (size_t b = 0; b < c->n; b++) {
        size_t mark = wide_mark();
        wide moved = w_int(0);
        for (size_t k = 0; k < THREE; k++)
            w_add_to(moved, w_mul(c->u[k][b], c->P[k][i]));
        for (size_t k = 0; k < THREE; k++)
            w_add_to(sum, w_abs(w_mul(c->J[k][b], w_mul(moved, c->P[k][i]))));
        wide_release(mark);
    }
    return sum;
}

/* Conditions are by the derivatives and by the elements of the curvature, which is an interface
 * in doubles; the skin counts as given. */
static void errors_of(const wide *x, wide *se, wide *sensitivity)
{
    static const double range[THREE] = { TISSUE_CM_MAX, 1.0, TISSUE_CH_MAX - TISSUE_CH_MIN };
    static struct curvature c;
    curvature_of(x, &c);
    for (size_t i = 0; i < THREE; i++) {
        wide sum = w_int(0);
        for (size_t k = 0; k < THREE; k++)
            for (size_t l = 0; l < THREE; l++)
                w_add_to(sum, w_abs(w_mul(c.P[i][k], w_mul(c.H[k][l], c.P[l][i]))));
        se[i] = w_sqrt(c.P[i][i]);
        sum = w_add(w_div(sum, w_int(2)), by_slopes(&c, i));
        sensitivity[i] = w_div(sum, se[i]);
        if (w_less(w(range[i]), se[i]))
            se[i] = w(range[i]);
    }
}

static void errors_twin(const wide *x, wide *y)
{
    wide unused[THREE];
    errors_of(x, y, unused);
}

static void errors_sensitivity(const wide *x, wide *sum)
{
    wide unused[THREE];
    errors_of(x, unused, sum);
}

/* Grids wide and narrow, down to bands that are equal but for rounding. */
static void fits(struct cases *c)
{
    static const double grids[][3] = {
        { 400, 10, 31 }, { 400, 100, 4 },      { 450, 150, 3 },
        { 545, 1, 12 },  { 545, 0x1p-10, 12 }, { 545, 0x1p-30, 12 },
    };
    for (int i = 0; i < 120; i++) {
        const double *grid = grids[i % 6];
        double x[INPUTS] = { [LAYERS] = i / 6 % 2 + 1, [FIRST] = grid[0], grid[1], grid[2] };
        x[CM] = i % 5 == 0 ? cases_decades(c, -20.0, -3.0) : cases_decades(c, -3.0, -0.31);
        x[BM] = dice_between(&c->dice, 0.001, 0.999);
        x[CH] = cases_decades(c, -2.9, -1.01);
        x[PLACEMENT] = i % 4 == 0 ? 0.0 : cases_decades(c, -4.0, 0.0);
        x[PRIOR] = i % 3 == 0 ? cases_decades(c, -3.0, 0.0) : 0.0;
        cases_add(c, x);
    }
}

/* ---- a whole fit ------------------------------------------------------------------------- */

/* refine() of the skin's own spectrum. */
static bool refined_of(const double *x, struct refined *ret)
{
    static struct chromophores c;
    static double scratch[MEDIUM_SCRATCH(SPECTRUM_MAX_BANDS)];
    struct fit fit = fit_of(x);
    struct noise noise = { white, x[PLACEMENT], slope_ratio };
    struct spectrum s = {
        .first_nm = x[FIRST], .step_nm = x[STEP], .n = (size_t)x[BANDS], .specular = SPECULAR_SCE
    };
    struct tissue t = tissue_of(x[CM], x[BM], x[CH]);
    memset(ret, 0, sizeof *ret); /* the bytes between members are compared too */
    return chromophores_init(x[FIRST], x[STEP], s.n, &c) == STATUS_OK &&
           model_reflectance(fit.model, &t, &c, scratch, s.value) == STATUS_OK &&
           refine(&fit, &noise, &s, 1, NULL, 0, ret, NULL) == STATUS_OK;
}

static bool refined_ours(const double *x, double *y)
{
    static struct refined r;
    if (!refined_of(x, &r))
        return false;
    memcpy(y, r.se, THREE * sizeof *y);
    return true;
}

/* At the skin that refine() found. */
static void refined_twin(const wide *x, wide *y)
{
    static struct refined r;
    double chosen[INPUTS];
    wide at[INPUTS], unused[THREE];
    for (size_t i = 0; i < INPUTS; i++) {
        chosen[i] = w_double(x[i]);
        at[i] = x[i];
    }
    (void)refined_of(chosen, &r);
    for (size_t i = 0; i < THREE; i++)
        at[CM + i] = w(r.value[i]);
    errors_of(at, y, unused);
}

/* Skins whose pigments can be told. */
static void told(struct cases *c)
{
    for (int i = 0; i < 80; i++) {
        double x[INPUTS] = { [LAYERS] = i % 2 + 1, [FIRST] = 400.0, 10.0, 31.0 };
        x[CM] = cases_decades(c, -2.5, -0.5);
        x[BM] = dice_between(&c->dice, 0.1, 0.9);
        x[CH] = cases_decades(c, -2.5, -1.2);
        x[PLACEMENT] = i % 4 < 2 ? 0.0 : 0.009;
        x[PRIOR] = i % 3 == 0 ? 0.1 : 0.0;
        cases_add(c, x);
    }
}

/* The curvature is that of the point before the last step, which promised to lower chi^2 by less
 * than 1e-3: so far, in standard errors, the fit itself is from there. */
#define REFINED_BAR (0.0316 / 0x1p-53)

/* 1 where every number is what the header says it is, and the same again. */
static bool sound_ours(const double *x, double *y)
{
    static struct refined r, again;
    struct fit fit = fit_of(x);
    if (!refined_of(x, &r) || !refined_of(x, &again))
        return false;
    y[0] = memcmp(&r, &again, sizeof r) == 0 ? 1.0 : 0.0;
    y[1] = y[2] = 1.0;
    for (size_t i = 0; i < THREE; i++) {
        const struct skin_role *role = &fit.role[i];
        if (!(r.se[i] >= 0.0 && r.se[i] <= role->hi - role->lo && r.repeat_se[i] <= r.se[i]))
            y[1] = 0.0;
        if (!(role->lo <= r.lo[i] && r.lo[i] <= r.value[i] && r.value[i] <= r.hi[i] &&
              r.hi[i] <= role->hi))
            y[2] = 0.0;
    }
    return true;
}

static void sound_twin(const wide *x, wide *y)
{
    (void)x;
    for (int i = 0; i < 3; i++)
        y[i] = w_int(1);
}

/* With Cm and Bm at their ends as well: without melanin nothing is told of its kind. */
static void collinear(struct cases *c)
{
    static const double grids[][3] = { { 400, 10, 31 },        { 450, 150, 3 },
                                       { 545, 0x1p-20, 31 },   { 545, 0x1p-40, 31 },
                                       { 545, 0x1p-43, 1024 }, { 400, 0.25, 1024 } };
    static const double Cm[] = { 0.0, 1e-300, 1e-17, 1e-6, 0.05, 0.5 }, Bm[] = { 0.0, 0.5, 1.0 };
    static const double placement[] = { 0.0, 0.01, 1.0 };
    for (int layers = 1; layers <= 2; layers++)
        for (size_t g = 0; g < 6; g++)
            for (size_t i = 0; i < 6; i++)
                for (size_t j = 0; j < 3; j++)
                    for (size_t k = 0; k < 3; k++)
                        cases_add(c, (double[]){ layers, Cm[i], Bm[j], k == 0 ? 0.001 : 0.03,
                                                 grids[g][0], grids[g][1], grids[g][2],
                                                 placement[k], j == 1 && k == 1 ? 0.1 : 0.0 });
}

#define FIT "layers", "Cm", "Bm", "Ch", "first_nm", "step_nm", "bands", "placement", "prior"
static const struct study studies[] = {
    { "minimum_se",
      { FIT },
      0,
      { "Cm", "Bm", "Ch" },
      64.0,
      errors_ours,
      errors_twin,
      fits,
      errors_sensitivity },
    { "refine, se",
      { FIT },
      0,
      { "Cm", "Bm", "Ch" },
      REFINED_BAR,
      refined_ours,
      refined_twin,
      told,
      NULL },
    { "refine, collinear",
      { FIT },
      0,
      { "same again", "se in range", "interval in range" },
      0.0,
      sound_ours,
      sound_twin,
      collinear,
      NULL },
};

const struct study_room study_fit = { "a fit (match/misfit, intervals, refine)", studies,
                                      sizeof studies / sizeof *studies };
