/* svg.h - a run as a picture: error against time, both in the logarithm. */
#ifndef SKINSPEC_TRIAL_SVG_H
#define SKINSPEC_TRIAL_SVG_H

#include <stdio.h>

#include "trial/trial.h"

/* Four charts: methods of the half space and of two layers on spectra of their own, all methods
 * on spectra by transport-32, and the models.  Colours are models, shapes are kinds of answers; a
 * line joins the front.  The caller looks at ferror(). */
void trial_svg(FILE *stream, const struct trial *trial, const char *machine);

#endif
