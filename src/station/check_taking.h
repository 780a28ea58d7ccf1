/* check_taking.h - the shots of a check tile, and what comes of them: a check, or a reference.
 *
 * The bench is at work from the first shot to the commit.  A lease that ends meanwhile, or a
 * station that stops, ends it after the shot under way: nothing is stored. */
#ifndef SKINSPEC_STATION_CHECK_TAKING_H
#define SKINSPEC_STATION_CHECK_TAKING_H

#include "station/bench.h"

struct check_order {
    struct ticket ticket; /* answered once, whatever happens */
    size_t replicates;
    bool sets_reference;
    /* What to compare with; or what is to become the reference: uuid, parameters_sha256, who,
     * tile and limit are known, the rest is measured. */
    struct store_check_tile tile;
    /* Of a check: uuid, parameters_sha256, operator_name and limit are known. */
    struct store_check check;
};

/* On a bench that is free and calibrated.  The order is copied. */
void check_take(struct bench *bench, const struct check_order *order);

#endif
