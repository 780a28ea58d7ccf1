/* rehearsal.c - a few skins made up, measured in thought, and fitted. */
#include "plan/rehearsal.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "base/chance.h"
#include "colour/delta_e.h"
#include "colour/lab.h"
#include "colour/xyz.h"
#include "match/refine.h"
#include "match/start.h"
#include "optics/quick.h"
#include "plan/costs.h"

/* ---- skins -------------------------------------------------------------------------- */

static double fraction(double x)
{
    return x - floor(x);
}

/* The i-th of points that fill a cube evenly, however many there are: multiples of 1/g, 1/g^2
 * and 1/g^3, g^4 = g + 1 (M. Roberts' generalised golden ratio). */
static double even_point(size_t i, size_t axis)
{
    static const double step[3] = { 0.8191725133961645, 0.6710436067037893, 0.5497004779019703 };
    return fraction(0.5 + (double)(i + 1) * step[axis]);
}

/* Three eighths of the skins are of the lightest quarter, three of the darkest. */
#define LIGHT 0.375
#define DARK 0.625

static double to_the_ends(double at)
{
    return at < LIGHT ? at / 1.5 : at < DARK ? 0.25 + 2.0 * (at - LIGHT) : 0.75 + (at - DARK) / 1.5;
}

static double weight_of(size_t i)
{
    double at = even_point(i, SKIN_CM);
    return at < LIGHT || at >= DARK ? 1.0 / 1.5 : 2.0;
}

/* Typical values as far as they are in the range, or where none is, all of it; Cm and Ch evenly
 * in the logarithm. */
static double skin_value(const struct scene_range *range, size_t axis, size_t i)
{
    const struct scene_range *typical = &costs_skins[axis];
    double lo = fmax(range->lo, typical->lo), hi = fmin(range->hi, typical->hi);
    double at = axis == SKIN_CM ? to_the_ends(even_point(i, axis)) : even_point(i, axis);
    if (range->lo == range->hi)
        return range->lo;
    if (!(lo < hi)) {
        lo = range->lo;
        hi = range->hi;
    }
    return axis == SKIN_BM || lo <= 0.0 ? lo + at * (hi - lo) : lo * pow(hi / lo, at);
}

static double moved(double x, const struct skin_role *role, double by)
{
    return role->spread_relative ? x * (1.0 + role->spread * by) : x + role->spread * by;
}

/* What the probe set down on such a skin sees: of a fit that knows how skin differs from
 * placement to placement another skin, as far as Cm, Ch and SO2 go. */
static struct tissue placed(const struct fit *fit, const struct tissue *skin, uint64_t *state)
{
    struct tissue t = *skin;
    double by[3];
    for (size_t i = 0; i < 3; i++)
        by[i] = chance_normal(state);
    t.Cm = fmax(0.0, moved(t.Cm, &fit->role[SKIN_CM], by[0]));
    t.Ch = fmax(0.0, moved(t.Ch, &fit->role[SKIN_CH], by[1]));
    t.gamma = fmin(fmax(moved(t.gamma, &fit->role[SKIN_SO2], by[2]), 0.0), 1.0);
    return t;
}

static struct tissue skin_of(const struct rehearsal *r, size_t i)
{
    double value[SKIN_PARAMETERS];
    for (size_t k = 0; k < SKIN_PARAMETERS; k++)
        value[k] = r->fit.role[k].value;
    for (size_t k = 0; k < 3; k++)
        value[k] = skin_value(&r->range[k], k, i);
    /* Skins of the trials have the paper's scattering, whatever a fit frees. */
    return r->fit.own_scattering ? tissue_of(value[SKIN_CM], value[SKIN_BM], value[SKIN_CH])
                                 : fit_tissue(&r->fit, value);
}

/* ---- spectra ------------------------------------------------------------------------ */

/* A model on the bands that are seen, and on those that colours are told of. */
struct model_on_both {
    struct quick seen, all;
};

/* What it says of one skin. */
struct seen {
    double here[QUICK_STRIDE(SPECTRUM_MAX_BANDS)], all[QUICK_STRIDE(COSTS_BANDS)];
};

struct stage {
    const struct rehearsal *r;
    struct chromophores seen, all;
    bool same_bands;
    struct model_on_both truth, fitted;
    struct start start;
    struct xyz_weights weights, weights_seen; /* the second for colours alone */
    struct refiner *refiner;
    struct spectrum measured;
    struct seen there, found;
    double nm[SPECTRUM_MAX_BANDS];
    double scratch[QUICK_SCRATCH(SPECTRUM_MAX_BANDS)];
};

static void model_init(const struct stage *g, const struct model *model, struct model_on_both *ret)
{
    quick_init(model, &g->seen, g->r->fit.eta, &ret->seen);
    quick_init(model, &g->all, g->r->fit.eta, &ret->all);
}

static enum status stage_init(const struct rehearsal *r, struct stage *g)
{
    g->r = r;
    enum status s = chromophores_init(r->first_nm, r->step_nm, r->bands, &g->seen);
    if (s == STATUS_OK)
        s = chromophores_init(COSTS_FIRST_NM, COSTS_STEP_NM, COSTS_BANDS, &g->all);
    if (s == STATUS_OK)
        s = xyz_weights_init(ILLUMINANT_D65, OBSERVER_10DEG, COSTS_FIRST_NM, COSTS_STEP_NM,
                             COSTS_BANDS, &g->weights);
    if (s == STATUS_OK && r->colour)
        s = xyz_weights_init(r->fit.illuminant, r->fit.observer, r->first_nm, r->step_nm, r->bands,
                             &g->weights_seen);
    if (s == STATUS_OK)
        s = refiner_open(&r->fit, r->first_nm, r->step_nm, r->bands, &g->refiner, NULL);
    if (s != STATUS_OK)
        return s;
    model_init(g, r->transport ? model_find("transport-8") : r->fit.model, &g->truth);
    model_init(g, r->fit.model, &g->fitted);
    g->same_bands =
        r->bands == COSTS_BANDS && r->first_nm == COSTS_FIRST_NM && r->step_nm == COSTS_STEP_NM;
    const struct tissue middle = skin_of(r, 0);
    if (r->closed_form)
        start_init(&middle, &g->seen, &g->start);
    for (size_t k = 0; k < r->bands; k++)
        g->nm[k] = r->first_nm + (double)k * r->step_nm;
    g->measured = (struct spectrum){ .first_nm = r->first_nm,
                                     .step_nm = r->step_nm,
                                     .n = r->bands,
                                     .specular = SPECULAR_SCE,
                                     .aperture_mm = NAN };
    return STATUS_OK;
}

/* What match/noise.h says of a replicate, n values. */
static void add_noise(const struct stage *g, uint64_t *state, double *R, size_t n)
{
    const struct noise *noise = &g->r->noise;
    double level = noise->placement * chance_normal(state);
    double slope = noise->placement * noise->slope_ratio * chance_normal(state);
    for (size_t k = 0; k < n; k++)
        R[k] += noise->white * chance_normal(state) + level +
                slope * sqrt(3.0) * (g->nm[k] - 550.0) / 150.0;
}

/* A skin on the bands that are seen and on those that colours are told of, by a model. */
static enum status spectra_of(struct stage *g, const struct model_on_both *by,
                              const struct tissue *skin, struct seen *ret)
{
    enum status s = quick_skin(&by->seen, skin, 0, g->scratch, ret->here, NULL);
    if (s == STATUS_OK && !g->same_bands)
        return quick_skin(&by->all, skin, 0, g->scratch, ret->all, NULL);
    memcpy(ret->all, ret->here, COSTS_BANDS * sizeof *ret->all);
    return s;
}

static bool is_spread(const struct fit *fit)
{
    return fit->role[SKIN_CM].spread != 0.0 || fit->role[SKIN_CH].spread != 0.0 ||
           fit->role[SKIN_SO2].spread != 0.0;
}

/* Skin i, of which g->there is, as it is measured; the same draws whatever the conditions. */
static enum status measure(struct stage *g, const struct tissue *skin, uint64_t i,
                           struct spectrum *ret)
{
    uint64_t state = i;
    enum status s = STATUS_OK;
    const double *clean = g->there.here;
    struct tissue placed_on = placed(&g->r->fit, skin, &state);
    if (is_spread(&g->r->fit)) {
        clean = g->found.here;
        s = quick_skin(&g->truth.seen, &placed_on, 0, g->scratch, g->found.here, NULL);
    }
    if (s != STATUS_OK)
        return s;
    memcpy(ret->value, clean, ret->n * sizeof *ret->value);
    add_noise(g, &state, ret->value, ret->n);
    return STATUS_OK;
}

/* ---- how far off -------------------------------------------------------------------- */

static void Lab_of(const struct stage *g, const struct seen *seen, double Lab[3])
{
    double XYZ[3];
    xyz_from_reflectance(&g->weights, seen->all, XYZ);
    lab_from_xyz(XYZ, g->weights.white, Lab);
}

static enum status compare(struct stage *g, const struct tissue *there, const struct tissue *found,
                           double weight, struct rehearsed *sum)
{
    double Lab[2][3], square = 0.0;
    const double off[3] = { found->Cm - there->Cm, found->Bm - there->Bm, found->Ch - there->Ch };
    enum status s = spectra_of(g, &g->fitted, found, &g->found);
    if (s != STATUS_OK)
        return s;
    for (size_t k = 0; k < g->r->bands; k++) {
        double d = g->there.here[k] - g->found.here[k];
        square += d * d;
    }
    Lab_of(g, &g->there, Lab[0]);
    Lab_of(g, &g->found, Lab[1]);
    sum->rms_R += weight * sqrt(square / (double)g->r->bands);
    sum->dE00 += weight * delta_e_2000(Lab[0], Lab[1]);
    for (size_t k = 0; k < 3; k++)
        sum->rmse[k] += weight * off[k] * off[k];
    return STATUS_OK;
}

/* ---- fitted ------------------------------------------------------------------------- */

static double inside(const struct skin_role *role, double x)
{
    return fmin(fmax(x, role->lo), role->hi);
}

/* The equations know no bounds; what they do not know stays in the middle, as a plan has it. */
static struct tissue solve(const struct stage *g)
{
    const struct skin_role *role = g->r->fit.role;
    double all[SPECTRUM_MAX_BANDS], value[SKIN_PARAMETERS];
    for (size_t k = 0; k < SKIN_PARAMETERS; k++)
        value[k] = role[k].value;
    for (size_t k = 0; k < g->measured.n; k++)
        all[k] = 1.0;
    struct tissue t = fit_tissue(&g->r->fit, value);
    start_guess(&g->start, g->measured.value, all, &t);
    t.Cm = inside(&role[SKIN_CM], t.Cm);
    t.Bm = inside(&role[SKIN_BM], t.Bm);
    t.Ch = inside(&role[SKIN_CH], t.Ch);
    return t;
}

/* ---- a colour ----------------------------------------------------------------------- */

/* The skin whose colour is nearest (dE*ab), inside the bounds: damped Gauss-Newton from the skin
 * itself.  Distances by other colours lead to much the same skin, for three numbers are matched by
 * three. */
enum { COLOUR_STEPS = 24 };

struct colour_fit {
    double value[SKIN_PARAMETERS], Lab[3], square;
};

static void Lab_seen(const struct stage *g, const double *R, double Lab[3])
{
    double XYZ[3];
    xyz_from_reflectance(&g->weights_seen, R, XYZ);
    lab_from_xyz(XYZ, g->weights_seen.white, Lab);
}

static enum status look(struct stage *g, const double target[3], struct colour_fit *at)
{
    const struct tissue t = fit_tissue(&g->r->fit, at->value);
    enum status s = quick_skin(&g->fitted.seen, &t, 0, g->scratch, g->found.here, NULL);
    if (s != STATUS_OK)
        return s;
    Lab_seen(g, g->found.here, at->Lab);
    at->square = 0.0;
    for (size_t k = 0; k < 3; k++)
        at->square += (at->Lab[k] - target[k]) * (at->Lab[k] - target[k]);
    return STATUS_OK;
}

/* J[i][k]: of Lab[k] by parameter i. */
static enum status slopes(struct stage *g, const double target[3], const struct colour_fit *at,
                          double J[3][3])
{
    for (size_t i = 0; i < 3; i++) {
        const struct skin_role *role = &g->r->fit.role[i];
        struct colour_fit beside = *at;
        double h = 1e-5 * (role->hi - role->lo);
        h = at->value[i] + h > role->hi ? -h : h;
        beside.value[i] += h;
        enum status s = look(g, target, &beside);
        if (s != STATUS_OK)
            return s;
        for (size_t k = 0; k < 3; k++)
            J[i][k] = (beside.Lab[k] - at->Lab[k]) / h;
    }
    return STATUS_OK;
}

/* d with (J J^T + damping) d = -J residual; 0 for what is held or pushed against its bound. */
static void step_of(const struct stage *g, const double target[3], const struct colour_fit *at,
                    double J[3][3], double damping, double d[3])
{
    double A[3][4];
    for (size_t i = 0; i < 3; i++) {
        const struct skin_role *role = &g->r->fit.role[i];
        double gradient = 0.0;
        for (size_t k = 0; k < 3; k++)
            gradient += J[i][k] * (at->Lab[k] - target[k]);
        bool still = !role->free || (at->value[i] <= role->lo && gradient > 0.0) ||
                     (at->value[i] >= role->hi && gradient < 0.0);
        for (size_t k = 0; k < 3; k++)
            J[i][k] = still ? 0.0 : J[i][k];
        A[i][3] = still ? 0.0 : -gradient;
    }
    for (size_t i = 0; i < 3; i++)
        for (size_t j = 0; j < 3; j++)
            A[i][j] = J[i][0] * J[j][0] + J[i][1] * J[j][1] + J[i][2] * J[j][2];
    for (size_t i = 0; i < 3; i++)
        A[i][i] = A[i][i] > 0.0 ? A[i][i] * (1.0 + damping) : 1.0;
    for (size_t i = 0; i < 3; i++) /* definite: no pivots */
        for (size_t j = i + 1; j < 3; j++) {
            double times = A[j][i] / A[i][i];
            for (size_t k = i; k < 4; k++)
                A[j][k] -= times * A[i][k];
        }
    for (size_t i = 3; i-- > 0;) {
        d[i] = A[i][3];
        for (size_t k = i + 1; k < 3; k++)
            d[i] -= A[i][k] * d[k];
        d[i] /= A[i][i];
    }
}

static enum status fit_colour(struct stage *g, const struct tissue *there, struct tissue *ret)
{
    const struct skin_role *role = g->r->fit.role;
    double target[3], J[3][3], d[3], damping = 1e-3;
    struct colour_fit at;
    for (size_t k = 0; k < SKIN_PARAMETERS; k++)
        at.value[k] = role[k].value;
    at.value[SKIN_CM] = inside(&role[SKIN_CM], there->Cm);
    at.value[SKIN_BM] = inside(&role[SKIN_BM], there->Bm);
    at.value[SKIN_CH] = inside(&role[SKIN_CH], there->Ch);
    Lab_seen(g, g->measured.value, target);
    enum status s = look(g, target, &at);
    for (size_t step = 0; step < COLOUR_STEPS && s == STATUS_OK && at.square > 1e-8; step++) {
        struct colour_fit next = at;
        s = slopes(g, target, &at, J);
        if (s != STATUS_OK)
            break;
        step_of(g, target, &at, J, damping, d);
        for (size_t i = 0; i < 3; i++)
            next.value[i] = inside(&role[i], at.value[i] + d[i]);
        s = look(g, target, &next);
        damping *= next.square < at.square ? 0.1 : 10.0;
        if (next.square < at.square)
            at = next;
        else if (damping > 1e6)
            break;
    }
    *ret = fit_tissue(&g->r->fit, at.value);
    return s;
}

static enum status fit_one(struct stage *g, const struct tissue *there, double weight,
                           struct rehearsed *sum, struct tissue *ret)
{
    const struct rehearsal *r = g->r;
    double start[1][SKIN_PARAMETERS];
    struct refined refined;
    for (size_t k = 0; k < SKIN_PARAMETERS; k++)
        start[0][k] = r->fit.role[k].value;
    start[0][SKIN_CM] = there->Cm;
    start[0][SKIN_BM] = there->Bm;
    start[0][SKIN_CH] = there->Ch;
    enum status s =
        refiner_run(g->refiner, &r->told, &g->measured, 1, (const double(*)[SKIN_PARAMETERS])start,
                    r->from_there ? 1 : 0, REFINE_NO_SE, &refined, NULL);
    if (s != STATUS_OK)
        return s;
    *ret = fit_tissue(&r->fit, refined.value);
    sum->evaluations += weight * (double)refined.model_spectra;
    sum->unfinished += (refined.flags & REFINE_NOT_CONVERGED) != 0 ? weight : 0.0;
    return STATUS_OK;
}

static enum status rehearse_skin(struct stage *g, size_t i, struct rehearsed *sum)
{
    const struct tissue there = skin_of(g->r, i);
    struct tissue found;
    enum status s = spectra_of(g, &g->truth, &there, &g->there);
    if (s == STATUS_OK)
        s = measure(g, &there, i, &g->measured);
    if (s == STATUS_OK && g->r->closed_form)
        found = solve(g);
    else if (s == STATUS_OK && g->r->colour)
        s = fit_colour(g, &there, &found);
    else if (s == STATUS_OK)
        s = fit_one(g, &there, weight_of(i), sum, &found);
    return s == STATUS_OK ? compare(g, &there, &found, weight_of(i), sum) : s;
}

static enum status rehearse_anew(const struct rehearsal *r, struct rehearsed *ret)
{
    struct rehearsed sum = { { 0.0, 0.0, 0.0 }, 0.0, 0.0, 0.0, 0.0 };
    double weights = 0.0;
    struct stage *g = calloc(1, sizeof *g);
    enum status s = g == NULL ? STATUS_NO_MEMORY : stage_init(r, g);
    size_t n = r->transport ? REHEARSAL_FEW : REHEARSAL_SKINS;
    for (size_t i = 0; i < n && s == STATUS_OK; i++) {
        s = rehearse_skin(g, i, &sum);
        weights += weight_of(i);
    }
    if (g != NULL)
        refiner_close(g->refiner);
    free(g);
    if (s != STATUS_OK)
        return s;
    for (size_t k = 0; k < 3; k++)
        sum.rmse[k] = sqrt(sum.rmse[k] / weights);
    sum.dE00 /= weights;
    sum.rms_R /= weights;
    sum.evaluations /= weights;
    sum.unfinished /= weights;
    *ret = sum;
    return STATUS_OK;
}

/* ---- remembered --------------------------------------------------------------------- */

enum { KEY_SIZE = 9 * SKIN_PARAMETERS + 24, REMEMBERED = 64 };

/* All that an answer depends on: numbers bit by bit. */
struct key {
    uint64_t number[KEY_SIZE];
};

static struct key key_of(const struct rehearsal *r)
{
    struct key key = { { 0 } };
    size_t n = 0;
    for (size_t i = 0; i < SKIN_PARAMETERS; i++) {
        const struct skin_role *role = &r->fit.role[i];
        const double numbers[] = { role->free,
                                   role->per_replicate,
                                   role->value,
                                   role->lo,
                                   role->hi,
                                   role->prior_mean,
                                   role->prior_sd,
                                   role->spread,
                                   role->spread_relative };
        memcpy(key.number + n, numbers, sizeof numbers);
        n += sizeof numbers / sizeof *numbers;
    }
    const double numbers[] = { (double)(r->fit.model - model_list),
                               r->fit.own_scattering,
                               r->fit.eta,
                               r->fit.model_error,
                               r->fit.spread_degrees,
                               r->noise.white,
                               r->noise.placement,
                               r->noise.slope_ratio,
                               r->told.white,
                               r->told.placement,
                               r->told.slope_ratio,
                               r->first_nm,
                               r->step_nm,
                               (double)r->bands,
                               r->range[0].lo,
                               r->range[0].hi,
                               r->range[1].lo,
                               r->range[1].hi,
                               r->range[2].lo,
                               r->range[2].hi,
                               r->from_there,
                               r->closed_form,
                               r->transport,
                               r->colour };
    memcpy(key.number + n, numbers, sizeof numbers);
    return key;
}

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static struct {
    size_t n, oldest;
    struct key key[REMEMBERED];
    struct rehearsed rehearsed[REMEMBERED];
} memory;

static bool is_same(const struct key *a, const struct key *b)
{
    for (size_t i = 0; i < KEY_SIZE; i++)
        if (a->number[i] != b->number[i])
            return false;
    return true;
}

static bool remember(const struct key *key, struct rehearsed *ret)
{
    bool known = false;
    (void)pthread_mutex_lock(&lock);
    for (size_t i = 0; i < memory.n && !known; i++)
        if (is_same(&memory.key[i], key)) {
            *ret = memory.rehearsed[i];
            known = true;
        }
    (void)pthread_mutex_unlock(&lock);
    return known;
}

static void keep(const struct key *key, const struct rehearsed *rehearsed)
{
    (void)pthread_mutex_lock(&lock);
    size_t i = memory.n < REMEMBERED ? memory.n++ : memory.oldest++ % REMEMBERED;
    memory.key[i] = *key;
    memory.rehearsed[i] = *rehearsed;
    (void)pthread_mutex_unlock(&lock);
}

enum status rehearse(const struct rehearsal *conditions, struct rehearsed *ret)
{
    const struct key key = key_of(conditions);
    if (remember(&key, ret))
        return STATUS_OK;
    enum status s = rehearse_anew(conditions, ret);
    if (s == STATUS_OK)
        keep(&key, ret);
    return s;
}
