/* delta_e.c - CIE 1976 and CIEDE2000 colour differences.  Equation numbers are
 * those of Sharma, Wu, Dalal, Color Res. Appl. 30:21 (2005). */
#include "colour/delta_e.h"

#include <math.h>

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

/* Eq. 7: hue of (a', b) in 0 .. 360; 0 for grey, where atan2 may say 180. */
static double hue_deg(double a_prime, double b)
{
    double h;

    if (a_prime == 0.0 && b == 0.0)
        return 0.0;
    h = atan2(b, a_prime) * UNITS_DEG_PER_RAD;
    return h < 0.0 ? h + 360.0 : h;
}

/* Eq. 10: h2 - h1 the short way round. */
static double hue_difference_deg(double h1, double h2)
{
    double d = h2 - h1;

    if (d > 180.0)
        return d - 360.0;
    if (d < -180.0)
        return d + 360.0;
    return d;
}

/* Eq. 14: the mean hue lies on the shorter arc; exactly opposite hues take the
 * plain mean. */
static double hue_mean_deg(double h1, double h2)
{
    double sum = h1 + h2;

    if (fabs(h1 - h2) <= 180.0)
        return sum / 2.0;
    return sum < 360.0 ? (sum + 360.0) / 2.0 : (sum - 360.0) / 2.0;
}

/* Eq. 15. */
static double hue_weight(double h_deg)
{
    return 1.0 - 0.17 * cos(rad(h_deg - 30.0)) + 0.24 * cos(rad(2.0 * h_deg)) +
           0.32 * cos(rad(3.0 * h_deg + 6.0)) - 0.20 * cos(rad(4.0 * h_deg - 63.0));
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
    double h1 = hue_deg(a1, Lab1[2]), h2 = hue_deg(a2, Lab2[2]);
    double C_mean = (C1 + C2) / 2.0;

    /* Eqs. 10 and 14: grey has no hue of its own and takes the other's. */
    int grey = C1 == 0.0 || C2 == 0.0;
    double dh = grey ? 0.0 : hue_difference_deg(h1, h2);
    double h_mean = grey ? h1 + h2 : hue_mean_deg(h1, h2);

    /* Eqs. 8-21, each difference over its weighting. */
    double l = delta_e_2000_lightness(Lab1[0], Lab2[0]);
    double c = (C2 - C1) / (1.0 + 0.045 * C_mean);
    double h =
        2.0 * sqrt(C1 * C2) * sin(rad(dh / 2.0)) / (1.0 + 0.015 * C_mean * hue_weight(h_mean));
    double d_theta = 30.0 * exp(-square((h_mean - 275.0) / 25.0));
    double R_T = -sin(rad(2.0 * d_theta)) * 2.0 * chroma_switch(C_mean);

    /* Eq. 22 has c^2 + h^2 + R_T c h; completing the square keeps it from going
     * below 0 by rounding, and so the total from going below l. */
    return sqrt(l * l + square(c + R_T * h / 2.0) + (1.0 - R_T * R_T / 4.0) * h * h);
}
