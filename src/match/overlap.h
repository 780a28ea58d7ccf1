/* overlap.h - a spectrum laid on a table's bands, to be compared with its rows. */
#ifndef SKINSPEC_MATCH_OVERLAP_H
#define SKINSPEC_MATCH_OVERLAP_H

#include <stddef.h>

#include "base/spectrum.h"
#include "base/vectors.h"
#include "match/table.h"

/* Weight 1 where both have the band and it was measured, else value and weight 0.
 * Padded like the table's rows, so that blocks need no remainder. */
struct overlap {
    size_t n, padded;
    double value[SPECTRUM_MAX_BANDS], weight[SPECTRUM_MAX_BANDS];
};

void overlap_init(const struct table *table, const struct spectrum *spectrum, struct overlap *ret);

/* Sum of squared differences from a row, given up as soon as it exceeds limit (then
 * only > limit).  The same to the last bit whatever the limit that it does not exceed. */
VECTORS_INLINE double overlap_sum_of_squares(const struct overlap *o, const float *row,
                                             double limit)
{
    double sum = 0.0;
    for (size_t i = 0; i + TABLE_BLOCK <= o->padded && sum <= limit; i += TABLE_BLOCK) {
        double part[TABLE_BLOCK];
        for (size_t j = 0; j < TABLE_BLOCK; j++) {
            double difference = (double)row[i + j] - o->value[i + j];
            part[j] = o->weight[i + j] * difference * difference;
        }
        sum += ((part[0] + part[1]) + (part[2] + part[3])) +
               ((part[4] + part[5]) + (part[6] + part[7]));
    }
    return sum;
}

/* The same, to the last bit, by a kind of vectors that the processor has. */
typedef double overlap_sum(const struct overlap *o, const float *row, double limit);
overlap_sum *overlap_sum_by(enum vectors kind);

#endif
