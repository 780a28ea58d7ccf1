/* colour_many.c - weighted sums along each spectrum, then the rest along the spectra. */
#include "colour/colour_many.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "colour/srgb.h"

enum { LANES = VECTORS_LANES, BLOCK = 64 };

/* ---- along a spectrum --------------------------------------------------------------- */

VECTORS_INLINE double lanes_sum(const double x[LANES])
{
    return ((x[0] + x[4]) + (x[2] + x[6])) + ((x[1] + x[5]) + (x[3] + x[7]));
}

VECTORS_INLINE void tristimulus(const struct colour_many *m, size_t n, const double *restrict R,
                                double *const XYZ[3], bool fused)
{
    for (size_t row = 0; row < n; row++, R += m->stride) {
        double X[LANES] = { 0.0 }, Y[LANES] = { 0.0 }, Z[LANES] = { 0.0 };
        for (size_t i = 0; i < m->stride; i += LANES) {
            const double *restrict r = R + i, *restrict x = m->weight[0] + i;
            const double *restrict y = m->weight[1] + i, *restrict z = m->weight[2] + i;
            VECTORS_LOOP
            for (int l = 0; l < LANES; l++) {
                X[l] = vectors_sum(fused, x[l], r[l], X[l]);
                Y[l] = vectors_sum(fused, y[l], r[l], Y[l]);
                Z[l] = vectors_sum(fused, z[l], r[l], Z[l]);
            }
        }
        XYZ[0][row] = lanes_sum(X);
        XYZ[1][row] = lanes_sum(Y);
        XYZ[2][row] = lanes_sum(Z);
    }
}

/* ---- along the spectra -------------------------------------------------------------- */

/* [CIE15] 8.2.1, as colour/lab.c. */
static const double epsilon = (6.0 / 29.0) * (6.0 / 29.0) * (6.0 / 29.0);
static const double slope = 841.0 / 108.0;

/* y nearer to x^(-1/3): h = 1 - x y^3 tells what is missing, (1-h)^(-1/3) by its series. */
VECTORS_INLINE double nearer(bool fused, double x, double y)
{
    double h = vectors_sum(fused, -(x * y), y * y, 1.0);
    double more = vectors_sum(fused, h, 35.0 / 243.0, 14.0 / 81.0);
    more = vectors_sum(fused, h, more, 2.0 / 9.0);
    return vectors_sum(fused, y * h, vectors_sum(fused, h, more, 1.0 / 3.0), y);
}

/* Cube root of x above epsilon, within 3 ulp: a third of the exponent with the sign turned, as an
 * integer, is within 3.5 % of x^(-1/3).  Of other x something finite. */
VECTORS_INLINE double cube_root(bool fused, double x)
{
    uint64_t bits;
    double y;
    memcpy(&bits, &x, sizeof bits);
    bits = (UINT64_C(0x553ee95d) - ((bits >> 32) * UINT64_C(0x55555556) >> 32)) << 32;
    memcpy(&y, &bits, sizeof y);
    y = nearer(fused, x, nearer(fused, x, y));
    return x * (y * y);
}

/* colour/lab.c's function, without the line's offset below epsilon. */
struct lightness {
    double f;
    double offset; /* what is to be added */
};

VECTORS_INLINE struct lightness lightness_of(bool fused, double t)
{
    double root = cube_root(fused, t), line = slope * t;
    bool above = t > epsilon;
    return (struct lightness){ above ? root : line, above ? 0.0 : 4.0 / 29.0 };
}

/* f(t) - f(u): two offsets take each other's place. */
VECTORS_INLINE double difference(struct lightness t, struct lightness u)
{
    return (t.f - u.f) + (t.offset - u.offset);
}

VECTORS_INLINE double linear(const double row[3], double X, double Y, double Z, bool fused)
{
    return vectors_sum(fused, row[0], X, vectors_sum(fused, row[1], Y, row[2] * Z));
}

VECTORS_INLINE void colours(const struct colour_many *m, size_t n, const double *const XYZ[3],
                            const struct colour_columns *to, bool fused)
{
    const double *restrict Xin = XYZ[0], *restrict Yin = XYZ[1], *restrict Zin = XYZ[2];
    double Lab[3][BLOCK], rgb[3][BLOCK];
    const double(*restrict M)[3] = m->rgb_of_xyz;
    const size_t whole = (n + LANES - 1) / LANES * LANES;
    VECTORS_LOOP
    for (size_t i = 0; i < whole; i++) {
        double X = Xin[i], Y = Yin[i], Z = Zin[i];
        struct lightness x = lightness_of(fused, X * m->i_white[0]);
        struct lightness y = lightness_of(fused, Y * m->i_white[1]);
        struct lightness z = lightness_of(fused, Z * m->i_white[2]);
        Lab[0][i] = 116.0 * (y.f - (4.0 / 29.0 - y.offset)); /* 16 = 116 4/29 */
        Lab[1][i] = 500.0 * difference(x, y);
        Lab[2][i] = 200.0 * difference(y, z);
        rgb[0][i] = linear(M[0], X, Y, Z, fused);
        rgb[1][i] = linear(M[1], X, Y, Z, fused);
        rgb[2][i] = linear(M[2], X, Y, Z, fused);
    }
    memcpy(to->L, Lab[0], n * sizeof *to->L);
    memcpy(to->a, Lab[1], n * sizeof *to->a);
    memcpy(to->b, Lab[2], n * sizeof *to->b);
    memcpy(to->red, rgb[0], n * sizeof *to->red);
    memcpy(to->green, rgb[1], n * sizeof *to->green);
    memcpy(to->blue, rgb[2], n * sizeof *to->blue);
}

/* ---- for each kind of vectors ------------------------------------------------------- */

static void sums_plain(const struct colour_many *m, size_t n, const double *R, double *const XYZ[3])
{
    tristimulus(m, n, R, XYZ, false);
}

static void colours_plain(const struct colour_many *m, size_t n, const double *const XYZ[3],
                          const struct colour_columns *to)
{
    colours(m, n, XYZ, to, false);
}

VECTORS_AVX2 static void sums_avx2(const struct colour_many *m, size_t n, const double *R,
                                   double *const XYZ[3])
{
    tristimulus(m, n, R, XYZ, true);
}

VECTORS_AVX2 static void colours_avx2(const struct colour_many *m, size_t n,
                                      const double *const XYZ[3], const struct colour_columns *to)
{
    colours(m, n, XYZ, to, true);
}

VECTORS_AVX512 static void sums_avx512(const struct colour_many *m, size_t n, const double *R,
                                       double *const XYZ[3])
{
    tristimulus(m, n, R, XYZ, true);
}

VECTORS_AVX512 static void colours_avx512(const struct colour_many *m, size_t n,
                                          const double *const XYZ[3],
                                          const struct colour_columns *to)
{
    colours(m, n, XYZ, to, true);
}

/* ---- the contract ------------------------------------------------------------------- */

void colour_many_xyz(const struct colour_many *m, size_t n, const double *R, double *const XYZ[3])
{
    if (m->vectors == VECTORS_WITH_AVX512)
        sums_avx512(m, n, R, XYZ);
    else if (m->vectors == VECTORS_WITH_AVX2)
        sums_avx2(m, n, R, XYZ);
    else
        sums_plain(m, n, R, XYZ);
}

void colour_many_of_xyz(const struct colour_many *m, size_t n, const double *const XYZ[3],
                        const struct colour_columns *ret)
{
    for (size_t i = 0; i < n; i += BLOCK) {
        size_t count = n - i < BLOCK ? n - i : BLOCK;
        const double *const from[3] = { XYZ[0] + i, XYZ[1] + i, XYZ[2] + i };
        struct colour_columns to = { ret->L + i,   ret->a + i,     ret->b + i,
                                     ret->red + i, ret->green + i, ret->blue + i };
        if (m->vectors == VECTORS_WITH_AVX512)
            colours_avx512(m, count, from, &to);
        else if (m->vectors == VECTORS_WITH_AVX2)
            colours_avx2(m, count, from, &to);
        else
            colours_plain(m, count, from, &to);
    }
}

void colour_many(const struct colour_many *m, size_t n, const double *R,
                 const struct colour_columns *ret)
{
    double X[BLOCK] = { 0.0 }, Y[BLOCK] = { 0.0 }, Z[BLOCK] = { 0.0 };
    double *const sums[3] = { X, Y, Z };
    const double *const XYZ[3] = { X, Y, Z };
    for (size_t i = 0; i < n; i += BLOCK) {
        size_t count = n - i < BLOCK ? n - i : BLOCK;
        struct colour_columns to = { ret->L + i,   ret->a + i,     ret->b + i,
                                     ret->red + i, ret->green + i, ret->blue + i };
        colour_many_xyz(m, count, R + i * m->stride, sums);
        colour_many_of_xyz(m, count, XYZ, &to);
    }
}

void colour_many_init(const struct xyz_weights *weights, struct colour_many *ret)
{
    memset(ret, 0, sizeof *ret);
    ret->stride = (weights->n + LANES - 1) / LANES * LANES;
    ret->vectors = vectors_best();
    for (int k = 0; k < 3; k++) {
        double axis[3] = { 0.0 }, rgb[3];
        axis[k] = 1.0;
        srgb_linear_from_xyz(axis, weights->white, rgb);
        for (int i = 0; i < 3; i++)
            ret->rgb_of_xyz[i][k] = rgb[i];
        ret->i_white[k] = 1.0 / weights->white[k];
        for (size_t band = 0; band < weights->n; band++)
            ret->weight[k][band] = weights->weight[band][k];
    }
}
