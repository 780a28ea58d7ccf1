/* layers.c - from below upwards: what a stack lets in; downwards again: the light at its borders.
 *
 * What is under the lowest layer comes as a factor, B = F^T F, so that rounding cannot make it
 * negative where nothing absorbs above and below. */
#include "optics/layers.h"

#include <math.h>
#include <stddef.h>
#include <stdbool.h>
#include <string.h>

#include "optics/dense.h"

/* 8-point Gauss-Legendre on [0, 1]: Abramowitz and Stegun 25.4.30. */
enum { POINTS = 8 };
static const double point[POINTS] = { 0.019855071751231884158, 0.10166676129318663020,
                                      0.23723379504183550709,  0.40828267875217509753,
                                      0.59171732124782490247,  0.76276620495816449291,
                                      0.89833323870681336980,  0.98014492824876811584 };
static const double point_weight[POINTS] = { 0.050614268145188129576, 0.11119051722668723527,
                                             0.15685332293894364367,  0.18134189168918099148,
                                             0.18134189168918099148,  0.15685332293894364367,
                                             0.11119051722668723527,  0.050614268145188129576 };

/* Whether light crosses a layer nearly straight even in the flattest direction.  There the formulas
 * by modes cancel, and 8 points are exact to rounding: the integrands fall by e^-2 at most. */
static bool is_thin(const struct streams *s, const struct layer *layer)
{
    return layer->tau <= s->mu[0];
}

/* k tau below which tanh and sinh are their argument to the last bit. */
#define NO_DECAY 1e-9

/* sinh(x y)/sinh(x), 0 <= y <= 1; y where x is 0. */
static double sinh_ratio(double x, double y)
{
    return x > NO_DECAY ? sinh(x * y) / sinh(x) : y;
}

/* ---- upwards -------------------------------------------------------------------- */

static double escape(const struct streams *s, ptrdiff_t i)
{
    return (1.0 - s->inside[i]) / (1.0 + s->inside[i]);
}

/* F of a surface under the stack, as rows of n. */
static void surface_factor(const struct streams *s, double *F)
{
    memset(F, 0, (size_t)(s->n * s->n) * sizeof *F);
    for (ptrdiff_t i = 0; i < s->n; i++)
        F[i * s->n + i] = sqrt(escape(s, i) / s->mu[i]);
}

static void endless_factor(ptrdiff_t n, const struct modes *modes, double *F)
{
    for (ptrdiff_t m = 0; m < n; m++) {
        double root = sqrt(modes->k[m]);
        for (ptrdiff_t i = 0; i < n; i++)
            F[m * n + i] = root * modes->V[i * n + m];
    }
}

/* E, theta, and into `tanh_k` k tanh(k tau). */
static void decay(ptrdiff_t n, struct layer *l, double *tanh_k)
{
    for (ptrdiff_t m = 0; m < n; m++) {
        double k = l->modes.k[m], x = k * l->tau, gone = exp(-2.0 * x);
        double t = -expm1(-2.0 * x) / (1.0 + gone);
        l->E[m] = 2.0 * exp(-x) / (1.0 + gone);
        l->theta[m] = x > NO_DECAY ? t / k : l->tau;
        tanh_k[m] = k * t;
    }
}

/* (1 + theta B)^-1 = theta^1/2 (1 + theta^1/2 B theta^1/2)^-1 theta^-1/2.  theta may span a hundred
 * decades; Cholesky's factors do not mind how rows are scaled. */
static void crossing(ptrdiff_t n, struct layer *l, const double *B, double *U)
{
    double root[STREAMS_MAX];
    for (ptrdiff_t m = 0; m < n; m++)
        root[m] = sqrt(l->theta[m]);
    for (ptrdiff_t i = 0; i < n; i++)
        for (ptrdiff_t j = 0; j < n; j++)
            U[i * n + j] = (i == j ? 1.0 : 0.0) + root[i] * B[i * n + j] * root[j];
    dense_factor(n, 1.0, U);
    dense_inverse(n, U, l->down);
    for (ptrdiff_t i = 0; i < n; i++)
        for (ptrdiff_t j = 0; j < n; j++)
            l->down[i * n + j] *= root[i] / root[j];
}

static void transpose(ptrdiff_t n, const double *A, double *T)
{
    for (ptrdiff_t i = 0; i < n; i++)
        for (ptrdiff_t j = 0; j < n; j++)
            T[j * n + i] = A[i * n + j];
}

/* B from under a layer to its top, in and out in scratch[0]. */
static void rise(ptrdiff_t n, struct layer *l, bool is_factor,
                 double (*scratch)[STREAMS_MAX * STREAMS_MAX])
{
    double tanh_k[STREAMS_MAX];
    double *B = scratch[0], *Z = scratch[1], *seen = scratch[2], *W = scratch[3];
    const double *V = l->modes.V;
    decay(n, l, tanh_k);
    dense_multiply(n, B, V, Z); /* seen = V^T B V */
    if (is_factor) {
        dense_gram(n, Z, seen);
    } else {
        transpose(n, V, W);
        dense_multiply(n, W, Z, seen);
    }
    crossing(n, l, seen, W);
    dense_multiply(n, seen, l->down, W);
    for (ptrdiff_t i = 0; i < n; i++) {
        for (ptrdiff_t j = i; j < n; j++)
            W[i * n + j] = (i == j ? tanh_k[i] : 0.0) + l->E[i] * W[i * n + j] * l->E[j];
        for (ptrdiff_t j = 0; j < i; j++)
            W[i * n + j] = W[j * n + i];
    }
    dense_multiply(n, V, W, Z); /* B = V W V^T */
    transpose(n, V, W);
    dense_multiply(n, Z, W, B);
}

/* ---- downwards ------------------------------------------------------------------ */

/* One layer's light from that at its top, by directions; what is below takes its place. */
static void sink(ptrdiff_t n, const struct layer *l, double *light, double *top, double *bottom)
{
    double weak[STREAMS_MAX];
    dense_apply_transposed(n, l->modes.V, light, top);
    for (ptrdiff_t m = 0; m < n; m++)
        weak[m] = l->E[m] * top[m];
    dense_apply(n, l->down, weak, bottom);
    dense_apply(n, l->modes.V, bottom, light);
}

static void pass_down(const struct streams *s, struct layers *l, double *light, double *adjoint)
{
    ptrdiff_t n = s->n;
    for (ptrdiff_t i = 0; i < l->count; i++) {
        struct layer *layer = &l->layer[i];
        if (isinf(layer->tau)) {
            dense_apply_transposed(n, layer->modes.V, light, layer->s_top);
            dense_apply_transposed(n, layer->modes.V, adjoint, layer->t_top);
            memset(light, 0, (size_t)n * sizeof *light);
        } else if (layer->tau > 0.0) {
            sink(n, layer, light, layer->s_top, layer->s_bottom);
            sink(n, layer, adjoint, layer->t_top, layer->t_bottom);
        } else {
            dense_apply_transposed(n, layer->modes.V, light, layer->s_top);
            dense_apply_transposed(n, layer->modes.V, adjoint, layer->t_top);
            memcpy(layer->s_bottom, layer->s_top, sizeof layer->s_top);
            memcpy(layer->t_bottom, layer->t_top, sizeof layer->t_top);
        }
    }
    memcpy(l->s_out, light, (size_t)n * sizeof *light);
}

void layers_solve(const struct streams *s, struct layers *l)
{
    ptrdiff_t n = s->n;
    double light[STREAMS_MAX] = { 0 }, adjoint[STREAMS_MAX];
    double *Q = l->scratch[0];
    int i = l->count - 1;
    bool is_factor = true;
    if (isinf(l->layer[i].tau))
        endless_factor(n, &l->layer[i--].modes, Q);
    else
        surface_factor(s, Q);
    for (; i >= 0; i--) {
        if (l->layer[i].tau > 0.0) {
            rise(n, &l->layer[i], is_factor, l->scratch);
            is_factor = false;
        }
    }
    if (is_factor) {
        dense_gram(n, Q, l->scratch[1]);
        Q = l->scratch[1];
    }
    /* At the surface (g/mu + B) s = what enters; the adjoint is lit where light escapes. */
    for (ptrdiff_t j = 0; j < n; j++) {
        Q[j * n + j] += escape(s, j) / s->mu[j];
        adjoint[j] = escape(s, j) * sqrt(s->w[j]);
    }
    light[n - 1] = 2.0 * s->entering / ((1.0 + s->inside[n - 1]) * sqrt(s->w[n - 1]));
    dense_factor(n, 0.0, Q);
    dense_solve(n, Q, light);
    dense_solve(n, Q, adjoint);
    pass_down(s, l, light, adjoint);
}

/* ---- what comes up --------------------------------------------------------------- */

/* What a mode sends up that goes on for ever: half of (1/mu - k) s, without the difference. */
static void add_endless(const struct streams *s, const struct modes *modes, double factor,
                        const double *by_mode, double *up)
{
    for (ptrdiff_t i = 0; i < s->n; i++) {
        double q = 1.0 / s->mu[i], sum = 0.0;
        for (ptrdiff_t m = 0; m < s->n; m++)
            sum += modes->hat[m] * by_mode[m] / (q + modes->k[m]);
        up[i] += factor * 0.5 * modes->albedo * sqrt(s->w[i]) * q * sum;
    }
}

/* The sum over all directions of the light (or the adjoint) at the points of a thin layer. */
static void light_at_points(ptrdiff_t n, const struct layer *l, const double *top,
                            const double *bottom, double at[POINTS])
{
    for (int g = 0; g < POINTS; g++) {
        at[g] = 0.0;
        for (ptrdiff_t m = 0; m < n; m++) {
            double x = l->modes.k[m] * l->tau;
            double here =
                top[m] * sinh_ratio(x, 1.0 - point[g]) + bottom[m] * sinh_ratio(x, point[g]);
            at[g] += l->modes.hat[m] * here;
        }
    }
}

/* Straight through, and scattered on the way: all terms positive. */
static void climb_thin(const struct streams *s, const struct layer *l, double *up)
{
    double at[POINTS];
    light_at_points(s->n, l, l->s_top, l->s_bottom, at);
    for (ptrdiff_t i = 0; i < s->n; i++) {
        double q = 1.0 / s->mu[i], sum = 0.0;
        for (int g = 0; g < POINTS; g++)
            sum += point_weight[g] * exp(-q * l->tau * point[g]) * at[g];
        up[i] = exp(-q * l->tau) * up[i] + 0.5 * l->modes.albedo * sqrt(s->w[i]) * q * l->tau * sum;
    }
}

/* As if the layer were endless, and what the difference at its bottom sends through. */
static void climb_thick(const struct streams *s, const struct layer *l, double *up)
{
    ptrdiff_t n = s->n;
    double by_mode[STREAMS_MAX];
    add_endless(s, &l->modes, -1.0, l->s_bottom, up);
    dense_apply_transposed(n, l->modes.V, up, by_mode);
    for (ptrdiff_t m = 0; m < n; m++)
        by_mode[m] *= exp(-l->modes.k[m] * l->tau);
    dense_apply(n, l->modes.V, by_mode, up);
    add_endless(s, &l->modes, 1.0, l->s_top, up);
}

double layers_reflectance(const struct streams *s, const struct layers *l)
{
    ptrdiff_t n = s->n;
    int i = l->count - 1;
    double up[STREAMS_MAX] = { 0 }, sum = 0.0; /* sqrt(w) I upwards */
    if (isinf(l->layer[i].tau)) {
        add_endless(s, &l->layer[i].modes, 1.0, l->layer[i].s_top, up);
        i--;
    } else {
        for (ptrdiff_t j = 0; j < n; j++)
            up[j] = l->s_out[j] / s->mu[j] * s->inside[j] / (1.0 + s->inside[j]);
    }
    for (; i >= 0; i--) {
        const struct layer *layer = &l->layer[i];
        if (is_thin(s, layer))
            climb_thin(s, layer, up);
        else
            climb_thick(s, layer, up);
    }
    for (ptrdiff_t j = 0; j < n; j++)
        sum += (1.0 - s->inside[j]) * sqrt(s->w[j]) * s->mu[j] * up[j];
    return sum;
}

double layers_transmittance(const struct streams *s, const struct layers *l)
{
    double sum = 0.0;
    for (ptrdiff_t i = 0; i < s->n; i++)
        sum += escape(s, i) * sqrt(s->w[i]) * l->s_out[i];
    return sum;
}

/* ---- slopes ---------------------------------------------------------------------- */

static double slope_endless(ptrdiff_t n, const struct layer *l)
{
    double sum = 0.0;
    for (ptrdiff_t i = 0; i < n; i++)
        for (ptrdiff_t j = 0; j < n; j++)
            sum += l->modes.hat[i] * l->s_top[i] * l->modes.hat[j] * l->t_top[j] /
                   (l->modes.k[i] + l->modes.k[j]);
    return l->modes.k[n - 1] > 0.0 ? sum : INFINITY;
}

static double slope_thin(ptrdiff_t n, const struct layer *l)
{
    double s_at[POINTS], t_at[POINTS], sum = 0.0;
    light_at_points(n, l, l->s_top, l->s_bottom, s_at);
    light_at_points(n, l, l->t_top, l->t_bottom, t_at);
    for (int g = 0; g < POINTS; g++)
        sum += point_weight[g] * s_at[g] * t_at[g];
    return l->tau * sum;
}

/* Of sinh(k t)/sinh(k tau): the integral of its square, and of it times its mirror image. */
static void mode_integrals(double k, double tau, double *square, double *mirror)
{
    double x = k * tau;
    if (x < 0.5) {
        *square = *mirror = 0.0;
        for (int g = 0; g < POINTS; g++) {
            double here = sinh_ratio(x, point[g]), there = sinh_ratio(x, 1.0 - point[g]);
            *square += tau * point_weight[g] * here * here;
            *mirror += tau * point_weight[g] * here * there;
        }
        return;
    }
    double over_sinh = 2.0 * exp(-x) / -expm1(-2.0 * x);
    double over_tanh = (1.0 + exp(-2.0 * x)) / -expm1(-2.0 * x);
    *square = (over_tanh - x * over_sinh * over_sinh) / (2.0 * k);
    *mirror = (x * over_tanh - 1.0) * over_sinh / (2.0 * k);
}

/* Two modes: (s't - s t')/(difference of k^2) between the ends, of s'' = k^2 s.  One mode: closed
 * forms. */
static double slope_thick(ptrdiff_t n, const struct layer *l)
{
    const double *k = l->modes.k, *hat = l->modes.hat;
    const double *s0 = l->s_top, *s1 = l->s_bottom, *t0 = l->t_top, *t1 = l->t_bottom;
    double ds0[STREAMS_MAX], ds1[STREAMS_MAX], dt0[STREAMS_MAX], dt1[STREAMS_MAX], sum = 0.0;
    for (ptrdiff_t m = 0; m < n; m++) {
        double over = 1.0 / l->theta[m], E = l->E[m], square, mirror;
        ds0[m] = (E * s1[m] - s0[m]) * over;
        ds1[m] = (s1[m] - E * s0[m]) * over;
        dt0[m] = (E * t1[m] - t0[m]) * over;
        dt1[m] = (t1[m] - E * t0[m]) * over;
        mode_integrals(k[m], l->tau, &square, &mirror);
        sum +=
            hat[m] * hat[m] *
            (square * (s0[m] * t0[m] + s1[m] * t1[m]) + mirror * (s0[m] * t1[m] + s1[m] * t0[m]));
    }
    for (ptrdiff_t i = 0; i < n; i++) {
        for (ptrdiff_t j = 0; j < i; j++) {
            double ends = ds1[i] * t1[j] - s1[i] * dt1[j] - ds0[i] * t0[j] + s0[i] * dt0[j];
            double mirrored = s1[j] * dt1[i] - ds1[j] * t1[i] - s0[j] * dt0[i] + ds0[j] * t0[i];
            sum += hat[i] * hat[j] * (ends + mirrored) / ((k[i] - k[j]) * (k[i] + k[j]));
        }
    }
    return sum;
}

double layers_slope_albedo(const struct streams *s, const struct layer *layer)
{
    if (isinf(layer->tau))
        return slope_endless(s->n, layer);
    return is_thin(s, layer) ? slope_thin(s->n, layer) : slope_thick(s->n, layer);
}

double layers_at_bottom(const struct streams *s, const struct layer *layer)
{
    double light = 0.0, adjoint = 0.0;
    for (ptrdiff_t m = 0; m < s->n; m++) {
        light += layer->modes.hat[m] * layer->s_bottom[m];
        adjoint += layer->modes.hat[m] * layer->t_bottom[m];
    }
    return light * adjoint;
}
