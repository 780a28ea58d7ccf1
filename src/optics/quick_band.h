/* quick_band.h - one band of the two closed-form models, in formulas without branches that a
 * compiler makes vectors of, be it over the bands of one skin or over many skins.
 *
 * `beyond` is 0 where the coefficients lie in the range that optics/quick.h states; else the
 * other members are not to be used.  Derivatives are those by absorption of either layer; the
 * others, where the caller asks for them by a constant. */
#ifndef SKINSPEC_OPTICS_QUICK_BAND_H
#define SKINSPEC_OPTICS_QUICK_BAND_H

#include "optics/quick_exp.h"

struct quick_band {
    double R, by_sa1, by_sa2;
    double by_ss, by_d; /* by sigma_s' (of both layers alike) and by the thickness */
    uint64_t beyond;
};

/* a b + c, as optics/quick_exp.h fuses it: a third of all operations. */
#define SUM(a, b, c) quick_sum(fused, a, b, c)

/* ---- half space -------------------------------------------------------------------------- */

/* optics/half_space.c's formulas, with one division: k = sqrt(3 sigma_a sigma_t') is s sigma_t'
 * and 3 sigma_a/s.  sigma_a is that of both layers together; A and the share that enters are of
 * the surface. */
QUICK_INLINE struct quick_band quick_half_space(bool fused, double A, double entering,
                                                double sigma_a, double ss)
{
    double steeper = 1.0 + 4.0 / 3.0 * A, half = 0.5 * entering;
    double st = sigma_a + ss;
    /* Its root and its division do not wait for each other. */
    double both = 1.0 / (st * sigma_a), inverse = both * sigma_a;
    double k = sqrt(3.0 * sigma_a * st), s = k * inverse, i_s = k * both * (1.0 / 3.0) * st;
    double mu = ss * inverse, b = sigma_a * inverse;
    double slow = quick_exp(fused, -s), fast = quick_exp(fused, -steeper * s);
    double g = slow + fast, fall = SUM(steeper, fast, slow), outside = half * inverse;
    struct quick_band ret;
    ret.R = half * mu * g;
    ret.by_sa1 = ret.by_sa2 = -outside * mu * SUM(1.5 * mu * fall, i_s, g);
    ret.by_ss = outside * SUM(0.5 * mu * s, fall, b * g);
    ret.by_d = 0.0;
    ret.beyond = b >= 1e-10 ? 0u : 1u;
    return ret;
}

/* ---- two layers -------------------------------------------------------------------------- */

/* R = H + (r1 - r2) G/M of optics/two_layer_slopes.c, its third form, which takes no branches:
 * what it loses where the epidermis is thin is 1/y.  Divisions cost as much as ten products,
 * so several quantities share one. */
QUICK_INLINE struct quick_band quick_two_layer(bool fused, bool slopes, bool all, double A,
                                               double entering, double d, double sa1, double ss1,
                                               double sa2, double ss2)
{
    double A2 = 2.0 * A, i_d = 1.0 / d;
    struct quick_band ret = { 0 };
    double st1 = sa1 + ss1, st2 = sa2 + ss2;
    double k1 = sqrt(3.0 * sa1 * st1), k2 = sqrt(3.0 * sa2 * st2);
    double x = st1 * d, y = k1 * d, apart = quick_not_zero(x - y);

    /* 1 over sigma_t1', k1, sigma_t2', k2 and x-y by one division. */
    double pair1 = st1 * k1, pair2 = st2 * k2;
    double pairs = pair1 * pair2, rest = 1.0 / (pairs * apart);
    double i_apart = rest * pairs, i_pairs = rest * apart;
    double i_pair1 = i_pairs * pair2, i_pair2 = i_pairs * pair1;
    double i1 = i_pair1 * k1, i_k1 = i_pair1 * st1, i2 = i_pair2 * k2;
    double i_r2 = i_pair2 * st2 * st2;
    double mu1 = ss1 * i1, b2 = sa2 * i2, mu2 = ss2 * i2, r1 = k1 * i1, r2 = k2 * i2;

    /* e^-y, e^-x and their likes; twice p and its fall at 2y by those at y. */
    struct quick_decay z = quick_decay_of(fused, apart, i_apart);
    struct quick_decay once = quick_decay_of(fused, y, i_k1 * i_d);
    double fading = once.e, T = fading * z.e, g = fading * z.mean;
    double g_x = -fading * z.fall, g_y = -g - g_x;
    double twice = fading * fading, more = 1.0 + fading, left = 1.0 + twice;
    double p2 = once.mean * more;

    /* 1 over 1+r1, 1+r2, 3 + 2A r1 and L by one division. */
    double plus1 = 1.0 + r1, plus2 = 1.0 + r2, surface = SUM(A2, r1, 3.0);
    double edge = SUM(A2 * (1.0 / 3.0), r2, 1.0), slope = SUM(x, r2, A2 * d * sa1);
    double L = SUM(p2, slope, left * edge);
    double plus = plus1 * plus2, outer = surface * L, together = 1.0 / (plus * outer);
    double i_plus = together * outer, i_outer = together * plus;
    double i_plus1 = i_plus * plus2, i_plus2 = i_plus * plus1;
    double i_surface = i_outer * L, i_L = i_outer * surface;

    double m1 = mu1 * i_plus1, H = 3.0 * m1 * i_surface;
    double quotient = SUM(2.0 / 3.0, i_plus, 1.0 / 3.0); /* (1 + (r1+r2+r1 r2)/3)/plus */
    double clear = A2 * fading * i_surface, layer = SUM(x, g, clear);
    double G = SUM(m1, layer, T * quotient), w = 2.0 * fading * i_L, difference = r1 - r2;
    ret.R = entering * SUM(w * difference, G, H);
    ret.beyond = y >= 1.0 / 128.0 ? 0u : 1u;
    ret.beyond |= r1 >= 1.0 / 64.0 ? 0u : 1u;
    ret.beyond |= x <= 150.0 ? 0u : 1u;
    ret.beyond |= r2 >= 1e-6 ? 0u : 1u;
    if (!slopes)
        return ret;

    /* By sigma_a1: x changes by d. */
    double p2_fall = 0.5 * SUM(once.fall, more, fading * once.mean);
    double r1_by = 1.5 * mu1 * i_k1; /* 1.5 mu1/(r1 sigma_t1') */
    double y_by = d * SUM(st1, r1_by, r1);
    double m1_by = -SUM(m1, r1_by, mu1 * i1) * i_plus1, lost = A2 * r1_by * i_surface;
    double H_by = 3.0 * i_surface * SUM(-m1, lost, m1_by);
    double shape_by = SUM(x, SUM(y_by, g_y, d * g_x), d * g);
    double layer_by = SUM(-clear, y_by + lost, shape_by);
    double quotient_by = -2.0 / 3.0 * r1_by * i_plus1 * i_plus;
    double beneath_by = T * SUM(-d, quotient, quotient_by);
    double G_by = SUM(m1, layer_by, SUM(m1_by, layer, beneath_by));
    double L_by = SUM(-2.0 * y_by, SUM(p2_fall, slope, twice * edge), p2 * d * (r2 + A2));
    double ends_by = SUM(-G, SUM(L_by, i_L, y_by), G_by);
    double by = entering * SUM(w, SUM(difference, ends_by, r1_by * G), H_by);
    ret.by_sa1 = by;

    /* By r2, and so by both of the dermis. */
    double losses = SUM(1.5 * x, p2, A * left) * (2.0 * i_L);
    double phi = SUM(losses, difference * G, 3.0 * m1 * layer), out = entering * w;
    double by_r2 =
        out * SUM(T * i_plus2 * i_plus2, SUM(2.0 / 3.0, r2, 1.0 + b2), phi * (1.0 / 3.0));
    ret.by_sa2 = -1.5 * mu2 * i2 * by_r2 * i_r2;

    if (all) { /* d dR/dd is the sum of what the coefficients times their derivatives are */
        double b1 = sa1 * i1, by_thickness = out * st1 * (b2 * mu1 - b1 * mu2) * (T + phi);
        ret.by_d = by_thickness;
        ret.by_ss = (d * by_thickness - sa1 * by) / ss1 + 0.5 * by_r2 * r2 * i2;
        ret.beyond |= mu1 >= 1.0 / 64.0 ? 0u : 1u;
    }
    return ret;
}

#undef SUM

#endif
