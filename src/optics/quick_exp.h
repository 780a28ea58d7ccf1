/* quick_exp.h - exponentials that a compiler makes vectors of: no branch, no call, no fused
 * multiplication.  Exponentials within 1 ulp, the
 * mean within 2, its fall within 13. */
#ifndef SKINSPEC_OPTICS_QUICK_EXP_H
#define SKINSPEC_OPTICS_QUICK_EXP_H

#include <stdint.h>
#include <string.h>

/* The helpers have to become part of the loop that calls them, for whatever vectors it is. */
#define QUICK_INLINE static inline __attribute__((always_inline))

/* e^x = scale (1 + r + r^2 s), scale = 2^k, |r| <= ln(2)/2;  -700 <= x <= 700. */
struct quick_parts {
    double scale, r, s;
};

QUICK_INLINE struct quick_parts quick_parts_of(double x)
{
    /* Added, it rounds to a whole number and leaves that in the last bits. */
    const double rounder = 0x1.8p52;
    const double log2_e = 1.44269504088896340736;
    /* ln 2 in two: k times the first is exact (fdlibm, e_exp.c). */
    const double ln2_high = 6.93147180369123816490e-01, ln2_low = 1.90821492927058770002e-10;
    double shifted = x * log2_e + rounder, k = shifted - rounder;
    uint64_t bits;
    struct quick_parts p;
    memcpy(&bits, &shifted, sizeof bits);
    bits = (bits + 1023) << 52; /* the exponent of a double */
    memcpy(&p.scale, &bits, sizeof bits);
    p.r = (x - k * ln2_high) - k * ln2_low;
    /* (e^r - 1 - r)/r^2 by its Chebyshev fit (mpmath.chebyfit, 40 digits), within 1.1e-16 */
    double r = p.r, s = 2.510038549551032e-08;
    s = s * r + 2.7620088445409746e-07;
    s = s * r + 2.7557268459997064e-06;
    s = s * r + 2.4801521295954376e-05;
    s = s * r + 0.00019841269863053618;
    s = s * r + 0.0013888888917213717;
    s = s * r + 0.008333333333330062;
    s = s * r + 0.04166666666662413;
    s = s * r + 0.16666666666666669;
    p.s = s * r + 0.5;
    return p;
}

QUICK_INLINE double quick_exp(double x)
{
    struct quick_parts p = quick_parts_of(x);
    return p.scale + p.scale * (p.r + p.r * p.r * p.s);
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

QUICK_INLINE struct quick_decay quick_decay_of(double z, double inverse)
{
    struct quick_parts p = quick_parts_of(-z);
    struct quick_decay d;
    double grown = p.r + p.r * p.r * p.s; /* e^r - 1 */
    d.e = p.scale + p.scale * grown;
    d.mean = ((1.0 - p.scale) - p.scale * grown) * inverse;
    /* Where r is -z itself, the difference is left out of what is written. */
    double near = 1.0 - p.s * (1.0 + z), far = (d.mean - d.e) * inverse;
    d.fall = p.scale == 1.0 ? near : far;
    return d;
}

#endif
