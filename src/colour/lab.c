/* lab.c - CIE 1976 L*a*b*, its polar form, and the individual typology angle. */
#include "colour/lab.h"

#include <math.h>
#include <stddef.h>

#include "base/units.h"

/* [CIE15] 8.2.1.  In fractions: the rounded 0.008856 and 903.3 of older texts
 * leave a step where the cube root meets the straight line. */
static const double delta = 6.0 / 29.0;
static const double epsilon = (6.0 / 29.0) * (6.0 / 29.0) * (6.0 / 29.0);
static const double slope = 841.0 / 108.0; /* 1 / (3 delta^2) */
static const double offset = 4.0 / 29.0;   /* the line's value at 0 */

static double f_forward(double t)
{
    return t > epsilon ? cbrt(t) : slope * t + offset;
}

/* f(t) - f(u); where both are on the line its offset is left out, for in the dark it
 * outweighs what is wanted. */
static double f_difference(double t, double u)
{
    return t > epsilon || u > epsilon ? f_forward(t) - f_forward(u) : slope * (t - u);
}

void lab_from_xyz(const double XYZ[3], const double white[3], double Lab[3])
{
    double x = XYZ[0] / white[0];
    double y = XYZ[1] / white[1];
    double z = XYZ[2] / white[2];

    Lab[0] = y > epsilon ? 116.0 * cbrt(y) - 16.0 : 116.0 * slope * y; /* 16 = 116 offset */
    Lab[1] = 500.0 * f_difference(x, y);
    Lab[2] = 200.0 * f_difference(y, z);
}

/* f as such, and what it is above the line's offset: in the dark the latter has the digits. */
static double f_inverse(double f, double above_offset)
{
    return f > delta ? f * f * f : above_offset / slope;
}

void lab_to_xyz(const double Lab[3], const double white[3], double XYZ[3])
{
    double f = (Lab[0] + 16.0) / 116.0, above = Lab[0] / 116.0;
    double x = Lab[1] / 500.0, z = -Lab[2] / 200.0;

    XYZ[0] = white[0] * f_inverse(f + x, above + x);
    XYZ[1] = white[1] * f_inverse(f, above);
    XYZ[2] = white[2] * f_inverse(f + z, above + z);
}

void lab_to_lch(const double Lab[3], double LCh[3])
{
    double C = hypot(Lab[1], Lab[2]);
    double h = 0.0; /* grey has no hue; atan2 would make 180 of a negative zero */

    if (C != 0.0) {
        h = atan2(Lab[2], Lab[1]) * UNITS_DEG_PER_RAD;
        if (h < 0.0)
            h += 360.0;
        if (h >= 360.0) /* -1e-20 + 360 rounds to 360 */
            h = 0.0;
    }
    LCh[0] = Lab[0];
    LCh[1] = C;
    LCh[2] = h;
}

void lab_from_lch(const double LCh[3], double Lab[3])
{
    double C = LCh[1], h = LCh[2] / UNITS_DEG_PER_RAD;

    Lab[0] = LCh[0];
    Lab[1] = C * cos(h);
    Lab[2] = C * sin(h);
}

double lab_ita_deg(const double Lab[3])
{
    return atan2(Lab[0] - 50.0, Lab[2]) * UNITS_DEG_PER_RAD;
}

const char *lab_ita_class(double ita_deg)
{
    /* The scheme writes "> 55", "> 41 to 55" ... "<= -30": an edge belongs to the
     * darker class. */
    static const struct {
        double above_deg;
        const char *name;
    } classes[] = {
        { 55.0, "very light" }, { 41.0, "light" },  { 28.0, "intermediate" },
        { 10.0, "tan" },        { -30.0, "brown" },
    };

    if (isnan(ita_deg))
        return "unknown"; /* not measured must not read as dark */
    for (size_t i = 0; i < sizeof classes / sizeof *classes; i++)
        if (ita_deg > classes[i].above_deg)
            return classes[i].name;
    return "dark";
}
