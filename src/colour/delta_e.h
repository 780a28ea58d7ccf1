/* delta_e.h - colour differences between two L*a*b* colours.
 * dE*ab: CIE 1976.  dE00: CIEDE2000 with kL = kC = kH = 1, CIE 142:2001, written
 * after Sharma, Wu, Dalal, Color Res. Appl. 30:21 (2005), whose 34 pairs it meets. */
#ifndef SKINSPEC_COLOUR_DELTA_E_H
#define SKINSPEC_COLOUR_DELTA_E_H

double delta_e_ab(const double Lab1[3], const double Lab2[3]);
double delta_e_2000(const double Lab1[3], const double Lab2[3]);

/* The lightness term of CIEDE2000 alone, |dL'|/S_L: never above dE00 (the rest of
 * it is a positive semi-definite form, as |R_T| < 2), and growing with |L2 - L1|
 * on either side while both lie in the range below; outside, S_L can outgrow the
 * difference (from L1 = -90 it falls again before L2 = 200).  Searches prune with it. */
#define DELTA_E_LIGHTNESS_MIN (-20.0)
#define DELTA_E_LIGHTNESS_MAX 120.0
double delta_e_2000_lightness(double L1, double L2);

#endif
