/* two_layer_slopes.c - the derivatives of two_layer.c's R, in forms that do not cancel.
 *
 * In units of the thickness, beside two_layer.c's x and y: q = y^2, e = sigma_a1 d, sigma =
 * sigma_s1' d, and r = k/sigma_t' per layer (so r^2/3 = b = sigma_a/sigma_t', u = r/3).  With
 * C = cosh y, S = sinh(y)/y, T = e^-x, the dermis's m2 = (1 - r2^2/3)/(1 + r2) and
 *
 *   M = C (1 + 2A r2/3) + S (x r2 + 2A e)                  two_layer.c's denominator, e^y/2 times
 *   R = (1-Rs) [sigma int_0^1 B(s) e^-xs ds + T m2]/M,     B(1-s) = C(ys) + x r2 S(ys)
 *
 * The dermis and the thickness enter at the junction only, so their derivatives need nothing but
 * phi there (positive), and no term cancels another:
 *   dR/dr2    = -(1-Rs)/M [T (1 + 2 r2/3 + r2^2/3)/(1 + r2)^2 + phi/3]
 *   d dR/dd   =  (1-Rs)/M x (b2 - b1) (T + phi)
 * Those by e and sigma are taken from whichever of three forms of R neither cancels nor divides
 * by next to nothing; docs/physics.md derives them. */
#include "optics/two_layer.h"

#include <math.h>

#include "optics/dipole.h"

/* What the derivatives of a band are made of. */
struct junction {
    double A;
    double sigma, e, x, y, q; /* the epidermis in units of its thickness */
    double mu1, b1, r1;       /* sigma_s'/sigma_t', sigma_a/sigma_t', k/sigma_t' */
    double mu2, b2, r2, m2;   /* of the dermis; m2 = mu2/(1 + r2) */
    double T, fading;         /* e^-x, e^-y */
    double L;                 /* 2 M e^-y */
    double g;                 /* int_0^1 e^(-x s - y (1-s)) ds */
    double phi;               /* fluence there over the light that came in */
};

/* By e at constant sigma, and by sigma at constant e. */
struct pair {
    double e, sigma;
};

/* (1 - e^-z)/z and its derivative, z >= 0. */
static double mean_decay(double z)
{
    return z > 0.0 ? -expm1(-z) / z : 1.0;
}

/* -d/dz of mean_decay: int_0^1 s e^-zs ds = (1 - (1+z) e^-z)/z^2. */
static double mean_decay_fall(double z)
{
    if (z > 0.5)
        return (mean_decay(z) - exp(-z)) / z;
    double term = 1.0, sum = 0.0; /* sum of (-z)^k / (k! (k+2)) */
    for (int k = 0; k < 14; k++) {
        sum += term / (k + 2);
        term *= -z / (k + 1);
    }
    return sum;
}

/* ---- even functions of y as series in q, for a thin layer ------------------------------- */

enum { TERMS = 8 }; /* enough for q <= 1/16 */

/* sum of q^k/(2k + first)!, times first! */
static double even_series(double q, int first)
{
    double sum = 1.0;
    for (int k = TERMS; k >= 1; k--)
        sum = 1.0 + sum * q / ((2 * k + first) * (2 * k + first - 1));
    return sum;
}

static double cosh_of(double q)
{
    return even_series(q, 0);
}

static double sinh_ratio(double q) /* sinh(y)/y */
{
    return even_series(q, 1);
}

/* (cosh y - sinh(y)/y)/q, twice the derivative of sinh(y)/y by q:
 * sum over k of (2k+2) q^k/(2k+3)! */
static double sinh_ratio_rise(double q)
{
    double sum = 0.0, term = 1.0 / 6.0;
    for (int k = 0; k <= TERMS; k++) {
        sum += (2 * k + 2) * term;
        term *= q / ((2 * k + 4) * (2 * k + 5));
    }
    return sum;
}

/* ---- a thin, weakly absorbing layer: x < 1, y <= 1/4 ------------------------------------ */

/* Integrals over 0..1 with c = cosh y(1-s), o = sinh(y(1-s))/y:
 *   J0, J1    of e^-xs c, e^-xs o; their derivatives by x and q
 *   J0_rest   of e^-xs (1 - xs) (c - 1)
 *   J1_rest   of e^-xs [(2 - xs) (o - (1-s)) - (c - 1)]
 *   between   of e^-xs (c - o)
 *   forward   of e^-xs sinh(ys)/y */
struct thin {
    double J0, J0_x, J0_q, J1, J1_x, J1_q, J0_rest, J1_rest, between, forward;
};

/* 8-point Gauss-Legendre, exact to rounding here: Abramowitz and Stegun 25.4.30. */
static struct thin thin_integrals(double x, double q)
{
    static const double node[4] = { 0.18343464249564980494, 0.52553240991632898582,
                                    0.79666647741362673959, 0.96028985649753623168 };
    static const double weight[4] = { 0.36268378337836198297, 0.31370664587788728734,
                                      0.22238103445337447054, 0.10122853629037625915 };
    struct thin sum = { 0 };
    for (int i = 0; i < 8; i++) {
        double side = i % 2 == 0 ? 0.5 : -0.5;
        double s = 0.5 + side * node[i / 2], up = 0.5 - side * node[i / 2], z = q * up * up;
        double w = 0.5 * weight[i / 2] * exp(-x * s);
        double c_more = 0.5 * z * even_series(z, 2), o_more = up * z / 6.0 * even_series(z, 3);
        double c = 1.0 + c_more, o = up + o_more;
        sum.J0 += w * c;
        sum.J0_x -= w * s * c;
        sum.J0_q += 0.5 * w * up * o;
        sum.J1 += w * o;
        sum.J1_x -= w * s * o;
        sum.J1_q += 0.5 * w * up * up * up * sinh_ratio_rise(z);
        sum.J0_rest += w * (1.0 - x * s) * c_more;
        sum.J1_rest += w * ((2.0 - x * s) * o_more - c_more);
        sum.between += w * (s + c_more - o_more);
        sum.forward += w * s * sinh_ratio(q * s * s);
    }
    return sum;
}

/* The quotient rule as it stands: nothing in it is large here.  By sigma, what is left where
 * neither layer absorbs is next to nothing, so all that is not of the order of e or r2^2 was
 * taken out first (docs/physics.md). */
static struct pair thin_pair(const struct junction *j, double R)
{
    struct thin t = thin_integrals(j->x, j->q);
    double r = j->r2, x = j->x, e = j->e, sigma = j->sigma;
    double C = cosh_of(j->q), S = sinh_ratio(j->q), rise = sinh_ratio_rise(j->q);
    double edge = 1.0 + 2.0 / 3.0 * j->A * r, slope = x * r + 2.0 * j->A * e;
    double M = C * edge + S * slope, M_q = 0.5 * (S * edge + rise * slope);
    double I = t.J0 + x * r * t.J1;
    double I_x = t.J0_x + r * (t.J1 + x * t.J1_x), I_q = t.J0_q + x * r * t.J1_q;

    /* x changes by 1, q by 3 (x+e); e itself stands in M. */
    double by_e = sigma * I_x - j->T * j->m2 - R * S * (r + 2.0 * j->A) +
                  3.0 * (x + e) * (sigma * I_q - R * M_q);

    /* x changes by 1, q by 3 e.  M - S, and what I M loses to it: */
    double above = j->q * rise + 2.0 / 3.0 * j->A * r * C + 2.0 * j->A * e * S;
    double M_less_S = above + x * r * S;
    double dermis = j->T * r / (1.0 + r) * (M_less_S + r / 3.0 * (M + r * S));
    double layer = M * (t.J0_rest - e * t.J0_x + 3.0 * e * sigma * I_q);
    double both = x * (t.J1_rest * M + t.J0 * above + x * r * S * t.between) +
                  e * (I * S - (t.J1 + x * t.J1_x) * M);
    double by_sigma = dermis + layer + r * both - 3.0 * e * R * M * M_q;
    return (struct pair){ by_e / M, by_sigma / M / M };
}

/* ---- a layer that scatters much and absorbs little: x >= 1, y <= 1/4 -------------------- */

/* R = P (1-V)/(1 + 2A V/3) + T K/M,  P = mu1/(1-r1^2),  K = m2 - P (1-r2),  with V three times
 * the admittance of all below the surface:  V = (r2 + 3 e t)/(1 + x r2 t),  t = tanh(y)/y.
 * What V changes by is written out, so that its large terms do not meet. */
static struct pair diffuse_pair(const struct junction *j)
{
    double r = j->r2, x = j->x, e = j->e, A = j->A;
    double C = cosh_of(j->q), S = sinh_ratio(j->q), t = S / C;
    double t_fall = even_series(4.0 * j->q, 3) / (3.0 * C * C); /* -dt/dq */
    double below = 1.0 + x * r * t, V = (r + 3.0 * e * t) / below;
    double contrast = x * r * r - 3.0 * e; /* of the dermis, over the epidermis */
    double V_by = 3.0 * (t * (j->mu2 + r * t * j->sigma) + t_fall * (x + e) * contrast);
    V_by /= below * below;
    double surface = 1.0 + 2.0 / 3.0 * A * V;
    double f = (1.0 - V) / surface, f_V = -(1.0 + 2.0 / 3.0 * A) / (surface * surface);

    double rest = 1.0 - j->r1 * j->r1, P = j->mu1 / rest;
    double P_by = j->mu1 * (3.0 * P - 1.0) / rest / x;

    double edge = 1.0 + 2.0 / 3.0 * A * r, slope = x * r + 2.0 * A * e;
    double M = C * edge + S * slope;
    double M_q = 0.5 * (S * edge + sinh_ratio_rise(j->q) * slope);
    double M_by = 3.0 * (x + e) * M_q + S * (r + 2.0 * A);
    double K = j->m2 - P * (1.0 - r);
    double by_e = P_by * f + P * f_V * V_by - j->T / M * (K + (1.0 - r) * P_by + K * (M_by / M));

    /* By sigma P changes by -2e/(sigma-2e)^2 only, and V by next to nothing as well; so does K,
     * here without the ones that m2 and P have in common. */
    double P_less_1 = 2.0 * j->b1 / rest, P_by_sigma = -P_less_1 / rest / x;
    double V_by_sigma = 3.0 * e * t_fall * contrast - r * t * (r + 3.0 * e * t);
    V_by_sigma /= below * below;
    K = (2.0 * j->b2 - (1.0 - r * r) * P_less_1) / (1.0 + r);
    double M_by_sigma = 3.0 * e * M_q + S * r;
    double by_sigma = P_by_sigma * f + P * f_V * V_by_sigma -
                      j->T / M * (K + (1.0 - r) * P_by_sigma + K * (M_by_sigma / M));
    return (struct pair){ by_e, by_sigma };
}

/* ---- any other layer: y > 1/4 ----------------------------------------------------------- */

/* R = H + (r1 - r2) G/M: the half space that the epidermis would be without an end, and what the
 * dermis changes in it, which fades with the thickness.
 *   H = m1/(1 + 2A r1/3),  m1 = mu1/(1 + r1)
 *   G = m1 [2A e^-y/(3 + 2A r1) + x g] + T (m1 - m2)/(r2 - r1) */
struct thick {
    double H, G, w; /* w = 1/M */
    double difference, quotient, m1;
};

/* By a parameter of which x, y, r1 and mu1 change so much. */
struct change {
    double y, r1, mu1;
    double e; /* 1 or 0; x changes by 1 */
};

/* dg/dx and dg/dy, of g = e^-y mean_decay(x-y) = e^-x mean_decay(y-x). */
static void g_slopes(const struct junction *j, double *by_x, double *by_y)
{
    double z = j->x - j->y, fall = exp(-fmin(j->x, j->y)) * mean_decay_fall(fabs(z));
    *by_x = z > 0.0 ? -fall : fall - j->g;
    *by_y = z > 0.0 ? fall - j->g : -fall;
}

static double thick_slope(const struct junction *j, const struct thick *k, struct change by)
{
    double A = j->A, x = j->x, y = j->y, r1 = j->r1, r2 = j->r2, g_x, g_y;
    g_slopes(j, &g_x, &g_y);
    double plus = 1.0 + r1, surface = 3.0 + 2.0 * A * r1;
    double m1_by = (by.mu1 - k->m1 * by.r1) / plus;
    double H_by = 3.0 * (m1_by - 2.0 * A * k->m1 * by.r1 / surface) / surface;

    double clear = 2.0 * A * j->fading / surface; /* phi there, but for 3 m1 and the source */
    double clear_by = -clear * (by.y + 2.0 * A * by.r1 / surface);
    double layer = clear + x * j->g;
    double layer_by = clear_by + j->g + x * (g_x + g_y * by.y);
    double quotient_by = by.r1 * ((1.0 + r2) / 3.0 / ((1.0 + r2) * plus) - k->quotient / plus);
    double G_by = m1_by * layer + k->m1 * layer_by + j->T * (quotient_by - k->quotient);

    /* 1/M = 2 e^-y/L,  L = (1 + e^-2y) edge + 2 p slope,  p = (1 - e^-2y)/(2y). */
    double twice = j->fading * j->fading, p = mean_decay(2.0 * y), p_y = (twice - p) / y;
    double edge = 1.0 + 2.0 / 3.0 * A * r2, slope = x * r2 + 2.0 * A * j->e;
    double L_by =
        -2.0 * by.y * twice * edge + 2.0 * p_y * by.y * slope + 2.0 * p * (r2 + 2.0 * A * by.e);
    double w_by = -k->w * (by.y + L_by / j->L);
    return H_by + w_by * k->difference * k->G + k->w * (by.r1 * k->G + k->difference * G_by);
}

static struct pair thick_pair(const struct junction *j)
{
    double r1 = j->r1, r2 = j->r2;
    struct thick k = { .m1 = j->mu1 / (1.0 + r1), .w = 2.0 * j->fading / j->L };
    k.H = k.m1 / (1.0 + 2.0 / 3.0 * j->A * r1);
    k.quotient = (1.0 + (r1 + r2 + r1 * r2) / 3.0) / ((1.0 + r1) * (1.0 + r2));
    k.G =
        k.m1 * (2.0 * j->A * j->fading / (3.0 + 2.0 * j->A * r1) + j->x * j->g) + j->T * k.quotient;
    k.difference = 3.0 * (j->b1 * j->mu2 - j->b2 * j->mu1) / (r1 + r2);
    double up = 1.5 * j->mu1 / r1;
    struct change by_e = { r1 + up, up / j->x, -j->mu1 / j->x, 1.0 };
    struct change by_sigma = { 0.5 * r1, -0.5 * r1 / j->x, j->b1 / j->x, 0.0 };
    return (struct pair){ thick_slope(j, &k, by_e), thick_slope(j, &k, by_sigma) };
}

/* ---- a band ----------------------------------------------------------------------------- */

/* h = e^-y int_0^1 e^-xs sinh(ys)/y ds, by whichever form does not cancel. */
static double forward_sinh(const struct junction *j, double a, double p)
{
    if (j->x - j->y >= 1.0) {
        double twice = j->fading * j->fading;
        double bracket = j->fading - j->T * (j->x * p + 0.5 * (1.0 + twice));
        return bracket / (j->x - j->y) / (j->x + j->y);
    }
    if (j->y > 0.25)
        return (j->g - j->fading * a) / (2.0 * j->y);
    return j->fading * thin_integrals(j->x, j->q).forward;
}

static struct junction junction_of(const struct medium *m, size_t i, double A)
{
    double sa1 = m->sigma_a_epidermis[i], ss1 = m->sigma_s_prime_epidermis[i];
    double sa2 = m->sigma_a_dermis[i], ss2 = m->sigma_s_prime_dermis[i];
    double st1 = sa1 + ss1, st2 = sa2 + ss2, d = m->epidermis_mm;
    struct junction j = {
        .A = A,
        .sigma = ss1 * d,
        .e = sa1 * d,
        .x = st1 * d,
        .mu1 = ss1 / st1,
        .b1 = sa1 / st1,
        .mu2 = ss2 / st2,
        .b2 = sa2 / st2,
    };
    j.r1 = sqrt(3.0 * j.b1);
    j.r2 = sqrt(3.0 * j.b2);
    j.y = j.r1 * st1 * d; /* as two_layer.c rounds it */
    j.q = 3.0 * j.e * j.x;
    j.m2 = j.mu2 / (1.0 + j.r2);
    j.T = exp(-j.x);
    j.fading = exp(-j.y);

    double twice = j.fading * j.fading, p = mean_decay(2.0 * j.y);
    double edge = 1.0 + 2.0 / 3.0 * A * j.r2, slope = j.x * j.r2 + 2.0 * A * j.e;
    j.L = (1.0 + twice) * edge + 2.0 * p * slope;
    j.g = exp(-fmin(j.x, j.y)) * mean_decay(fabs(j.x - j.y));
    double a = mean_decay(j.x + j.y), h = forward_sinh(&j, a, p);
    double from_epidermis = j.sigma * (A * (j.g + j.fading * a) + 3.0 * j.x * h);
    double from_dermis = (A * (1.0 + twice) + 3.0 * j.x * p) * (j.T * j.m2);
    j.phi = 2.0 * (from_epidermis + from_dermis) / j.L;
    return j;
}

static struct pair epidermis_pair(const struct junction *j, double R)
{
    return j->y > 0.25 ? thick_pair(j) : j->x < 1.0 ? thin_pair(j, R) : diffuse_pair(j);
}

enum status two_layer_slopes(const struct medium *m, double *R, const struct slopes *dR)
{
    double A = 0.0, d = m->epidermis_mm;
    enum status status = two_layer_reflectance(m, R);
    if (status != STATUS_OK)
        return status;
    (void)dipole_A(m->eta, &A); /* just accepted */
    double entering = 1.0 - dipole_Rs(m->eta);
    for (size_t i = 0; i < m->n; i++) {
        struct junction j = junction_of(m, i, A);
        double st1 = m->sigma_a_epidermis[i] + m->sigma_s_prime_epidermis[i];
        double st2 = m->sigma_a_dermis[i] + m->sigma_s_prime_dermis[i];
        double out = entering * 2.0 * j.fading / j.L, plus = 1.0 + j.r2;
        double by_r2 = -out * (j.T * (1.0 + 2.0 / 3.0 * j.r2 + j.b2) / (plus * plus) + j.phi / 3.0);
        double by_d = out * st1 * (j.b2 * j.mu1 - j.b1 * j.mu2) * (j.T + j.phi);
        struct pair by = epidermis_pair(&j, R[i] / entering);
        dR->sigma_a_epidermis[i] = entering * by.e * d;
        dR->sigma_s_prime_epidermis[i] = entering * by.sigma * d;
        dR->sigma_a_dermis[i] = j.r2 > 0.0    ? by_r2 * 1.5 * j.mu2 / j.r2 / st2
                                : by_r2 < 0.0 ? -INFINITY
                                              : 0.0;
        dR->sigma_s_prime_dermis[i] = -by_r2 * 0.5 * j.r2 / st2;
        dR->epidermis_mm[i] = by_d;
    }
    return STATUS_OK;
}
