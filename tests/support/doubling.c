/* doubling.c - matrices are n rows of n, packed: what comes out in direction i of light in
 * direction j. */
#include "tests/support/doubling.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

typedef double matrix[DOUBLING_MAX * DOUBLING_MAX];

/* What gets through an endless layer at most: to and fro it counts twice. */
#define ENOUGH 1e-6

struct slab {
    matrix R, T;
};

static void keep(int n, const double *from, double *ret)
{
    memcpy(ret, from, (size_t)(n * n) * sizeof *ret);
}

static void multiply(int n, const double *x, const double *y, double *ret)
{
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            double sum = 0.0;
            for (int k = 0; k < n; k++)
                sum += x[i * n + k] * y[k * n + j];
            ret[i * n + j] = sum;
        }
}

/* x = left^-1 right by Gauss elimination with pivots; left is used up. */
static void solve(int n, matrix left, matrix right, matrix x)
{
    keep(n, right, x);
    for (int c = 0; c < n; c++) {
        int pivot = c;
        for (int i = c + 1; i < n; i++)
            if (fabs(left[i * n + c]) > fabs(left[pivot * n + c]))
                pivot = i;
        for (int j = 0; j < n; j++) {
            double a = left[c * n + j], b = x[c * n + j];
            left[c * n + j] = left[pivot * n + j], left[pivot * n + j] = a;
            x[c * n + j] = x[pivot * n + j], x[pivot * n + j] = b;
        }
        for (int i = 0; i < n; i++) {
            double factor = i == c ? 0.0 : left[i * n + c] / left[c * n + c];
            if (factor == 0.0)
                continue;
            for (int j = c; j < n; j++)
                left[i * n + j] -= factor * left[c * n + j];
            for (int j = 0; j < n; j++)
                x[i * n + j] -= factor * x[c * n + j];
        }
    }
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            x[i * n + j] /= left[i * n + i];
}

/* (1 - x y)^-1 z */
static void between(int n, matrix x, matrix y, matrix z, matrix ret)
{
    matrix left;
    multiply(n, x, y, left);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            left[i * n + j] = (i == j ? 1.0 : 0.0) - left[i * n + j];
    solve(n, left, z, ret);
}

/* The diamond scheme: with A and B half of what a layer takes from and adds to each direction,
 * T = 2G - 1 and R = 2 G B (1+A)^-1, G = (1 + A - B (1+A)^-1 B)^-1. */
static void thin(const struct streams *s, double albedo, double depth, struct slab *ret)
{
    int n = s->n;
    matrix plus, copy, B, one, quotient, G;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            one[i * n + j] = i == j ? 1.0 : 0.0;
            B[i * n + j] = 0.25 * albedo * depth * s->w[j] / s->mu[i];
            plus[i * n + j] = one[i * n + j] * (1.0 + 0.5 * depth / s->mu[i]) - B[i * n + j];
        }
    keep(n, plus, copy);
    solve(n, copy, B, quotient);
    multiply(n, B, quotient, copy);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            copy[i * n + j] = plus[i * n + j] - copy[i * n + j];
    solve(n, copy, one, G);
    /* R = (1+A)^-1 B (1 + T), from the equation of the light that goes up. */
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            ret->T[i * n + j] = 2.0 * G[i * n + j] - one[i * n + j];
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            copy[i * n + j] = one[i * n + j] + ret->T[i * n + j];
    multiply(n, quotient, copy, ret->R);
}

/* R + T (1 - below R)^-1 below T: a slab over what reflects as `below`. */
static void add(int n, struct slab *top, matrix below, matrix ret)
{
    matrix through, up, out;
    multiply(n, below, top->T, through);
    between(n, below, top->R, through, up);
    multiply(n, top->T, up, out);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            ret[i * n + j] = top->R[i * n + j] + out[i * n + j];
}

/* With X = (1 - R R)^-1 T: T becomes T X, and R grows by T R X, for R and the inverse commute. */
static void twice(int n, struct slab *slab)
{
    matrix X, up, out;
    between(n, slab->R, slab->R, slab->T, X);
    multiply(n, slab->R, X, up);
    multiply(n, slab->T, up, out);
    for (int i = 0; i < n * n; i++)
        slab->R[i] += out[i];
    multiply(n, slab->T, X, out);
    keep(n, out, slab->T);
}

static bool gets_through(int n, const struct slab *slab)
{
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            if (fabs(slab->T[i * n + j]) > ENOUGH)
                return true;
    return false;
}

static void layer_of(const struct streams *s, double albedo, double tau, double thinness,
                     struct slab *ret)
{
    int times = 0;
    while (ldexp(tau, -times) > thinness * s->mu[0])
        times++;
    thin(s, albedo, ldexp(tau, -times), ret);
    while (times-- > 0)
        twice(s->n, ret);
}

static void endless(const struct streams *s, double albedo, double thinness, struct slab *ret)
{
    thin(s, albedo, thinness * s->mu[0], ret);
    for (int times = 0; times < 60 && gets_through(s->n, ret); times++)
        twice(s->n, ret);
}

double doubling_two_layers(const struct streams *s, double albedo1, double tau, double albedo2,
                           double thinness)
{
    int n = s->n;
    struct slab epidermis, dermis;
    matrix R, left, in = { 0 }, up;
    layer_of(s, albedo1, tau, thinness, &epidermis);
    endless(s, albedo2, thinness, &dermis);
    add(n, &epidermis, dermis.R, R);

    /* Under the surface, which sends part of what comes up down again: (1 - R r)^-1 R in. */
    double sum = 0.0;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            left[i * n + j] = (i == j ? 1.0 : 0.0) - R[i * n + j] * s->inside[j];
    for (int i = 0; i < n; i++)
        in[i * n] = R[i * n + n - 1] * s->entering / (s->mu[n - 1] * s->w[n - 1]);
    solve(n, left, in, up);
    for (int i = 0; i < n; i++)
        sum += s->mu[i] * s->w[i] * (1.0 - s->inside[i]) * up[i * n];
    return sum;
}
