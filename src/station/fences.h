/* fences.h - the numbers of leases: none comes again in a state folder, after restarts neither.
 *
 * A supply of them is reserved at a time, on the writer's thread (store_reserve_fences()).  Where
 * the folder cannot be written none is, nor is anything stored: they go on above those on
 * record. */
#ifndef SKINSPEC_STATION_FENCES_H
#define SKINSPEC_STATION_FENCES_H

#include <stdbool.h>
#include <stdint.h>

struct station;

struct fences {
    int64_t last;     /* the last one given, or not to be given: leases go on above it */
    int64_t reserved; /* up to this one */
    bool known;       /* last is: before, no lease is granted */
    bool asked;       /* the writer has been, for more */
};

/* See that there are enough of them, and that it becomes known where they go on. */
void fences_keep(struct station *station);

/* Not that one again, nor one below; known from here on. */
void fences_go_on_above(struct station *station, int64_t fence);

#endif
