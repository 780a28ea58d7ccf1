/* kd_frame.c - subspace iteration on the covariance of the points.
 *
 * Any orthonormal directions give a valid bound, good ones a tight one: a few rounds do. */
#include "match/kd_frame.h"

#include <math.h>
#include <string.h>

enum { DIMS = KD_TREE_MAX_DIMS, DIRECTIONS = KD_FRAME_DIRECTIONS, ROUNDS = 6 };

/* ---- directions --------------------------------------------------------------------- */

static double dot(const double x[DIMS], const double y[DIMS])
{
    double sum = 0.0;
    for (size_t i = 0; i < DIMS; i++)
        sum += x[i] * y[i];
    return sum;
}

/* Take what lies in the earlier directions out of this one; returns the norm left. */
static double take_out_earlier(double direction[DIRECTIONS][DIMS], size_t which)
{
    for (size_t j = 0; j < which; j++) {
        double along = dot(direction[j], direction[which]);
        for (size_t i = 0; i < DIMS; i++)
            direction[which][i] -= along * direction[j][i];
    }
    return sqrt(dot(direction[which], direction[which]));
}

/* Gram-Schmidt, twice each.  A direction nearly all in the earlier ones would be made of rounding,
 * so it becomes 0; so does what is too small for its square. */
static void make_orthonormal(double direction[DIRECTIONS][DIMS])
{
    for (size_t which = 0; which < DIRECTIONS; which++) {
        double *v = direction[which], before = sqrt(dot(v, v));
        double after = take_out_earlier(direction, which);
        if (after > 1e-8 * before && before > 1e-100 && before < 1e100)
            after = take_out_earlier(direction, which);
        else
            after = 0.0;
        for (size_t i = 0; i < DIMS; i++)
            v[i] = after > 0.0 ? v[i] / after : 0.0;
    }
}

/* The axes along which most lies, most first. */
static void begin_with_axes(double covariance[DIMS][DIMS], double direction[DIRECTIONS][DIMS])
{
    bool taken[DIMS] = { false };
    for (size_t which = 0; which < DIRECTIONS; which++) {
        size_t most = DIMS;
        for (size_t i = 0; i < DIMS; i++)
            if (!taken[i] && (most == DIMS || covariance[i][i] > covariance[most][most]))
                most = i;
        taken[most] = true;
        direction[which][most] = 1.0;
    }
}

static void iterate(double covariance[DIMS][DIMS], double direction[DIRECTIONS][DIMS])
{
    for (size_t which = 0; which < DIRECTIONS; which++) {
        double product[DIMS];
        for (size_t i = 0; i < DIMS; i++)
            product[i] = dot(covariance[i], direction[which]);
        memcpy(direction[which], product, sizeof product);
    }
    make_orthonormal(direction);
}

/* Covariance, but for a factor, of the points around the centre. */
static void add_all(size_t dims, size_t n, const float *point, size_t stride,
                    const float centre[DIMS], double covariance[DIMS][DIMS])
{
    for (size_t number = 0; number < n; number++) {
        double x[DIMS] = { 0.0 };
        for (size_t i = 0; i < dims; i++)
            x[i] = (double)point[number * stride + i] - (double)centre[i];
        for (size_t i = 0; i < dims; i++)
            for (size_t j = 0; j < DIMS; j++)
                covariance[i][j] += x[i] * x[j];
    }
}

void kd_frame_make(size_t dims, size_t n, const float *point, size_t stride, struct kd_frame *ret)
{
    double centre[DIMS] = { 0.0 }, covariance[DIMS][DIMS] = { { 0.0 } };
    double direction[DIRECTIONS][DIMS] = { { 0.0 } };
    for (size_t number = 0; number < n; number++)
        for (size_t i = 0; i < dims; i++)
            centre[i] += (double)point[number * stride + i];
    for (size_t i = 0; i < DIMS; i++)
        ret->centre[i] = (float)(centre[i] / (double)n);
    add_all(dims, n, point, stride, ret->centre, covariance);
    begin_with_axes(covariance, direction);
    for (int round = 0; round < ROUNDS; round++)
        iterate(covariance, direction);
    for (size_t which = 0; which < DIRECTIONS; which++)
        for (size_t i = 0; i < DIMS; i++)
            ret->direction[which][i] = (float)direction[which][i];
}

/* ---- points ------------------------------------------------------------------------- */

enum { LANES = VECTORS_LANES };

/* In a fixed order, whatever the vectors. */
VECTORS_INLINE double sum_of(const double x[DIMS])
{
    double eight[LANES], four[LANES / 2];
    for (size_t i = 0; i < LANES; i++)
        eight[i] = x[i] + x[LANES + i];
    for (size_t i = 0; i < LANES / 2; i++)
        four[i] = eight[i] + eight[LANES / 2 + i];
    return (four[0] + four[2]) + (four[1] + four[3]);
}

VECTORS_INLINE void point_any(const struct kd_frame *frame, const float *point, float *ret)
{
    double rest[DIMS], along[DIRECTIONS], product[DIMS];
    for (size_t i = 0; i < DIMS; i++)
        rest[i] = (double)point[i] - (double)frame->centre[i];
    for (size_t which = 0; which < DIRECTIONS; which++) {
        for (size_t i = 0; i < DIMS; i++)
            product[i] = rest[i] * (double)frame->direction[which][i];
        along[which] = sum_of(product);
    }
    for (size_t which = 0; which < DIRECTIONS; which++) {
        ret[which] = (float)along[which];
        for (size_t i = 0; i < DIMS; i++)
            rest[i] -= along[which] * (double)frame->direction[which][i];
    }
    for (size_t i = 0; i < DIMS; i++)
        product[i] = rest[i] * rest[i];
    ret[DIRECTIONS] = (float)sqrt(sum_of(product));
}

static void point_plain(const struct kd_frame *frame, const float *point, float *ret)
{
    point_any(frame, point, ret);
}

VECTORS_AVX2 static void point_avx2(const struct kd_frame *frame, const float *point, float *ret)
{
    point_any(frame, point, ret);
}

VECTORS_AVX512 static void point_avx512(const struct kd_frame *frame, const float *point,
                                        float *ret)
{
    point_any(frame, point, ret);
}

void kd_frame_point(enum vectors kind, const struct kd_frame *frame,
                    const float point[KD_TREE_MAX_DIMS], float ret[KD_FRAME_DIMS])
{
    static void (*const of[VECTORS_KINDS])(const struct kd_frame *, const float *,
                                           float *) = { point_plain, point_avx2, point_avx512 };
    of[kind](frame, point, ret);
}
