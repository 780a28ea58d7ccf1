/* checks.h - what the newest checks of one instrument say: has it drifted?
 *
 * Plain state.  Of each tile through each port the newest check counts; one that failed means
 * drift through that port until a check of the same tile passes: a tile that passes does not
 * speak for another colour that failed. */
#ifndef SKINSPEC_STATION_CHECKS_H
#define SKINSPEC_STATION_CHECKS_H

#include <stdbool.h>

#include "db/store_check.h"

struct checked {
    struct checked *next;
    int64_t seq;
    char id[STORE_UUID_SIZE], tile[STORE_TILE_SIZE], taken_at[STORE_TIME_SIZE];
    double aperture_mm, dE00, limit_dE00;
    bool passed;
};

struct checks { /* zeroed: none */
    struct checked *first;
};

/* What counts of a check; NULL: no memory. */
struct checked *checked_make(const struct store_check *check);

/* Given away.  One that is older than what is known of its tile and port changes nothing. */
void checks_note(struct checks *checks, struct checked *checked);
void checks_forget(struct checks *checks);

/* Whether a check through that port has failed and none has passed since. */
bool checks_drift(const struct checks *checks, double aperture_mm);

/* The check to show: the newest that failed while there is drift, else the newest; NULL: none
 * through that port. */
const struct checked *checks_shown(const struct checks *checks, double aperture_mm);

#endif
