/* cie_tables.h - CIE observers and illuminants, and the 10 nm weights made
 * from them.  Data only; the sources stand on top of cie_tables.c. */
#ifndef SKINSPEC_COLOUR_CIE_TABLES_H
#define SKINSPEC_COLOUR_CIE_TABLES_H

#include "base/status.h"

enum observer { OBSERVER_2DEG, OBSERVER_10DEG, OBSERVER_COUNT };

enum illuminant {
    ILLUMINANT_A,
    ILLUMINANT_C,
    ILLUMINANT_D50,
    ILLUMINANT_D55,
    ILLUMINANT_D65,
    ILLUMINANT_D75,
    ILLUMINANT_E,
    ILLUMINANT_FL2,
    ILLUMINANT_FL7,
    ILLUMINANT_FL11,
    ILLUMINANT_LED_B3,
    ILLUMINANT_COUNT
};

/* "A" ... "FL11", "LED-B3"; "2", "10".  Names parse in either case; anything
 * else is STATUS_NOT_FOUND. */
const char *illuminant_name(enum illuminant illuminant);
const char *observer_name(enum observer observer);
enum status illuminant_parse(const char *text, enum illuminant *ret);
enum status observer_parse(const char *text, enum observer *ret);

/* Colour-matching functions, 360..830 nm by 1, [nm - 360][X Y Z]. */
enum { CIE_CMF_FIRST_NM = 360, CIE_CMF_N = 471 };
extern const double cie_cmf[OBSERVER_COUNT][CIE_CMF_N][3];

/* Relative spectral power by 5 nm from 360 nm, [i][illuminant].  Beyond the
 * range an illuminant is published for (780 nm at most but for E; 380 nm at
 * least for FL and LED) the value is 0. */
enum { CIE_ILLUMINANT_FIRST_NM = 360, CIE_ILLUMINANT_STEP_NM = 5, CIE_ILLUMINANT_N = 95 };
extern const double cie_illuminant[CIE_ILLUMINANT_N][ILLUMINANT_COUNT];

/* ASTM E2022 weights for data by 10 nm, 360..780 nm, [i][X Y Z], scaled so that
 * a perfect white has Y = 100. */
enum { CIE_WEIGHTS_FIRST_NM = 360, CIE_WEIGHTS_STEP_NM = 10, CIE_WEIGHTS_N = 43 };
extern const double cie_weights_10nm[ILLUMINANT_COUNT][OBSERVER_COUNT][CIE_WEIGHTS_N][3];

#endif
