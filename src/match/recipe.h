/* recipe.h - all that decides what stands in a table, and its rows computed.
 *
 * A table is a recipe carried out: the same recipe gives the same rows, bit for
 * bit with the same build on the same machine. */
#ifndef SKINSPEC_MATCH_RECIPE_H
#define SKINSPEC_MATCH_RECIPE_H

#include <stddef.h>

#include "base/status.h"
#include "colour/cie_tables.h"
#include "match/grid.h"
#include "optics/model.h"

/* How the RGB reflectances of the model `paper`, which the paper leaves open,
 * are shown: as linear values (our reading: they are reflectances) or as values
 * that went through the sRGB curve already. */
enum rgb_reading { RGB_READING_LINEAR, RGB_READING_CODED };

struct recipe {
    const struct model *model;
    struct grid grid;
    double gamma, epidermis_mm, eta;
    /* Bands of the stored spectra, which colour is computed from as well; 0 bands
     * for a model without spectra. */
    double first_nm, step_nm;
    size_t bands;
    enum illuminant illuminant;
    enum observer observer;
    enum rgb_reading rgb_reading;
};

/* The recipe of a model's default table: the default grid; 400..700 nm by 10,
 * D65, 10 degrees - for `paper` no bands, D65, 2 degrees, which its sRGB implies. */
struct recipe recipe_default(const struct model *model);

/* STATUS_RANGE where grid or tissue leaves its range or the bands cannot give a
 * colour (colour/xyz.h); STATUS_UNSUPPORTED for bands with a model that has no
 * spectra, or none with one that has, or a paper table not under D65, 2 degrees. */
enum status recipe_check(const struct recipe *recipe);

/* One row: a skin and its colour.  r, g, b: linear sRGB, not clipped. */
struct table_row {
    double Cm, Bm, Ch;
    double Lab[3], rgb[3];
};

/* What all rows share, computed once; and scratch for one thread at a time. */
struct row_maker;
enum status row_maker_open(const struct recipe *recipe, struct row_maker **ret);
void row_maker_close(struct row_maker *maker); /* takes NULL */

/* Row number `row`, and its spectrum as stored into spectrum[recipe->bands]
 * (NULL: not wanted).  A row maker serves one thread at a time. */
enum status row_maker_make(struct row_maker *maker, size_t row, struct table_row *ret,
                           float *spectrum);

#endif
