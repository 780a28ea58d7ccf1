/* intervals.c - the ends of a profile, by Newton's method on the root of chi^2. */
#include "match/intervals.h"

#include <math.h>
#include <string.h>

/* Root of the 95 % point of chi^2 with one degree of freedom, 3.841459. */
#define ROOT_95 1.959963984540054
/* The minimum over the others is found to this in chi^2; 1e-3 moves an end by 0.01 %. */
#define INNER_TOLERANCE 1e-3
/* A mean is tied this closely, in standard errors. */
#define TIE 1e-3
enum { INNER_STEPS = 25, OUTER_STEPS = 25 };

void minimum_covariance(const struct misfit *m, struct minimum *at)
{
    double unseen[LEAST_SQUARES_MAX];
    for (size_t i = 0; i < m->n; i++)
        unseen[i] = (m->hi[i] - m->lo[i]) * (m->hi[i] - m->lo[i]);
    normal_covariance(&at->normal, m->n, unseen, at->covariance);
}

/* Covariance of place j with the mean of a parameter's places. */
static double with_mean(const struct misfit *m, const struct minimum *at, enum skin_parameter i,
                        size_t j)
{
    double sum = 0.0;
    for (size_t k = 0; k < m->places[i]; k++)
        sum += at->covariance[(m->first[i] + k) * m->n + j];
    return sum / (double)m->places[i];
}

double minimum_se(const struct misfit *m, const struct minimum *at, enum skin_parameter i)
{
    double sum = 0.0, most = m->fit->role[i].hi - m->fit->role[i].lo;
    for (size_t k = 0; k < m->places[i]; k++)
        sum += with_mean(m, at, i, m->first[i] + k);
    double se = sqrt(sum / (double)m->places[i]);
    return se < most ? se : most; /* NaN too */
}

/* ---- one profile ------------------------------------------------------------------- */

struct profile {
    struct misfit *misfit;
    const struct minimum *at;
    enum skin_parameter parameter;
    double value, se;            /* at the minimum */
    double x[LEAST_SQUARES_MAX]; /* where the last minimum over the others was */
};

/* Where the quadratic has the minimum over the others when the parameter is at theta. */
static void follow(struct profile *p, double theta)
{
    const struct misfit *m = p->misfit;
    size_t first = m->first[p->parameter], places = m->places[p->parameter];
    double own = 0.0;
    for (size_t k = 0; k < places; k++)
        own += with_mean(m, p->at, p->parameter, first + k) / (double)places;
    for (size_t j = 0; j < m->n; j++) {
        double share = with_mean(m, p->at, p->parameter, j) / own;
        p->x[j] = p->at->x[j] + (isfinite(share) ? share * (theta - p->value) : 0.0);
    }
}

/* Chi^2 above its minimum with the parameter at theta, and its derivative by theta.  One
 * place is held there; the mean of several is tied to it, and the tie's part taken off. */
static double rise(struct profile *p, double theta, double *slope)
{
    struct misfit *m = p->misfit;
    size_t first = m->first[p->parameter], places = m->places[p->parameter];
    double sd = TIE * p->se, lo = m->lo[first], hi = m->hi[first], tied = 0.0;
    struct normal normal;
    struct least_squares_run run;
    follow(p, theta);
    if (places == 1) {
        m->lo[first] = m->hi[first] = theta;
    } else {
        m->tie.parameter = p->parameter;
        m->tie.mean = theta;
        m->tie.sd = sd;
    }
    struct least_squares problem = misfit_problem(m, INNER_TOLERANCE, INNER_STEPS);
    enum status s = least_squares_run(&problem, p->x, &normal, &run);
    m->lo[first] = lo;
    m->hi[first] = hi;
    m->tie.sd = INFINITY;
    if (s != STATUS_OK)
        return INFINITY;
    *slope = 0.0;
    for (size_t k = 0; k < places; k++)
        *slope += 2.0 * normal.gradient[first + k];
    if (places > 1) {
        double off = (misfit_mean(m, p->x, p->parameter) - theta) / sd;
        *slope -= 2.0 * off / sd;
        tied = off * off;
    }
    return normal.chi_square - tied - p->at->normal.chi_square;
}

/* The end towards `bound`; false where a better minimum was met, which is then in p->x. */
static bool find_end(struct profile *p, double bound, double *ret)
{
    double towards = bound < p->value ? -1.0 : 1.0, inside = p->value, outside = bound;
    bool outside_tried = false;
    double theta = p->value + towards * ROOT_95 * p->se;
    for (int turn = 0; turn < OUTER_STEPS; turn++) {
        double slope = 0.0;
        if (!(towards * (theta - inside) > 0.0))
            theta = 0.5 * (inside + outside);
        if (towards * (theta - outside) >= 0.0)
            theta = outside_tried ? 0.5 * (inside + outside) : bound;
        double rises = rise(p, theta, &slope);
        if (rises < -0.01)
            return false;
        double root = sqrt(fmax(rises, 0.0)), off = root - ROOT_95;
        if (off <= 0.0 && theta == bound)
            break;
        if (off <= 0.0)
            inside = theta;
        else
            outside = theta;
        outside_tried = outside_tried || off > 0.0;
        double newton = theta - off * 2.0 * root / slope;
        theta = isfinite(newton) ? newton : outside;
        /* From so near the last step needs no look at where it leads. */
        if (fabs(off) < 0.05 || fabs(outside - inside) < 1e-9 * fabs(bound - p->value))
            break;
    }
    double low = fmin(inside, outside), high = fmax(inside, outside);
    *ret = fmin(fmax(theta, low), high);
    return true;
}

bool interval_find(struct misfit *m, const struct minimum *at, enum skin_parameter i, double *lo,
                   double *hi, double *better)
{
    const struct skin_role *role = &m->fit->role[i];
    struct profile p = { .misfit = m, .at = at, .parameter = i };
    double ends[2], bound[2] = { role->lo, role->hi };
    p.value = misfit_mean(m, at->x, i);
    p.se = minimum_se(m, at, i);
    for (int k = 0; k < 2; k++) {
        ends[k] = bound[k];
        if (p.value != bound[k] && !find_end(&p, bound[k], &ends[k])) {
            memcpy(better, p.x, m->n * sizeof *better);
            return false;
        }
    }
    *lo = ends[0];
    *hi = ends[1];
    return true;
}
