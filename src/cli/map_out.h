/* map_out.h - what is said of a map: what it was made of, its header, and what came of it. */
#ifndef SKINSPEC_CLI_MAP_OUT_H
#define SKINSPEC_CLI_MAP_OUT_H

#include <stdbool.h>

#include "base/status.h"
#include "cli/cube_file.h"
#include "cli/map_file.h"
#include "cli/map_fit.h"
#include "cli/map_pictures.h"
#include "cli/out.h"

struct map_report {
    const struct cube_file *cube;
    const struct band_grid *grid;
    const struct map_fit *fit;
    const struct map_fit_options *options;
    const struct map_contents *contents;
    const struct map_file *file;
    bool pictures;
    double seconds; /* for the pixels alone */
    size_t lines;   /* done in those */
};

/* Lines "name: value" of all that decides a pixel (struct map_file); the caller's to free.  Without
 * memory for it the program ends. */
char *map_out_key(const struct map_report *report);

/* The header of the map, under its name with the map.  Statuses of map_file_finish(). */
enum status map_out_finish(const struct map_report *report, struct map_file *file);

/* Pixels, medians and files, on standard output. */
void map_out_report(const struct map_report *report, enum out_format format);

#endif
