/* map_pictures.h - what is in a map's bands, and a picture of each: PREFIX-BAND.png. */
#ifndef SKINSPEC_CLI_MAP_PICTURES_H
#define SKINSPEC_CLI_MAP_PICTURES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/status.h"
#include "cli/map_file.h"
#include "cli/map_fit.h"

/* Of the pixels that were fitted. */
struct map_band {
    double lo, median, hi; /* quantiles 0.01, 0.5, 0.99; NAN where nothing was fitted */
    double range[2];       /* the ends of its bar: in, NAN: to be found; out */
};

struct map_contents {
    uint64_t pixels, fitted, flagged[MAP_FLAG_COUNT];
    struct map_band band[MAP_BANDS_MAX]; /* all but the flags */
};

/* STATUS_EXISTS, logged, where a picture is there already. */
enum status map_pictures_look(const char *prefix, const struct map_fit *fit);

/* Of a band's picture. */
enum { MAP_PICTURES_PATH_SIZE = MAP_FILE_PATH_SIZE + 64 };
void map_pictures_path(const char *prefix, const struct map_fit *fit, size_t band,
                       char path[MAP_PICTURES_PATH_SIZE]);

/* From the map's own values; pictures false: the contents alone.  On so many threads, to the same
 * bytes; they keep 16 MB of the map at most, and a line each.  STATUS_NO_MEMORY; STATUS_IO and
 * STATUS_RANGE (a picture too large), logged. */
enum status map_pictures_make(const struct map_file *file, const struct map_fit *fit, bool pictures,
                              unsigned threads, struct map_contents *contents);

#endif
