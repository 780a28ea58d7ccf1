/* chi_square.c - the regularised incomplete gamma function at whole and half parameters. */
#define _GNU_SOURCE /* lgamma_r: lgamma() writes a variable that threads share */
#include "match/chi_square.h"

#include <float.h>
#include <math.h>

#include "base/units.h"

/* x^a e^-x / Gamma(a + 1). */
static double term(double a, double x)
{
    int sign;
    return exp(a * log(x) - x - lgamma_r(a + 1.0, &sign));
}

/* P(a, x) = x^a e^-x / Gamma(a+1) (1 + x/(a+1) + x^2/((a+1)(a+2)) + ...), [AS] 6.5.29;
 * for x < a + 1, where each term is smaller than the one before. */
static double lower(double a, double x)
{
    double sum = 1.0, next = 1.0;
    for (size_t i = 1; next > DBL_EPSILON * sum; i++) {
        next *= x / (a + (double)i);
        sum += next;
    }
    return term(a, x) * sum;
}

/* Q(a, x) = Q(a - 1, x) + x^(a-1) e^-x / Gamma(a), [AS] 6.5.21, from the top down to
 * Q(0, x) = 0 or Q(1/2, x) = erfc(sqrt x): all terms are positive. */
static double upper(double a, double x)
{
    double whole = floor(a), sum = 0.0;
    size_t terms = (size_t)whole;
    double next = terms > 0 ? term(a - 1.0, x) : 0.0;
    for (size_t i = 1; i <= terms && next > 0.0; i++) {
        sum += next;
        next *= (a - (double)i) / x;
    }
    return a > whole ? sum + erfc(sqrt(x)) : sum;
}

/* The same from Q(0, x) or Q(1/2, x) up: no logarithm, but as many terms as a.  Not
 * where e^-x is too small for a double, nor where Q is 1 but for rounding. */
static double upwards(double a, double x)
{
    size_t terms = (size_t)a;
    double off = a - (double)terms;
    double next = off > 0.0 ? 2.0 / sqrt(UNITS_PI) * sqrt(x) * exp(-x) : exp(-x);
    double sum = off > 0.0 ? erfc(sqrt(x)) : 0.0;
    for (size_t i = 1; i <= terms; i++) {
        sum += next;
        next *= x / ((double)i + off);
    }
    return fmin(sum, 1.0);
}

double chi_square_above(double value, size_t degrees)
{
    double a = 0.5 * (double)degrees, x = 0.5 * value;
    if (!(value > 0.0))
        return 1.0;
    if (isinf(value) || degrees == 0)
        return 0.0;
    if (a < 64.0 && x > 0.5 * a && x < 700.0)
        return upwards(a, x);
    return x < a + 1.0 ? 1.0 - lower(a, x) : fmin(upper(a, x), 1.0);
}
