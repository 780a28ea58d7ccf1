/* plot.h - a spectrum and a colour drawn with characters. */
#ifndef SKINSPEC_CLI_PLOT_H
#define SKINSPEC_CLI_PLOT_H

#include <stdbool.h>
#include <stdio.h>

#include "base/spectrum.h"

/* What the stream can show: colours and block characters on a terminal that has
 * them; plain ASCII in a pipe, a file, or where NO_COLOR or TERM=dumb asks. */
struct plot_style {
    bool colours, blocks;
};
struct plot_style plot_style_of(FILE *stream);

/* Bars over wavelength, with both axes; ten lines at most 76 wide. */
void plot_spectrum(FILE *stream, struct plot_style style, const struct spectrum *s);

/* A patch of the colour, or nothing in a style without colours. */
void plot_swatch(FILE *stream, struct plot_style style, const int sRGB[3]);

#endif
