/* tile_file.h - certified reflectance of a white tile and of grey ones, from CSV.
 *
 * The same form as every spectrum file of skinspec: a header whose numeric columns are
 * wavelengths in nm, then one spectrum a row, as fractions.  Empty lines and lines that begin
 * with # are passed over; no quotes, '.' for the point.
 *
 *   # white tile, certificate 2026-118, 8/d, gloss excluded
 *   id,specular,geometry,400,410,...,700
 *   WS-1-4711,sce,8/d,0.9863,0.9867,...,0.9881
 *
 *   column      must be                    in
 *   id          a name                     both; the tile's becomes the identity's white_tile
 *   specular    sce                        both: SCI holds the gloss, which the open trap lets out
 *   geometry    d/8 or 8/d, di:8 or 8:di   may be missing
 *   what        measured or certified      greys: two rows of the same id for each tile, the one
 *                                          from its certificate, the other as this instrument
 *                                          measured it without `greys`
 *   400..700    0 .. 1.2                   at least from 400 to 700, in steps of 20 nm or less
 *
 * Between wavelengths a straight line is drawn.  A first column at 400 is extended by the
 * line of the first two as far as the first band's triangle reaches (390), the last likewise.
 * Other columns are ignored. */
#ifndef SKINSPEC_DRIVERS_OCEAN_OOI_TILE_FILE_H
#define SKINSPEC_DRIVERS_OCEAN_OOI_TILE_FILE_H

#include <stddef.h>

#include "drivers/driver.h"
#include "drivers/ocean_ooi/bands.h"

enum {
    OOI_TILE_COLUMNS = 1024,
    OOI_TILE_ROWS = 32,
    OOI_FILE_BYTES = 1 << 20,
    OOI_FILE_HASH_SIZE = 65, /* SHA-256, 64 small hex digits */
};

enum ooi_tile_what { OOI_TILE_UNSAID, OOI_TILE_MEASURED, OOI_TILE_CERTIFIED };

struct ooi_tile {
    char id[DRIVER_NAME_SIZE];
    enum ooi_tile_what what;
    double value[OOI_TILE_COLUMNS];
};

struct ooi_tile_file {
    char sha256[OOI_FILE_HASH_SIZE]; /* of the file's bytes, as sha256sum prints it */
    size_t columns, rows;
    double nm[OOI_TILE_COLUMNS];
    struct ooi_tile row[OOI_TILE_ROWS];
};

/* text[n] of a file called `path`, which it cuts up.  DRIVER_UNSUPPORTED, and a text that names
 * file, line and what to do, for what is not as above. */
enum driver_result ooi_tile_parse(char *text, size_t n, const char *path, struct ooi_tile_file *ret,
                                  struct driver_error *error);

/* The same from the disk. */
enum driver_result ooi_tile_read(const char *path, struct ooi_tile_file *ret,
                                 struct driver_error *error);

/* Whether it is that of one white tile: one row, certified or unsaid, with a mean of 0.5 and
 * above. */
enum driver_result ooi_tile_is_white(const struct ooi_tile_file *file, const char *path,
                                     struct driver_error *error);

/* Whether it is of greys: rows in pairs.  Their number and for each pair both rows as bands. */
enum driver_result ooi_tile_greys(const struct ooi_tile_file *file, const char *path, size_t *ret,
                                  double (*measured)[OOI_BANDS], double (*certified)[OOI_BANDS],
                                  struct driver_error *error);

/* Reflectance at any 390 <= nm <= 710. */
double ooi_tile_at(const struct ooi_tile_file *file, size_t row, double nm);

#endif
