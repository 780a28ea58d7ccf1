/* quick_band_float.h - the formulas of optics/quick_band.h in single precision, of which twice
 * as many make a vector: for the first steps of a fit.  On human skin R is within 2e-6 and the
 * derivatives within 1e-4 of their largest; nothing says where they are not. */
#ifndef SKINSPEC_OPTICS_QUICK_BAND_FLOAT_H
#define SKINSPEC_OPTICS_QUICK_BAND_FLOAT_H

#include "optics/quick_exp.h"

struct quick_band_float {
    float R, by_sa1, by_sa2;
};

/* ---- exponentials: as optics/quick_exp.h ------------------------------------------------- */

QUICK_INLINE float quick_sum_float(bool fused, float a, float b, float c)
{
    return fused ? fmaf(a, b, c) : a * b + c;
}

struct quick_parts_float {
    float scale, r, s;
};

QUICK_INLINE struct quick_parts_float quick_parts_float_of(bool fused, float given)
{
    const float rounder = 0x1.8p23f, log2_e = 1.44269504088896340736f;
    const float ln2_high = 0.693359375f, ln2_low = -2.12194440e-4f; /* Cephes, expf.c */
    /* Where that is not so, nothing depends on it. */
    float x = given > -80.0f ? (given < 80.0f ? given : 80.0f) : -80.0f;
    float shifted = quick_sum_float(fused, x, log2_e, rounder), k = shifted - rounder;
    uint32_t bits;
    struct quick_parts_float p;
    memcpy(&bits, &shifted, sizeof bits);
    bits = (bits + 127) << 23;
    memcpy(&p.scale, &bits, sizeof bits);
    p.r = quick_sum_float(fused, -k, ln2_low, x - k * ln2_high);
    /* (e^r - 1 - r)/r^2 interpolated at Chebyshev's five nodes, within 1e-8 of e^r. */
    float r = p.r, r2 = r * r;
    float s01 = quick_sum_float(fused, 0.1666657702559799f, r, 0.5f);
    float s23 = quick_sum_float(fused, 0.008363173074513711f, r, 0.041666554662050534f);
    p.s = quick_sum_float(fused, quick_sum_float(fused, 0.001392617611993558f, r2, s23), r2, s01);
    return p;
}

QUICK_INLINE float quick_grown_float(bool fused, struct quick_parts_float p)
{
    return quick_sum_float(fused, p.r * p.r, p.s, p.r);
}

QUICK_INLINE float quick_exp_float(bool fused, float x)
{
    struct quick_parts_float p = quick_parts_float_of(fused, x);
    return quick_sum_float(fused, p.scale, quick_grown_float(fused, p), p.scale);
}

struct quick_decay_float {
    float e, mean, fall;
};

QUICK_INLINE float quick_not_zero_float(float z)
{
    return z * z > 1e-20f ? z : 1e-10f;
}

QUICK_INLINE struct quick_decay_float quick_decay_float_of(bool fused, float z, float inverse)
{
    struct quick_parts_float p = quick_parts_float_of(fused, -z);
    struct quick_decay_float d;
    float grown = quick_grown_float(fused, p);
    d.e = quick_sum_float(fused, p.scale, grown, p.scale);
    d.mean = quick_sum_float(fused, -p.scale, grown, 1.0f - p.scale) * inverse;
    float near = quick_sum_float(fused, -p.s, 1.0f + z, 1.0f), far = (d.mean - d.e) * inverse;
    d.fall = p.scale == 1.0f ? near : far;
    return d;
}

/* ---- the models -------------------------------------------------------------------------- */

QUICK_INLINE struct quick_band_float quick_half_space_float(bool fused, float A, float entering,
                                                            float sigma_a, float ss)
{
    float steeper = 1.0f + 4.0f / 3.0f * A, half = 0.5f * entering;
    float st = sigma_a + ss;
    float both = 1.0f / (st * sigma_a), inverse = both * sigma_a;
    float k = sqrtf(3.0f * sigma_a * st), s = k * inverse, i_s = k * both * (1.0f / 3.0f) * st;
    float mu = ss * inverse;
    float slow = quick_exp_float(fused, -s), fast = quick_exp_float(fused, -steeper * s);
    float g = slow + fast, fall = slow + steeper * fast;
    struct quick_band_float ret;
    ret.R = half * mu * g;
    ret.by_sa1 = ret.by_sa2 = -half * inverse * mu * (g + 1.5f * mu * fall * i_s);
    return ret;
}

QUICK_INLINE struct quick_band_float quick_two_layer_float(bool fused, float A, float entering,
                                                           float d, float sa1, float ss1, float sa2,
                                                           float ss2)
{
    float A2 = 2.0f * A, i_d = 1.0f / d;
    struct quick_band_float ret = { 0 };
    float st1 = sa1 + ss1, st2 = sa2 + ss2;
    float k1 = sqrtf(3.0f * sa1 * st1), k2 = sqrtf(3.0f * sa2 * st2);
    float x = st1 * d, y = k1 * d, apart = quick_not_zero_float(x - y);

    /* 1 over sigma_t1', k1, sigma_t2', k2 and x-y by one division. */
    float pair1 = st1 * k1, pair2 = st2 * k2;
    float rest = 1.0f / (pair1 * pair2 * apart);
    float i_apart = rest * (pair1 * pair2), i_pairs = rest * apart;
    float i_pair1 = i_pairs * pair2, i_pair2 = i_pairs * pair1;
    float i1 = i_pair1 * k1, i_k1 = i_pair1 * st1, i2 = i_pair2 * k2, i_r2 = i_pair2 * st2 * st2;
    float mu1 = ss1 * i1, b2 = sa2 * i2, mu2 = ss2 * i2;
    float r1 = k1 * i1, r2 = k2 * i2;

    /* e^-y, e^-x and their likes; p and its fall at 2y by those at y. */
    struct quick_decay_float z = quick_decay_float_of(fused, apart, i_apart);
    struct quick_decay_float once = quick_decay_float_of(fused, y, i_k1 * i_d);
    float fading = once.e, T = fading * z.e, g = fading * z.mean;
    float g_x = -fading * z.fall, g_y = -g - g_x;
    float twice = fading * fading, more = 1.0f + fading, left = 1.0f + twice;
    float p = 0.5f * once.mean * more;
    float p_fall = 0.25f * (once.fall * more + fading * once.mean);

    /* 1 over 1+r1, 1+r2, 3 + 2A r1 and L by one division. */
    float plus1 = 1.0f + r1, plus2 = 1.0f + r2, surface = 3.0f + A2 * r1;
    float edge = 1.0f + A2 * (1.0f / 3.0f) * r2, slope = x * r2 + A2 * (sa1 * d);
    float L = left * edge + 2.0f * p * slope;
    float plus = plus1 * plus2, outer = surface * L, together = 1.0f / (plus * outer);
    float i_plus = together * outer, i_outer = together * plus;
    float i_plus1 = i_plus * plus2, i_plus2 = i_plus * plus1;
    float i_surface = i_outer * L, i_L = i_outer * surface;

    float m1 = mu1 * i_plus1, H = 3.0f * m1 * i_surface;
    float quotient = (1.0f + (r1 + r2 + r1 * r2) * (1.0f / 3.0f)) * i_plus;
    float clear = A2 * fading * i_surface, layer = clear + x * g;
    float G = m1 * layer + T * quotient, w = 2.0f * fading * i_L, difference = r1 - r2;
    ret.R = entering * (H + w * difference * G);

    /* By sigma_a1: x changes by d. */
    float r1_by = 1.5f * mu1 * i_k1; /* 1.5 mu1/(r1 sigma_t1') */
    float y_by = d * (r1 + st1 * r1_by);
    float m1_by = -(mu1 * i1 + m1 * r1_by) * i_plus1, lost = A2 * r1_by * i_surface;
    float H_by = 3.0f * (m1_by - m1 * lost) * i_surface;
    float layer_by = d * g + x * (d * g_x + y_by * g_y) - clear * (y_by + lost);
    float quotient_by = r1_by * i_plus1 * (1.0f / 3.0f - quotient);
    float G_by = m1_by * layer + m1 * layer_by + T * (quotient_by - d * quotient);
    float L_by = 2.0f * (p * d * (r2 + A2) - y_by * (twice * edge + 2.0f * p_fall * slope));
    float by = entering * (H_by + w * (r1_by * G + difference * (G_by - G * (y_by + L_by * i_L))));
    ret.by_sa1 = by;

    /* By r2, and so by both of the dermis. */
    float phi = 3.0f * m1 * layer + (A * left + 3.0f * x * p) * (2.0f * i_L) * difference * G;
    float out = entering * w;
    float by_r2 =
        out * (T * (1.0f + 2.0f / 3.0f * r2 + b2) * (i_plus2 * i_plus2) + phi * (1.0f / 3.0f));
    ret.by_sa2 = -1.5f * mu2 * i2 * by_r2 * i_r2;
    return ret;
}

#endif
