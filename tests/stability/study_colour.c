/* study_colour.c - spectrum to XYZ, XYZ to and from L*a*b* and sRGB, colour differences. */
#include <math.h>
#include <string.h>

#include "colour/delta_e.h"
#include "colour/lab.h"
#include "colour/srgb.h"
#include "tests/stability/extremes.h"
#include "tests/stability/rooms.h"
#include "tests/stability/twins.h"

/* A share of white: 0, next to nothing, where the curves change their form, more than all. */
static double share(struct cases *c)
{
    static const double special[] = { 0.0,  1e-290,    1e-100,  1e-20,
                                      1e-9, 0.0031308, 0.04045, 0.0088564516790356308,
                                      0.18, 0.5,       1.0 };
    size_t i = dice_below(&c->dice, 3);
    if (i == 0)
        return special[dice_below(&c->dice, sizeof special / sizeof *special)];
    if (i == 1)
        return cases_decades(c, -9.0, 1.0);
    return dice_between(&c->dice, 0.0, 1.0);
}

/* ---- XYZ and L*a*b* ------------------------------------------------------------------ */

static bool lab_ours(const double *x, double *y)
{
    lab_from_xyz(x, x + 3, y);
    return true;
}

static void lab_twin(const wide *x, wide *y)
{
    twin_lab(x, x + 3, y);
}

static bool lab_to_xyz_ours(const double *x, double *y)
{
    lab_to_xyz(x, x + 3, y);
    return true;
}

static void lab_to_xyz_twin(const wide *x, wide *y)
{
    twin_lab_to_xyz(x, x + 3, y);
}

static void put_white(struct cases *c, double *white)
{
    static const double known[][3] = { { 95.047, 100.0, 108.883 },
                                       { 94.811, 100.0, 107.304 },
                                       { 109.85, 100.0, 35.585 },
                                       { 96.422, 100.0, 82.521 },
                                       { 100.0, 100.0, 100.0 } };
    memcpy(white, known[dice_below(&c->dice, 5)], 3 * sizeof *white);
}

/* Greys, greys but for one unit of the last place, and any colour. */
static void xyz_under_white(struct cases *c)
{
    for (int i = 0; i < 20000; i++) {
        double x[6], grey = share(c);
        put_white(c, x + 3);
        for (int k = 0; k < 3; k++) {
            x[k] = x[3 + k] * (i % 4 == 0 ? grey : share(c));
            if (i % 8 == 4)
                x[k] = extreme_beside(x[3 + k] * grey, (int)dice_below(&c->dice, 3) - 1);
        }
        cases_add(c, x);
    }
}

static void one_lab(struct cases *c, double *Lab)
{
    static const double chroma[] = { 0.0, 1e-100, 1e-9, 1e-3, 25.0, 100.0 };
    Lab[0] = 100.0 * share(c);
    if (dice_below(&c->dice, 4) == 0) /* where the curve meets its line */
        Lab[0] = extreme_beside(8.0, (int)dice_below(&c->dice, 3) - 1);
    for (int k = 1; k < 3; k++) {
        Lab[k] = dice_between(&c->dice, -120.0, 120.0);
        if (dice_below(&c->dice, 2) == 0)
            Lab[k] = copysign(chroma[dice_below(&c->dice, 6)], Lab[k]);
    }
}

static void labs_under_white(struct cases *c)
{
    for (int i = 0; i < 20000; i++) {
        double x[6];
        one_lab(c, x);
        put_white(c, x + 3);
        cases_add(c, x);
    }
}

static bool lch_ours(const double *x, double *y)
{
    lab_to_lch(x, y);
    y[3] = lab_ita_deg(x);
    return true;
}

static void lch_twin(const wide *x, wide *y)
{
    y[0] = x[0];
    y[1] = twin_chroma(x[1], x[2]);
    y[2] = twin_hue(x[1], x[2]);
    if (w_double(y[2]) >= 360.0) /* its double is not below 360: then it is 0 */
        y[2] = w_int(0);
    y[3] = twin_degrees(w_sub(x[0], w_int(50)), x[2]);
}

static void one_colour_each(struct cases *c)
{
    for (int i = 0; i < 8000; i++) {
        double x[3];
        one_lab(c, x);
        if (i % 5 == 0)
            x[0] = 50.0 + cases_decades(c, -13.0, 0.0) * (i % 2 == 0 ? 1.0 : -1.0);
        cases_add(c, x);
    }
}

static bool from_lch_ours(const double *x, double *y)
{
    lab_from_lch(x, y);
    return true;
}

static void from_lch_twin(const wide *x, wide *y)
{
    wide h = twin_radians(x[2]);
    y[0] = x[0];
    y[1] = w_mul(x[1], w_cos(h));
    y[2] = w_mul(x[1], w_sin(h));
}

static void lchs(struct cases *c)
{
    for (int quarter = 0; quarter <= 8; quarter++)
        for (int side = -1; side <= 1; side++)
            cases_add(c, (double[]){ 50.0, 30.0, fabs(extreme_beside(45.0 * quarter, side)) });
    for (int i = 0; i < 4000; i++)
        cases_add(c, (double[]){ 100.0 * share(c), cases_decades(c, -100.0, 3.0),
                                 dice_between(&c->dice, 0.0, 360.0) });
}

/* ---- sRGB ------------------------------------------------------------------------------ */

static bool linear_ours(const double *x, double *y)
{
    srgb_linear_from_xyz(x, x + 3, y);
    return true;
}

static void linear_twin(const wide *x, wide *y)
{
    twin_srgb_linear(x, x + 3, y);
}

static bool to_xyz_ours(const double *x, double *y)
{
    srgb_linear_to_xyz(x, y, NULL);
    return true;
}

static void to_xyz_twin(const wide *x, wide *y)
{
    twin_srgb_to_xyz(x, y);
}

static bool bradford_ours(const double *x, double *y)
{
    bradford_adapt(x, x + 3, x + 6, y);
    return true;
}

static void bradford_twin(const wide *x, wide *y)
{
    twin_bradford(x, x + 3, x + 6, y);
}

static void triples(struct cases *c)
{
    for (int i = 0; i < 8000; i++) {
        double x[3];
        for (int k = 0; k < 3; k++)
            x[k] = share(c) * (dice_below(&c->dice, 5) == 0 ? -1.0 : 1.0);
        cases_add(c, x);
    }
}

static void xyz_between_whites(struct cases *c)
{
    for (int i = 0; i < 8000; i++) {
        double x[9];
        put_white(c, x + 3);
        put_white(c, x + 6);
        for (int k = 0; k < 3; k++)
            x[k] = x[3 + k] * share(c);
        cases_add(c, x);
    }
}

static bool curve_ours(const double *x, double *y)
{
    y[0] = srgb_encode(x[0]);
    y[1] = srgb_decode(x[0]);
    return true;
}

static void curve_twin(const wide *x, wide *y)
{
    y[0] = twin_encode(x[0]);
    y[1] = twin_decode(x[0]);
}

/* Integers: a whole unit off wherever the value is not next to a half. */
static bool code_ours(const double *x, double *y)
{
    int code[3];
    (void)srgb_code((double[]){ x[0], x[0], x[0] }, code);
    y[0] = code[0];
    return true;
}

static void code_twin(const wide *x, wide *y)
{
    wide scaled = w_add(w_mul(w_int(255), twin_encode(x[0])), w_div(w_int(1), w_int(2)));
    double whole = floor(w_double(scaled));
    if (w_less(scaled, w(whole))) /* rounding to a double may carry over */
        whole -= 1.0;
    y[0] = w(fmin(fmax(whole, 0.0), 255.0));
}

/* Only within a few units of a half may the next integer stand. */
static void code_sensitivity(const wide *x, wide *sum)
{
    wide scaled = w_mul(w_int(255), twin_encode(x[0])), half = w_div(w_int(1), w_int(2));
    wide off = w_sub(w_sub(scaled, w(floor(w_double(scaled)))), half);
    bool near = w_less(w_abs(off), w_mul(w_abs(scaled), w_two_to(-50)));
    sum[0] = near ? w_two_to(60) : w_int(0);
}

static void curve_cases(struct cases *c)
{
    static const double edge[] = { 0.0031308, 0.04045, 0.0, 1.0 };
    for (int i = 0; i < 4; i++)
        for (int side = -1; side <= 1; side++) {
            double x = extreme_beside(edge[i], side);
            cases_add(c, &x);
        }
    for (int i = 0; i < 510; i++) { /* where a code begins */
        double x = srgb_decode((i + 0.5) / 255.0);
        cases_add(c, &x);
    }
    for (int i = 0; i < 8000; i++) {
        double x = share(c) * (i % 7 == 0 ? -1.0 : 1.0);
        cases_add(c, &x);
    }
}

/* ---- differences ------------------------------------------------------------------------ */

static bool delta_e_ours(const double *x, double *y)
{
    y[0] = delta_e_ab(x, x + 3);
    y[1] = delta_e_2000_lightness(x[0], x[3]);
    return true;
}

static void delta_e_twin(const wide *x, wide *y)
{
    y[0] = twin_delta_e_ab(x);
    y[1] = twin_lightness(x[0], x[3]);
}

static bool de2000_ours(const double *x, double *y)
{
    y[0] = delta_e_2000(x, x + 3);
    return true;
}

static void de2000_twin(const wide *x, wide *y)
{
    y[0] = twin_delta_e_2000(x);
}

/* Opposite hues: where the mean hue jumps; exactly, and a few doubles beside. */
static void opposite(struct cases *c, double *x)
{
    double times = -cases_decades(c, -2.0, 2.0);
    x[4] = times * x[1];
    x[5] = extreme_beside(times * x[2], (int)dice_below(&c->dice, 3) - 1);
}

/* Both sides of hue 0, where degrees go from 360 to 0. */
static void around_red(struct cases *c, double *x)
{
    x[1] = cases_decades(c, -1.0, 2.0);
    x[4] = dice_below(&c->dice, 2) == 0 ? x[1] : cases_decades(c, -1.0, 2.0);
    x[2] = cases_decades(c, -14.0, 1.0);
    x[5] = -x[2] * dice_between(&c->dice, 0.0, 2.0);
}

/* Next to one another. */
static void near_pair(struct cases *c, double *x)
{
    double by = cases_decades(c, -15.0, -1.0);
    for (int k = 0; k < 3; k++)
        x[3 + k] = x[k] * (1.0 + by * dice_between(&c->dice, -1.0, 1.0));
}

/* Where the blue rotation is strong and its quadratic form the flattest. */
static void blue(struct cases *c, double *x)
{
    double h = dice_between(&c->dice, 255.0, 295.0) * acos(-1.0) / 180.0;
    double C = cases_decades(c, 0.0, 2.2), turn = cases_decades(c, -6.0, -0.5);
    x[3] = x[0];
    x[1] = C * cos(h);
    x[2] = C * sin(h);
    C *= 1.0 + turn * dice_between(&c->dice, 0.2, 2.0);
    x[4] = C * cos(h + turn);
    x[5] = C * sin(h + turn);
}

static void pairs(struct cases *c)
{
    for (int i = 0; i < 24000; i++) {
        double x[6];
        one_lab(c, x);
        one_lab(c, x + 3);
        switch (i % 8) {
        case 0:
            opposite(c, x);
            break;
        case 1:
            around_red(c, x);
            break;
        case 2:
            near_pair(c, x);
            break;
        case 3:
            blue(c, x);
            break;
        case 4:
            memcpy(x + 3, x, 3 * sizeof *x);
            break;
        case 5: /* grey against a colour */
            x[1] = x[2] = 0.0;
            break;
        default:
            break;
        }
        if (i % 16 >= 8)
            x[3] = x[0];
        cases_add(c, x);
    }
}

#define XYZ "X", "Y", "Z"
#define PAIR "L1", "a1", "b1", "L2", "a2", "b2"
static const struct study studies[] = {
    { "lab_from_xyz",
      { XYZ, "Xn", "Yn", "Zn" },
      6,
      { "L", "a", "b" },
      8.0,
      lab_ours,
      lab_twin,
      xyz_under_white,
      NULL },
    { "lab_to_xyz",
      { "L", "a", "b", "Xn", "Yn", "Zn" },
      6,
      { XYZ },
      8.0,
      lab_to_xyz_ours,
      lab_to_xyz_twin,
      labs_under_white,
      NULL },
    { "lab_to_lch, lab_ita_deg",
      { "L", "a", "b" },
      3,
      { "L", "C", "h", "ITA" },
      8.0,
      lch_ours,
      lch_twin,
      one_colour_each,
      NULL },
    { "lab_from_lch",
      { "L", "C", "h" },
      3,
      { "L", "a", "b" },
      8.0,
      from_lch_ours,
      from_lch_twin,
      lchs,
      NULL },
    { "srgb_linear_from_xyz",
      { XYZ, "Xn", "Yn", "Zn" },
      6,
      { "R", "G", "B" },
      8.0,
      linear_ours,
      linear_twin,
      xyz_under_white,
      NULL },
    { "srgb_linear_to_xyz",
      { "R", "G", "B" },
      3,
      { XYZ },
      8.0,
      to_xyz_ours,
      to_xyz_twin,
      triples,
      NULL },
    { "bradford_adapt",
      { XYZ, "X1", "Y1", "Z1", "X2", "Y2", "Z2" },
      9,
      { XYZ },
      8.0,
      bradford_ours,
      bradford_twin,
      xyz_between_whites,
      NULL },
    { "srgb_encode, srgb_decode",
      { "x" },
      1,
      { "coded", "linear" },
      8.0,
      curve_ours,
      curve_twin,
      curve_cases,
      NULL },
    { "srgb_code",
      { "linear" },
      1,
      { "code" },
      8.0,
      code_ours,
      code_twin,
      curve_cases,
      code_sensitivity },
    { "delta_e_ab, lightness",
      { PAIR },
      6,
      { "dE*ab", "lightness" },
      8.0,
      delta_e_ours,
      delta_e_twin,
      pairs,
      NULL },
    { "delta_e_2000", { PAIR }, 6, { "dE00" }, 8.0, de2000_ours, de2000_twin, pairs, NULL },
};

const struct study_room study_colour = { "colour (colour/lab, srgb, delta_e)", studies,
                                         sizeof studies / sizeof *studies };
