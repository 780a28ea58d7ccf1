/* srgb.c - IEC 61966-2-1 and the Bradford adaptation that leads to its white. */
#include "colour/srgb.h"

#include <math.h>
#include <stddef.h>

/* Both matrices, and the inverse of Bradford's, were solved in exact fractions
 * and rounded once, to 17 digits: the columns are the primaries' XYZ
 * (x/y, 1, (1-x-y)/y), scaled so that (1, 1, 1) gives the white's.  From the (x, y) of the
 * standard: red (0.64, 0.33), green (0.30, 0.60), blue (0.15, 0.06). */
static const double xyz_of_rgb[3][3] = {
    { 0.41239079926595951, 0.35758433938387796, 0.18048078840183429 },
    { 0.21263900587151036, 0.71516867876775592, 0.072192315360733714 },
    { 0.019330818715591849, 0.11919477979462599, 0.95053215224966059 },
};
static const double rgb_of_xyz[3][3] = {
    { 3.2409699419045213, -1.5373831775700935, -0.49861076029300327 },
    { -0.96924363628087984, 1.8759675015077206, 0.041555057407175612 },
    { 0.055630079696993608, -0.20397695888897657, 1.0569715142428786 },
};

/* XYZ of the standard's white, (x, y) = (0.3127, 0.3290), with Y = 100. */
static const double srgb_white[3] = { 100.0 * 0.3127 / 0.3290, 100.0, 100.0 * 0.3583 / 0.3290 };

/* [LAM85] Lam, Metamerism and Colour Constancy, University of Bradford, 1985. */
static const double bradford[3][3] = {
    { 0.8951, 0.2664, -0.1614 },
    { -0.7502, 1.7135, 0.0367 },
    { 0.0389, -0.0685, 1.0296 },
};
static const double bradford_inverse[3][3] = {
    { 0.98699290546671214, -0.1470542564209901, 0.15996265166373125 },
    { 0.4323052697233945, 0.51836027153677755, 0.049291228212855615 },
    { -0.0085286645751773311, 0.040042821654084862, 0.96848669578754998 },
};

static void transform(const double m[3][3], const double v[3], double ret[3])
{
    for (int i = 0; i < 3; i++)
        ret[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
}

void bradford_adapt(const double XYZ[3], const double from_white[3], const double to_white[3],
                    double ret[3])
{
    double cone[3], from[3], to[3];

    transform(bradford, XYZ, cone);
    transform(bradford, from_white, from);
    transform(bradford, to_white, to);
    for (int i = 0; i < 3; i++)
        cone[i] *= to[i] / from[i];
    transform(bradford_inverse, cone, ret);
}

void srgb_linear_from_xyz(const double XYZ[3], const double white[3], double linear[3])
{
    double adapted[3];

    bradford_adapt(XYZ, white, srgb_white, adapted);
    for (int i = 0; i < 3; i++)
        adapted[i] /= 100.0;
    transform(rgb_of_xyz, adapted, linear);
}

void srgb_linear_to_xyz(const double linear[3], double XYZ[3], double white[3])
{
    double unit[3];

    transform(xyz_of_rgb, linear, unit);
    for (int i = 0; i < 3; i++) {
        XYZ[i] = 100.0 * unit[i];
        if (white != NULL)
            white[i] = srgb_white[i];
    }
}

/* The standard's own thresholds: the curve's two pieces meet there to 1e-7 only,
 * far below one code value. */
double srgb_encode(double linear)
{
    double x = fabs(linear);
    double coded = x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1.0 / 2.4) - 0.055;

    return copysign(coded, linear);
}

double srgb_decode(double coded)
{
    double x = fabs(coded);
    double linear = x <= 0.04045 ? x / 12.92 : pow((x + 0.055) / 1.055, 2.4);

    return copysign(linear, coded);
}

bool srgb_code(const double linear[3], int code[3])
{
    bool clipped = false;

    for (int i = 0; i < 3; i++) {
        double v = round(255.0 * srgb_encode(linear[i]));
        if (v >= 0.0 && v <= 255.0) {
            code[i] = (int)v;
        } else { /* NaN lands here too, and is black */
            code[i] = v > 255.0 ? 255 : 0;
            clipped = true;
        }
    }
    return clipped;
}
