/* shared_layers.c - the two closed-form models, taken apart into their layers.
 *
 * As optics/quick.c: every loop is compiled for several kinds of vectors and does the same
 * operations in the same order in all of them. */
#include "optics/shared_layers.h"

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "optics/dipole.h"
#include "optics/quick_exp.h"

/* Beyond, 1 - v^2 would have lost more digits than are promised: twice this in all. */
static const double q_max = 500.0;

/* How much of P, which is 0.17 or more, may be left out. */
static const double rest_max = 1e-16;

/* Rows of a layer. */
enum epidermis_row {
    EPIDERMIS_H,
    EPIDERMIS_R1,
    EPIDERMIS_G,
    EPIDERMIS_GU,
    EPIDERMIS_L,
    EPIDERMIS_LR,
    EPIDERMIS_ROWS
};
enum dermis_row { DERMIS_R2, DERMIS_U, DERMIS_ROWS };

/* ---- the half space's polynomial ---------------------------------------------------- */

/* e^-z I_n(z), the modified Bessel function by its series, of which no term is negative. */
static double bessel_I(int n, double z)
{
    double term = exp(-z), sum = 0.0, half = 0.5 * z;
    for (int k = 1; k <= n; k++)
        term *= half / k;
    for (int k = 1; term > 0.25 * DBL_EPSILON * sum; k++) {
        sum += term;
        term *= half / k * (half / (n + k));
    }
    return sum;
}

/* (1-Rs)/2 [e^-s + e^-(steeper s)] at s = sqrt(3)/2 (1+t): the sum over n of c_n (-1)^n T_n(t) with
 * c_n = e^-z I_n(z), z = sqrt(3)/2 and steeper times that, twice it from n = 1 on; written out in
 * powers of t.  Whether the terms that are left out are small enough. */
static bool polynomial(double steeper, double half, double P[SHARED_LAYERS_TERMS])
{
    enum { KEPT = SHARED_LAYERS_TERMS, LOOKED_AT = KEPT + 8 };
    const double z = 0.5 * sqrt(3.0);
    double rest = 0.0, T[KEPT] = { 1.0 }, next[KEPT] = { 0.0, 1.0 };
    memset(P, 0, KEPT * sizeof *P);
    for (int n = 0; n < LOOKED_AT; n++) {
        double c = (n == 0 ? 1.0 : 2.0) * (bessel_I(n, z) + bessel_I(n, steeper * z));
        if (n >= KEPT) {
            rest += c;
            continue;
        }
        for (int k = 0; k <= n; k++)
            P[k] += half * (n % 2 == 0 ? c : -c) * T[k];
        for (int k = KEPT - 1; k >= 0; k--) { /* T_n+2 = 2t T_n+1 - T_n */
            double after = (k > 0 ? 2.0 * next[k - 1] : 0.0) - T[k];
            T[k] = next[k];
            next[k] = after;
        }
    }
    return rest <= rest_max;
}

/* In octets, each as Estrin has it: one after the other every sum would wait for the last. */
VECTORS_INLINE double octet(bool fused, const double *P, double t, double t2, double t4)
{
    double p01 = vectors_sum(fused, P[1], t, P[0]), p23 = vectors_sum(fused, P[3], t, P[2]);
    double p45 = vectors_sum(fused, P[5], t, P[4]), p67 = vectors_sum(fused, P[7], t, P[6]);
    double low = vectors_sum(fused, p23, t2, p01), high = vectors_sum(fused, p67, t2, p45);
    return vectors_sum(fused, high, t4, low);
}

/* y nearer to 1/sqrt(x): h = 1 - x y^2 tells what is missing, (1-h)^(-1/2) by its series. */
VECTORS_INLINE double nearer(bool fused, double x, double y)
{
    double h = vectors_sum(fused, -(x * y), y, 1.0);
    double more = vectors_sum(fused, h, 5.0 / 16.0, 3.0 / 8.0);
    return vectors_sum(fused, y * h, vectors_sum(fused, h, more, 0.5), y);
}

/* 1/sqrt(x), x >= 0, within 2 ulp: half the exponent with the sign turned, as an integer, is within
 * 3.5 % of it.  Of 0 something large and finite. */
VECTORS_INLINE double inverse_root(bool fused, double x)
{
    uint64_t bits;
    double y;
    memcpy(&bits, &x, sizeof bits);
    bits = UINT64_C(0x5fe6e8e000000000) - (bits >> 1);
    memcpy(&y, &bits, sizeof y);
    return nearer(fused, x, nearer(fused, x, y));
}

/* ---- layers ------------------------------------------------------------------------- */

/* What a layer is made from. */
struct layer_job {
    const struct shared_layers *s;
    double Cm, Bm, Ch;
    double *restrict out;
};

/* R = H + (r1 - r2) w G/L as optics/quick.c has it, with all that is of the epidermis alone; of
 * G the dermis takes u = 1/(1+r2), of L it takes r2. */
VECTORS_INLINE bool epidermis_layer(const struct layer_job *job, bool fused, bool two)
{
    const struct shared_layers *s = job->s;
    const struct chromophores *restrict c = s->c;
    const size_t stride = s->stride;
    double Cm = job->Cm, Bm = job->Bm, d = s->d, i_d = 1.0 / s->d;
    double A2 = 2.0 * s->A, entering = s->entering;
    double *restrict H = job->out, *restrict R1 = job->out + EPIDERMIS_R1 * stride;
    double *restrict G = job->out + EPIDERMIS_G * stride;
    double *restrict GU = job->out + EPIDERMIS_GU * stride;
    double *restrict L = job->out + EPIDERMIS_L * stride;
    double *restrict LR = job->out + EPIDERMIS_LR * stride;
    uint64_t beyond = 0;
    VECTORS_LOOP
    for (size_t i = 0; i < stride; i++) {
        double melanin = Bm * c->eumelanin[i] + (1.0 - Bm) * c->pheomelanin[i];
        double sa = Cm * melanin + (1.0 - Cm) * c->base[i], ss = c->sigma_s_prime[i];
        if (!two) {
            double q = sa / ss;
            H[i] = q;
            beyond |= q <= q_max ? 0 : 1;
            continue;
        }
        double st = sa + ss, i_st = 1.0 / st, k = sqrt(3.0 * sa * st);
        double x = st * d, y = k * d, r1 = k * i_st, mu = ss * i_st;
        double apart = quick_not_zero(x - y);
        struct quick_decay z = quick_decay_of(fused, apart, 1.0 / apart);
        struct quick_decay once = quick_decay_of(fused, y, i_d / k);
        double fading = once.e, T = fading * z.e, g = fading * z.mean;
        double left = 1.0 + fading * fading, p = 0.5 * once.mean * (1.0 + fading);
        double i_plus = 1.0 / (1.0 + r1), i_surface = 1.0 / (3.0 + A2 * r1);
        double m1 = mu * i_plus, layer = A2 * fading * i_surface + x * g;
        double w = 2.0 * entering * fading, third = T * (1.0 / 3.0);
        H[i] = 3.0 * entering * m1 * i_surface;
        R1[i] = r1;
        /* m1 layer + T quotient = m1 layer + T/3 + (2/3) T/(1+r1) u */
        G[i] = w * (m1 * layer + third);
        GU[i] = w * (2.0 * third * i_plus);
        L[i] = left + 2.0 * p * (A2 * (sa * d));
        LR[i] = A2 * (1.0 / 3.0) * left + 2.0 * p * x;
        beyond |= y >= 1.0 / 128.0 ? 0 : 1;
        beyond |= r1 >= 1.0 / 64.0 ? 0 : 1;
        beyond |= x <= 150.0 ? 0 : 1;
    }
    return beyond == 0;
}

VECTORS_INLINE bool dermis_layer(const struct layer_job *job, bool two)
{
    const struct shared_layers *s = job->s;
    const struct chromophores *restrict c = s->c;
    double Ch = job->Ch, gamma = s->gamma;
    double *restrict r2 = job->out, *restrict u = job->out + DERMIS_U * s->stride;
    uint64_t beyond = 0;
    VECTORS_LOOP
    for (size_t i = 0; i < s->stride; i++) {
        double blood = gamma * c->oxy[i] + (1.0 - gamma) * c->deoxy[i];
        double sa = Ch * blood + (1.0 - Ch) * c->base[i], ss = c->sigma_s_prime[i];
        if (!two) {
            double q = sa / ss;
            r2[i] = q;
            beyond |= q <= q_max ? 0 : 1;
            continue;
        }
        double r = sqrt(3.0 * (sa / (sa + 0.5 * ss)));
        r2[i] = r;
        u[i] = 1.0 / (1.0 + r);
        beyond |= r >= 1e-6 ? 0 : 1;
    }
    return beyond == 0;
}

/* ---- pairs -------------------------------------------------------------------------- */

struct pairs_job {
    const struct shared_layers *s;
    const double *restrict epidermis, *restrict dermis;
    size_t n;
    double *restrict R;
};

VECTORS_INLINE void half_space_pairs(const struct pairs_job *job, bool fused)
{
    const size_t stride = job->s->stride;
    const double *restrict q1 = job->epidermis;
    double P[SHARED_LAYERS_TERMS];
    memcpy(P, job->s->P, sizeof P);
    for (size_t row = 0; row < job->n; row++) {
        const double *restrict q2 = job->dermis + row * job->s->dermis_size;
        double *restrict R = job->R + row * stride;
        VECTORS_LOOP
        for (size_t i = 0; i < stride; i++) {
            double q = q1[i] + q2[i];
            double v = q * inverse_root(fused, vectors_sum(fused, q, q, q));
            double t = vectors_sum(fused, 2.0, v, -1.0), mu = vectors_sum(fused, -v, v, 1.0);
            double t2 = t * t, t4 = t2 * t2, t8 = t4 * t4;
            double low = octet(fused, P, t, t2, t4), middle = octet(fused, P + 8, t, t2, t4);
            double high = octet(fused, P + 16, t, t2, t4);
            R[i] = mu * vectors_sum(fused, vectors_sum(fused, high, t8, middle), t8, low);
        }
    }
}

VECTORS_INLINE void two_layer_pairs(const struct pairs_job *job, bool fused)
{
    const size_t stride = job->s->stride;
    const double *restrict H = job->epidermis, *restrict R1 = H + EPIDERMIS_R1 * stride;
    const double *restrict G = H + EPIDERMIS_G * stride, *restrict GU = H + EPIDERMIS_GU * stride;
    const double *restrict L = H + EPIDERMIS_L * stride, *restrict LR = H + EPIDERMIS_LR * stride;
    for (size_t row = 0; row < job->n; row++) {
        const double *restrict R2 = job->dermis + row * job->s->dermis_size;
        const double *restrict u = R2 + DERMIS_U * stride;
        double *restrict R = job->R + row * stride;
        VECTORS_LOOP
        for (size_t i = 0; i < stride; i++) {
            double r2 = R2[i], source = vectors_sum(fused, GU[i], u[i], G[i]);
            double losses = vectors_sum(fused, LR[i], r2, L[i]);
            R[i] = vectors_sum(fused, R1[i] - r2, source / losses, H[i]);
        }
    }
}

/* ---- for each kind of vectors ------------------------------------------------------- */

VECTORS_INLINE bool make_layer(const struct layer_job *job, bool fused, bool dermis)
{
    bool two = job->s->kind == MODEL_QUICK_TWO_LAYER;
    if (dermis)
        return two ? dermis_layer(job, true) : dermis_layer(job, false);
    return two ? epidermis_layer(job, fused, true) : epidermis_layer(job, fused, false);
}

VECTORS_INLINE void make_pairs(const struct pairs_job *job, bool fused)
{
    if (job->s->kind == MODEL_QUICK_TWO_LAYER)
        two_layer_pairs(job, fused);
    else
        half_space_pairs(job, fused);
}

static bool layer_plain(const struct layer_job *job, bool dermis)
{
    return make_layer(job, false, dermis);
}

static void pairs_plain(const struct pairs_job *job)
{
    make_pairs(job, false);
}

VECTORS_AVX2 static bool layer_avx2(const struct layer_job *job, bool dermis)
{
    return make_layer(job, true, dermis);
}

VECTORS_AVX2 static void pairs_avx2(const struct pairs_job *job)
{
    make_pairs(job, true);
}

VECTORS_AVX512 static bool layer_avx512(const struct layer_job *job, bool dermis)
{
    return make_layer(job, true, dermis);
}

VECTORS_AVX512 static void pairs_avx512(const struct pairs_job *job)
{
    make_pairs(job, true);
}

static bool layer(const struct layer_job *job, bool dermis)
{
    return job->s->vectors == VECTORS_WITH_AVX512 ? layer_avx512(job, dermis)
           : job->s->vectors == VECTORS_WITH_AVX2 ? layer_avx2(job, dermis)
                                                  : layer_plain(job, dermis);
}

/* ---- transport ---------------------------------------------------------------------- */

/* Of one layer eight bands after the other, as tissue_medium() has their coefficients. */
static bool transport_epidermis(const struct shared_layers *s, double Cm, double Bm, double *ret)
{
    const struct chromophores *c = s->c;
    const size_t size = TRANSPORT_LANES_EPIDERMIS((size_t)s->transport.streams.n);
    unsigned beyond = 0;
    for (size_t at = 0; at < s->stride; at += VECTORS_LANES, ret += size) {
        double sa[VECTORS_LANES];
        for (size_t l = 0; l < VECTORS_LANES; l++) {
            double melanin = Bm * c->eumelanin[at + l] + (1.0 - Bm) * c->pheomelanin[at + l];
            sa[l] = Cm * melanin + (1.0 - Cm) * c->base[at + l];
        }
        beyond |= transport_lanes_epidermis(&s->transport, sa, c->sigma_s_prime + at, s->d, ret);
    }
    return beyond == 0;
}

static bool transport_dermis(const struct shared_layers *s, double Ch, double *ret)
{
    const struct chromophores *c = s->c;
    const size_t size = TRANSPORT_LANES_DERMIS((size_t)s->transport.streams.n);
    unsigned beyond = 0;
    for (size_t at = 0; at < s->stride; at += VECTORS_LANES, ret += size) {
        double sa[VECTORS_LANES], ss[VECTORS_LANES];
        for (size_t l = 0; l < VECTORS_LANES; l++) {
            double blood = s->gamma * c->oxy[at + l] + (1.0 - s->gamma) * c->deoxy[at + l];
            sa[l] = Ch * blood + (1.0 - Ch) * c->base[at + l];
            ss[l] = 0.5 * c->sigma_s_prime[at + l];
        }
        beyond |= transport_lanes_dermis(&s->transport, sa, ss, ret);
    }
    return beyond == 0;
}

static void transport_pairs(const struct pairs_job *job)
{
    const struct transport_lanes *t = &job->s->transport;
    const size_t n = (size_t)t->streams.n, blocks = job->s->stride / VECTORS_LANES;
    for (size_t row = 0; row < job->n; row++)
        for (size_t b = 0; b < blocks; b++)
            transport_lanes_join(t, job->epidermis + b * TRANSPORT_LANES_EPIDERMIS(n),
                                 job->dermis + row * job->s->dermis_size +
                                     b * TRANSPORT_LANES_DERMIS(n),
                                 job->R + row * job->s->stride + b * VECTORS_LANES);
}

/* As shared_layers_init(), of which this is the last. */
static enum status transport_init(int streams, double eta, struct shared_layers *s)
{
    const size_t n = (size_t)streams, blocks = s->stride / VECTORS_LANES;
    s->epidermis_size = blocks * TRANSPORT_LANES_EPIDERMIS(n);
    s->dermis_size = blocks * TRANSPORT_LANES_DERMIS(n);
    return transport_lanes_init(streams, eta, &s->transport) == STATUS_OK ? STATUS_OK
                                                                          : STATUS_UNSUPPORTED;
}

/* ---- the contract ------------------------------------------------------------------- */

enum status shared_layers_init(const struct model *model, const struct chromophores *c,
                               const struct tissue *t, struct shared_layers *ret)
{
    struct shared_layers s = {
        .kind = model->quick,
        .c = c,
        .stride = SHARED_LAYERS_STRIDE(c->n),
        .epidermis_size = EPIDERMIS_ROWS * SHARED_LAYERS_STRIDE(c->n),
        .dermis_size = DERMIS_ROWS * SHARED_LAYERS_STRIDE(c->n),
        .gamma = t->gamma,
        .d = t->epidermis_mm,
        .entering = 1.0 - dipole_Rs(t->eta),
        .vectors = vectors_best(),
    };
    if (tissue_check(t) != STATUS_OK)
        return STATUS_RANGE;
    if ((model->quick == MODEL_QUICK_NONE && model->streams == 0) || t->scattering_a != 0.0 ||
        dipole_A(t->eta, &s.A) != STATUS_OK)
        return STATUS_UNSUPPORTED;
    if (model->streams > 0 && transport_init(model->streams, t->eta, &s) != STATUS_OK)
        return STATUS_UNSUPPORTED;
    if (model->quick == MODEL_QUICK_HALF_SPACE &&
        !polynomial(1.0 + 4.0 / 3.0 * s.A, 0.5 * s.entering, s.P))
        return STATUS_UNSUPPORTED;
    *ret = s;
    return STATUS_OK;
}

bool shared_epidermis(const struct shared_layers *s, double Cm, double Bm, double *epidermis)
{
    struct layer_job job = { .s = s, .Cm = Cm, .Bm = Bm, .out = epidermis };
    if (s->kind == MODEL_QUICK_NONE)
        return transport_epidermis(s, Cm, Bm, epidermis);
    return layer(&job, false);
}

bool shared_dermis(const struct shared_layers *s, double Ch, double *dermis)
{
    struct layer_job job = { .s = s, .Ch = Ch, .out = dermis };
    if (s->kind == MODEL_QUICK_NONE)
        return transport_dermis(s, Ch, dermis);
    return layer(&job, true);
}

void shared_reflectance(const struct shared_layers *s, const double *epidermis, size_t n,
                        const double *dermis, double *R)
{
    struct pairs_job job = { s, epidermis, dermis, n, R };
    if (s->kind == MODEL_QUICK_NONE)
        transport_pairs(&job);
    else if (s->vectors == VECTORS_WITH_AVX512)
        pairs_avx512(&job);
    else if (s->vectors == VECTORS_WITH_AVX2)
        pairs_avx2(&job);
    else
        pairs_plain(&job);
}
