/* measuring.h - one measurement, from the first shot to the record.
 *
 * Plain state without clocks, threads or sockets: the caller takes the shots, waits where
 * a step says so, and stores what comes out. */
#ifndef SKINSPEC_STATION_MEASURING_H
#define SKINSPEC_STATION_MEASURING_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "colour/xyz.h"
#include "db/store.h"
#include "drivers/driver.h"
#include "station/protocol.h"
#include "station/quality.h"

struct measuring {
    enum specular specular; /* what is matched: SCE, or SCI less its surface */
    double surface;         /* with SCI; else ignored */
    size_t replicates;
    bool prompt;           /* each further shot waits */
    struct spectrum bands; /* the grid the instrument is set to, and its aperture; no values */

    size_t taken;
    struct driver_reading *reading;        /* [replicates] */
    struct spectrum *matched;              /* [replicates], of each the mode that is matched */
    double a_star[QUALITY_MAX_REPLICATES]; /* D65, 10 degrees; NAN where the bands give none */
    struct xyz_weights *weights;           /* NULL there too */
    unsigned flags, set_flags; /* of enum quality_flag, from single shots and from all together */
    unsigned warnings;         /* of enum driver_warning, from all shots */
    bool lift_probe;
};

/* specular, surface, replicates, prompt and bands are set by the caller before; the rest is
 * made here.  STATUS_RANGE for replicates outside 1 .. QUALITY_MAX_REPLICATES,
 * STATUS_NO_MEMORY. */
enum status measuring_init(struct measuring *m);
void measuring_done(struct measuring *m); /* takes a zeroed one */

enum measuring_step {
    MEASURING_SHOOT,  /* take the next shot at once */
    MEASURING_WAIT,   /* take it when the operator says so; measuring_prompt() is for them */
    MEASURING_FINISH, /* all are there: measuring_finish() */
    MEASURING_REFUSE, /* this shot is no measurement of skin: *refusal says why; nothing
                         is to be stored */
};

/* A shot was taken.  *shot_flags: bits of enum quality_flag that this shot brought, by itself
 * or beside those before.  Reasons: measurement_failed; instrument_unsupported where the
 * instrument does not measure that specular mode; surface_needed with SCI. */
enum measuring_step measuring_take(struct measuring *m, const struct driver_reading *reading,
                                   unsigned *shot_flags, struct refusal *refusal);

/* For the operator before the shot that waits: "Lift the probe, ..." where the last shots
 * spread or blanch.  A constant. */
const char *measuring_prompt(const struct measuring *m);

/* Fill the members of *record that come from the shots: replicates and their spectra, raw
 * (allocated; the caller frees (void *)record->raw), raw_unit, spectrum (the mean of the kept
 * ones, SCE: of SCI the surface was taken off), specular (of spectrum), aperture_mm, surface
 * (NAN: none was taken off), flags (JSON array of tokens: quality flags, then driver warnings).
 * extra: further bits of enum quality_flag.  False with *refusal, and *record untouched,
 * where the surface exceeds the reading (measurement_failed), or for no_memory. */
bool measuring_finish(const struct measuring *m, unsigned extra, struct store_record *record,
                      struct refusal *refusal);

#endif
