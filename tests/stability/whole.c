/* whole.c - seeded skins through transport, random walks and quick formulas; whole fits. */
#include "tests/stability/whole.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "match/refine.h"
#include "match/skin_fit.h"
#include "optics/model.h"
#include "optics/monte_carlo.h"
#include "optics/quick.h"
#include "tests/support/dice.h"
#include "tests/support/figures.h"

/* Those of docs/examples/skin.csv. */
enum { BANDS = 31 };
#define FIRST_NM 400.0
#define STEP_NM 10.0

/* ---- outputs, and skins to make them of --------------------------------------------- */

struct outputs {
    double *value;
    size_t n, room;
    bool full; /* there was no memory for more */
};

static void put(struct outputs *out, const double *value, size_t n)
{
    if (out->n + n > out->room) {
        size_t room = 2 * (out->n + n);
        double *more = realloc(out->value, room * sizeof *more);
        if (more == NULL) {
            out->full = true;
            return;
        }
        out->value = more;
        out->room = room;
    }
    memcpy(out->value + out->n, value, n * sizeof *value);
    out->n += n;
}

static void put_refused(struct outputs *out)
{
    put(out, &(double){ NAN }, 1);
}

static double *taken(struct outputs *out, uint64_t *n)
{
    *n = out->n;
    if (!out->full)
        return out->value;
    free(out->value);
    return NULL;
}

static const struct chromophores *bands(void)
{
    static struct chromophores c;
    return chromophores_init(FIRST_NM, STEP_NM, BANDS, &c) == STATUS_OK ? &c : NULL;
}

/* What people are like; every other one with scattering of its own. */
static struct tissue person(struct dice *dice, size_t i)
{
    double Cm = pow(10.0, dice_between(dice, -3.0, -0.5)); /* one by one: the order is fixed */
    double Bm = dice_between(dice, 0.0, 1.0);
    double Ch = pow(10.0, dice_between(dice, -3.0, -1.0));
    struct tissue t = tissue_of(Cm, Bm, Ch);
    t.gamma = dice_between(dice, 0.3, 0.95);
    t.epidermis_mm = dice_between(dice, 0.03, 0.15);
    t.scattering_a = i % 2 == 0 ? 0.0 : dice_between(dice, 3.0, 20.0);
    t.scattering_b = dice_between(dice, 0.0, 3.0);
    return t;
}

/* ---- transport ---------------------------------------------------------------------- */

static double *transport_outputs(uint64_t *n)
{
    enum { SKINS = 100 };
    static double scratch[MODEL_SLOPES_SCRATCH(BANDS)], R[BANDS], J[TISSUE_PARAMETERS * BANDS];
    struct dice dice = { 1 };
    struct outputs out = { 0 };
    for (size_t i = 0; i < SKINS; i++) {
        struct tissue t = person(&dice, i);
        if (model_slopes(model_find("transport-8"), &t, bands(), scratch, R, J) != STATUS_OK) {
            put_refused(&out);
            continue;
        }
        put(&out, R, BANDS);
        put(&out, J, TISSUE_PARAMETERS * BANDS);
    }
    return taken(&out, n);
}

/* The grid of extremes that transport is held against its equations on. */
static double *transport_extremes(uint64_t *n)
{
    enum { STREAMS = 8, FIRST_COLUMN = 1, SLOPES = 5 };
    struct outputs out = { 0 };
    struct figures f;
    if (!figures_read("tests/reference/transport_exact.csv", &f))
        return NULL;
    for (size_t row = 0; row < f.rows; row++) {
        double x[6], y[1 + SLOPES];
        for (size_t i = 0; i < 6; i++)
            x[i] = figures_at(&f, row, FIRST_COLUMN + i);
        struct medium m = { 1, x[4], x[5], &x[0], &x[2], &x[1], &x[3] };
        struct slopes dR = { y + 1, y + 2, y + 3, y + 4, y + 5 };
        if (model_find("transport-8")->slopes(&m, y, &dR) == STATUS_OK)
            put(&out, y, 1 + SLOPES);
        else
            put_refused(&out);
    }
    figures_done(&f);
    return taken(&out, n);
}

/* ---- random walks ------------------------------------------------------------------- */

static double *monte_carlo_outputs(uint64_t *n)
{
    enum { SKINS = 4, SLOPES = 5 };
    static double scratch[MEDIUM_SCRATCH(BANDS)], R[2][BANDS], y[2][SLOPES][BANDS];
    const struct monte_carlo_run run = { .photons = 1000, .seed = 7, .threads = 2 };
    struct dice dice = { 2 };
    struct outputs out = { 0 };
    for (size_t i = 0; i < SKINS; i++) {
        struct tissue t = person(&dice, i);
        struct medium m;
        struct slopes dR[2];
        for (size_t k = 0; k < 2; k++)
            dR[k] = (struct slopes){ y[k][0], y[k][1], y[k][2], y[k][3], y[k][4] };
        if (tissue_medium(&t, bands(), scratch, &m) != STATUS_OK ||
            monte_carlo_skin(&m, &run, R[0], R[1], &dR[0], &dR[1]) != STATUS_OK) {
            put_refused(&out);
            continue;
        }
        for (size_t k = 0; k < 2; k++) {
            put(&out, R[k], BANDS);
            for (size_t j = 0; j < SLOPES; j++)
                put(&out, y[k][j], BANDS);
        }
    }
    return taken(&out, n);
}

/* ---- spectra by vectors ------------------------------------------------------------- */

static void quick_by(enum quick_vectors v, const char *model, struct outputs *out)
{
    enum { SKINS = 300, STRIDE = QUICK_STRIDE(BANDS) };
    static double scratch[QUICK_SCRATCH(BANDS)], R[STRIDE], J[TISSUE_PARAMETERS * STRIDE];
    struct dice dice = { 3 };
    for (size_t i = 0; i < SKINS; i++) {
        struct tissue t = person(&dice, i);
        if (quick_slopes_by(v, model_find(model), &t, bands(), QUICK_WANT_ALL, scratch, R, J) !=
            STATUS_OK) {
            put_refused(out);
            continue;
        }
        put(out, R, BANDS);
        for (size_t p = 0; p < TISSUE_PARAMETERS; p++)
            put(out, J + p * STRIDE, BANDS);
    }
}

/* By all vectors that the processor has. */
static double *quick_outputs(uint64_t *n)
{
    struct outputs out = { 0 };
    for (enum quick_vectors v = QUICK_PLAIN; v < QUICK_VECTORS; v++) {
        if (!quick_has(v))
            continue;
        quick_by(v, "half-space", &out);
        quick_by(v, "two-layer", &out);
    }
    return taken(&out, n);
}

/* ---- whole fits --------------------------------------------------------------------- */

static void put_fit(const struct fit *fit, const struct noise *noise, const struct spectrum *s,
                    size_t replicates, struct outputs *out)
{
    static struct refined r;
    if (refine(fit, noise, s, replicates, NULL, 0, &r, NULL) != STATUS_OK) {
        put_refused(out);
        return;
    }
    put(out, r.value, SKIN_PARAMETERS);
    put(out, r.se, SKIN_PARAMETERS);
    put(out, r.lo, SKIN_PARAMETERS);
    put(out, r.hi, SKIN_PARAMETERS);
    put(out, r.repeat_se, SKIN_PARAMETERS);
    put(out, r.residual, r.bands);
    put(out,
        (double[]){ r.rms, r.dE00, r.chi_square, r.chi_square_p, (double)r.flags,
                    (double)r.iterations, (double)r.evaluations, (double)r.has_second },
        8);
    if (r.has_second)
        put(out, r.second, SKIN_PARAMETERS);
}

static struct spectrum blank(void)
{
    return (struct spectrum){
        .first_nm = FIRST_NM, .step_nm = STEP_NM, .n = BANDS, .specular = SPECULAR_SCE
    };
}

static void put_all_fits(const struct spectrum *s, size_t replicates, bool transport,
                         struct outputs *out)
{
    static const char *const models[] = { "half-space", "two-layer", "transport-8" };
    const struct noise three = noise_default(), skin = noise_skin();
    for (size_t i = 0; i < (transport ? 3 : 2); i++) {
        struct recipe recipe = recipe_default(model_find(models[i]));
        struct fit fit = fit_three(&recipe);
        put_fit(&fit, &three, s, replicates, out);
        fit = fit_skin(recipe.model);
        put_fit(&fit, &skin, s, replicates, out);
    }
}

/* The six skins of docs/examples, each alone, and all as replicates of one site. */
static double *example_fits(uint64_t *n)
{
    enum { MOST = 16 };
    static struct spectrum s[MOST];
    struct outputs out = { 0 };
    struct figures f;
    if (!figures_read("docs/examples/skin.csv", &f))
        return NULL;
    size_t first = figures_column(&f, "400"), rows = f.rows < MOST ? f.rows : MOST;
    for (size_t row = 0; row < rows && first + BANDS <= f.columns; row++) {
        s[row] = blank();
        for (size_t i = 0; i < BANDS; i++)
            s[row].value[i] = figures_at(&f, row, first + i);
        put_all_fits(&s[row], 1, true, &out);
    }
    put_all_fits(s, rows, true, &out);
    figures_done(&f);
    return taken(&out, n);
}

/* Two-layer skins under noise: one placement, and three. */
static double *noisy_fits(uint64_t *n)
{
    enum { SKINS = 200, REPLICATES = 3 };
    static double scratch[MEDIUM_SCRATCH(BANDS)];
    static struct spectrum s[REPLICATES];
    struct dice dice = { 4 };
    struct outputs out = { 0 };
    for (size_t i = 0; i < SKINS; i++) {
        struct tissue t = person(&dice, i);
        double R[BANDS];
        if (model_reflectance(model_find("two-layer"), &t, bands(), scratch, R) != STATUS_OK) {
            put_refused(&out);
            continue;
        }
        for (size_t k = 0; k < REPLICATES; k++) {
            s[k] = blank();
            for (size_t j = 0; j < BANDS; j++)
                s[k].value[j] = R[j] + dice_between(&dice, -0.005, 0.005);
        }
        put_all_fits(s, i % 2 == 0 ? 1 : REPLICATES, false, &out);
    }
    return taken(&out, n);
}

const struct whole whole_list[] = {
    { "transport-8, R and slopes of skins", transport_outputs },
    { "transport-8, R and slopes at extremes", transport_extremes },
    { "monte-carlo, seeded, R and slopes with their errors", monte_carlo_outputs },
    { "quick_slopes of whole spectra", quick_outputs },
    { "fits of docs/examples/skin.csv", example_fits },
    { "fits of generated spectra", noisy_fits },
};
const size_t whole_count = sizeof whole_list / sizeof *whole_list;
