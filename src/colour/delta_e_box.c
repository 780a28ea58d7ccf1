/* delta_e_box.c - the bound that the header derives, for sixteen boxes at once.  The numbers of
 * its steps stand at theirs. */
#include "colour/delta_e_box.h"

#include <math.h>

#include "base/units.h"
#include "colour/delta_e.h"

#define INLINE static inline __attribute__((always_inline))

#if defined(__clang__)
#define LOOP _Pragma("clang loop vectorize(assume_safety)")
#define WIDE "avx512f,avx512dq,avx512vl"
#else
#define LOOP _Pragma("GCC ivdep")
#define WIDE "avx512f,avx512dq,avx512vl,prefer-vector-width=512"
#endif

/* ---- the colour --------------------------------------------------------------------- */

bool delta_e_box_takes(const double Lab[3])
{
    return Lab[0] >= DELTA_E_LIGHTNESS_MIN && Lab[0] <= DELTA_E_LIGHTNESS_MAX &&
           fabs(Lab[1]) <= DELTA_E_BOX_MAX && fabs(Lab[2]) <= DELTA_E_BOX_MAX; /* as NaN is not */
}

bool delta_e_box_init(const double Lab[3], double extent, struct delta_e_box *ret)
{
    double L = Lab[0], a = Lab[1], b = Lab[2];
    if (!delta_e_box_takes(Lab))
        return false;
    double C = hypot(a, b), most = fmax(extent, fmax(fabs(L), fmax(fabs(a), fabs(b))));
    *ret = (struct delta_e_box){
        .L = (float)L,
        .a = (float)a,
        .b = (float)b,
        .C = (float)C,
        .wider = (float)(0x1p-21 * most),
        .chroma_slack = (float)(0x1p-19 * most),
        .vectors = delta_e_best_vectors(),
    };
    return true;
}

/* ---- the boxes ---------------------------------------------------------------------- */

/* As fminf() and fmaxf(), which calls and their care for NaN make slow. */
INLINE float lower(float x, float y)
{
    return x < y ? x : y;
}

INLINE float higher(float x, float y)
{
    return x > y ? x : y;
}

/* From x to an interval. */
INLINE float gap(float x, float low, float high)
{
    return higher(higher(low - x, x - high), 0.0f);
}

/* s of a mean C*. */
INLINE float stretch(float C)
{
    float C2 = C * C, C7 = C2 * C2 * C2 * C;
    return 1.5f - 0.5f * sqrtf(C7 / (C7 + 6103515625.0f));
}

INLINE float length(float x, float y)
{
    return sqrtf(x * x + y * y);
}

/* Step 1. */
INLINE float lightness(const struct delta_e_box *q, float low, float high)
{
    float d = gap(q->L, low, high), nearer = low > q->L ? q->L + d : q->L - d;
    float m = 0.5f * (q->L + nearer) - 50.0f, m2 = m * m, root = sqrtf(20.0f + m2);
    return d * root / (root + 0.015f * m2);
}

/* Eq. 15's T from the cosine and sine of the mean hue, as delta_e_many.c has it. */
INLINE float hue_weight(float c1, float s1)
{
    float c2 = c1 * c1 - s1 * s1, s2 = 2.0f * c1 * s1;
    float c3 = c2 * c1 - s2 * s1, s3 = s2 * c1 + c2 * s1;
    float c4 = c2 * c2 - s2 * s2, s4 = 2.0f * c2 * s2;
    return 1.0f - 0.1472243f * c1 - 0.085f * s1 + 0.24f * c2 + 0.318247f * c3 - 0.03344911f * s3 -
           0.0907981f * c4 - 0.1782013f * s4;
}

/* sin(2 d_theta), Eq. 16, at most, of hues that are at least so far from 275 degrees as the cosine
 * says: from 85, 60 and 30 degrees, and nearer. */
INLINE float most_turn(float cosine)
{
    float near = cosine < 0.8660254f ? 0.246f : 0.8660255f;
    float far = cosine < 0.08715574f ? 1.1e-5f : 0.0034f;
    return cosine < 0.5f ? far : near;
}

INLINE float square_of_bound(const struct delta_e_box *q, float L_low, float L_high, float a_low,
                             float a_high, float b_low, float b_high)
{
    float l = lightness(q, L_low, L_high);

    /* The corners nearest to grey and farthest from it; 2. */
    float a_least = gap(0.0f, a_low, a_high), a_most = higher(-a_low, a_high);
    float b_least = gap(0.0f, b_low, b_high), b_most = higher(-b_low, b_high);
    float s_lo = stretch(0.5f * (q->C + length(a_most, b_most))) - 1e-6f;
    float s_hi = stretch(0.5f * (q->C + length(a_least, b_least))) + 1e-6f;

    /* 3, 4. */
    float da = s_lo * gap(q->a, a_low, a_high), db = gap(q->b, b_low, b_high);
    float D2 = da * da + db * db;
    float C1_most = length(s_hi * q->a, q->b), C1_least = length(s_lo * q->a, q->b);
    float C2_most = length(s_hi * a_most, b_most), C2_least = length(s_lo * a_least, b_least);
    float apart = higher(C2_least - C1_most, C1_least - C2_most) - q->chroma_slack;
    float dC = higher(apart, 0.0f), C_sum = C1_most + C2_most;
    float dC_most = higher(C2_most - C1_least, C1_most - C2_least) + q->chroma_slack;

    /* 5: the products with the box's ends. */
    float x1 = q->a * b_low, x2 = q->a * b_high, y1 = q->b * a_low, y2 = q->b * a_high;
    float N_low = lower(x1, x2) - higher(y1, y2), N_high = higher(x1, x2) - lower(y1, y2);
    float N_least = s_lo * higher(higher(N_low, -N_high), 0.0f);
    float near = N_least * N_least / (C1_least * C2_most + 1e-30f);
    float dH2 = higher(near, D2 * (1.0f - 1e-5f) - dC_most * dC_most);

    /* 7. */
    float s = 0.5f * (s_lo + s_hi), a_mid = 0.5f * (a_low + a_high),
          b_mid = 0.5f * (b_low + b_high);
    float a1 = s * q->a, a2 = s * a_mid, C1 = length(a1, q->b), C2 = length(a2, b_mid);
    float x = C2 * a1 + C1 * a2, y = C2 * q->b + C1 * b_mid, square = x * x + y * y;
    float inverse = 1.0f / sqrtf(square + 1e-30f), C12 = C1 * C2;
    float c = x * inverse, t = y * inverse;
    float half = length(s_hi * (a_high - a_mid), b_high - b_mid);
    float rho = half / (length(s_lo * a_mid, b_mid) + 1e-30f);
    float off = 0.5f * (rho + 0.5708f * rho * rho * rho) + 0.25f * (s_hi - s_lo) + 1e-4f;
    float dot = a1 * a2 + q->b * b_mid;
    float known =
        rho < 0.9f && (dot > 0.0f || N_least > 0.0f) && square > 0.01f * C12 * C12 ? off : 10.0f;
    float T = lower(hue_weight(c, t) + 2.41f * known, 1.5725f);

    /* 6, 8. */
    float S_C = 1.0f + 0.0225f * C_sum, S_H = 1.0f + 0.0075f * C_sum * T;
    float chroma = lower(0.02f * C_sum, 1.0f); /* C'/25 */
    float turn = most_turn(c * 0.08715574f - t * 0.9961947f + known);
    float left = 1.0f - turn * chroma * chroma * chroma;
    float dC2 = higher(dC * dC, D2 - dH2) / (S_C * S_C);
    return (l * l + left * (dC2 + dH2 / (S_H * S_H))) * (1.0f - 1e-5f);
}

INLINE void bound_any(const struct delta_e_box *q, const float *restrict low,
                      const float *restrict high, float *restrict bound)
{
    const struct delta_e_box from = *q;
    float e = from.wider;
    LOOP for (int i = 0; i < DELTA_E_BOXES; i++)
    {
        const int a = i + DELTA_E_BOXES, b = i + 2 * DELTA_E_BOXES;
        bound[i] = square_of_bound(&from, low[i] - e, high[i] + e, low[a] - e, high[a] + e,
                                   low[b] - e, high[b] + e);
    }
}

/* The same operations, none fused: the same bits by any vectors. */
static void bound_plain(const struct delta_e_box *q, const float *low, const float *high,
                        float *bound)
{
    bound_any(q, low, high, bound);
}

#if defined(__x86_64__) && defined(__GNUC__)
__attribute__((target("avx2"))) static void
bound_avx2(const struct delta_e_box *q, const float *low, const float *high, float *bound)
{
    bound_any(q, low, high, bound);
}

__attribute__((target(WIDE))) static void
bound_avx512(const struct delta_e_box *q, const float *low, const float *high, float *bound)
{
    bound_any(q, low, high, bound);
}
#else
#define bound_avx2 bound_plain
#define bound_avx512 bound_plain
#endif

void delta_e_box_bound_by(enum delta_e_vectors v, const struct delta_e_box *q, const float *low,
                          const float *high, float *bound)
{
    if (v == DELTA_E_AVX512)
        bound_avx512(q, low, high, bound);
    else if (v == DELTA_E_AVX2)
        bound_avx2(q, low, high, bound);
    else
        bound_plain(q, low, high, bound);
}

void delta_e_box_bound(const struct delta_e_box *q, const float *low, const float *high,
                       float *bound)
{
    delta_e_box_bound_by(q->vectors, q, low, high, bound);
}
