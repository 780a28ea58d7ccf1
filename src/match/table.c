/* table.c - memory of a table. */
#include "match/table.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "base/huge_pages.h"
#include "match/table_maker.h"

/* All double columns in one block, so that there is one thing to free. */
enum { DOUBLE_COLUMNS = 9 };

static size_t rounded_up(size_t n)
{
    return (n + TABLE_BLOCK - 1) / TABLE_BLOCK * TABLE_BLOCK;
}

static enum status init(const struct recipe *recipe, size_t n, bool spectra, struct table *ret)
{
    struct table table = { .recipe = *recipe, .n = n };
    if (n == 0 || n > GRID_ROWS_MAX)
        return STATUS_RANGE;
    /* Columns start on a cache line each: round their length up to 8 doubles. */
    size_t column_length = rounded_up(n);
    double **column[DOUBLE_COLUMNS] = { &table.Cm, &table.Bm,  &table.Ch,    &table.L,   &table.a,
                                        &table.b,  &table.red, &table.green, &table.blue };
    double *block = huge_pages_alloc(column_length * DOUBLE_COLUMNS, sizeof *block);
    if (block == NULL)
        return STATUS_NO_MEMORY;
    for (size_t i = 0; i < DOUBLE_COLUMNS; i++)
        *column[i] = block + i * column_length;
    if (spectra) {
        table.stride = rounded_up(recipe->bands);
        table.spectrum = huge_pages_alloc(n * table.stride, sizeof *table.spectrum);
        if (table.spectrum == NULL) {
            free(block);
            return STATUS_NO_MEMORY;
        }
    }
    *ret = table;
    return STATUS_OK;
}

enum status table_init(const struct recipe *recipe, size_t n, struct table *ret)
{
    return init(recipe, n, recipe->bands > 0, ret);
}

enum status table_init_without_spectra(const struct recipe *recipe, size_t n, struct table *ret)
{
    return init(recipe, n, false, ret);
}

size_t table_bytes(const struct table *table)
{
    size_t columns = rounded_up(table->n) * DOUBLE_COLUMNS * sizeof *table->Cm;
    return columns + table->n * table->stride * sizeof *table->spectrum;
}

void table_done(struct table *table)
{
    free(table->Cm); /* the block of all columns */
    free(table->spectrum);
    memset(table, 0, sizeof *table);
}

void table_set(struct table *table, size_t row, const struct table_row *values,
               const float *spectrum)
{
    table->Cm[row] = values->Cm;
    table->Bm[row] = values->Bm;
    table->Ch[row] = values->Ch;
    table->L[row] = values->Lab[0];
    table->a[row] = values->Lab[1];
    table->b[row] = values->Lab[2];
    table->red[row] = values->rgb[0];
    table->green[row] = values->rgb[1];
    table->blue[row] = values->rgb[2];
    if (table->spectrum != NULL) {
        size_t bands = table->recipe.bands;
        float *place = table->spectrum + row * table->stride;
        memset(place, 0, table->stride * sizeof *place);
        memcpy(place, spectrum, bands * sizeof *place);
    }
}

const float *table_spectrum(const struct table *table, size_t row)
{
    return table->spectrum != NULL ? table->spectrum + row * table->stride : NULL;
}

void table_get(const struct table *table, size_t row, struct table_row *ret)
{
    *ret = (struct table_row){
        .Cm = table->Cm[row],
        .Bm = table->Bm[row],
        .Ch = table->Ch[row],
        .Lab = { table->L[row], table->a[row], table->b[row] },
        .rgb = { table->red[row], table->green[row], table->blue[row] },
    };
}

enum status table_compute(struct table *table, size_t first, size_t count, unsigned threads)
{
    struct table_maker *maker;
    enum status s = table_maker_open(&table->recipe, threads, &maker);
    if (s != STATUS_OK)
        return s;
    s = table_maker_rows(maker, first, count, table);
    table_maker_close(maker);
    return s;
}
