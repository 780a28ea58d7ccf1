/* streams.c - Gauss and Radau points by Newton's method, Fresnel's equations. */
#include "optics/streams.h"

#include <math.h>

#include "base/units.h"
#include "optics/dipole.h"

/* Legendre's P_n and P_(n-1) at x. */
static double legendre(int n, double x, double *before)
{
    double p = 1.0, last = 0.0;
    for (int k = 1; k <= n; k++) {
        double next = ((2 * k - 1) * x * p - (k - 1) * last) / k;
        last = p;
        p = next;
    }
    *before = last;
    return p;
}

/* (1-x^2) P_n'(x). */
static double legendre_slope(int n, double x, double p, double before)
{
    return n * (before - x * p);
}

/* Newton's method on f from x until the step no longer counts: the start is good, and a
 * step below 1e-9 is followed by one below rounding. */
static double newton(int n, double x, double (*step)(int n, double x))
{
    for (int i = 0; i < 20; i++) {
        double dx = step(n, x);
        x -= dx;
        if (fabs(dx) < 1e-9)
            break;
    }
    return x - step(n, x);
}

static double gauss_step(int n, double x)
{
    double before, p = legendre(n, x, &before);
    return p * (1.0 - x * x) / legendre_slope(n, x, p, before);
}

/* Points of [-1, 1], rising, and weights. */
static void gauss(int n, double *x, double *w)
{
    for (int i = 0; i < n; i++) {
        double before;
        double t = newton(n, -cos(UNITS_PI * (i + 0.75) / (n + 0.5)), gauss_step);
        (void)legendre(n, t, &before);
        x[i] = t;
        w[i] = 2.0 * (1.0 - t * t) / ((double)(n * n) * before * before);
    }
}

/* g = (P_(n-1) - P_n)/(1-x), whose zeros are the points but the one at 1;
 * g/g' = 1/((log of the numerator)' + 1/(1-x)). */
static double radau_step(int n, double x)
{
    double before, p = legendre(n, x, &before);
    double two_before;
    (void)legendre(n - 1, x, &two_before);
    double numerator = before - p;
    double slope = legendre_slope(n - 1, x, before, two_before) - legendre_slope(n, x, p, before);
    return numerator * (1.0 - x * x) / (slope + numerator * (1.0 + x));
}

static void radau(int n, double *x, double *w)
{
    for (int i = 0; i < n - 1; i++) {
        double before;
        double t = newton(n, -cos(UNITS_PI * (2 * i + 1) / (2 * n - 1)), radau_step);
        (void)legendre(n, t, &before);
        x[i] = t;
        w[i] = (1.0 + t) / ((double)(n * n) * before * before);
    }
    x[n - 1] = 1.0;
    w[n - 1] = 2.0 / (double)(n * n);
}

/* From [-1, 1] to [low, high]. */
static void lay(int n, double low, double high, double *x, double *w)
{
    double half = 0.5 * (high - low);
    for (int i = 0; i < n; i++) {
        x[i] = low + half * (1.0 + x[i]);
        w[i] *= half;
    }
}

static double fresnel_inside(double mu, double eta)
{
    double outside2 = 1.0 - eta * eta * (1.0 - mu) * (1.0 + mu);
    if (outside2 <= 0.0)
        return 1.0;
    double outside = sqrt(outside2);
    double across = (eta * mu - outside) / (eta * mu + outside);
    double along = (mu - eta * outside) / (mu + eta * outside);
    return 0.5 * (across * across + along * along);
}

enum status streams_init(int n, double eta, struct streams *ret)
{
    if (n < 4 || n > STREAMS_MAX || n % 4 != 0 ||
        !(eta > DIPOLE_ETA_ABOVE && eta < DIPOLE_ETA_BELOW))
        return STATUS_RANGE;
    struct streams *s = ret;
    int below = eta > 1.0 ? n / 2 : 0;
    double mu_c = eta > 1.0 ? sqrt((eta - 1.0) * (eta + 1.0)) / eta : 0.0;
    gauss(below, s->mu, s->w);
    lay(below, 0.0, mu_c, s->mu, s->w);
    radau(n - below, s->mu + below, s->w + below);
    lay(n - below, mu_c, 1.0, s->mu + below, s->w + below);
    s->mu[n - 1] = 1.0;
    s->n = n;
    s->eta = eta;
    s->entering = 1.0 - dipole_Rs(eta);
    for (int i = 0; i < n; i++)
        s->inside[i] = i < below ? 1.0 : fresnel_inside(s->mu[i], eta);
    return STATUS_OK;
}
