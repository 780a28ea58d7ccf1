/* skin_fit.h - the fit for measured skin.
 *
 * With the paper's constants the model cannot reach what half of 100 measured people reflect.
 * This fit leaves oxygen saturation and the reduced scattering free as well:
 *     sigma_s' = a (l/500 nm)^-b in both layers
 *   free     Cm 0..0.5, Ch 0.001..0.2, SO2 0..1, a 0.5..60 mm^-1, b -2..5
 *   held     Bm 0.25, epidermis 0.08 mm, eta 1.4
 * Bm is held because b takes its place: the data do not tell them apart, so an answer says
 * nothing of the kind of melanin.  The thickness is held because R stays as it is when all
 * coefficients are multiplied and the thickness divided by one number; for the same reason a is
 * no measurement of scattering: what is seen is its ratio to the base absorption of Eq. 3.
 * Which variants were tried, on whom, and how they did on people not looked at when choosing:
 * docs/decisions/0011-skin-fit.md; what to believe of an answer: docs/inversion.md. */
#ifndef SKINSPEC_MATCH_SKIN_FIT_H
#define SKINSPEC_MATCH_SKIN_FIT_H

#include "match/fit.h"
#include "match/noise.h"

#define SKIN_FIT_BM 0.25
#define SKIN_FIT_EPIDERMIS_MM 0.08
/* Fitted scattering comes out at about twice what is published (a 10 against 4.6 mm^-1: Jacques,
 * Phys. Med. Biol. 58:R37, 2013), and with it all that absorbs; hence twice the paper's 0.1. */
#define SKIN_FIT_CH_MAX 0.2

/* Standard deviation of R, a band, that the model leaves on skin: its median on 100 people. */
#define SKIN_FIT_MODEL_ERROR 0.005

/* Between placements of the probe on one site: the most likely sizes for the three repeats of
 * each of 100 people; Cm, Ch and a in parts of the value.  What no change of the skin explains
 * is SKIN_FIT_WHITE a band.  Fitted on either half of the people they hold on the other. */
#define SKIN_FIT_CM_SPREAD 0.066
#define SKIN_FIT_CH_SPREAD 0.16
#define SKIN_FIT_SO2_SPREAD 0.046
#define SKIN_FIT_A_SPREAD 0.064
#define SKIN_FIT_B_SPREAD 0.175
#define SKIN_FIT_WHITE 0.0009
/* People differ in how steady a site is: a variance known as by 4 degrees of freedom (3.1 to
 * 3.7 fitted). */
#define SKIN_FIT_SPREAD_DEGREES 4.0

/* For a model with derivatives and an epidermis; fit_check() refuses others. */
struct fit fit_skin(const struct model *model);

/* The noise that belongs to it: SKIN_FIT_WHITE, and no placement, which the spreads are. */
struct noise noise_skin(void);

#endif
