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
    p.r = quick_sum_float(fused, -k, ln2_low, quick_sum_float(fused, -k, ln2_high, x));
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

#define SUM(a, b, c) quick_sum_float(fused, a, b, c)

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
    float g = slow + fast, fall = SUM(steeper, fast, slow);
    struct quick_band_float ret;
    ret.R = half * mu * g;
    ret.by_sa1 = ret.by_sa2 = -half * inverse * mu * SUM(1.5f * mu * fall, i_s, g);
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
    float pairs = pair1 * pair2, rest = 1.0f / (pairs * apart);
    float i_apart = rest * pairs, i_pairs = rest * apart;
    float i_pair1 = i_pairs * pair2, i_pair2 = i_pairs * pair1;
    float i1 = i_pair1 * k1, i_k1 = i_pair1 * st1, i2 = i_pair2 * k2;
    float i_r2 = i_pair2 * st2 * st2;
    float mu1 = ss1 * i1, b2 = sa2 * i2, mu2 = ss2 * i2, r1 = k1 * i1, r2 = k2 * i2;

    /* e^-y, e^-x and their likes; twice p and its fall at 2y by those at y. */
    struct quick_decay_float z = quick_decay_float_of(fused, apart, i_apart);
    struct quick_decay_float once = quick_decay_float_of(fused, y, i_k1 * i_d);
    float fading = once.e, T = fading * z.e, g = fading * z.mean;
    float g_x = -fading * z.fall, g_y = -g - g_x;
    float twice = fading * fading, more = 1.0f + fading, left = 1.0f + twice;
    float p2 = once.mean * more;

    /* 1 over 1+r1, 1+r2, 3 + 2A r1 and L by one division. */
    float plus1 = 1.0f + r1, plus2 = 1.0f + r2, surface = SUM(A2, r1, 3.0f);
    float edge = SUM(A2 * (1.0f / 3.0f), r2, 1.0f), slope = SUM(x, r2, A2 * d * sa1);
    float L = SUM(p2, slope, left * edge);
    float plus = plus1 * plus2, outer = surface * L, together = 1.0f / (plus * outer);
    float i_plus = together * outer, i_outer = together * plus;
    float i_plus1 = i_plus * plus2, i_plus2 = i_plus * plus1;
    float i_surface = i_outer * L, i_L = i_outer * surface;

    float m1 = mu1 * i_plus1, H = 3.0f * m1 * i_surface;
    float quotient = SUM(2.0f / 3.0f, i_plus, 1.0f / 3.0f); /* (1 + (r1+r2+r1 r2)/3)/plus */
    float clear = A2 * fading * i_surface, layer = SUM(x, g, clear);
    float G = SUM(m1, layer, T * quotient), w = 2.0f * fading * i_L, difference = r1 - r2;
    ret.R = entering * SUM(w * difference, G, H);

    /* By sigma_a1: x changes by d. */
    float p2_fall = 0.5f * SUM(once.fall, more, fading * once.mean);
    float r1_by = 1.5f * mu1 * i_k1; /* 1.5 mu1/(r1 sigma_t1') */
    float y_by = d * SUM(st1, r1_by, r1);
    float m1_by = -SUM(m1, r1_by, mu1 * i1) * i_plus1, lost = A2 * r1_by * i_surface;
    float H_by = 3.0f * i_surface * SUM(-m1, lost, m1_by);
    float shape_by = SUM(x, SUM(y_by, g_y, d * g_x), d * g);
    float layer_by = SUM(-clear, y_by + lost, shape_by);
    float quotient_by = -2.0f / 3.0f * r1_by * i_plus1 * i_plus;
    float beneath_by = T * SUM(-d, quotient, quotient_by);
    float G_by = SUM(m1, layer_by, SUM(m1_by, layer, beneath_by));
    float L_by = SUM(-2.0f * y_by, SUM(p2_fall, slope, twice * edge), p2 * d * (r2 + A2));
    float ends_by = SUM(-G, SUM(L_by, i_L, y_by), G_by);
    float by = entering * SUM(w, SUM(difference, ends_by, r1_by * G), H_by);
    ret.by_sa1 = by;

    /* By r2, and so by both of the dermis. */
    float losses = SUM(1.5f * x, p2, A * left) * (2.0f * i_L);
    float phi = SUM(losses, difference * G, 3.0f * m1 * layer), out = entering * w;
    float by_r2 =
        out * SUM(T * i_plus2 * i_plus2, SUM(2.0f / 3.0f, r2, 1.0f + b2), phi * (1.0f / 3.0f));
    ret.by_sa2 = -1.5f * mu2 * i2 * by_r2 * i_r2;
    return ret;
}

#undef SUM

#endif
