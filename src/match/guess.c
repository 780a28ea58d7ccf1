/* guess.c - skins all over the bounds, their components, and least squares. */
#include "match/guess.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/units.h"

/* Skins that the polynomials are fitted to: so many of each amount, and of Bm. */
enum { AMOUNTS = 13, SHARES = 8, SKINS = AMOUNTS * AMOUNTS * SHARES, ITERATIONS = 12 };
/* Keeps the least squares from following what so few components do not show. */
#define RIDGE 1e-7

struct sample {
    size_t bands;
    double (*wanted)[GUESS_PARAMETERS]; /* [SKINS] */
    double *straight;                   /* [SKINS][bands] */
    double *direction;                  /* [GUESS_PARAMETERS][bands] */
    double (*component)[GUESS_PARAMETERS];
};

static double dot(size_t n, const double *x, const double *y)
{
    double sum = 0.0;
    for (size_t i = 0; i < n; i++)
        sum += x[i] * y[i];
    return sum;
}

static void add_scaled(size_t n, double factor, const double *x, double *y)
{
    for (size_t i = 0; i < n; i++)
        y[i] += factor * x[i];
}

/* ---- skins --------------------------------------------------------------------------------- */

/* Place i of n from 0 to 1, closer at the ends: Chebyshev's nodes. */
static double place(size_t i, size_t n)
{
    return 0.5 - 0.5 * cos(UNITS_PI * ((double)i + 0.5) / (double)n);
}

static double amount(const struct skin_role *role, size_t i)
{
    double x = place(i, AMOUNTS), root = sqrt(role->lo) + (sqrt(role->hi) - sqrt(role->lo)) * x * x;
    return root * root;
}

static enum status take_sample(const struct fit *fit, const struct quick *quick, struct sample *s)
{
    double value[SKIN_PARAMETERS], *scratch, *R;
    size_t stride = QUICK_STRIDE(s->bands);
    enum status status = STATUS_OK;
    scratch = malloc((QUICK_SCRATCH(s->bands) + stride) * sizeof *scratch);
    if (scratch == NULL)
        return STATUS_NO_MEMORY;
    R = scratch + QUICK_SCRATCH(s->bands);
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        value[i] = fit->role[i].value;
    for (size_t k = 0; k < SKINS && status == STATUS_OK; k++) {
        const struct skin_role *Bm = &fit->role[SKIN_BM];
        value[SKIN_CM] = amount(&fit->role[SKIN_CM], k / SHARES % AMOUNTS);
        value[SKIN_BM] = Bm->lo + (Bm->hi - Bm->lo) * place(k % SHARES, SHARES);
        value[SKIN_CH] = amount(&fit->role[SKIN_CH], k / SHARES / AMOUNTS);
        struct tissue t = fit_tissue(fit, value);
        status = quick_skin(quick, &t, 0, scratch, R, NULL);
        for (size_t i = 0; i < s->bands; i++)
            s->straight[k * s->bands + i] = R[i] * (1.0 + R[i] * (0.64 * R[i] - 1.2));
        s->wanted[k][0] = sqrt(value[SKIN_CM]);
        s->wanted[k][1] = value[SKIN_BM];
        s->wanted[k][2] = sqrt(value[SKIN_CH]);
    }
    free(scratch);
    return status;
}

/* ---- components ------------------------------------------------------------------------------ */

/* Orthonormal; one that lies in those before it is left as rounding has it, of norm 1. */
static void make_orthonormal(size_t n, double *direction)
{
    for (size_t k = 0; k < GUESS_PARAMETERS; k++) {
        double *v = direction + k * n;
        for (int turn = 0; turn < 2; turn++)
            for (size_t j = 0; j < k; j++)
                add_scaled(n, -dot(n, direction + j * n, v), direction + j * n, v);
        double norm = sqrt(dot(n, v, v));
        for (size_t i = 0; norm > 0.0 && i < n; i++)
            v[i] /= norm;
    }
}

/* x times each direction.  A sum waits for its last term, but not for the others. */
static void dots(size_t n, const double *x, const double *direction, double ret[GUESS_PARAMETERS])
{
    double sum[GUESS_PARAMETERS] = { 0 };
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < GUESS_PARAMETERS; k++)
            sum[k] += x[i] * direction[k * n + i];
    memcpy(ret, sum, sizeof sum);
}

/* Directions times the sample's covariance, again and again: what varies most grows most. */
static void find_directions(struct sample *s, double *product)
{
    size_t n = s->bands;
    for (size_t k = 0; k < GUESS_PARAMETERS; k++)
        for (size_t i = 0; i < n; i++)
            s->direction[k * n + i] = cos(UNITS_PI * ((double)i + 0.5) * (double)k / (double)n);
    make_orthonormal(n, s->direction);
    for (int turn = 0; turn < ITERATIONS; turn++) {
        memset(product, 0, (size_t)GUESS_PARAMETERS * n * sizeof *product);
        for (size_t j = 0; j < SKINS; j++) {
            double along[GUESS_PARAMETERS];
            dots(n, s->straight + j * n, s->direction, along);
            for (size_t k = 0; k < GUESS_PARAMETERS; k++)
                add_scaled(n, along[k], s->straight + j * n, product + k * n);
        }
        memcpy(s->direction, product, (size_t)GUESS_PARAMETERS * n * sizeof *product);
        make_orthonormal(n, s->direction);
    }
}

/* The sample's components, of mean square 1, and how they come from a spectrum. */
static void project(struct sample *s, double *mean, struct guess *ret)
{
    size_t n = s->bands;
    memset(mean, 0, n * sizeof *mean);
    for (size_t j = 0; j < SKINS; j++)
        add_scaled(n, 1.0 / SKINS, s->straight + j * n, mean);
    for (size_t j = 0; j < SKINS; j++)
        add_scaled(n, -1.0, mean, s->straight + j * n);
    find_directions(s, mean + n);
    for (size_t k = 0; k < GUESS_PARAMETERS; k++) {
        double *v = s->direction + k * n, square = 0.0;
        for (size_t j = 0; j < SKINS; j++) {
            s->component[j][k] = dot(n, s->straight + j * n, v);
            square += s->component[j][k] * s->component[j][k] / SKINS;
        }
        double scale = square > 0.0 ? 1.0 / sqrt(square) : 0.0;
        for (size_t j = 0; j < SKINS; j++)
            s->component[j][k] *= scale;
        for (size_t i = 0; i < n; i++)
            ret->direction[i][k] = (float)(scale * v[i]);
        ret->offset[k] = (float)(scale * dot(n, mean, v));
    }
}

/* ---- polynomials ------------------------------------------------------------------------------
 */

/* Each term of a degree from those of the degree before, by the component that comes last in it. */
static void list_terms(struct guess *ret)
{
    size_t n = 1, from = 0;
    ret->before[0] = ret->by[0] = 0;
    for (int degree = 1; degree <= GUESS_DEGREE; degree++) {
        size_t to = n;
        for (size_t i = from; i < to; i++)
            for (unsigned by = degree == 1 ? 0 : ret->by[i]; by < GUESS_PARAMETERS; by++) {
                ret->before[n] = (unsigned char)i;
                ret->by[n++] = (unsigned char)by;
            }
        from = to;
    }
}

/* A x = b in place for GUESS_PARAMETERS b at once; A is positive definite, its lower triangle is
 * used. */
static void solve(size_t n, double A[GUESS_TERMS][GUESS_TERMS],
                  double b[GUESS_TERMS][GUESS_PARAMETERS])
{
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j <= i; j++) {
            double sum = A[i][j] - dot(j, A[i], A[j]);
            A[i][j] = i == j ? sqrt(sum) : sum / A[j][j];
        }
        for (size_t k = 0; k < GUESS_PARAMETERS; k++) {
            for (size_t j = 0; j < i; j++)
                b[i][k] -= A[i][j] * b[j][k];
            b[i][k] /= A[i][i];
        }
    }
    for (size_t i = n; i-- > 0;)
        for (size_t k = 0; k < GUESS_PARAMETERS; k++) {
            for (size_t j = i + 1; j < n; j++)
                b[i][k] -= A[j][i] * b[j][k];
            b[i][k] /= A[i][i];
        }
}

struct equations {
    double A[GUESS_TERMS][GUESS_TERMS], b[GUESS_TERMS][GUESS_PARAMETERS];
};

/* Skins whose products are added at a time, in their order: each sum is fetched and kept once for
 * them. */
enum { AT_A_TIME = 4 };
_Static_assert((int)SKINS % (int)AT_A_TIME == 0, "no skin is left over");

/* The first n terms into ret[n]. */
static void fit_terms(const struct sample *s, size_t n, struct equations *e,
                      const struct guess *guess, float (*ret)[GUESS_PARAMETERS])
{
    memset(e, 0, sizeof *e);
    for (size_t j = 0; j < SKINS; j += AT_A_TIME) {
        double term[AT_A_TIME][GUESS_TERMS];
        for (size_t l = 0; l < AT_A_TIME; l++) {
            term[l][0] = 1.0;
            for (size_t i = 1; i < n; i++)
                term[l][i] = term[l][guess->before[i]] * s->component[j + l][guess->by[i]];
        }
        for (size_t i = 0; i < n; i++) {
            double *A = e->A[i], a = term[0][i], b = term[1][i], c = term[2][i], d = term[3][i];
            for (size_t k = 0; k <= i; k++)
                A[k] = A[k] + a * term[0][k] + b * term[1][k] + c * term[2][k] + d * term[3][k];
            for (size_t l = 0; l < AT_A_TIME; l++)
                add_scaled(GUESS_PARAMETERS, term[l][i], s->wanted[j + l], e->b[i]);
        }
    }
    for (size_t i = 0; i < n; i++)
        e->A[i][i] += RIDGE * SKINS;
    solve(n, e->A, e->b);
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < GUESS_PARAMETERS; k++)
            ret[i][k] = (float)e->b[i][k];
}

/* How far out of the bounds a value may be told and still be a guess: where no skin of the fit is
 * near, the polynomial runs away. */
#define MARGIN 0.25

static void find_ends(const struct fit *fit, struct guess *ret)
{
    static const enum skin_parameter which[GUESS_PARAMETERS] = { SKIN_CM, SKIN_BM, SKIN_CH };
    for (size_t k = 0; k < GUESS_PARAMETERS; k++) {
        double lo = fit->role[which[k]].lo, hi = fit->role[which[k]].hi;
        double from = which[k] == SKIN_BM ? lo : sqrt(lo), to = which[k] == SKIN_BM ? hi : sqrt(hi);
        ret->least[k] = (float)(from - MARGIN * (to - from));
        ret->most[k] = (float)(to + MARGIN * (to - from));
    }
}

enum status guess_init(const struct fit *fit, const struct quick *quick, struct guess *ret)
{
    size_t n = quick->c->n;
    struct equations *equations = malloc(sizeof *equations);
    size_t parameters = GUESS_PARAMETERS, skins = SKINS;
    double *room = malloc((skins * (n + 2 * parameters) + (2 * parameters + 1) * n) * sizeof *room);
    enum status status = STATUS_NO_MEMORY;
    if (equations != NULL && room != NULL) {
        struct sample s = { .bands = n, .straight = room };
        s.wanted = (double(*)[GUESS_PARAMETERS])(room + (size_t)SKINS * n);
        s.component = s.wanted + SKINS;
        s.direction = (double *)(s.component + SKINS);
        status = take_sample(fit, quick, &s);
        if (status == STATUS_OK) {
            project(&s, s.direction + (size_t)GUESS_PARAMETERS * n, ret);
            list_terms(ret);
            fit_terms(&s, 1 + GUESS_PARAMETERS, equations, ret, ret->linear);
            fit_terms(&s, GUESS_TERMS, equations, ret, ret->term);
            find_ends(fit, ret);
        }
    }
    free(room);
    free(equations);
    return status;
}
