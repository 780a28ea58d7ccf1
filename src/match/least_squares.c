/* least_squares.c - Gauss-Newton in a box. */
#include "match/least_squares.h"

#include <math.h>
#include <string.h>

enum { MAX = LEAST_SQUARES_MAX, TRIANGLE = MAX * (MAX + 1) / 2 };

static size_t packed(size_t i, size_t j)
{
    return i >= j ? i * (i + 1) / 2 + j : j * (j + 1) / 2 + i;
}

/* ---- small dense algebra ------------------------------------------------------------ */

/* Three or five parameters are usual, or one less where one rests on a bound: for these the loops
 * below are made anew with constant ends, and come apart into straight lines. */
#define INLINE static inline __attribute__((always_inline))
#define UNROLLED _Pragma("GCC unroll 8")
#define FOR_SIZE(n, call) \
    ((n) == 2 ? call(2) : (n) == 3 ? call(3) : (n) == 4 ? call(4) : (n) == 5 ? call(5) : call(n))

/* L D L^T = A, all packed, A's diagonal grown by damping times itself.  L has 1 on its diagonal;
 * there stands 1/D, for it is only divided by.  A pivot that rounding has eaten is marked by 0:
 * that direction is not seen. */
INLINE void factor(const double *A, size_t n, double damping, double *L)
{
    double *Li = L, with_D[MAX];
    UNROLLED
    for (size_t i = 0; i < n; Li += ++i) {
        const double *Ai = A + i * (i + 1) / 2, *Lj = L;
        double whole = Ai[i] * (1.0 + damping), D = whole;
        UNROLLED
        for (size_t j = 0; j < i; Lj += ++j) {
            double x = Ai[j];
            UNROLLED
            for (size_t k = 0; k < j; k++)
                x -= with_D[k] * Lj[k];
            with_D[j] = x;
            Li[j] = x * Lj[j];
            D -= x * Li[j];
        }
        Li[i] = D > 1e-14 * whole && D > 0.0 ? 1.0 / D : 0.0;
    }
}

/* b becomes A^-1 b; 0 along directions that are not seen. */
INLINE void substitute(const double *L, size_t n, double *b)
{
    const double *Li = L;
    UNROLLED
    for (size_t i = 0; i < n; Li += ++i)
        UNROLLED
    for (size_t k = 0; k < i; k++)
        b[i] -= Li[k] * b[k];
    UNROLLED
    for (size_t i = n; i-- > 0;) {
        Li -= i + 1;
        b[i] *= Li[i];
    }
    UNROLLED
    for (size_t i = n; i-- > 0;) {
        Li = L + i * (i + 1) / 2;
        UNROLLED
        for (size_t k = 0; k < i; k++)
            b[k] -= Li[k] * b[i];
    }
}

INLINE void solve_of(const double *A, size_t n, double damping, double *b)
{
    double L[TRIANGLE];
    factor(A, n, damping, L);
    substitute(L, n, b);
}

static void solve(const double *A, size_t n, double damping, double *b)
{
#define CALL(size) solve_of(A, size, damping, b)
    FOR_SIZE(n, CALL);
#undef CALL
}

INLINE void invert_of(const double *A, size_t n, const double *unseen, double *inverse)
{
    double L[TRIANGLE];
    factor(A, n, 0.0, L);
    for (size_t i = 0; i < n; i++) {
        double *column = inverse + i * n;
        for (size_t k = 0; k < n; k++)
            column[k] = k == i ? 1.0 : 0.0;
        substitute(L, n, column);
        if (!(L[packed(i, i)] > 0.0))
            column[i] = unseen[i];
    }
}

void normal_covariance(const struct normal *normal, size_t n, const double *unseen, double *inverse)
{
#define CALL(size) invert_of(normal->curvature, size, unseen, inverse)
    FOR_SIZE(n, CALL);
#undef CALL
}

/* ---- the step: a quadratic in a box ---------------------------------------------------- */

/* Minimum of 2 g.p + p^T (H + damping diag H) p over lo - x <= p <= hi - x, by the primal
 * active-set method: towards the minimum over the free ones, to rest at the first bound met;
 * when there, the held one that pulls hardest inwards is let go. */
struct step {
    const struct least_squares *problem;
    const struct normal *normal;
    const double *x;
    double damping;
    double p[MAX];
    bool held[MAX];
};

/* p and held are set by find_step(). */
static void step_init(struct step *s, const struct least_squares *problem,
                      const struct normal *normal, const double *x)
{
    s->problem = problem;
    s->normal = normal;
    s->x = x;
    s->damping = 0.0;
}

static double room_below(const struct step *s, size_t i)
{
    return s->problem->lo[i] - s->x[i];
}

static double room_above(const struct step *s, size_t i)
{
    return s->problem->hi[i] - s->x[i];
}

/* Half the derivative of the quadratic by p[i]. */
static double slope_at(const struct step *s, size_t i)
{
    const double *H = s->normal->curvature;
    const double *row = H + i * (i + 1) / 2; /* to the diagonal; then down the column */
    double sum = s->normal->gradient[i] + s->damping * row[i] * s->p[i];
    for (size_t j = 0; j <= i; j++)
        sum += row[j] * s->p[j];
    for (size_t j = i + 1; j < s->problem->n; j++)
        sum += H[j * (j + 1) / 2 + i] * s->p[j];
    return sum;
}

/* From p by d of the rows that are not held, or to the first bound met, where that one comes to
 * rest; true where it went all the way. */
static bool advance(struct step *s, const size_t *row, size_t free, const double *d)
{
    size_t blocking = MAX;
    double share = 1.0;
    for (size_t k = 0; k < free; k++) {
        size_t i = row[k];
        double room = d[k] < 0.0 ? room_below(s, i) - s->p[i] : room_above(s, i) - s->p[i];
        if (fabs(d[k]) * share > fabs(room)) {
            share = fabs(room) / fabs(d[k]);
            blocking = k;
        }
    }
    for (size_t k = 0; k < free; k++)
        s->p[row[k]] += share * d[k];
    if (blocking == MAX)
        return true;
    size_t i = row[blocking];
    s->held[i] = true;
    s->p[i] = d[blocking] < 0.0 ? room_below(s, i) : room_above(s, i);
    return false;
}

/* One walk; true where it went all the way. */
static bool walk(struct step *s)
{
    size_t free = 0, row[MAX];
    double A[TRIANGLE], *Ak = A, d[MAX];
    for (size_t i = 0; i < s->problem->n; i++) {
        if (s->held[i])
            continue;
        d[free] = -slope_at(s, i);
        row[free++] = i;
        for (size_t k = 0; k < free; k++)
            *Ak++ = s->normal->curvature[packed(i, row[k])];
    }
    if (free == 0)
        return true;
    solve(A, free, s->damping, d);
    return advance(s, row, free, d);
}

/* Let go of the held one that would lower chi^2 most; false where none would. */
static bool let_go(struct step *s)
{
    size_t best = MAX;
    double gain = 0.0;
    for (size_t i = 0; i < s->problem->n; i++) {
        if (!s->held[i] || s->problem->lo[i] == s->problem->hi[i])
            continue;
        double slope = slope_at(s, i), H = s->normal->curvature[packed(i, i)];
        bool inwards = s->p[i] <= room_below(s, i) ? slope < 0.0 : slope > 0.0;
        if (inwards && H > 0.0 && slope * slope / H > gain) {
            gain = slope * slope / H;
            best = i;
        }
    }
    if (best == MAX)
        return false;
    s->held[best] = false;
    return true;
}

/* The usual case, nothing rests on a bound: the first walk; true where it ends inside all of them
 * and so is the step. */
static bool free_step(struct step *s)
{
    size_t n = s->problem->n, row[MAX];
    double d[MAX];
    for (size_t i = 0; i < n; i++) {
        row[i] = i;
        d[i] = -s->normal->gradient[i];
    }
    solve(s->normal->curvature, n, s->damping, d);
    return advance(s, row, n, d);
}

/* What rests on a bound and is pulled outwards; false where nothing is on a bound. */
static bool hold(struct step *s)
{
    bool any = false;
    for (size_t i = 0; i < s->problem->n; i++) {
        double g = s->normal->gradient[i];
        bool below = room_below(s, i) >= 0.0, above = room_above(s, i) <= 0.0;
        s->p[i] = 0.0;
        s->held[i] = (g >= 0.0 && below) || (g <= 0.0 && above);
        any = any || below || above;
    }
    return any;
}

/* By how much chi^2 would fall if it were the quadratic. */
static double find_step(struct step *s)
{
    size_t n = s->problem->n;
    double gain = 0.0;
    if (!hold(s) && free_step(s)) {
        for (size_t i = 0; i < n; i++)
            gain -= s->p[i] * (s->normal->gradient[i] -
                               s->damping * s->normal->curvature[packed(i, i)] * s->p[i]);
        return gain;
    }
    /* Ends by itself; the limit is for rounding. */
    for (size_t turn = 0; turn < 4 * n + 4; turn++)
        if (walk(s) && !let_go(s))
            break;
    for (size_t i = 0; i < n; i++)
        gain -= s->p[i] * (s->normal->gradient[i] + slope_at(s, i));
    return gain;
}

/* ---- the run ----------------------------------------------------------------------- */

static bool is_finite(const struct normal *normal, size_t n)
{
    double sum = normal->chi_square;
    for (size_t i = 0; i < n; i++)
        sum += normal->gradient[i] + normal->curvature[packed(i, i)];
    return isfinite(sum);
}

static void copy_normal(const struct normal *from, size_t n, struct normal *to)
{
    to->chi_square = from->chi_square;
    memcpy(to->gradient, from->gradient, n * sizeof *to->gradient);
    memcpy(to->curvature, from->curvature, n * (n + 1) / 2 * sizeof *to->curvature);
}

static double clamp(double x, double lo, double hi)
{
    return x > lo ? (x < hi ? x : hi) : lo;
}

/* Changes of chi^2 below this share of itself are not pursued: where it is large the model does
 * not explain the data, and steps converge slowly. */
#define SHARE 1e-10
/* Damping begins where a step fails, and is forgotten below. */
#define DAMPING_FIRST 1e-2
#define DAMPING_MOST 1e16
enum { LOOKS = 4 };

/* After a step that gained so large a share of what the quadratic promised: steps that go
 * to and fro across a bent valley gain little, though they all go down. */
static void damp(struct step *step, double share)
{
    if (share < 0.25)
        step->damping = fmax(4.0 * step->damping, DAMPING_FIRST);
    else if (share > 0.75)
        step->damping = step->damping > DAMPING_FIRST ? 0.1 * step->damping : 0.0;
}

/* One step tried from `here`; true where chi^2 fell, then x is the new point. */
static bool try_step(const struct least_squares *problem, struct step *step, double *x,
                     struct normal *trial)
{
    size_t n = problem->n;
    double tried[MAX];
    for (size_t i = 0; i < n; i++)
        tried[i] = clamp(x[i] + step->p[i], problem->lo[i], problem->hi[i]);
    problem->evaluate(problem->context, tried, trial);
    if (!is_finite(trial, n) || !(trial->chi_square < step->normal->chi_square))
        return false;
    memcpy(x, tried, n * sizeof *x);
    return true;
}

double least_squares_step(size_t n, const double *lo, const double *hi, const struct normal *normal,
                          double *x)
{
    const struct least_squares problem = { .n = n, .lo = lo, .hi = hi };
    struct step step;
    step_init(&step, &problem, normal, x);
    double gain = find_step(&step);
    for (size_t i = 0; i < n; i++)
        x[i] = clamp(x[i] + step.p[i], lo[i], hi[i]);
    return gain;
}

/* To where the quadratic has its minimum, unseen. */
static void last_step(const struct step *step, double *x, struct normal *ret, double gain)
{
    const struct least_squares *problem = step->problem;
    for (size_t i = 0; i < problem->n; i++)
        x[i] = clamp(x[i] + step->p[i], problem->lo[i], problem->hi[i]);
    if (step->normal != ret)
        copy_normal(step->normal, problem->n, ret);
    ret->chi_square -= gain;
}

enum status least_squares_run(const struct least_squares *problem, double *x, struct normal *at,
                              struct least_squares_run *run)
{
    size_t n = problem->n;
    struct normal second, *trial = &second;
    struct step step;
    bool failed = false, trusted = false; /* the last step kept what it promised */
    int looks = 0;
    double last_gain = problem->promised;
    step_init(&step, problem, at, x);
    *run = (struct least_squares_run){ .left = INFINITY, .evaluations = 1 };
    for (size_t i = 0; i < n; i++)
        x[i] = clamp(x[i], problem->lo[i], problem->hi[i]);
    problem->evaluate(problem->context, x, at);
    if (!is_finite(at, n))
        return STATUS_RANGE;
    for (; run->iterations < problem->steps && !run->converged; run->iterations++) {
        double chi_square = step.normal->chi_square, gain = find_step(&step);
        if (!(gain > problem->tolerance + SHARE * chi_square)) {
            /* A damped step may be small because it is damped: look without, some times. */
            run->converged = step.damping == 0.0 || failed || looks++ >= LOOKS;
            step.damping = 0.0;
            continue;
        }
        trusted = trusted || (run->evaluations == 1 && gain < 0.01 * last_gain);
        if (gain < problem->unseen && step.damping == 0.0 && trusted) {
            last_step(&step, x, at, gain);
            run->left = gain * gain / last_gain;
            run->converged = true;
            run->iterations++;
            return STATUS_OK;
        }
        run->evaluations++;
        failed = !try_step(problem, &step, x, trial);
        if (failed) {
            step.damping = fmax(10.0 * step.damping, DAMPING_FIRST);
            run->converged = step.damping > DAMPING_MOST;
        } else {
            const struct normal *left = step.normal;
            step.normal = trial;
            trial = left == at ? at : &second;
            double share = (chi_square - step.normal->chi_square) / gain;
            trusted = fabs(share - 1.0) < 0.2;
            last_gain = gain;
            damp(&step, share);
        }
    }
    if (step.normal != at)
        copy_normal(step.normal, n, at);
    return STATUS_OK;
}
