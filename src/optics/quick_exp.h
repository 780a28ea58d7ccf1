/* quick_exp.h - exponentials that a compiler makes vectors of: no branch, no call.  Exponentials
 * within 1 ulp, the mean within 2, its fall within 13.
 *
 * `fused`, a constant where it is passed: multiply and add are rounded once, which halves the
 * work where the processor has an instruction for it; the last bits then differ. */
#ifndef SKINSPEC_OPTICS_QUICK_EXP_H
#define SKINSPEC_OPTICS_QUICK_EXP_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

/* The helpers have to become part of the loop that calls them, for whatever vectors it is. */
#define QUICK_INLINE static inline __attribute__((always_inline))

/* a b + c */
QUICK_INLINE double quick_sum(bool fused, double a, double b, double c)
{
    return fused ? fma(a, b, c) : a * b + c;
}

/* e^x = scale (1 + r + r^2 s), scale = 2^k, |r| <= ln(2)/2;  -700 <= x <= 700. */
struct quick_parts {
    double scale, r, s;
};

QUICK_INLINE struct quick_parts quick_parts_of(bool fused, double x)
{
    /* Added, it rounds to a whole number and leaves that in the last bits. */
    const double rounder = 0x1.8p52;
    const double log2_e = 1.44269504088896340736;
    /* ln 2 in two: k times the first is exact (fdlibm, e_exp.c). */
    const double ln2_high = 6.93147180369123816490e-01, ln2_low = 1.90821492927058770002e-10;
    double shifted = quick_sum(fused, x, log2_e, rounder), k = shifted - rounder;
    uint64_t bits;
    struct quick_parts p;
    memcpy(&bits, &shifted, sizeof bits);
    bits = (bits + 1023) << 52; /* the exponent of a double */
    memcpy(&p.scale, &bits, sizeof bits);
    p.r = quick_sum(fused, -k, ln2_low, quick_sum(fused, -k, ln2_high, x));
    /* (e^r - 1 - r)/r^2 by its Chebyshev fit (mpmath.chebyfit, 40 digits), within 1.1e-16; in
     * pairs, as Estrin has it: one after the other each sum would wait for the last. */
    double r = p.r, r2 = r * r, r4 = r2 * r2;
    double s01 = quick_sum(fused, 0.16666666666666669, r, 0.5);
    double s23 = quick_sum(fused, 0.008333333333330062, r, 0.04166666666662413);
    double s45 = quick_sum(fused, 0.00019841269863053618, r, 0.0013888888917213717);
    double s67 = quick_sum(fused, 2.7557268459997064e-06, r, 2.4801521295954376e-05);
    double s89 = quick_sum(fused, 2.510038549551032e-08, r, 2.7620088445409746e-07);
    double low = quick_sum(fused, s23, r2, s01), high = quick_sum(fused, s67, r2, s45);
    p.s = quick_sum(fused, quick_sum(fused, s89, r4, high), r4, low);
    return p;
}

/* e^r - 1 */
QUICK_INLINE double quick_grown(bool fused, struct quick_parts p)
{
    return quick_sum(fused, p.r * p.r, p.s, p.r);
}

QUICK_INLINE double quick_exp(bool fused, double x)
{
    struct quick_parts p = quick_parts_of(fused, x);
    return quick_sum(fused, p.scale, quick_grown(fused, p), p.scale);
}

/* Of -700 <= z <= 700: e^-z; the mean of e^-zs over 0 <= s <= 1, (1 - e^-z)/z; and minus the
 * derivative of that, (1 - (1+z) e^-z)/z^2.  z is not 0 and comes with its inverse. */
struct quick_decay {
    double e, mean, fall;
};

/* What stands for a z of 0: all that is asked of it is the same. */
QUICK_INLINE double quick_not_zero(double z)
{
    return z * z > 1e-60 ? z : 1e-30;
}

QUICK_INLINE struct quick_decay quick_decay_of(bool fused, double z, double inverse)
{
    struct quick_parts p = quick_parts_of(fused, -z);
    struct quick_decay d;
    double grown = quick_grown(fused, p);
    d.e = quick_sum(fused, p.scale, grown, p.scale);
    d.mean = quick_sum(fused, -p.scale, grown, 1.0 - p.scale) * inverse;
    /* Where r is -z itself, the difference is left out of what is written. */
    double near = quick_sum(fused, -p.s, 1.0 + z, 1.0), far = (d.mean - d.e) * inverse;
    d.fall = p.scale == 1.0 ? near : far;
    return d;
}

#endif
