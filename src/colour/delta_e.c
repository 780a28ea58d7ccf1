/* delta_e.c - CIE 1976 and CIEDE2000 colour differences.  Equation numbers are
 * those of Sharma, Wu, Dalal, Color Res. Appl. 30:21 (2005). */
#include "colour/delta_e.h"

#include <math.h>
#include <stdbool.h>

#include "base/units.h"

static double rad(double deg)
{
    return deg / UNITS_DEG_PER_RAD;
}

static double square(double x)
{
    return x * x;
}

/* sqrt(C^7 / (C^7 + 25^7)), the chroma switch of Eqs. 4 and 17. */
static double chroma_switch(double C)
{
    static const double C7_half = 6103515625.0; /* 25^7 */
    double C2 = C * C, C7 = C2 * C2 * C2 * C;

    return sqrt(C7 / (C7 + C7_half));
}

/* Eq. 7: hue of (a', b), here -180 < h <= 180, for near 0 degrees have more digits; 0 for
 * grey, where atan2 may say 180. */
static double hue_deg(double a_prime, double b)
{
    if (a_prime == 0.0 && b == 0.0)
        return 0.0;
    return atan2(b + 0.0, a_prime) * UNITS_DEG_PER_RAD; /* + 0: -0 is not below the axis */
}

/* Eqs. 10 and 14: how two hues lie to each other. */
struct hues {
    double difference; /* h2 - h1 the short way round, degrees; of opposites as in 0 .. 360 */
    double middle;     /* of that way, degrees: as it stands, or from 180 */
    bool from_180;
    bool below; /* the middle, from 0, is to be read as 180 .. 360 */
};

/* Which way is the short one, and on which side of the axis its middle lies, the signs of
 * sin(h2 - h1) and sin(h2 + h1) decide: right also where degrees, rounded, would not.  G
 * stretches both a alike and is no matter. */
static struct hues hues_of(double a1, const double Lab1[3], double a2, const double Lab2[3])
{
    double p = Lab1[1] * Lab2[2], q = Lab2[1] * Lab1[2];
    double h1 = hue_deg(a1, Lab1[2]), h2 = hue_deg(a2, Lab2[2]);
    struct hues h = { .difference = h2 - h1, .middle = (h1 + h2) / 2.0 };

    if ((h1 < 0.0) == (h2 < 0.0)) {
        h.below = h1 < 0.0;
    } else if (h1 < 0.0 ? p > q : p < q) { /* across 0 */
        h.below = p + q < 0.0;
    } else { /* across 180, or opposite */
        h.difference += h1 < 0.0 ? -360.0 : 360.0;
        h.from_180 = true;
    }
    return h;
}

/* The same beside grey, which has no hue of its own and takes the other's. */
static struct hues hues_beside_grey(double a1, const double Lab1[3], double a2,
                                    const double Lab2[3])
{
    double h = hue_deg(a1, Lab1[2]) + hue_deg(a2, Lab2[2]);

    return (struct hues){ .middle = h, .below = h < 0.0 };
}

/* Eq. 11, 2 sqrt(C1 C2) sin(dh/2).  Of near hues the sine is taken from the products
 * themselves: their degrees would differ in their last digits only. */
static double hue_term(double a1, double b1, double C1, double a2, double b2, double C2,
                       double dh_deg)
{
    double dot = a1 * a2 + b1 * b2;

    if (dot > 0.0)
        return (a1 * b2 - a2 * b1) * sqrt(2.0 / (C1 * C2 + dot));
    return 2.0 * sqrt(C1 * C2) * sin(rad(dh_deg / 2.0));
}

/* Eq. 15.  Half a turn more turns the signs of cos h and cos 3h; of 4h, whole turns are
 * taken off before 63 degrees are, so that it stays small. */
static double hue_weight(const struct hues *h)
{
    double m = h->middle, side = h->from_180 ? -1.0 : 1.0;
    double four = 4.0 * m;

    if (fabs(four) > 360.0)
        four -= copysign(360.0, four);
    return 1.0 - side * 0.17 * cos(rad(m - 30.0)) + 0.24 * cos(rad(2.0 * m)) +
           side * 0.32 * cos(rad(3.0 * m + 6.0)) - 0.20 * cos(rad(four - 63.0));
}

/* Eq. 16's h - 275 degrees. */
static double from_blue_deg(const struct hues *h)
{
    if (h->from_180)
        return h->middle - 95.0;
    return h->below ? h->middle + 85.0 : h->middle - 275.0;
}

double delta_e_ab(const double Lab1[3], const double Lab2[3])
{
    return sqrt(square(Lab2[0] - Lab1[0]) + square(Lab2[1] - Lab1[1]) + square(Lab2[2] - Lab1[2]));
}

double delta_e_2000_lightness(double L1, double L2)
{
    double m2 = square((L1 + L2) / 2.0 - 50.0);
    double S_L = 1.0 + 0.015 * m2 / sqrt(20.0 + m2); /* Eq. 15 */

    return fabs(L2 - L1) / S_L;
}

double delta_e_2000(const double Lab1[3], const double Lab2[3])
{
    /* Eqs. 2-7: a* is stretched near grey, then chroma and hue are taken anew. */
    double C_ab_mean = (hypot(Lab1[1], Lab1[2]) + hypot(Lab2[1], Lab2[2])) / 2.0;
    double stretch = 1.5 - 0.5 * chroma_switch(C_ab_mean); /* 1 + G */
    double a1 = stretch * Lab1[1], a2 = stretch * Lab2[1];
    double C1 = hypot(a1, Lab1[2]), C2 = hypot(a2, Lab2[2]);
    double b1 = Lab1[2], b2 = Lab2[2];
    double C_mean = (C1 + C2) / 2.0;

    bool grey = C1 == 0.0 || C2 == 0.0;
    struct hues hues = grey ? hues_beside_grey(a1, Lab1, a2, Lab2) : hues_of(a1, Lab1, a2, Lab2);

    /* C2 - C1 from the differences of their squares: chromas that hardly differ. */
    double dC =
        stretch * stretch * (Lab2[1] - Lab1[1]) * (Lab2[1] + Lab1[1]) + (b2 - b1) * (b2 + b1);
    double dH = hue_term(a1, b1, C1, a2, b2, C2, hues.difference);

    /* Eqs. 8-21, each difference over its weighting. */
    double l = delta_e_2000_lightness(Lab1[0], Lab2[0]);
    double c = C_mean > 0.0 ? dC / (C1 + C2) / (1.0 + 0.045 * C_mean) : 0.0;
    double h = dH / (1.0 + 0.015 * C_mean * hue_weight(&hues));
    double d_theta = 30.0 * exp(-square(from_blue_deg(&hues) / 25.0));
    double R_T = -sin(rad(2.0 * d_theta)) * 2.0 * chroma_switch(C_mean);

    /* Eq. 22 has c^2 + h^2 + R_T c h; completing the square keeps it from going
     * below 0 by rounding, and so the total from going below l. */
    return sqrt(l * l + square(c + R_T * h / 2.0) + (1.0 - R_T * R_T / 4.0) * h * h);
}
