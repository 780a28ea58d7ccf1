/* modes.c - eigenvalues of a diagonal matrix less one of rank one.
 *
 * Root m lies in the gap between pole p_m above and p_(m+1) below it (0 for the last).  Found is
 * its distance x from the pole above, by fitting r + s/(x_below) to the poles below and
 * R + S/x to those above in value and slope and solving the quadratic that is left (Bunch,
 * Nielsen, Sorensen, Rank-one modification of the symmetric eigenproblem, 1978): quadratic
 * convergence from anywhere in the gap. */
#include "optics/modes.h"

#include <math.h>
#include <stddef.h>

enum { STEPS_MAX = 60 };

/* What the poles add up to at the distances x[m], all roots side by side:
 * constant = 1 + a (r - R), above = a S, below = a s. */
struct fit {
    double constant[STREAMS_MAX], above[STREAMS_MAX], below[STREAMS_MAX];
};

static void fit_poles(ptrdiff_t n, ptrdiff_t roots, double a, const double *p, const double *w,
                      const double *x, struct fit *f)
{
    for (ptrdiff_t m = 0; m < roots; m++) {
        f->constant[m] = 1.0;
        f->above[m] = f->below[m] = 0.0;
    }
    for (ptrdiff_t i = 0; i < n; i++) {
        double weight = a * w[i] * p[i];
        ptrdiff_t lower = i < roots ? i : roots; /* for the roots before it this pole lies below */
        for (ptrdiff_t m = 0; m < lower; m++) {
            double over = 1.0 / (p[m] - x[m] - p[i]);
            double ratio = (p[m] - p[m + 1] - x[m]) * over;
            f->constant[m] += weight * over * (1.0 - ratio);
            f->below[m] += weight * ratio * ratio;
        }
        for (ptrdiff_t m = i; m < roots; m++) {
            double over = 1.0 / (p[i] - p[m] + x[m]);
            double ratio = x[m] * over;
            f->constant[m] -= weight * over * (1.0 - ratio);
            f->above[m] += weight * ratio * ratio;
        }
    }
}

/* The roots but the last: distances from the poles above. */
static void find_roots(ptrdiff_t n, double a, const double *p, const double *w, double *x)
{
    struct fit f;
    ptrdiff_t roots = n - 1;
    for (ptrdiff_t m = 0; m < roots; m++)
        x[m] = 0.5 * (p[m] - p[m + 1]);
    for (ptrdiff_t step = 0; step < STEPS_MAX; step++) {
        double most = 0.0;
        fit_poles(n, roots, a, p, w, x, &f);
        for (ptrdiff_t m = 0; m < roots; m++) {
            /* c x^2 - B x + S gap = 0; B^2 - 4 c S gap as a sum of what is positive */
            double gap = p[m] - p[m + 1], c = f.constant[m], S = f.above[m], s = f.below[m];
            double B = c * gap + s + S, less = c * gap + s - S;
            double root = sqrt(less * less + 4.0 * s * S);
            double next = B > 0.0 ? 2.0 * S * gap / (B + root) : (B - root) / (2.0 * c);
            most = fmax(most, fabs(next - x[m]) / fmin(next, gap - next));
            x[m] = next;
        }
        if (most < 1e-8) /* the next step would be below rounding */
            break;
    }
}

/* The last root from 0: l sum w/(p - l) = (1-a)/a, by Newton's method from above; the left side is
 * convex. */
static double slowest_from_zero(ptrdiff_t n, double e, const double *p, const double *w, double l)
{
    for (ptrdiff_t step = 0; step < STEPS_MAX; step++) {
        double h = 0.0, slope = 0.0;
        for (ptrdiff_t i = 0; i < n; i++) {
            double over = 1.0 / (p[i] - l);
            h += w[i] * over;
            slope += w[i] * p[i] * over * over; /* of l h */
        }
        double next = l - (l * h - e) / slope;
        double change = fabs(next - l);
        l = next;
        if (change <= 1e-9 * l)
            break;
    }
    return l;
}

/* The last root's distance x from its pole, where that is the nearer: no pole is below. */
static double slowest_from_pole(ptrdiff_t n, double a, const double *p, const double *w)
{
    double x = 0.5;
    for (ptrdiff_t step = 0; step < STEPS_MAX; step++) {
        double c = 1.0, S = 0.0;
        for (ptrdiff_t i = 0; i < n; i++) {
            double over = 1.0 / (p[i] - p[n - 1] + x), ratio = x * over;
            c -= a * w[i] * p[i] * over * (1.0 - ratio);
            S += a * w[i] * p[i] * ratio * ratio;
        }
        double next = S / c;
        double change = fabs(next - x);
        x = next;
        if (change <= 1e-9 * x)
            break;
    }
    return x;
}

/* k^2 of the slowest mode, and its distance from the pole 1. */
static double slowest(ptrdiff_t n, double a, double absorbed, const double *p, const double *w,
                      double *x)
{
    double e = absorbed / a, at_0 = 0.0, at_half = 0.0;
    for (ptrdiff_t i = 0; i < n; i++) {
        at_0 += w[i] / p[i];
        at_half += 0.5 * w[i] / (p[i] - 0.5);
    }
    if (e > at_half) {
        *x = slowest_from_pole(n, a, p, w);
        return 1.0 - *x;
    }
    double square = e > 0.0 ? slowest_from_zero(n, e, p, w, fmin(e / at_0, 0.5)) : 0.0;
    *x = 1.0 - square;
    return square;
}

void modes_init(const struct streams *s, double albedo, double absorbed, struct modes *ret)
{
    ptrdiff_t n = s->n;
    double p[STREAMS_MAX] = { 0 }, u[STREAMS_MAX], x[STREAMS_MAX], norm2[STREAMS_MAX] = { 0 };
    for (ptrdiff_t i = 0; i < n; i++) {
        p[i] = 1.0 / (s->mu[i] * s->mu[i]);
        u[i] = sqrt(s->w[i]) / s->mu[i];
    }
    find_roots(n, albedo, p, s->w, x);
    double square = slowest(n, albedo, absorbed, p, s->w, &x[n - 1]);
    for (ptrdiff_t m = 0; m < n; m++)
        ret->k[m] = sqrt(m < n - 1 ? p[m] - x[m] : square);
    /* v_i = u_i/(p_i - k^2), times x so that nothing overflows. */
    for (ptrdiff_t i = 0; i < n; i++) {
        double *row = ret->V + i * n;
        for (ptrdiff_t m = 0; m < n; m++) {
            row[m] = u[i] * (x[m] / (p[i] - p[m] + x[m]));
            norm2[m] += row[m] * row[m];
        }
    }
    for (ptrdiff_t m = 0; m < n; m++) {
        norm2[m] = 1.0 / sqrt(norm2[m]);
        ret->hat[m] = x[m] / albedo * norm2[m];
    }
    for (ptrdiff_t i = 0; i < n; i++)
        for (ptrdiff_t m = 0; m < n; m++)
            ret->V[i * n + m] *= norm2[m];
    ret->albedo = albedo;
}
