/* legal_skin.c - see legal_skin.h. */
#include "tests/support/legal_skin.h"

#include <math.h>
#include <stdio.h>

double dice_decades(struct dice *dice, double low, double high)
{
    return pow(10.0, dice_between(dice, low, high));
}

static double legal_absorption(struct dice *dice)
{
    double which = dice_between(dice, 0.0, 1.0);
    return which < 0.1    ? 0.0
           : which < 0.15 ? 1e100
           : which < 0.2  ? 5e-324
           : which < 0.6  ? dice_decades(dice, -3.0, 3.0)
                          : fmin(dice_decades(dice, -100.0, 100.0), 1e100);
}

static double legal_scattering(struct dice *dice)
{
    double which = dice_between(dice, 0.0, 1.0);
    return which < 0.05  ? 1e-100
           : which < 0.1 ? 1e100
           : which < 0.5 ? dice_decades(dice, -3.0, 3.0)
                         : fmax(1e-100, fmin(dice_decades(dice, -100.0, 100.0), 1e100));
}

static double legal_thickness(struct dice *dice)
{
    double which = dice_between(dice, 0.0, 1.0);
    return which < 0.05   ? 0.0
           : which < 0.1  ? 1000.0
           : which < 0.15 ? 5e-324
           : which < 0.5  ? dice_decades(dice, -4.0, 2.0)
                          : dice_decades(dice, -100.0, 2.9);
}

struct skin legal_skin(struct dice *dice)
{
    struct skin s;
    s.sigma_a1 = legal_absorption(dice);
    s.sigma_s1 = legal_scattering(dice);
    s.sigma_a2 = legal_absorption(dice);
    s.sigma_s2 = legal_scattering(dice);
    s.eta = dice_between(dice, 0.26, 3.848);
    s.d_mm = legal_thickness(dice);
    if (dice_between(dice, 0.0, 1.0) < 0.1)
        s.eta = 1.0;
    return s;
}

void skin_describe(char *text, size_t size, struct skin s)
{
    snprintf(text, size, "{ %.17g, %.17g, %.17g, %.17g, %.17g, %.17g }", s.sigma_a1, s.sigma_s1,
             s.sigma_a2, s.sigma_s2, s.d_mm, s.eta);
}
