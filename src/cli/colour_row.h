/* colour_row.h - all that the commands say about one spectrum's colour. */
#ifndef SKINSPEC_CLI_COLOUR_ROW_H
#define SKINSPEC_CLI_COLOUR_ROW_H

#include <stdbool.h>

#include "cli/out.h"
#include "cli/plot.h"
#include "cli/spectra.h"
#include "colour/xyz.h"

struct colour_row {
    double XYZ[3], Lab[3], LCh[3];
    int sRGB[3];
    bool clipped; /* a channel of sRGB had to be clipped */
    double ITA;
};

void colour_row_of(const struct xyz_weights *weights, const double *value, struct colour_row *ret);

/* sRGB's white is D65 for 2 degrees; from any other it is adapted by Bradford. */
bool colour_is_adapted(enum illuminant illuminant, enum observer observer);

/* The members XYZ, Lab, LCh, sRGB, clipped, adapted, ITA and its class. */
void colour_row_json(cJSON *object, const struct colour_row *colour, bool adapted);

/* The lines "colour" and "ITA" on standard output, for a person. */
void colour_row_print(struct plot_style style, const double Lab[3], const int sRGB[3], bool clipped,
                      double ITA);

/* Weights for a file's bands; why there are none is logged.  Statuses of
 * xyz_weights_init(). */
enum status colour_weights(const struct spectra *spectra, enum illuminant illuminant,
                           enum observer observer, struct xyz_weights *ret);

#endif
