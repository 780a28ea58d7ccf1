/* lab.h - CIE 1976 L*a*b*, LCh and ITA.  [CIE15] CIE 15:2018; ITA: Chardon 1991,
 * classes: Del Bino and Bernerd 2013.
 *
 *   Lab[0] L*, 0 for black, 100 for the white; Lab[1] a*, Lab[2] b*
 *   LCh[0] L*; LCh[1] C*ab; LCh[2] h in degrees, 0 <= h < 360, 0 where C* = 0
 *   ITA    atan2(L* - 50, b*) in degrees, -180 .. 180
 * The white comes with the XYZ: pass the same struct xyz_weights' white. */
#ifndef SKINSPEC_COLOUR_LAB_H
#define SKINSPEC_COLOUR_LAB_H

void lab_from_xyz(const double XYZ[3], const double white[3], double Lab[3]);
void lab_to_xyz(const double Lab[3], const double white[3], double XYZ[3]);
void lab_to_lch(const double Lab[3], double LCh[3]);
void lab_from_lch(const double LCh[3], double Lab[3]);

/* Individual typology angle. */
double lab_ita_deg(const double Lab[3]);

/* A class of skin by ITA, under a named scheme: schemes compete. */
#define LAB_ITA_SCHEME "del-bino-2013"
const char *lab_ita_class(double ita_deg); /* "very light" ... "dark" */

#endif
