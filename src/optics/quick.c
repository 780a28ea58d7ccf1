/* quick.c - the two closed-form models over whole vectors of bands.
 *
 * Each loop below is compiled for several kinds of vectors (inlined into functions of those
 * targets) and does the same operations in the same order in all of them; only whether its
 * exponentials are fused differs. */
#include "optics/quick.h"

#include <math.h>
#include <string.h>

#include "optics/dipole.h"
#include "optics/quick_band.h"

/* One spectrum: what a skin is at each band, and what is asked.  All rows are QUICK_STRIDE(n)
 * long. */
struct quick_job {
    size_t stride;
    double d, A, entering;
    const struct tissue *t;
    const struct chromophores *c;
    double *restrict sa1, *restrict sa2, *restrict ss1, *restrict ss2; /* coefficients */
    double *restrict law;                                              /* sigma_s'/scattering_a */
    double *restrict by_sa1, *restrict by_sa2, *restrict by_ss, *restrict by_d;
    double *restrict R, *restrict J;
    unsigned wanted; /* rows of J */
};

/* The rows of a job do not overlap, which the compiler would else ask before each loop. */
#if defined(__clang__)
#define QUICK_LOOP _Pragma("clang loop vectorize(assume_safety)")
#define QUICK_WIDE "fma,avx512f,avx512dq,avx512vl"
#else
#define QUICK_LOOP _Pragma("GCC ivdep")
#define QUICK_WIDE "fma,avx512f,avx512dq,avx512vl,prefer-vector-width=512"
#endif

/* ---- coefficients: as tissue_medium() ---------------------------------------------------- */

/* dermis: whether its coefficients are wanted.  Where all melanin is of one kind the other is not
 * looked at: the same bits, for 1 x + 0 y is x. */
QUICK_INLINE void coefficients(const struct quick_job *q, bool fused, bool dermis)
{
    const struct chromophores *restrict c = q->c;
    double Cm = q->t->Cm, Bm = q->t->Bm, Ch = q->t->Ch, gamma = q->t->gamma;
    double a = q->t->scattering_a, b = q->t->scattering_b;
    double *restrict sa1 = q->sa1, *restrict sa2 = q->sa2;
    double *restrict ss1 = q->ss1, *restrict ss2 = q->ss2, *restrict law = q->law;
    const double *restrict pure = Bm == 1.0 ? c->eumelanin : c->pheomelanin;
    if (Bm == 1.0 || Bm == 0.0) {
        QUICK_LOOP
        for (size_t i = 0; i < q->stride; i++)
            sa1[i] = Cm * pure[i] + (1.0 - Cm) * c->base[i];
    } else {
        QUICK_LOOP
        for (size_t i = 0; i < q->stride; i++) {
            double melanin = Bm * c->eumelanin[i] + (1.0 - Bm) * c->pheomelanin[i];
            sa1[i] = Cm * melanin + (1.0 - Cm) * c->base[i];
        }
    }
    if (dermis) {
        QUICK_LOOP
        for (size_t i = 0; i < q->stride; i++) {
            double blood = gamma * c->oxy[i] + (1.0 - gamma) * c->deoxy[i];
            sa2[i] = Ch * blood + (1.0 - Ch) * c->base[i];
        }
    }
    if (a == 0.0) {
        QUICK_LOOP
        for (size_t i = 0; i < q->stride; i++) {
            ss1[i] = c->sigma_s_prime[i];
            ss2[i] = 0.5 * c->sigma_s_prime[i];
        }
    } else {
        QUICK_LOOP
        for (size_t i = 0; i < q->stride; i++) {
            law[i] = quick_exp(fused, -b * c->log_nm[i]);
            ss1[i] = a * law[i];
            ss2[i] = a * law[i];
        }
    }
}

/* ---- the models -------------------------------------------------------------------------- */

/* Whether every band is in range. */
QUICK_INLINE bool half_space(const struct quick_job *q, bool fused, bool slopes)
{
    const double *restrict sa1 = q->sa1, *restrict sa2 = q->sa2, *restrict ss1 = q->ss1;
    double *restrict R = q->R, *restrict by_sa1 = q->by_sa1, *restrict by_sa2 = q->by_sa2;
    double *restrict by_ss = q->by_ss, A = q->A, entering = q->entering;
    uint64_t beyond = 0;
    QUICK_LOOP
    for (size_t i = 0; i < q->stride; i++) {
        struct quick_band at = quick_half_space(fused, A, entering, sa1[i] + sa2[i], ss1[i]);
        R[i] = at.R;
        if (slopes) {
            by_sa1[i] = at.by_sa1;
            by_sa2[i] = at.by_sa2;
            by_ss[i] = at.by_ss;
        }
        beyond |= at.beyond;
    }
    return beyond == 0;
}

/* The epidermis alone: optics/opaque.c's formulas. */
QUICK_INLINE bool epidermis(const struct quick_job *q, bool slopes)
{
    const double *restrict sa1 = q->sa1, *restrict ss1 = q->ss1;
    double *restrict R = q->R, *restrict by_sa1 = q->by_sa1, *restrict by_sa2 = q->by_sa2;
    double *restrict by_ss = q->by_ss;
    double surface = 2.0 / 3.0 * q->A, entering = q->entering;
    uint64_t beyond = 0;
    QUICK_LOOP
    for (size_t i = 0; i < q->stride; i++) {
        double st = sa1[i] + ss1[i], k = sqrt(3.0 * sa1[i] * st);
        double both = 1.0 / (st * k), inverse = both * k, i_k = both * st;
        double r = k * inverse, mu = ss1[i] * inverse;
        double i_losses = 1.0 / ((1.0 + r) * (1.0 + surface * r));
        R[i] = entering * mu * i_losses;
        if (slopes) {
            double by_r = 1.0 + surface + 2.0 * surface * r;
            double by_c = -entering * i_losses * (1.0 + mu * by_r * i_losses * (1.5 * st * i_k));
            by_sa1[i] = by_c * mu * inverse;
            by_ss[i] = -by_c * (sa1[i] * inverse) * inverse;
            by_sa2[i] = 0.0;
        }
        beyond |= r >= 1.0 / 64.0 ? 0 : 1;
    }
    return beyond == 0;
}

QUICK_INLINE bool two_layer(const struct quick_job *q, bool fused, bool slopes, bool all)
{
    const double *restrict sa1 = q->sa1, *restrict sa2 = q->sa2;
    const double *restrict ss1 = q->ss1, *restrict ss2 = q->ss2;
    double *restrict R = q->R, *restrict by_sa1 = q->by_sa1, *restrict by_sa2 = q->by_sa2;
    double *restrict by_ss = q->by_ss, *restrict by_d = q->by_d;
    double A = q->A, entering = q->entering, d = q->d;
    uint64_t beyond = 0;
    QUICK_LOOP
    for (size_t i = 0; i < q->stride; i++) {
        struct quick_band at =
            quick_two_layer(fused, slopes, all, A, entering, d, sa1[i], ss1[i], sa2[i], ss2[i]);
        R[i] = at.R;
        if (slopes) {
            by_sa1[i] = at.by_sa1;
            by_sa2[i] = at.by_sa2;
        }
        if (all) {
            by_ss[i] = at.by_ss;
            by_d[i] = at.by_d;
        }
        beyond |= at.beyond;
    }
    return beyond == 0;
}

/* ---- the chain rule: as tissue_slopes() -------------------------------------------------- */

/* row = by times factor, which is an expression of i; what is past the last band is 0. */
#define QUICK_ROW(parameter, by, factor) \
    if (q->wanted & QUICK_WANT(parameter)) { \
        double *restrict row = q->J + (parameter)*q->stride; \
        QUICK_LOOP \
        for (size_t i = 0; i < q->stride; i++) \
            row[i] = (by)[i] * (factor); \
        for (size_t i = c->n; i < q->stride; i++) \
            row[i] = 0.0; \
    }

QUICK_INLINE void chain(const struct quick_job *q)
{
    const struct chromophores *restrict c = q->c;
    double Cm = q->t->Cm, Bm = q->t->Bm, Ch = q->t->Ch, gamma = q->t->gamma;
    const double *restrict by_sa1 = q->by_sa1, *restrict by_sa2 = q->by_sa2;
    const double *restrict by_ss = q->by_ss, *restrict by_d = q->by_d;
    const double *restrict law = q->law, *restrict ss1 = q->ss1;
    QUICK_ROW(TISSUE_CM, by_sa1, Bm * c->eumelanin[i] + (1.0 - Bm) * c->pheomelanin[i] - c->base[i])
    QUICK_ROW(TISSUE_BM, by_sa1, Cm * (c->eumelanin[i] - c->pheomelanin[i]))
    QUICK_ROW(TISSUE_CH, by_sa2, gamma * c->oxy[i] + (1.0 - gamma) * c->deoxy[i] - c->base[i])
    QUICK_ROW(TISSUE_GAMMA, by_sa2, Ch * (c->oxy[i] - c->deoxy[i]))
    QUICK_ROW(TISSUE_EPIDERMIS_MM, by_d, 1.0)
    QUICK_ROW(TISSUE_SCATTERING_A, by_ss, law[i])
    QUICK_ROW(TISSUE_SCATTERING_B, by_ss, -c->log_nm[i] * ss1[i])
}

/* ---- for each kind of vectors ------------------------------------------------------------ */

/* What is computed: R alone; and the derivatives by absorption; and by all. */
enum quick_kernel {
    HALF_SPACE_R,
    HALF_SPACE,
    EPIDERMIS_R,
    EPIDERMIS,
    TWO_LAYER_R,
    TWO_LAYER,
    TWO_LAYER_ALL
};

/* Constants, so that each of the loops is made for its own. */
QUICK_INLINE bool run(const struct quick_job *q, bool fused, enum quick_kernel kernel)
{
    coefficients(q, fused, kernel != EPIDERMIS_R && kernel != EPIDERMIS);
    bool good = kernel == HALF_SPACE_R  ? half_space(q, fused, false)
                : kernel == HALF_SPACE  ? half_space(q, fused, true)
                : kernel == EPIDERMIS_R ? epidermis(q, false)
                : kernel == EPIDERMIS   ? epidermis(q, true)
                : kernel == TWO_LAYER_R ? two_layer(q, fused, false, false)
                : kernel == TWO_LAYER   ? two_layer(q, fused, true, false)
                                        : two_layer(q, fused, true, true);
    if (good)
        chain(q);
    return good;
}

static bool run_plain(const struct quick_job *q, enum quick_kernel kernel)
{
    return run(q, false, kernel);
}

#if defined(__x86_64__) && defined(__GNUC__)
__attribute__((target("avx2,fma"))) static bool run_avx2(const struct quick_job *q,
                                                         enum quick_kernel kernel)
{
    return run(q, true, kernel);
}

__attribute__((target(QUICK_WIDE))) static bool run_avx512(const struct quick_job *q,
                                                           enum quick_kernel kernel)
{
    return run(q, true, kernel);
}

bool quick_has(enum quick_vectors v)
{
    return v == QUICK_PLAIN ||
           (v == QUICK_AVX2 && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) ||
           (v == QUICK_AVX512 && __builtin_cpu_supports("avx512f") &&
            __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl"));
}
#else
#define run_avx2 run_plain
#define run_avx512 run_plain

bool quick_has(enum quick_vectors v)
{
    return v == QUICK_PLAIN;
}
#endif

static enum quick_vectors best_vectors(void)
{
    return quick_has(QUICK_AVX512) ? QUICK_AVX512
           : quick_has(QUICK_AVX2) ? QUICK_AVX2
                                   : QUICK_PLAIN;
}

static bool run_by(enum quick_vectors v, const struct quick_job *q, enum quick_kernel kernel)
{
    return v == QUICK_AVX512 ? run_avx512(q, kernel)
           : v == QUICK_AVX2 ? run_avx2(q, kernel)
                             : run_plain(q, kernel);
}

_Static_assert((int)QUICK_AVX2 == (int)VECTORS_WITH_AVX2 &&
                   (int)QUICK_AVX512 == (int)VECTORS_WITH_AVX512,
               "one order");

/* ---- other models, and what is out of range ----------------------------------------- */

/* As model_slopes() and model_reflectance(), for models of N streams. */
static enum status lanes_slopes(const struct quick *q, const struct tissue *t, unsigned wanted,
                                double *scratch, double *R, double *J)
{
    struct medium m;
    struct slopes dR = slopes_in(scratch + MEDIUM_SCRATCH(q->c->n), q->c->n);
    enum status s = tissue_medium(t, q->c, scratch, &m);
    if (s != STATUS_OK)
        return s;
    if (wanted == 0)
        return transport_lanes_reflectance(&q->lanes, &m, R);
    s = transport_lanes_slopes(&q->lanes, &m, R, &dR);
    if (s == STATUS_OK)
        tissue_slopes(t, q->c, &m, &dR, J);
    return s;
}

/* Rows of another model laid out as here. */
static enum status slow_slopes(const struct quick *q, const struct tissue *t, unsigned wanted,
                               double *scratch, double *R, double *J)
{
    size_t n = q->c->n, stride = QUICK_STRIDE(n);
    double *rows = scratch + MODEL_SLOPES_SCRATCH(n);
    enum status s = q->by_lanes   ? lanes_slopes(q, t, wanted, scratch, R, rows)
                    : wanted == 0 ? model_reflectance(q->model, t, q->c, scratch, R)
                                  : model_slopes(q->model, t, q->c, scratch, R, rows);
    if (s != STATUS_OK)
        return s;
    for (size_t i = n; i < stride; i++)
        R[i] = 0.0;
    for (size_t p = 0; p < TISSUE_PARAMETERS; p++)
        if (wanted & QUICK_WANT(p)) {
            memcpy(J + p * stride, rows + p * n, n * sizeof *J);
            memset(J + p * stride + n, 0, (stride - n) * sizeof *J);
        }
    return STATUS_OK;
}

void quick_init(const struct model *model, const struct chromophores *c, double eta,
                struct quick *ret)
{
    ret->model = model;
    ret->c = c;
    ret->eta = eta;
    ret->vectors = best_vectors();
    ret->formulas =
        model->quick != MODEL_QUICK_NONE && dipole_A(eta, &ret->A) == STATUS_OK && eta <= 3.7;
    ret->entering = 1.0 - dipole_Rs(eta);
    ret->by_lanes =
        model->streams > 0 && transport_lanes_init(model->streams, eta, &ret->lanes) == STATUS_OK;
}

/* Which loops, for the parameters that are wanted of a skin and change it. */
static enum quick_kernel kernel_for(enum model_quick formulas, unsigned wanted)
{
    const unsigned scattering = QUICK_WANT(TISSUE_EPIDERMIS_MM) | QUICK_WANT(TISSUE_SCATTERING_A) |
                                QUICK_WANT(TISSUE_SCATTERING_B);
    if (formulas == MODEL_QUICK_HALF_SPACE)
        return wanted == 0 ? HALF_SPACE_R : HALF_SPACE;
    if (formulas == MODEL_QUICK_EPIDERMIS)
        return wanted == 0 ? EPIDERMIS_R : EPIDERMIS;
    return wanted == 0 ? TWO_LAYER_R : wanted & scattering ? TWO_LAYER_ALL : TWO_LAYER;
}

enum status quick_skin(const struct quick *q, const struct tissue *t, unsigned wanted,
                       double *scratch, double *R, double *J)
{
    const struct chromophores *c = q->c;
    size_t stride = QUICK_STRIDE(c->n);
    double *slow_scratch = scratch + 9 * stride;
    if (!q->formulas || tissue_check(t) != STATUS_OK)
        return slow_slopes(q, t, wanted, slow_scratch, R, J);
    bool two = q->model->quick == MODEL_QUICK_TWO_LAYER;
    /* Parameters that this skin or model does not look at: their rows are 0. */
    unsigned without = two ? 0 : QUICK_WANT(TISSUE_EPIDERMIS_MM);
    if (t->scattering_a == 0.0)
        without |= QUICK_WANT(TISSUE_SCATTERING_A) | QUICK_WANT(TISSUE_SCATTERING_B);
    struct quick_job job = {
        .stride = stride,
        .d = t->epidermis_mm,
        .A = q->A,
        .entering = q->entering,
        .t = t,
        .c = c,
        .sa1 = scratch,
        .sa2 = scratch + stride,
        .ss1 = scratch + 2 * stride,
        .ss2 = scratch + 3 * stride,
        .law = scratch + 4 * stride,
        .by_sa1 = scratch + 5 * stride,
        .by_sa2 = scratch + 6 * stride,
        .by_ss = scratch + 7 * stride,
        .by_d = scratch + 8 * stride,
        .R = R,
        .J = J,
        .wanted = wanted & ~without,
    };
    if (!run_by(q->vectors, &job, kernel_for(q->model->quick, job.wanted)))
        return slow_slopes(q, t, wanted, slow_scratch, R, J);
    for (size_t i = c->n; i < stride; i++)
        R[i] = 0.0;
    if (wanted & without)
        for (size_t p = 0; p < TISSUE_PARAMETERS; p++)
            if (wanted & without & QUICK_WANT(p))
                memset(J + p * stride, 0, stride * sizeof *J);
    return STATUS_OK;
}

enum status quick_slopes_by(enum quick_vectors v, const struct model *model, const struct tissue *t,
                            const struct chromophores *c, unsigned wanted, double *scratch,
                            double *R, double *J)
{
    struct quick q;
    quick_init(model, c, t->eta, &q);
    q.vectors = v;
    q.lanes.vectors = (enum vectors)v;
    return quick_skin(&q, t, wanted, scratch, R, J);
}

enum status quick_slopes(const struct model *model, const struct tissue *t,
                         const struct chromophores *c, unsigned wanted, double *scratch, double *R,
                         double *J)
{
    return quick_slopes_by(best_vectors(), model, t, c, wanted, scratch, R, J);
}
