/* misfit.c - model, whitening and priors put together into normal equations. */
#include "match/misfit.h"

#include <math.h>
#include <string.h>

#include "match/products.h"
#include "match/start.h"

/* Rows of J are taken by the numbers of the fit's parameters. */
_Static_assert(SKIN_CM == (int)TISSUE_CM && SKIN_BM == (int)TISSUE_BM &&
                   SKIN_CH == (int)TISSUE_CH && SKIN_SO2 == (int)TISSUE_GAMMA &&
                   SKIN_EPIDERMIS_MM == (int)TISSUE_EPIDERMIS_MM &&
                   SKIN_SCATTERING_A == (int)TISSUE_SCATTERING_A &&
                   SKIN_SCATTERING_B == (int)TISSUE_SCATTERING_B &&
                   SKIN_PARAMETERS == (int)TISSUE_PARAMETERS,
               "one order of the parameters of a skin");

enum status misfit_layout(struct misfit *m)
{
    m->n = 0;
    m->wanted = fit_free(m->fit);
    m->tie.sd = INFINITY;
    m->rows = 0;
    m->scratch->spectra = m->scratch->derivatives = 0;
    for (size_t i = 0; i < SKIN_PARAMETERS; i++) {
        const struct skin_role *role = &m->fit->role[i];
        m->first[i] = m->n;
        m->places[i] = !role->free ? 0 : role->per_replicate ? m->groups : 1;
        if (m->n + m->places[i] > LEAST_SQUARES_MAX)
            return STATUS_UNSUPPORTED;
        for (size_t k = 0; k < m->places[i]; k++) {
            m->lo[m->n + k] = role->lo;
            m->hi[m->n + k] = role->hi;
        }
        m->n += m->places[i];
        m->rows += role->free ? 1u : 0u;
    }
    return STATUS_OK;
}

/* Where parameter i of group g stands. */
static size_t place(const struct misfit *m, size_t i, size_t g)
{
    return m->first[i] + (m->places[i] > 1 ? g : 0);
}

void misfit_values(const struct misfit *m, const double *x, size_t g, double value[SKIN_PARAMETERS])
{
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        value[i] = m->places[i] > 0 ? x[place(m, i, g)] : m->fit->role[i].value;
}

double misfit_mean(const struct misfit *m, const double *x, enum skin_parameter i)
{
    double sum = 0.0;
    if (m->places[i] == 0)
        return m->fit->role[i].value;
    if (m->places[i] == 1)
        return x[m->first[i]];
    for (size_t k = 0; k < m->places[i]; k++)
        sum += x[m->first[i] + k];
    /* Rounding must not carry the mean past a bound. */
    return fmin(fmax(sum / (double)m->places[i], m->fit->role[i].lo), m->fit->role[i].hi);
}

void misfit_vector(const struct misfit *m, const double value[SKIN_PARAMETERS], double *x)
{
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        for (size_t k = 0; k < m->places[i]; k++)
            x[m->first[i] + k] = value[i];
}

/* ---- sums over bands --------------------------------------------------------------------- */

static size_t packed(size_t i, size_t j)
{
    return i >= j ? i * (i + 1) / 2 + j : j * (j + 1) / 2 + i;
}

static void whiten(const struct misfit *m, double *v)
{
    if (!m->whole)
        for (size_t i = 0; i < m->chromophores->n; i++)
            if (m->weight[i] == 0.0)
                v[i] = 0.0; /* not a product: v may be NaN there */
    if (m->whitener.rank > 0)
        whitener_apply(&m->whitener, v);
}

/* ---- chi^2 ------------------------------------------------------------------------------- */

/* Residual r and derivatives of group g from R to the scale of ln R:  m ln(R/m), for which
 * 2m (R-m)/(R+m) does as well (Pade), and its derivative.  Both are those of R where R is m. */
static void straighten(const struct misfit *m, size_t g, double *restrict r)
{
    size_t n = m->chromophores->n, stride = QUICK_STRIDE(n);
    const double *restrict given = m->measured[g];
    double *restrict steeper = m->scratch->model; /* free now */
    for (size_t i = 0; i < n; i++) {
        /* Where noise has left nothing, or nothing was measured, the band counts for little. */
        double least = 1e-3, measured = given[i] > least ? given[i] : least;
        double w = 2.0 * measured / (r[i] + 2.0 * measured);
        r[i] *= w;
        steeper[i] = w * w;
    }
    for (size_t p = 0; p < SKIN_PARAMETERS; p++) {
        double *row = m->scratch->J + p * stride;
        for (size_t i = 0; m->places[p] > 0 && i < n; i++)
            row[i] *= steeper[i];
    }
}

/* Group g into the sums; residual and derivatives are whitened where they lie. */
static void add_group(const struct misfit *m, size_t g, bool straight, struct normal *ret)
{
    size_t n = m->chromophores->n, stride = QUICK_STRIDE(n), at[SKIN_PARAMETERS], rows = 0;
    const double *row[SKIN_PARAMETERS + 1], *sum, weight = 1.0 / m->whitener.white2;
    double *r = m->scratch->R, triangle[(SKIN_PARAMETERS + 1) * (SKIN_PARAMETERS + 2) / 2];
    for (size_t i = 0; i < n; i++)
        r[i] -= m->measured[g][i];
    if (straight)
        straighten(m, g, r);
    for (size_t i = 0; i < SKIN_PARAMETERS; i++) {
        if (m->places[i] == 0)
            continue;
        at[rows] = place(m, i, g);
        whiten(m, m->scratch->J + i * stride);
        row[rows++] = m->scratch->J + i * stride;
    }
    whiten(m, r);
    row[rows] = r;
    products(row, rows + 1, stride, triangle);
    sum = triangle;
    if (m->groups == 1) { /* then at[a] is a, and the triangles are alike */
        size_t pairs = rows * (rows + 1) / 2;
        for (size_t p = 0; p < pairs; p++)
            ret->curvature[p] += weight * sum[p];
        sum += pairs;
    } else {
        for (size_t a = 0; a < rows; a++)
            for (size_t b = 0; b <= a; b++)
                ret->curvature[packed(at[a], at[b])] += weight * *sum++;
    }
    for (size_t a = 0; a < rows; a++)
        ret->gradient[at[a]] += weight * *sum++;
    ret->chi_square += weight * *sum;
}

/* ((mean of the places - wanted)/sd)^2. */
static void add_prior(const struct misfit *m, const double *x, enum skin_parameter i, double wanted,
                      double sd, struct normal *ret)
{
    double share = 1.0 / (double)m->places[i], off = (misfit_mean(m, x, i) - wanted) / sd;
    ret->chi_square += off * off;
    for (size_t k = 0; k < m->places[i]; k++) {
        ret->gradient[m->first[i] + k] += off * share / sd;
        for (size_t l = 0; l <= k; l++)
            ret->curvature[packed(m->first[i] + k, m->first[i] + l)] += share / sd * share / sd;
    }
}

/* straight: by the logarithm of R. */
static void evaluate(const struct misfit *m, const double *x, bool straight, struct normal *ret)
{
    struct misfit_scratch *s = m->scratch;
    ret->chi_square = m->scatter;
    memset(ret->gradient, 0, m->n * sizeof *ret->gradient);
    memset(ret->curvature, 0, m->n * (m->n + 1) / 2 * sizeof *ret->curvature);
    s->spectra += m->groups;
    s->derivatives += m->groups * m->rows;
    for (size_t g = 0; g < m->groups; g++) {
        double value[SKIN_PARAMETERS];
        misfit_values(m, x, g, value);
        struct tissue t = fit_tissue(m->fit, value);
        if (quick_skin(m->quick, &t, m->wanted, s->model, s->R, s->J) != STATUS_OK) {
            ret->chi_square = INFINITY; /* worse than any skin that the model takes */
            return;
        }
        add_group(m, g, straight, ret);
    }
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        if (m->places[i] > 0 && isfinite(m->fit->role[i].prior_sd))
            add_prior(m, x, (enum skin_parameter)i, m->fit->role[i].prior_mean,
                      m->fit->role[i].prior_sd, ret);
    if (isfinite(m->tie.sd))
        add_prior(m, x, m->tie.parameter, m->tie.mean, m->tie.sd, ret);
}

void misfit_evaluate(void *misfit, const double *x, struct normal *ret)
{
    const struct misfit *m = misfit;
    memcpy(m->scratch->x, x, m->n * sizeof *x);
    evaluate(m, x, false, ret);
}

bool misfit_follow(const struct misfit *m, const double *x, double *fitted)
{
    size_t n = m->chromophores->n, stride = QUICK_STRIDE(n);
    if (m->groups > 1)
        return false;
    memcpy(fitted, m->scratch->R, n * sizeof *fitted); /* the residual there, whitened */
    for (size_t p = 0; p < SKIN_PARAMETERS; p++) {
        const double *row = m->scratch->J + p * stride;
        double way = m->places[p] > 0 ? x[m->first[p]] - m->scratch->x[m->first[p]] : 0.0;
        for (size_t i = 0; m->places[p] > 0 && i < n; i++)
            fitted[i] += way * row[i];
    }
    whitener_undo(&m->whitener, fitted);
    for (size_t i = 0; i < n; i++)
        fitted[i] += m->measured[0][i];
    return true;
}

static double inside(const struct misfit *m, size_t i, double x)
{
    return x > m->lo[i] ? (x < m->hi[i] ? x : m->hi[i]) : m->lo[i];
}

void misfit_approach(const struct misfit *m, double *x)
{
    static const enum skin_parameter amount[] = { SKIN_CM, SKIN_CH, SKIN_SCATTERING_A };
    struct normal normal;
    double y[LEAST_SQUARES_MAX], sum = 0.0;
    for (size_t i = 0; i < m->n; i++)
        y[i] = x[i] = inside(m, i, x[i]);
    evaluate(m, x, true, &normal);
    if (!isfinite(normal.chi_square))
        return;
    (void)least_squares_step(m->n, m->lo, m->hi, &normal, y);
    for (size_t k = 0; k < sizeof amount / sizeof *amount; k++)
        for (size_t i = m->first[amount[k]]; i < m->first[amount[k]] + m->places[amount[k]]; i++)
            if (x[i] > 0.0)
                y[i] = inside(m, i, start_by_root(x[i], y[i]));
    for (size_t i = 0; i < m->n; i++)
        sum += y[i];
    if (isfinite(sum))
        memcpy(x, y, m->n * sizeof *x);
}

struct least_squares misfit_problem(struct misfit *m, double tolerance, size_t steps)
{
    return (struct least_squares){ .n = m->n,
                                   .lo = m->lo,
                                   .hi = m->hi,
                                   .evaluate = misfit_evaluate,
                                   .context = m,
                                   .tolerance = tolerance,
                                   .steps = steps };
}

double misfit_chi_square(const struct misfit *m, const double *x, double *fitted)
{
    double sum = m->scatter;
    size_t n = m->chromophores->n, stride = QUICK_STRIDE(n);
    double *r = m->scratch->R;
    for (size_t i = 0; i < n; i++)
        fitted[i] = 0.0;
    m->scratch->spectra += m->groups;
    for (size_t g = 0; g < m->groups; g++) {
        const double *row[1] = { r };
        double value[SKIN_PARAMETERS], product;
        misfit_values(m, x, g, value);
        struct tissue t = fit_tissue(m->fit, value);
        if (quick_skin(m->quick, &t, 0, m->scratch->model, r, NULL) != STATUS_OK)
            return INFINITY;
        for (size_t i = 0; i < n; i++) {
            fitted[i] += r[i] / (double)m->groups;
            r[i] -= m->measured[g][i];
        }
        whiten(m, r);
        products(row, 1, stride, &product);
        sum += product / m->whitener.white2;
    }
    for (size_t i = 0; i < SKIN_PARAMETERS; i++) {
        const struct skin_role *role = &m->fit->role[i];
        double off =
            (misfit_mean(m, x, (enum skin_parameter)i) - role->prior_mean) / role->prior_sd;
        if (m->places[i] > 0 && isfinite(role->prior_sd))
            sum += off * off;
    }
    return sum;
}
