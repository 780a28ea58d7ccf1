/* spread.c - other placements of the probe carried through the fit. */
#include "match/spread.h"

#include <math.h>

/* What the probe may do at the answer: rows of J, and p_k of the parameters that spread. */
struct moves {
    size_t n, bands;
    enum skin_parameter which[SKIN_PARAMETERS];
    double size[SKIN_PARAMETERS];
    double p[SKIN_PARAMETERS][SPECTRUM_MAX_BANDS];
};

bool spread_any(const struct fit *fit)
{
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        if (fit->role[i].spread > 0.0)
            return true;
    return false;
}

static double dot(const double *x, const double *y, size_t n)
{
    double sum = 0.0;
    for (size_t i = 0; i < n; i++)
        sum += x[i] * y[i];
    return sum;
}

static size_t packed(size_t i, size_t j)
{
    return i >= j ? i * (i + 1) / 2 + j : j * (j + 1) / 2 + i;
}

static double *row_of(const struct misfit *m, size_t i)
{
    return m->scratch->J + i * QUICK_STRIDE(m->chromophores->n);
}

/* J at the answer into the scratch, 0 in bands that were not measured, and the moves. */
static void find_moves(const struct misfit *m, const double *x, struct moves *ret)
{
    double value[SKIN_PARAMETERS];
    size_t bands = m->chromophores->n;
    misfit_values(m, x, 0, value);
    struct tissue t = fit_tissue(m->fit, value);
    (void)quick_slopes(m->fit->model, &t, m->chromophores, QUICK_WANT_ALL, m->scratch->model,
                       m->scratch->R, m->scratch->J);
    ret->n = 0;
    ret->bands = bands;
    for (size_t k = 0; k < SKIN_PARAMETERS; k++) {
        const struct skin_role *role = &m->fit->role[k];
        double *row = row_of(m, k);
        for (size_t i = 0; i < bands; i++)
            row[i] = m->weight[i] == 0.0 ? 0.0 : row[i];
        if (role->spread == 0.0)
            continue;
        ret->which[ret->n] = (enum skin_parameter)k;
        ret->size[ret->n] = role->spread * (role->spread_relative ? value[k] : 1.0);
        for (size_t i = 0; i < bands; i++)
            ret->p[ret->n][i] = ret->size[ret->n] * row[i];
        ret->n++;
    }
}

/* ---- how much at this site ------------------------------------------------------------- */

/* (1 + P^T P)^-1 of the whitened moves, as a table of n * n. */
static void invert_plus_one(const struct moves *w, double *inverse)
{
    struct normal normal;
    double unseen[SKIN_PARAMETERS] = { 0 }; /* none is: 1 stands on the diagonal */
    for (size_t k = 0; k < w->n; k++)
        for (size_t l = 0; l <= k; l++)
            normal.curvature[packed(k, l)] = dot(w->p[k], w->p[l], w->bands) + (k == l ? 1.0 : 0.0);
    normal_covariance(&normal, w->n, unseen, inverse);
}

/* q: v^T (1 + P P^T)^-1 v, summed over the replicates, by Woodbury's identity. */
static double strangeness(const struct misfit *m, const struct noise *noise, const double *nm,
                          const struct spectrum *spectra, size_t replicates, struct moves *moves)
{
    double scratch[WHITENER_SCRATCH(SPECTRUM_MAX_BANDS)], v[SPECTRUM_MAX_BANDS], q = 0.0;
    double inverse[SKIN_PARAMETERS * SKIN_PARAMETERS], along[SKIN_PARAMETERS];
    size_t bands = moves->bands;
    struct whitener one;
    whitener_init(noise, 1, nm, m->weight, bands, scratch, &one);
    for (size_t k = 0; k < moves->n; k++) {
        whitener_apply(&one, moves->p[k]);
        for (size_t i = 0; i < bands; i++)
            moves->p[k][i] /= noise->white;
    }
    invert_plus_one(moves, inverse);
    for (size_t r = 0; r < replicates; r++) {
        for (size_t i = 0; i < bands; i++)
            v[i] = m->weight[i] == 0.0 ? 0.0
                                       : (spectra[r].value[i] - m->measured[0][i]) / noise->white;
        whitener_apply(&one, v);
        for (size_t k = 0; k < moves->n; k++)
            along[k] = dot(moves->p[k], v, bands);
        q += dot(v, v, bands);
        for (size_t k = 0; k < moves->n; k++)
            q -= along[k] * dot(inverse + k * moves->n, along, moves->n);
    }
    return q;
}

static double measured_bands(const struct misfit *m)
{
    double sum = 0.0;
    for (size_t i = 0; i < m->chromophores->n; i++)
        sum += m->weight[i];
    return sum;
}

/* f^2; spoils the moves. */
static double factor_of(const struct misfit *m, const struct noise *noise, const double *nm,
                        const struct spectrum *spectra, size_t replicates, struct moves *moves)
{
    double nu = m->fit->spread_degrees;
    if (nu == 0.0)
        return 1.0;
    if (replicates == 1)
        return nu / (nu - 2.0);
    return (nu + strangeness(m, noise, nm, spectra, replicates, moves)) /
           (nu + (double)(replicates - 1) * measured_bands(m) - 2.0);
}

/* ---- through the fit -------------------------------------------------------------------- */

/* The free parameters that are not at a bound, and the inverse of their curvature. */
struct inside {
    size_t n;
    enum skin_parameter which[SKIN_PARAMETERS];
    double inverse[SKIN_PARAMETERS * SKIN_PARAMETERS];
};

static void find_inside(const struct misfit *m, const struct minimum *at, struct inside *ret)
{
    struct normal normal;
    double unseen[SKIN_PARAMETERS];
    ret->n = 0;
    for (size_t i = 0; i < SKIN_PARAMETERS; i++) {
        size_t place = m->first[i];
        if (m->places[i] > 0 && at->x[place] > m->lo[place] && at->x[place] < m->hi[place])
            ret->which[ret->n++] = (enum skin_parameter)i;
    }
    for (size_t a = 0; a < ret->n; a++) {
        const struct skin_role *role = &m->fit->role[ret->which[a]];
        unseen[a] = (role->hi - role->lo) * (role->hi - role->lo);
        for (size_t b = 0; b <= a; b++)
            normal.curvature[packed(a, b)] =
                at->normal.curvature[packed(m->first[ret->which[a]], m->first[ret->which[b]])];
    }
    normal_covariance(&normal, ret->n, unseen, ret->inverse);
}

/* Adds the squares of G p for one move; the rows of J are whitened. */
static void add_move(const struct misfit *m, const struct inside *in, const double *p,
                     double variance[SKIN_PARAMETERS])
{
    double moved[SPECTRUM_MAX_BANDS], pull[SKIN_PARAMETERS];
    size_t bands = m->chromophores->n;
    for (size_t i = 0; i < bands; i++)
        moved[i] = p[i];
    whitener_apply(&m->whitener, moved);
    for (size_t a = 0; a < in->n; a++)
        pull[a] = dot(row_of(m, in->which[a]), moved, bands) / m->whitener.white2;
    for (size_t a = 0; a < in->n; a++) {
        double shift = dot(in->inverse + a * in->n, pull, in->n);
        variance[in->which[a]] += shift * shift;
    }
}

void spread_find(const struct misfit *m, const struct minimum *at, const struct noise *noise,
                 const double *nm, const struct spectrum *spectra, size_t replicates,
                 double sd[SKIN_PARAMETERS])
{
    double variance[SKIN_PARAMETERS] = { 0 };
    struct moves moves;
    struct inside in;
    find_moves(m, at->x, &moves);
    find_inside(m, at, &in);
    for (size_t a = 0; a < in.n; a++)
        whitener_apply(&m->whitener, row_of(m, in.which[a]));
    for (size_t k = 0; k < moves.n; k++)
        add_move(m, &in, moves.p[k], variance);
    for (size_t k = 0; k < moves.n; k++) {
        enum skin_parameter i = moves.which[k];
        size_t place = m->first[i];
        if (m->places[i] > 0 && (at->x[place] == m->lo[place] || at->x[place] == m->hi[place]))
            variance[i] = moves.size[k] * moves.size[k];
    }
    double share = factor_of(m, noise, nm, spectra, replicates, &moves) / (double)replicates;
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        sd[i] = sqrt(share * variance[i]);
}
