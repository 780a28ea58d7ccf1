/* colour_scale.c - a curve through L*a*b*, walked at an even pace. */
#include "cube/colour_scale.h"

#include <math.h>
#include <stdbool.h>

#include "colour/delta_e.h"
#include "colour/lab.h"
#include "colour/srgb.h"

/* Ends of the curve. */
#define L_LEAST 12.0
#define L_MOST 95.0
#define HUE_LEAST (-60.0) /* violet, degrees */
#define HUE_MOST 102.0    /* yellow */
/* Of the chroma that a screen has at that lightness and hue. */
#define SHARE 0.92
/* The most; without it the red in the middle would be glaring.  It begins with less and rises,
 * straight over the first part, so that the way has no corner in the dark blue. */
#define CHROMA_MOST 78.0
#define CHROMA_LEAST 26.0
#define RISE 0.3
/* Short pieces of the curve, whose lengths are added up. */
enum { PIECES = 512 };

/* Linear sRGB of a colour; whether a screen, whose white that is, has it. */
static bool on_screen(const double LCh[3], const double white[3], double linear[3])
{
    double Lab[3], XYZ[3];
    lab_from_lch(LCh, Lab);
    lab_to_xyz(Lab, white, XYZ);
    srgb_linear_from_xyz(XYZ, white, linear);
    for (int i = 0; i < 3; i++)
        if (!(linear[i] >= 0.0 && linear[i] <= 1.0))
            return false;
    return true;
}

/* At t = 0..1 of the curve. */
static void curve(double t, const double white[3], double Lab[3], double linear[3])
{
    double hue = HUE_LEAST + t * (HUE_MOST - HUE_LEAST);
    double LCh[3] = { L_LEAST + t * (L_MOST - L_LEAST), 0.0, hue < 0.0 ? hue + 360.0 : hue };
    double least = 0.0, most = 150.0;
    for (int i = 0; i < 24; i++) {
        LCh[1] = 0.5 * (least + most);
        if (on_screen(LCh, white, linear))
            least = LCh[1];
        else
            most = LCh[1];
    }
    double rise = fmin(t / RISE, 1.0);
    LCh[1] = fmin(SHARE * least, CHROMA_LEAST + rise * (CHROMA_MOST - CHROMA_LEAST));
    (void)on_screen(LCh, white, linear);
    lab_from_lch(LCh, Lab);
}

void colour_scale_make(size_t n, unsigned char (*rgb)[3])
{
    static const double black[3];
    double before[3], here[3], linear[3], none[3], white[3], sum[PIECES + 1] = { 0 };
    srgb_linear_to_xyz(black, none, white);
    curve(0.0, white, before, linear);
    for (int i = 1; i <= PIECES; i++) {
        curve((double)i / PIECES, white, here, linear);
        sum[i] = sum[i - 1] + delta_e_2000(before, here);
        for (int k = 0; k < 3; k++)
            before[k] = here[k];
    }
    int piece = 0;
    for (size_t i = 0; i < n; i++) {
        double wanted = sum[PIECES] * (double)i / (double)(n - 1);
        int code[3];
        while (piece + 1 < PIECES && sum[piece + 1] < wanted)
            piece++;
        double part = (wanted - sum[piece]) / (sum[piece + 1] - sum[piece]);
        curve(((double)piece + fmin(part, 1.0)) / PIECES, white, here, linear);
        (void)srgb_code(linear, code);
        for (int k = 0; k < 3; k++)
            rgb[i][k] = (unsigned char)code[k];
    }
}
