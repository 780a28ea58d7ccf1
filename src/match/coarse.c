/* coarse.c - sums over the bands of one spectrum, sixteen at a time, and steps by them. */
#include "match/coarse.h"

#include <math.h>
#include <string.h>

#include "match/least_squares.h"
#include "match/start.h"
#include "optics/quick_band_float.h"

/* Lanes depend on nothing but themselves. */
#if defined(__clang__)
#define COARSE_LOOP _Pragma("clang loop vectorize(assume_safety)")
#define COARSE_WIDE "fma,avx512f,avx512dq,avx512vl"
#else
#define COARSE_LOOP _Pragma("GCC ivdep")
#define COARSE_WIDE "fma,avx512f,avx512dq,avx512vl,prefer-vector-width=512"
#endif

/* A second step that promises more is left to those that look where they lead. */
#define FAR 100.0

/* Sums over bands: products of the three derivatives (as match/least_squares.h packs them), of each
 * with the residual. */
enum { GRADIENT = 6, SUMS = 9 };

/* One spectrum, in rows of COARSE_STRIDE(n). */
struct site {
    const struct coarse *coarse;
    double white2;
    _Alignas(64) float R[COARSE_STRIDE(SPECTRUM_MAX_BANDS)];
};

/* ---- sums over bands ---------------------------------------------------------------- */

/* Of sixteen partial sums, in one order: halves, quarters, and so on. */
QUICK_INLINE float add_up(const float *part)
{
    float eight[8], four[4];
    for (size_t l = 0; l < 8; l++)
        eight[l] = part[l] + part[l + 8];
    for (size_t l = 0; l < 4; l++)
        four[l] = eight[l] + eight[l + 4];
    return (four[0] + four[2]) + (four[1] + four[3]);
}

/* At x; straight: by ln R, as misfit.c's straighten(). */
QUICK_INLINE void sums_of(const struct site *s, bool straight, const double *x, float *ret)
{
    const struct coarse *c = s->coarse;
    const float *restrict row = c->row;
    float A = c->A, entering = c->entering, d = c->d;
    float Cm = (float)x[0], Bm = (float)x[1], Ch = (float)x[2];
    _Alignas(64) float sum[SUMS][COARSE_LANES];
    size_t stride = c->stride;
    for (size_t k = 0; k < SUMS; k++)
        for (size_t l = 0; l < COARSE_LANES; l++)
            sum[k][l] = 0.0f;
    for (size_t at = 0; at < stride; at += COARSE_LANES) {
        COARSE_LOOP
        for (size_t l = 0; l < COARSE_LANES; l++) {
            size_t i = at + l;
            float without = row[COARSE_WITHOUT * stride + i];
            float by_Bm = row[COARSE_BY_CM_BM * stride + i];
            float by_Cm = row[COARSE_BY_CM * stride + i] + Bm * by_Bm;
            float by_Ch = row[COARSE_BY_CH * stride + i];
            struct quick_band_float y = quick_two_layer_float(
                false, A, entering, d, without + Cm * by_Cm, row[COARSE_SS1 * stride + i],
                without + Ch * by_Ch, row[COARSE_SS2 * stride + i]);
            float r = (y.R - s->R[i]) * row[COARSE_COUNTS * stride + i];
            float by1 = y.by_sa1, by2 = y.by_sa2;
            if (straight) {
                float measured = s->R[i] > 1e-3f ? s->R[i] : 1e-3f;
                float w = 2.0f * measured / (r + 2.0f * measured);
                r *= w;
                by1 *= w * w;
                by2 *= w * w;
            }
            float J0 = by1 * by_Cm, J1 = by1 * Cm * by_Bm, J2 = by2 * by_Ch;
            sum[0][l] += J0 * J0;
            sum[1][l] += J1 * J0;
            sum[2][l] += J1 * J1;
            sum[3][l] += J2 * J0;
            sum[4][l] += J2 * J1;
            sum[5][l] += J2 * J2;
            sum[GRADIENT][l] += J0 * r;
            sum[GRADIENT + 1][l] += J1 * r;
            sum[GRADIENT + 2][l] += J2 * r;
        }
    }
    for (size_t k = 0; k < SUMS; k++)
        ret[k] = add_up(sum[k]);
}

/* Constants, so that each of the loops is made for its own. */
QUICK_INLINE void sums(const struct site *s, bool straight, const double *x, float *ret)
{
    if (straight)
        sums_of(s, true, x, ret);
    else
        sums_of(s, false, x, ret);
}

static void sums_plain(const struct site *s, bool straight, const double *x, float *ret)
{
    sums(s, straight, x, ret);
}

#if defined(__x86_64__) && defined(__GNUC__)
__attribute__((target("avx2,fma"))) static void sums_avx2(const struct site *s, bool straight,
                                                          const double *x, float *ret)
{
    sums(s, straight, x, ret);
}

__attribute__((target(COARSE_WIDE))) static void sums_avx512(const struct site *s, bool straight,
                                                             const double *x, float *ret)
{
    sums(s, straight, x, ret);
}
#else
#define sums_avx2 sums_plain
#define sums_avx512 sums_plain
#endif

/* What a step needs. */
static void evaluate(enum quick_vectors v, const struct site *s, bool straight, const double *x,
                     struct normal *ret)
{
    float sum[SUMS];
    double weight = 1.0 / s->white2;
    if (v == QUICK_AVX512)
        sums_avx512(s, straight, x, sum);
    else if (v == QUICK_AVX2)
        sums_avx2(s, straight, x, sum);
    else
        sums_plain(s, straight, x, sum);
    for (size_t k = 0; k < GRADIENT; k++)
        ret->curvature[k] = weight * (double)sum[k];
    for (size_t k = 0; k < COARSE_PARAMETERS; k++)
        ret->gradient[k] = weight * (double)sum[GRADIENT + k];
}

/* ---- steps -------------------------------------------------------------------------- */

static double inside(double x, double lo, double hi)
{
    return x > lo ? (x < hi ? x : hi) : lo;
}

static bool is_finite(const double x[COARSE_PARAMETERS])
{
    return isfinite(x[0] + x[1] + x[2]);
}

bool coarse_approach_by(enum quick_vectors v, const struct coarse *coarse, const double *R,
                        const struct whitener *whitener, double x[COARSE_PARAMETERS],
                        double *promise)
{
    struct site site;
    struct normal normal;
    double y[COARSE_PARAMETERS];
    *promise = 0.0;
    if (whitener->rank > 0)
        return false;
    site.coarse = coarse;
    site.white2 = whitener->white2;
    for (size_t i = 0; i < coarse->stride; i++)
        site.R[i] = i < coarse->n ? (float)R[i] : 0.0f;
    for (size_t i = 0; i < COARSE_PARAMETERS; i++)
        y[i] = x[i] = inside(x[i], coarse->lo[i], coarse->hi[i]);
    evaluate(v, &site, true, x, &normal);
    (void)least_squares_step(COARSE_PARAMETERS, coarse->lo, coarse->hi, &normal, y);
    for (size_t i = 0; i < COARSE_PARAMETERS; i += 2) /* Cm and Ch */
        if (x[i] > 0.0)
            y[i] = inside(start_by_root(x[i], y[i]), coarse->lo[i], coarse->hi[i]);
    if (!is_finite(y))
        return true;
    memcpy(x, y, sizeof y);
    evaluate(v, &site, false, x, &normal);
    double gain = least_squares_step(COARSE_PARAMETERS, coarse->lo, coarse->hi, &normal, y);
    if (is_finite(y) && gain < FAR) {
        memcpy(x, y, sizeof y);
        *promise = gain;
    }
    return true;
}

bool coarse_approach(const struct coarse *coarse, const double *R, const struct whitener *whitener,
                     double x[COARSE_PARAMETERS], double *promise)
{
    return coarse_approach_by(coarse->vectors, coarse, R, whitener, x, promise);
}

/* ---- what fits share ---------------------------------------------------------------- */

static bool for_coarse(const struct fit *fit, const struct quick *quick)
{
    const unsigned three = 1u << SKIN_CM | 1u << SKIN_BM | 1u << SKIN_CH;
    if (!quick->formulas || fit->model->quick != MODEL_QUICK_TWO_LAYER || fit_free(fit) != three)
        return false;
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        if (isfinite(fit->role[i].prior_sd))
            return false;
    return true;
}

/* Band i into place k of the rows; what lies past the last band depends on nothing. */
static void set_band(const struct fit *fit, const struct tissue *t, const struct chromophores *c,
                     size_t i, size_t k, struct coarse *ret)
{
    double law = fit->own_scattering ? t->scattering_a * exp(-t->scattering_b * c->log_nm[i])
                                     : c->sigma_s_prime[i];
    double blood = t->gamma * c->oxy[i] + (1.0 - t->gamma) * c->deoxy[i], base = c->base[i];
    double counts = k < c->n ? 1.0 : 0.0;
    const double row[COARSE_ROWS] = {
        [COARSE_WITHOUT] = base,
        [COARSE_BY_CM] = counts * (c->pheomelanin[i] - base),
        [COARSE_BY_CM_BM] = counts * (c->eumelanin[i] - c->pheomelanin[i]),
        [COARSE_BY_CH] = counts * (blood - base),
        [COARSE_SS1] = law,
        [COARSE_SS2] = fit->own_scattering ? law : 0.5 * law,
        [COARSE_COUNTS] = counts,
    };
    for (size_t j = 0; j < COARSE_ROWS; j++)
        ret->row[j * ret->stride + k] = (float)row[j];
}

bool coarse_init(const struct fit *fit, const struct quick *quick, struct coarse *ret)
{
    static const enum skin_parameter which[COARSE_PARAMETERS] = { SKIN_CM, SKIN_BM, SKIN_CH };
    const struct chromophores *c = quick->c;
    double value[SKIN_PARAMETERS];
    if (!for_coarse(fit, quick))
        return false;
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        value[i] = fit->role[i].value;
    struct tissue t = fit_tissue(fit, value);
    ret->n = c->n;
    ret->stride = COARSE_STRIDE(c->n);
    ret->A = (float)quick->A;
    ret->entering = (float)quick->entering;
    ret->d = (float)t.epidermis_mm;
    ret->vectors = quick->vectors;
    for (size_t i = 0; i < COARSE_PARAMETERS; i++) {
        ret->lo[i] = fit->role[which[i]].lo;
        ret->hi[i] = fit->role[which[i]].hi;
    }
    for (size_t k = 0; k < ret->stride; k++)
        set_band(fit, &t, c, k < c->n ? k : c->n - 1, k, ret);
    return true;
}
