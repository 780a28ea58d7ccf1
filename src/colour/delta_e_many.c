/* delta_e_many.c - CIEDE2000 over vectors of rows.  Equation numbers are those of Sharma, Wu,
 * Dalal, Color Res. Appl. 30:21 (2005).
 *
 * With p1' = (a1', b1) and p2' = (a2', b2): N = a1' b2 - a2' b1 is C1' C2' sin(h2 - h1), dot =
 * p1'.p2' is C1' C2' cos(h2 - h1).  With W = C1' C2' + |dot|,
 *
 *   dH'^2 = 2 (C1' C2' - dot)       is 2 N^2 / W of near hues (dot > 0) and 2 W of far ones;
 *   C2' p1' + C1' p2'               points along the mean hue and is sqrt(2 C1' C2' W) long, of
 * near hues; of far ones, where it vanishes, C2' p1' - C1' p2' is as long, and the mean is a right
 * angle from it, towards p2'.
 *
 * So one reciprocal root gives the hue and dH'.  Beside grey dH' is 0 and the hue no matter.
 *
 * Each loop below is compiled for several kinds of vectors, as those of optics/quick.c are. */
#include "colour/delta_e_many.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

#define INLINE static inline __attribute__((always_inline))

#if defined(__clang__)
#define LOOP _Pragma("clang loop vectorize(assume_safety)")
#define WIDE "fma,avx512f,avx512dq,avx512vl"
#else
#define LOOP _Pragma("GCC ivdep")
#define WIDE "fma,avx512f,avx512dq,avx512vl,prefer-vector-width=512"
#endif

/* Rows at a time: whole vectors of any kind. */
enum { BLOCK = 64 };

/* What the pairs of a colour have in common. */
struct from {
    double L, a, b, C; /* C: without a stretch */
    double opposite;   /* which way round opposite hues are: +1 or -1 */
};

struct block {
    const double *restrict L, *restrict a, *restrict b;
    double *restrict square;
};

/* x y + z */
INLINE double sum(bool fused, double x, double y, double z)
{
    return fused ? fma(x, y, z) : x * y + z;
}

/* 1/sqrt(x), 1e-300 < x < 1e300, within 3e-12 of itself: a first guess by halving the exponent
 * (3.5 % off), then twice a step that cubes what is left.  0 gives some number. */
INLINE double inverse_root(bool fused, double x)
{
    uint64_t bits;
    double y;
    memcpy(&bits, &x, sizeof bits);
    bits = UINT64_C(0x5fe6eb50c7b537a9) - (bits >> 1);
    memcpy(&y, &bits, sizeof y);
    double left = sum(fused, -x * y, y, 1.0);
    y = sum(fused, y * left, sum(fused, left, 0.375, 0.5), y);
    left = sum(fused, -x * y, y, 1.0);
    return sum(fused, y * left, sum(fused, left, 0.375, 0.5), y);
}

/* sqrt(C^7 / (C^7 + 25^7)), Eqs. 4 and 17. */
INLINE double chroma_switch(bool fused, double C)
{
    double C2 = C * C, C7 = C2 * C2 * C2 * C;
    return C7 * inverse_root(fused, sum(fused, C7, C7, C7 * 6103515625.0) + 1e-200);
}

/* Eq. 15's T from the cosine and sine of the mean hue.  cos and sin of 30, 6 and 63 degrees are
 * multiplied out. */
INLINE double hue_weight(bool fused, double c1, double s1)
{
    double c2 = sum(fused, c1, c1, -s1 * s1), s2 = 2.0 * c1 * s1;
    double c3 = sum(fused, c2, c1, -s2 * s1), s3 = sum(fused, s2, c1, c2 * s1);
    double c4 = sum(fused, c2, c2, -s2 * s2), s4 = 2.0 * c2 * s2;
    double T = sum(fused, c1, -0.17 * 0.86602540378443864676, 1.0);
    T = sum(fused, s1, -0.17 * 0.5, T);
    T = sum(fused, c2, 0.24, T);
    T = sum(fused, c3, 0.32 * 0.99452189536827333692, T);
    T = sum(fused, s3, -0.32 * 0.10452846326765347140, T);
    T = sum(fused, c4, -0.20 * 0.45399049973954679156, T);
    return sum(fused, s4, -0.20 * 0.89100652418836786236, T);
}

/* cos of the mean hue's distance from 275 degrees; R_T is 0 from where it is cos 120 down.  Eq.
 * 16 takes hues as 0 .. 360: those from 0 up are far, and where 0 lies, the products tell. */
INLINE double towards_blue(bool fused, double c, double s, double below)
{
    double cosine = sum(fused, c, 0.08715574274765817356, s * -0.99619469809174553230);
    double at_zero = below < 0.0 ? cosine : -1.0;
    return c > 0.0 ? at_zero : cosine;
}

static const double blue_ends = -0.5;

/* e^-x, 0 <= x <= 25, within 2e-11. */
INLINE double decay(bool fused, double x)
{
    const double rounder = 0x1.8p52; /* added, leaves a whole number in the last bits */
    double shifted = sum(fused, x, -1.44269504088896340736, rounder), k = shifted - rounder;
    double r = sum(fused, k, -0.69314718055994530942, -x), scale;
    uint64_t bits;
    memcpy(&bits, &shifted, sizeof bits);
    bits = (bits + 1023) << 52; /* the exponent of a double */
    memcpy(&scale, &bits, sizeof scale);
    double e = 1.0 / 362880.0;
    e = sum(fused, e, r, 1.0 / 40320.0);
    e = sum(fused, e, r, 1.0 / 5040.0);
    e = sum(fused, e, r, 1.0 / 720.0);
    e = sum(fused, e, r, 1.0 / 120.0);
    e = sum(fused, e, r, 1.0 / 24.0);
    e = sum(fused, e, r, 1.0 / 6.0);
    e = sum(fused, e, r, 0.5);
    e = sum(fused, e, r, 1.0);
    e = sum(fused, e, r, 1.0);
    return e * scale;
}

/* sin of 2 d_theta, Eq. 16, from towards_blue() above blue_ends.  With w = 1 - cos y, (y/25
 * degrees)^2 is w times a polynomial of w: the best by e^-(y/25)^2 (mpmath and Lawson's weights),
 * which keeps the exponential within 7e-12. */
INLINE double blue_turn(bool fused, double cosine)
{
    double w = 1.0 - cosine, p = 0.005638336896534326;
    p = sum(fused, p, w, -0.011121129147688006);
    p = sum(fused, p, w, 0.017324194227822776);
    p = sum(fused, p, w, -0.0008050504944659073);
    p = sum(fused, p, w, 0.023473857459112384);
    p = sum(fused, p, w, 0.052636283140856575);
    p = sum(fused, p, w, 0.15016390395248896);
    p = sum(fused, p, w, 0.46688159910956006);
    p = sum(fused, p, w, 1.7508302587355549);
    p = sum(fused, p, w, 10.504980317918017);
    double t = 1.04719755119659774615 * decay(fused, w * p); /* 60 degrees */
    double t2 = t * t, s = 1.0 / 6227020800.0;
    s = sum(fused, s, t2, -1.0 / 39916800.0);
    s = sum(fused, s, t2, 1.0 / 362880.0);
    s = sum(fused, s, t2, -1.0 / 5040.0);
    s = sum(fused, s, t2, 1.0 / 120.0);
    s = sum(fused, s, t2, -1.0 / 6.0);
    return sum(fused, s * t2, t, t);
}

/* A block's squares; whether R_T matters to a row.  With `blue` it is in them, else missing. */
INLINE bool run(const struct from *from, const struct block *rows, bool fused, bool blue)
{
    const double *restrict L = rows->L, *restrict a = rows->a, *restrict b = rows->b;
    double *restrict square = rows->square;
    const double L1 = from->L, a_1 = from->a, b1 = from->b, C_ab1 = from->C;
    const double opposite = from->opposite;
    uint64_t matters = 0;
    LOOP for (size_t i = 0; i < BLOCK; i++)
    {
        double a_2 = a[i], b2 = b[i];

        /* Eqs. 2-6. */
        double ab2 = sum(fused, a_2, a_2, b2 * b2);
        double C_ab2 = sqrt(ab2);
        double stretch = sum(fused, -0.5, chroma_switch(fused, 0.5 * (C_ab1 + C_ab2)), 1.5);
        double a1 = stretch * a_1, a2 = stretch * a_2;
        double square1 = sum(fused, a1, a1, b1 * b1), square2 = sum(fused, a2, a2, b2 * b2);
        double C1 = sqrt(square1);
        double C2 = sqrt(square2), C_sum = C1 + C2;

        /* Eqs. 10, 11, 14.  Not fused: two products that are equal have to be. */
        double p = a_1 * b2, q = a_2 * b1, N = stretch * (p - q);
        double dot = sum(fused, a1, a2, b1 * b2), C12 = C1 * C2;
        double way = p > q ? 1.0 : p < q ? -1.0 : opposite;
        double W = C12 + fabs(dot), inverse = inverse_root(fused, 2.0 * C12 * W + 1e-100);
        double near = 4.0 * C12 * (N * inverse) * (N * inverse), far = 2.0 * W;
        double dH2 = dot > 0.0 ? near : far;
        double x1 = C2 * a1, y1 = C2 * b1, x2 = C1 * a2, y2 = C1 * b2;
        double c = dot > 0.0 ? x1 + x2 : way * (y2 - y1);
        double s = dot > 0.0 ? y1 + y2 : way * (x1 - x2);
        c *= inverse;
        s *= inverse;

        /* Eqs. 8-9, 12-13, 15, 18-22: by one division. */
        double dL = L[i] - L1, m = sum(fused, 0.5, L[i] + L1, -50.0), m2 = m * m;
        double S_L = sum(fused, 0.015 * m2, inverse_root(fused, m2 + 20.0), 1.0);
        double da = stretch * (a_2 - a_1), db = b2 - b1;
        double dC2 = sum(fused, da, a2 + a1, db * (b2 + b1)); /* C2'^2 - C1'^2 */
        double S_C = sum(fused, 0.0225, C_sum, 1.0) * (C_sum + 1e-200);
        double S_H = sum(fused, 0.0075 * C_sum, hue_weight(fused, c, s), 1.0);
        double over = 1.0 / (S_L * S_C * S_H);
        double l = dL * over * (S_C * S_H), C = dC2 * over * (S_L * S_H);
        double H1 = over * (S_L * S_C), H2 = dH2 * H1 * H1;
        double total = sum(fused, l, l, sum(fused, C, C, H2));
        double lower = b1 < b2 ? b1 : b2, upper = b1 < b2 ? b2 : b1;
        double below = upper < 0.0 ? upper : lower < 0.0 ? p + q : 1.0;
        double cosine = towards_blue(fused, c, s, below);
        if (blue) {
            double root = dH2 * inverse_root(fused, dH2 + 1e-200); /* dH' */
            double turn = blue_turn(fused, cosine > blue_ends ? cosine : blue_ends);
            double R_T = -2.0 * turn * chroma_switch(fused, 0.5 * C_sum);
            R_T = cosine > blue_ends ? R_T : 0.0;
            total = sum(fused, R_T * C, way * root * H1, total);
        }
        square[i] = total;
        matters |= cosine > blue_ends ? 1 : 0;
    }
    return matters != 0;
}

static bool plain(const struct from *from, const struct block *rows, bool blue)
{
    return blue ? run(from, rows, false, true) : run(from, rows, false, false);
}

#if defined(__x86_64__) && defined(__GNUC__)
__attribute__((target("avx2,fma"))) static bool avx2(const struct from *from,
                                                     const struct block *rows, bool blue)
{
    return blue ? run(from, rows, true, true) : run(from, rows, true, false);
}

__attribute__((target(WIDE))) static bool avx512(const struct from *from, const struct block *rows,
                                                 bool blue)
{
    return blue ? run(from, rows, true, true) : run(from, rows, true, false);
}

bool delta_e_has(enum delta_e_vectors v)
{
    return v == DELTA_E_PLAIN ||
           (v == DELTA_E_AVX2 && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) ||
           (v == DELTA_E_AVX512 && __builtin_cpu_supports("avx512f") &&
            __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl"));
}
#else
#define avx2 plain
#define avx512 plain

bool delta_e_has(enum delta_e_vectors v)
{
    return v == DELTA_E_PLAIN;
}
#endif

enum delta_e_vectors delta_e_best_vectors(void)
{
    return delta_e_has(DELTA_E_AVX512) ? DELTA_E_AVX512
           : delta_e_has(DELTA_E_AVX2) ? DELTA_E_AVX2
                                       : DELTA_E_PLAIN;
}

static bool run_by(enum delta_e_vectors v, const struct from *from, const struct block *rows,
                   bool blue)
{
    return v == DELTA_E_AVX512 ? avx512(from, rows, blue)
           : v == DELTA_E_AVX2 ? avx2(from, rows, blue)
                               : plain(from, rows, blue);
}

/* R_T only where it is not 0 for all: then the others' rows have the same bits again. */
static void do_block(enum delta_e_vectors v, const struct from *from, const struct block *rows)
{
    if (run_by(v, from, rows, false))
        run_by(v, from, rows, true);
}

void delta_e_2000_squares_by(enum delta_e_vectors v, const double Lab[3], size_t n, const double *L,
                             const double *a, const double *b, double *square)
{
    struct from from = { Lab[0], Lab[1], Lab[2], hypot(Lab[1], Lab[2]), 1.0 };
    /* Eqs. 10 and 14 speak of opposite hues as of 0 .. 360 degrees: the mean lies between them. */
    if (Lab[2] < 0.0 || (Lab[2] == 0.0 && Lab[1] < 0.0))
        from.opposite = -1.0;
    size_t i = 0;
    for (; i + BLOCK <= n; i += BLOCK)
        do_block(v, &from, &(struct block){ L + i, a + i, b + i, square + i });
    if (i < n) { /* the rest, padded with the last row */
        double rest[4][BLOCK];
        for (size_t j = 0; j < BLOCK; j++) {
            size_t row = i + j < n ? i + j : n - 1;
            rest[0][j] = L[row];
            rest[1][j] = a[row];
            rest[2][j] = b[row];
        }
        do_block(v, &from, &(struct block){ rest[0], rest[1], rest[2], rest[3] });
        memcpy(square + i, rest[3], (n - i) * sizeof *square);
    }
}

void delta_e_2000_squares(const double Lab[3], size_t n, const double *L, const double *a,
                          const double *b, double *square)
{
    delta_e_2000_squares_by(delta_e_best_vectors(), Lab, n, L, a, b, square);
}
