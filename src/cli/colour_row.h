/* colour_row.h - all that `convert` and `demo` say about one spectrum's colour. */
#ifndef SKINSPEC_CLI_COLOUR_ROW_H
#define SKINSPEC_CLI_COLOUR_ROW_H

#include <stdbool.h>

#include "colour/xyz.h"

struct colour_row {
    double XYZ[3], Lab[3], LCh[3];
    int sRGB[3];
    bool clipped; /* a channel of sRGB had to be clipped */
    double ITA;
};

void colour_row_of(const struct xyz_weights *weights, const double *value, struct colour_row *ret);

/* Weights for a file's bands; why there are none is logged under the path.
 * Statuses of xyz_weights_init(). */
enum status colour_weights(const char *path, const struct spectrum *bands,
                           enum illuminant illuminant, enum observer observer,
                           struct xyz_weights *ret);

#endif
