/* table_maker.c - runs of rows that share an epidermis, put together to blocks for colour. */
#include "match/table_maker.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "base/parallel.h"
#include "colour/colour_many.h"
#include "match/lattice.h"
#include "optics/shared_layers.h"

/* Pieces of several epidermises of one Cm, which have sums in common. */
enum { ALIGNMENT = 64, ROWS_PER_PIECE = 1024, ROWS_PER_BLOCK = 64 };

/* Bytes that all dermises may take: transport-32 on 31 bands needs 135 kB for each. */
static const size_t dermises_most = (size_t)512 << 20;

/* All that rows share; only read once it is made. */
struct shared_rows {
    struct grid grid;
    size_t bands;
    struct chromophores chromophores;
    struct shared_layers layers;
    struct colour_many colour;
    double *Cm, *Bm, *Ch;    /* values of the axes */
    double *dermis;          /* [Ch][layers.dermis_size] */
    bool *within;            /* [Ch] whether that dermis is in the formulas' range */
    struct lattice *lattice; /* NULL: every colour is computed from its spectrum */
};

/* Of one thread. */
struct workspace {
    struct row_maker *plain;
    struct lattice_sums *sums;
    double *epidermis, *R;
    double XYZ[3][ROWS_PER_BLOCK + VECTORS_LANES];
};

struct table_maker {
    struct recipe recipe;
    struct shared_rows *shared; /* NULL: all rows are the plain row maker's */
    unsigned threads;
    struct workspace workspace[PARALLEL_MAX_THREADS];
};

/* ---- what rows share ---------------------------------------------------------------- */

static double *aligned(size_t doubles)
{
    size_t bytes = (doubles * sizeof(double) + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
    return aligned_alloc(ALIGNMENT, bytes);
}

static double *axis_values(const struct axis *axis)
{
    double *value = malloc(axis->n * sizeof *value);
    for (size_t i = 0; value != NULL && i < axis->n; i++)
        value[i] = axis_value(axis, i);
    return value;
}

static void shared_rows_close(struct shared_rows *s)
{
    if (s == NULL)
        return;
    free(s->Cm);
    free(s->Bm);
    free(s->Ch);
    free(s->dermis);
    free(s->within);
    lattice_close(s->lattice);
    free(s);
}

/* STATUS_UNSUPPORTED: there are no such formulas for this recipe. */
static enum status shared_rows_init(const struct recipe *recipe, struct shared_rows *s)
{
    struct xyz_weights weights;
    struct tissue t = tissue_of(0.0, 0.0, 0.0);
    t.gamma = recipe->gamma;
    t.epidermis_mm = recipe->epidermis_mm;
    t.eta = recipe->eta;
    s->grid = recipe->grid;
    s->bands = recipe->bands;
    enum status status =
        chromophores_init(recipe->first_nm, recipe->step_nm, recipe->bands, &s->chromophores);
    if (status == STATUS_OK)
        status = shared_layers_init(recipe->model, &s->chromophores, &t, &s->layers);
    if (status == STATUS_OK)
        status = xyz_weights_init(recipe->illuminant, recipe->observer, recipe->first_nm,
                                  recipe->step_nm, recipe->bands, &weights);
    if (status == STATUS_OK)
        colour_many_init(&weights, &s->colour);
    return status;
}

static enum status shared_rows_fill(struct shared_rows *s)
{
    size_t size = s->layers.dermis_size;
    if (s->grid.Ch.n > dermises_most / (size * sizeof *s->dermis))
        return STATUS_UNSUPPORTED;
    s->Cm = axis_values(&s->grid.Cm);
    s->Bm = axis_values(&s->grid.Bm);
    s->Ch = axis_values(&s->grid.Ch);
    s->dermis = aligned(s->grid.Ch.n * size);
    s->within = malloc(s->grid.Ch.n * sizeof *s->within);
    if (s->Cm == NULL || s->Bm == NULL || s->Ch == NULL || s->dermis == NULL || s->within == NULL)
        return STATUS_NO_MEMORY;
    bool all = true;
    for (size_t i = 0; i < s->grid.Ch.n; i++) {
        s->within[i] = shared_dermis(&s->layers, s->Ch[i], s->dermis + i * size);
        all = all && s->within[i];
    }
    struct lattice_source source = { &s->grid,   s->Cm,     s->Bm,     s->Ch,
                                     &s->layers, s->dermis, &s->colour };
    return all ? lattice_open(&source, &s->lattice) : STATUS_OK;
}

/* *ret stays NULL where the recipe has no such formulas. */
static enum status shared_rows_open(const struct recipe *recipe, struct shared_rows **ret)
{
    bool has_formulas = recipe->model->quick != MODEL_QUICK_NONE || recipe->model->streams > 0;
    if (!has_formulas || grid_check(&recipe->grid) != STATUS_OK)
        return STATUS_OK;
    struct shared_rows *s = calloc(1, sizeof *s);
    if (s == NULL)
        return STATUS_NO_MEMORY;
    enum status status = shared_rows_init(recipe, s);
    if (status == STATUS_OK)
        status = shared_rows_fill(s);
    if (status == STATUS_OK) {
        *ret = s;
        return STATUS_OK;
    }
    shared_rows_close(s);
    /* What is wrong with a recipe the row maker says, of the row that has it. */
    return status == STATUS_NO_MEMORY ? status : STATUS_OK;
}

/* ---- rows --------------------------------------------------------------------------- */

/* Rows whose XYZ, and spectra where they are kept, stand in the workspace and wait. */
struct block {
    size_t begin, n; /* of the table */
};

/* By whole blocks, which become vectors. */
static void put_spectrum(const double *restrict R, size_t bands, size_t stride, float *restrict to)
{
    for (size_t block = 0; block < stride; block += TABLE_BLOCK)
        for (size_t i = block; i < block + TABLE_BLOCK; i++)
            to[i] = (float)R[i];
    for (size_t i = bands; i < stride; i++)
        to[i] = 0.0f;
}

static void flush(const struct shared_rows *s, struct workspace *w, struct table *t,
                  struct block *block)
{
    size_t at = block->begin, stride = s->layers.stride;
    struct colour_columns columns = { t->L + at,   t->a + at,     t->b + at,
                                      t->red + at, t->green + at, t->blue + at };
    const double *const XYZ[3] = { w->XYZ[0], w->XYZ[1], w->XYZ[2] };
    colour_many_of_xyz(&s->colour, block->n, XYZ, &columns);
    for (size_t row = 0; t->spectrum != NULL && row < block->n; row++)
        put_spectrum(w->R + row * stride, s->bands, t->stride,
                     t->spectrum + (at + row) * t->stride);
    block->begin += block->n;
    block->n = 0;
}

/* Rows of one epidermis from place on, `most` of them at most, that fit into the block and are in
 * range; 0 where the first is not. */
static size_t run_length(const struct shared_rows *s, struct grid_place place, size_t most)
{
    size_t n = 0, rest = s->grid.Ch.n - place.Ch;
    if (most > rest)
        most = rest;
    while (n < most && s->within[place.Ch + n])
        n++;
    return n;
}

/* n rows from place on, as rows `at` and on of a block. */
static void put_rows(const struct shared_rows *s, struct workspace *w, struct grid_place place,
                     size_t n, size_t at, bool spectra)
{
    double *const XYZ[3] = { w->XYZ[0] + at, w->XYZ[1] + at, w->XYZ[2] + at };
    double *R = w->R + at * s->layers.stride;
    if (s->lattice == NULL || spectra)
        shared_reflectance(&s->layers, w->epidermis, n,
                           s->dermis + place.Ch * s->layers.dermis_size, R);
    if (s->lattice == NULL)
        colour_many_xyz(&s->colour, n, R, XYZ);
    else
        lattice_xyz(s->lattice, w->sums, place, n, XYZ);
}

static void put_parameters(const struct shared_rows *s, struct table *t, size_t at,
                           struct grid_place place, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        t->Cm[at + i] = s->Cm[place.Cm];
        t->Bm[at + i] = s->Bm[place.Bm];
        t->Ch[at + i] = s->Ch[place.Ch + i];
    }
}

static enum status plain_row(struct workspace *w, size_t row, struct table *t, size_t at)
{
    float spectrum[SPECTRUM_MAX_BANDS];
    struct table_row made;
    enum status s = row_maker_make(w->plain, row, &made, spectrum);
    if (s == STATUS_OK)
        table_set(t, at, &made, spectrum);
    return s;
}

/* Rows from `row` of the recipe on into rows at .. end-1. */
static enum status shared_piece(const struct shared_rows *s, struct workspace *w, size_t row,
                                size_t at, size_t end, struct table *t)
{
    struct block block = { at, 0 };
    struct grid_place now = { SIZE_MAX, 0, 0 };
    enum status status = STATUS_OK;
    bool within = s->lattice != NULL, spectra = t->spectrum != NULL;
    bool epidermis = !within || spectra; /* is needed */
    while (at < end && status == STATUS_OK) {
        struct grid_place place = grid_place(&s->grid, row);
        if (epidermis && (place.Cm != now.Cm || place.Bm != now.Bm))
            within = shared_epidermis(&s->layers, s->Cm[place.Cm], s->Bm[place.Bm], w->epidermis);
        now = place;
        size_t room = ROWS_PER_BLOCK - block.n;
        size_t n = within ? run_length(s, place, room < end - at ? room : end - at) : 0;
        if (n > 0) {
            put_rows(s, w, place, n, block.n, spectra);
            put_parameters(s, t, at, place, n);
            block.n += n;
            row += n;
            at += n;
        }
        if (n == 0 || block.n == ROWS_PER_BLOCK)
            flush(s, w, t, &block);
        if (n == 0) {
            status = plain_row(w, row++, t, at);
            block.begin = ++at;
        }
    }
    flush(s, w, t, &block);
    return status;
}

struct computation {
    struct table_maker *maker;
    struct table *table;
    size_t first, count;
};

static enum status compute_piece(size_t piece, unsigned worker, void *context)
{
    struct computation *c = context;
    size_t at = piece * ROWS_PER_PIECE, rest = c->count - at;
    return table_maker_some(c->maker, worker, c->first + at,
                            rest < ROWS_PER_PIECE ? rest : ROWS_PER_PIECE, c->table, at);
}

/* ---- the contract ------------------------------------------------------------------- */

static enum status workspace_open(const struct table_maker *maker, struct workspace *w)
{
    enum status s = row_maker_open(&maker->recipe, &w->plain);
    if (s != STATUS_OK || maker->shared == NULL)
        return s;
    size_t stride = maker->shared->layers.stride;
    w->epidermis = aligned(maker->shared->layers.epidermis_size);
    w->R = aligned(ROWS_PER_BLOCK * stride);
    if (w->epidermis == NULL || w->R == NULL)
        return STATUS_NO_MEMORY;
    return maker->shared->lattice != NULL ? lattice_sums_open(maker->shared->lattice, &w->sums)
                                          : STATUS_OK;
}

enum status table_maker_open(const struct recipe *recipe, unsigned threads,
                             struct table_maker **ret)
{
    struct table_maker *maker = calloc(1, sizeof *maker);
    if (maker == NULL)
        return STATUS_NO_MEMORY;
    maker->recipe = *recipe;
    maker->threads = threads < 1                      ? 1
                     : threads > PARALLEL_MAX_THREADS ? PARALLEL_MAX_THREADS
                                                      : threads;
    enum status s = shared_rows_open(recipe, &maker->shared);
    for (unsigned i = 0; i < maker->threads && s == STATUS_OK; i++)
        s = workspace_open(maker, &maker->workspace[i]);
    if (s != STATUS_OK) {
        table_maker_close(maker);
        return s;
    }
    *ret = maker;
    return STATUS_OK;
}

void table_maker_close(struct table_maker *maker)
{
    if (maker == NULL)
        return;
    for (unsigned i = 0; i < maker->threads; i++) {
        row_maker_close(maker->workspace[i].plain);
        lattice_sums_close(maker->workspace[i].sums);
        free(maker->workspace[i].epidermis);
        free(maker->workspace[i].R);
    }
    shared_rows_close(maker->shared);
    free(maker);
}

enum status table_maker_rows(struct table_maker *maker, size_t first, size_t count,
                             struct table *table)
{
    struct computation c = { maker, table, first, count };
    size_t pieces = (count + ROWS_PER_PIECE - 1) / ROWS_PER_PIECE;
    return parallel_run(pieces, maker->threads, compute_piece, &c);
}

enum status table_maker_some(struct table_maker *maker, unsigned worker, size_t first, size_t n,
                             struct table *table, size_t at)
{
    struct workspace *w = &maker->workspace[worker];
    if (maker->shared != NULL)
        return shared_piece(maker->shared, w, first, at, at + n, table);
    enum status s = STATUS_OK;
    for (size_t i = 0; i < n && s == STATUS_OK; i++)
        s = plain_row(w, first + i, table, at + i);
    return s;
}
