/* table.h - a precomputed table in memory: plain arrays, one row per skin.
 *
 * Row i (from 0) is entry i+1 of the file; ids in answers count from 1. */
#ifndef SKINSPEC_MATCH_TABLE_H
#define SKINSPEC_MATCH_TABLE_H

#include <stddef.h>

#include "base/status.h"
#include "match/recipe.h"

enum { TABLE_NAME_SIZE = 256, TABLE_SHA256_SIZE = 65, TABLE_BLOCK = 8 };

struct table {
    struct recipe recipe;
    char name[TABLE_NAME_SIZE];     /* as answers give it */
    char sha256[TABLE_SHA256_SIZE]; /* of the content; "" while not known */
    size_t n;                       /* rows */
    double *Cm, *Bm, *Ch;           /* [n] each, aligned to 64 bytes */
    double *L, *a, *b;              /* [n] under the recipe's illuminant and observer */
    double *red, *green, *blue;     /* [n] linear sRGB, not clipped */
    float *spectrum;                /* [n][stride], zero past the bands; NULL without */
    size_t stride;                  /* recipe.bands rounded up to TABLE_BLOCK; 0 without spectra */
};

/* Memory for n rows of a recipe; contents undefined, name and hash empty.
 * STATUS_RANGE for n = 0; STATUS_NO_MEMORY. */
enum status table_init(const struct recipe *recipe, size_t n, struct table *ret);

/* The same without the spectra, whatever bands the recipe has: colours are computed from the
 * bands as ever, but none is kept.  A third of the memory; such a table is not searched by
 * spectrum. */
enum status table_init_without_spectra(const struct recipe *recipe, size_t n, struct table *ret);

void table_done(struct table *table); /* takes a zeroed one */

/* What the arrays take, bytes. */
size_t table_bytes(const struct table *table);

/* spectrum[recipe.bands] is not looked at in a table without. */
void table_set(struct table *table, size_t row, const struct table_row *values,
               const float *spectrum);
void table_get(const struct table *table, size_t row, struct table_row *ret);

/* Spectrum of a row, [recipe.bands]; NULL for a table without. */
const float *table_spectrum(const struct table *table, size_t row);

/* Rows first .. first+count-1 of the recipe computed into rows 0 .. count-1 of the
 * table, count <= table->n, on at most `threads` threads; the same for any number
 * of them.  For one piece after the other match/table_maker.h is opened but once. */
enum status table_compute(struct table *table, size_t first, size_t count, unsigned threads);

#endif
