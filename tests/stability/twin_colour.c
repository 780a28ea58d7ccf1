/* twin_colour.c - CIE 15, IEC 61966-2-1, Bradford and CIEDE2000 as their texts have them. */
#include "tests/stability/twins.h"

#include <string.h>

/* As many bits more as there are orders of magnitude between the largest number of an
 * equation and the smallest input: 16/116 and 1e-290, a hue of 180 degrees and 1e-200 of it. */
enum { BITS_IN_THE_DARK = 1100, BITS_OF_HUES = 800 };

static wide ratio(long over, long under)
{
    return w_div(w_int(over), w_int(under));
}

/* ---- L*a*b* ---------------------------------------------------------------------- */

static wide f_of(wide t)
{
    if (w_less(ratio(216, 24389), t))
        return w_cbrt(t);
    return w_add(w_mul(ratio(841, 108), t), ratio(4, 29));
}

static wide t_of(wide f)
{
    if (w_less(ratio(6, 29), f))
        return w_mul(f, w_square(f));
    return w_mul(ratio(108, 841), w_sub(f, ratio(4, 29)));
}

void twin_lab(const wide *XYZ, const wide *white, wide *Lab)
{
    mpfr_prec_t narrow = wide_bits;
    wide f[3];
    wide_bits += BITS_IN_THE_DARK;
    for (int i = 0; i < 3; i++)
        f[i] = f_of(w_div(XYZ[i], white[i]));
    Lab[0] = w_sub(w_mul(w_int(116), f[1]), w_int(16));
    Lab[1] = w_mul(w_int(500), w_sub(f[0], f[1]));
    Lab[2] = w_mul(w_int(200), w_sub(f[1], f[2]));
    wide_bits = narrow;
}

void twin_lab_to_xyz(const wide *Lab, const wide *white, wide *XYZ)
{
    mpfr_prec_t narrow = wide_bits;
    wide_bits += BITS_IN_THE_DARK;
    wide fy = w_div(w_add(Lab[0], w_int(16)), w_int(116));
    XYZ[0] = w_mul(white[0], t_of(w_add(fy, w_div(Lab[1], w_int(500)))));
    XYZ[1] = w_mul(white[1], t_of(fy));
    XYZ[2] = w_mul(white[2], t_of(w_sub(fy, w_div(Lab[2], w_int(200)))));
    wide_bits = narrow;
}

wide twin_degrees(wide y, wide x)
{
    return w_div(w_mul(w_atan2(y, x), w_int(180)), w_pi());
}

wide twin_radians(wide degrees)
{
    return w_div(w_mul(degrees, w_pi()), w_int(180));
}

/* 0 .. 360, 0 for grey. */
wide twin_hue(wide a, wide b)
{
    if (w_is_zero(a) && w_is_zero(b))
        return w_int(0);
    wide h = twin_degrees(b, a);
    return w_less(h, w_int(0)) ? w_add(h, w_int(360)) : h;
}

wide twin_chroma(wide a, wide b)
{
    return w_sqrt(w_add(w_square(a), w_square(b)));
}

/* ---- sRGB and Bradford ------------------------------------------------------------- */

typedef wide matrix[3][3];

static void transform(matrix m, const wide *v, wide *ret)
{
    for (int i = 0; i < 3; i++)
        ret[i] = w_add(w_mul(m[i][0], v[0]), w_add(w_mul(m[i][1], v[1]), w_mul(m[i][2], v[2])));
}

static void invert(matrix m, matrix ret)
{
    wide determinant = w_int(0);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            int a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
            ret[j][i] = w_sub(w_mul(m[a][c], m[b][d]), w_mul(m[a][d], m[b][c]));
        }
    for (int j = 0; j < 3; j++)
        determinant = w_add(determinant, w_mul(m[0][j], ret[j][0]));
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            ret[i][j] = w_div(ret[i][j], determinant);
}

/* (x/y, 1, (1-x-y)/y) */
static void xyz_of(const char *x, const char *y, wide *ret)
{
    wide X = w_dec(x), Y = w_dec(y);
    ret[0] = w_div(X, Y);
    ret[1] = w_int(1);
    ret[2] = w_div(w_sub(w_int(1), w_add(X, Y)), Y);
}

/* XYZ of linear R, G, B, from the primaries and the white of the standard; white Y = 1. */
static void srgb_matrix(matrix ret, wide *white)
{
    static const char *const primary[3][2] = { { "0.64", "0.33" },
                                               { "0.30", "0.60" },
                                               { "0.15", "0.06" } };
    matrix inverse;
    wide scale[3];
    for (int j = 0; j < 3; j++) {
        wide column[3];
        xyz_of(primary[j][0], primary[j][1], column);
        for (int i = 0; i < 3; i++)
            ret[i][j] = column[i];
    }
    xyz_of("0.3127", "0.3290", white);
    invert(ret, inverse);
    transform(inverse, white, scale);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            ret[i][j] = w_mul(ret[i][j], scale[j]);
}

void twin_bradford(const wide *XYZ, const wide *from, const wide *to, wide *ret)
{
    static const char *const entry[3][3] = { { "0.8951", "0.2664", "-0.1614" },
                                             { "-0.7502", "1.7135", "0.0367" },
                                             { "0.0389", "-0.0685", "1.0296" } };
    matrix m, inverse;
    wide cone[3], cone_from[3], cone_to[3];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            m[i][j] = w_dec(entry[i][j]);
    invert(m, inverse);
    transform(m, XYZ, cone);
    transform(m, from, cone_from);
    transform(m, to, cone_to);
    for (int i = 0; i < 3; i++)
        cone[i] = w_div(w_mul(cone[i], cone_to[i]), cone_from[i]);
    transform(inverse, cone, ret);
}

void twin_srgb_linear(const wide *XYZ, const wide *white, wide *linear)
{
    matrix m, inverse;
    wide own[3], adapted[3];
    srgb_matrix(m, own);
    invert(m, inverse);
    twin_bradford(XYZ, white, own, adapted); /* own: Y = 1, as linear is */
    transform(inverse, adapted, linear);
}

void twin_srgb_to_xyz(const wide *linear, wide *XYZ)
{
    matrix m;
    wide white[3];
    srgb_matrix(m, white);
    transform(m, linear, XYZ);
    for (int i = 0; i < 3; i++)
        XYZ[i] = w_mul(XYZ[i], w_int(100));
}

static wide mirrored(wide x, wide magnitude)
{
    return w_less(x, w_int(0)) ? w_neg(magnitude) : magnitude;
}

wide twin_encode(wide linear)
{
    wide x = w_abs(linear);
    if (!w_less(w_dec("0.0031308"), x))
        return w_mul(w_dec("12.92"), linear);
    wide root = w_pow(x, ratio(10, 24));
    return mirrored(linear, w_sub(w_mul(w_dec("1.055"), root), w_dec("0.055")));
}

wide twin_decode(wide coded)
{
    wide x = w_abs(coded);
    if (!w_less(w_dec("0.04045"), x))
        return w_div(coded, w_dec("12.92"));
    wide base = w_div(w_add(x, w_dec("0.055")), w_dec("1.055"));
    return mirrored(coded, w_pow(base, ratio(24, 10)));
}

/* ---- colour differences, Sharma, Wu, Dalal 2005 -------------------------------------- */

wide twin_delta_e_ab(const wide *x)
{
    wide sum = w_int(0);
    for (int i = 0; i < 3; i++)
        sum = w_add(sum, w_square(w_sub(x[3 + i], x[i])));
    return w_sqrt(sum);
}

/* sqrt(C^7/(C^7 + 25^7)) */
static wide chroma_switch(wide C)
{
    wide C7 = w_pow(C, w_int(7));
    return w_sqrt(w_div(C7, w_add(C7, w_int(6103515625))));
}

wide twin_lightness(wide L1, wide L2)
{
    wide m2 = w_square(w_sub(w_div(w_add(L1, L2), w_int(2)), w_int(50)));
    wide S_L = w_add(w_int(1), w_div(w_mul(w_dec("0.015"), m2), w_sqrt(w_add(w_int(20), m2))));
    return w_div(w_abs(w_sub(L2, L1)), S_L);
}

/* Eq. 15: 1 - 0.17 cos(h-30) + 0.24 cos 2h + 0.32 cos(3h+6) - 0.20 cos(4h-63) */
static wide hue_weight(wide h)
{
    static const struct {
        const char *share;
        int times, plus;
    } term[] = { { "-0.17", 1, -30 }, { "0.24", 2, 0 }, { "0.32", 3, 6 }, { "-0.20", 4, -63 } };
    wide T = w_int(1);
    for (size_t i = 0; i < sizeof term / sizeof *term; i++) {
        wide angle = w_add(w_mul(w_int(term[i].times), h), w_int(term[i].plus));
        T = w_add(T, w_mul(w_dec(term[i].share), w_cos(twin_radians(angle))));
    }
    return T;
}

/* Whether the colours' hues are exactly opposite or alike, which arc tangents cannot tell. */
static bool collinear(const wide *x)
{
    return mpfr_equal_p(w_mul(x[1], x[5]), w_mul(x[4], x[2])) != 0;
}

/* Eqs. 10 and 14: the difference of the hues and their mean, degrees. */
static void hues(const wide *x, wide h1, wide h2, bool grey, wide *difference, wide *mean)
{
    wide d = w_sub(h2, h1), sum = w_add(h1, h2);
    *difference = grey ? w_int(0) : d;
    *mean = grey ? sum : w_div(sum, w_int(2));
    if (grey || collinear(x) || !w_less(w_int(180), w_abs(d)))
        return;
    *difference = w_less(w_int(0), d) ? w_sub(d, w_int(360)) : w_add(d, w_int(360));
    *mean =
        w_div(w_less(sum, w_int(360)) ? w_add(sum, w_int(360)) : w_sub(sum, w_int(360)), w_int(2));
}

static wide delta_e_2000(const wide *x)
{
    wide C_ab = w_div(w_add(twin_chroma(x[1], x[2]), twin_chroma(x[4], x[5])), w_int(2));
    wide G = w_div(w_sub(w_int(1), chroma_switch(C_ab)), w_int(2)), stretch = w_add(w_int(1), G);
    wide a1 = w_mul(stretch, x[1]), a2 = w_mul(stretch, x[4]);
    wide C1 = twin_chroma(a1, x[2]), C2 = twin_chroma(a2, x[5]);
    wide C = w_div(w_add(C1, C2), w_int(2)), C1C2 = w_mul(C1, C2), dh, h;
    hues(x, twin_hue(a1, x[2]), twin_hue(a2, x[5]), w_is_zero(C1C2), &dh, &h);
    wide dH = w_mul(w_mul(w_int(2), w_sqrt(C1C2)), w_sin(twin_radians(w_div(dh, w_int(2)))));
    wide S_C = w_add(w_int(1), w_mul(w_dec("0.045"), C));
    wide S_H = w_add(w_int(1), w_mul(w_mul(w_dec("0.015"), C), hue_weight(h)));
    wide off = w_div(w_sub(h, w_int(275)), w_int(25));
    wide d_theta = w_mul(w_int(30), w_exp(w_neg(w_square(off))));
    wide R_T = w_neg(
        w_mul(w_sin(twin_radians(w_mul(w_int(2), d_theta))), w_mul(w_int(2), chroma_switch(C))));
    wide l = twin_lightness(x[0], x[3]), c = w_div(w_sub(C2, C1), S_C), t = w_div(dH, S_H);
    wide squares = w_add(w_square(l), w_add(w_square(c), w_square(t)));
    return w_sqrt(w_add(squares, w_mul(R_T, w_mul(c, t))));
}

wide twin_delta_e_2000(const wide *x)
{
    mpfr_prec_t narrow = wide_bits;
    wide_bits += BITS_OF_HUES;
    wide dE = delta_e_2000(x);
    wide_bits = narrow;
    return dE;
}
