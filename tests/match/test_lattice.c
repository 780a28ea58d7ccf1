/* test_lattice.c - colours of large tables against the row maker's, which has references of its
 * own, and where there must be none. */
#include "match/lattice.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "match/table_maker.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

/* ---- what a lattice is made of ------------------------------------------------------ */

enum { AXIS_MOST = 400, BANDS_MOST = 480, DERMIS_MOST = 8 * BANDS_MOST };

static struct room {
    struct grid grid;
    double Cm[AXIS_MOST], Bm[AXIS_MOST], Ch[AXIS_MOST];
    struct chromophores chromophores;
    struct shared_layers layers;
    struct colour_many colour;
    double *dermis;
    struct lattice_source source;
} room;

static void values(const struct axis *axis, double *to)
{
    TEST_ASSERT_TRUE(axis->n <= AXIS_MOST);
    for (size_t i = 0; i < axis->n; i++)
        to[i] = axis_value(axis, i);
}

static void make_dermises(void)
{
    size_t size = room.layers.dermis_size;
    for (size_t i = 0; i < room.grid.Ch.n; i++)
        TEST_ASSERT_TRUE(shared_dermis(&room.layers, room.Ch[i], room.dermis + i * size));
}

static void furnish(const struct recipe *r)
{
    struct tissue t = tissue_of(0.0, 0.0, 0.0);
    struct xyz_weights w;
    t.gamma = r->gamma;
    t.epidermis_mm = r->epidermis_mm;
    t.eta = r->eta;
    room.grid = r->grid;
    values(&r->grid.Cm, room.Cm);
    values(&r->grid.Bm, room.Bm);
    values(&r->grid.Ch, room.Ch);
    TEST_ASSERT_EQUAL_INT(STATUS_OK,
                          chromophores_init(r->first_nm, r->step_nm, r->bands, &room.chromophores));
    TEST_ASSERT_EQUAL_INT(STATUS_OK,
                          shared_layers_init(r->model, &room.chromophores, &t, &room.layers));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, xyz_weights_init(r->illuminant, r->observer, r->first_nm,
                                                      r->step_nm, r->bands, &w));
    colour_many_init(&w, &room.colour);
    free(room.dermis);
    room.dermis = calloc(AXIS_MOST, DERMIS_MOST * sizeof *room.dermis);
    TEST_ASSERT_NOT_NULL(room.dermis);
    make_dermises();
    room.source = (struct lattice_source){ &room.grid,   room.Cm,     room.Bm,     room.Ch,
                                           &room.layers, room.dermis, &room.colour };
}

static struct recipe recipe_with(const char *model, const struct grid *grid)
{
    struct recipe r = recipe_default(model_find(model));
    r.grid = *grid;
    return r;
}

/* ---- as the row maker --------------------------------------------------------------- */

/* Grids of the default's kind, and others; expect: the row maker's colours. */
static const struct lattice_case {
    const char *what, *model;
    struct grid grid;
    double first_nm, step_nm, gamma, epidermis_mm, eta;
    size_t bands;
} cases[] = {
    { "half-space",
      "half-space",
      { { 0.001, 0.5, 50, true }, { 0.0, 1.0, 21, false }, { 0.001, 0.1, 48, true } },
      380,
      10,
      0.75,
      0.08,
      1.4,
      37 },
    { "two-layer",
      "two-layer",
      { { 0.001, 0.5, 50, true }, { 0.0, 1.0, 21, false }, { 0.001, 0.1, 48, true } },
      400,
      10,
      0.75,
      0.08,
      1.4,
      31 },
    { "half-space from Cm 0 by even steps",
      "half-space",
      { { 0.0, 0.5, 80, false }, { 0.0, 1.0, 11, false }, { 0.001, 0.1, 75, false } },
      400,
      10,
      0.2,
      0.08,
      1.33,
      31 },
    { "two-layer from Cm 0 by even steps, eta 1.7",
      "two-layer",
      { { 0.0, 0.5, 120, false }, { 0.1, 0.9, 13, false }, { 0.001, 0.1, 80, false } },
      400,
      5,
      1.0,
      0.06,
      1.7,
      61 },
    { "one Bm",
      "two-layer",
      { { 0.001, 0.5, 300, true }, { 0.5, 0.5, 1, false }, { 0.001, 0.1, 300, true } },
      360,
      1,
      0.75,
      0.1,
      1.4,
      471 },
};
enum { CASES = sizeof cases / sizeof *cases };

static struct recipe recipe_of(const struct lattice_case *c)
{
    struct recipe r = recipe_with(c->model, &c->grid);
    r.first_nm = c->first_nm;
    r.step_nm = c->step_nm;
    r.bands = c->bands;
    r.gamma = c->gamma;
    r.epidermis_mm = c->epidermis_mm;
    r.eta = c->eta;
    return r;
}

static void assert_has_lattice(const struct recipe *r, const char *what)
{
    struct lattice *l = NULL;
    furnish(r);
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, lattice_open(&room.source, &l), what);
    TEST_ASSERT_NOT_NULL_MESSAGE(l, what);
    TEST_ASSERT_TRUE_MESSAGE(lattice_nodes(l) * 4 <= grid_rows(&r->grid), what);
    lattice_close(l);
}

static void test_colours_are_the_row_makers(void)
{
    for (size_t k = 0; k < CASES; k++) {
        const struct lattice_case *c = &cases[k];
        struct recipe r = recipe_of(c);
        struct row_maker *maker;
        struct table t;
        double worst = 0.0, worst_rgb = 0.0;
        assert_has_lattice(&r, c->what);
        size_t n = grid_rows(&r.grid);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, table_init_without_spectra(&r, n, &t));
        TEST_ASSERT_EQUAL_INT(STATUS_OK, table_compute(&t, 0, n, 2));
        TEST_ASSERT_EQUAL_INT(STATUS_OK, row_maker_open(&r, &maker));
        for (size_t row = 0; row < n; row += 37) {
            struct table_row expect, got;
            TEST_ASSERT_EQUAL_INT(STATUS_OK, row_maker_make(maker, row, &expect, NULL));
            table_get(&t, row, &got);
            TEST_ASSERT_EQUAL_MEMORY(&expect.Cm, &got.Cm, sizeof(double));
            TEST_ASSERT_EQUAL_MEMORY(&expect.Bm, &got.Bm, sizeof(double));
            TEST_ASSERT_EQUAL_MEMORY(&expect.Ch, &got.Ch, sizeof(double));
            for (int i = 0; i < 3; i++) {
                worst = fmax(worst, fabs(expect.Lab[i] - got.Lab[i]));
                worst_rgb = fmax(worst_rgb, fabs(expect.rgb[i] - got.rgb[i]));
            }
        }
        char text[128];
        snprintf(text, sizeof text, "%s: Lab %.2g, rgb %.2g", c->what, worst, worst_rgb);
        TEST_ASSERT_TRUE_MESSAGE(worst <= 2e-11 && worst_rgb <= 2e-13, text);
        row_maker_close(maker);
        table_done(&t);
    }
}

/* ---- whoever computes them ---------------------------------------------------------- */

static void assert_colours_equal(const struct table *x, size_t x_row, const struct table *y,
                                 size_t y_row, size_t n)
{
    const double *p[] = { x->L, x->a, x->b, x->red, x->green, x->blue, x->Cm, x->Bm, x->Ch };
    const double *q[] = { y->L, y->a, y->b, y->red, y->green, y->blue, y->Cm, y->Bm, y->Ch };
    for (int i = 0; i < 9; i++)
        TEST_ASSERT_EQUAL_MEMORY(p[i] + x_row, q[i] + y_row, n * sizeof(double));
}

/* Property: the same bits for any number of threads, in any pieces, with spectra and without. */
static void test_same_rows_in_any_pieces(void)
{
    static const size_t chunks[] = { 1013, 4096, 49999 };
    struct recipe r = recipe_of(&cases[1]);
    size_t n = grid_rows(&r.grid);
    struct table whole, got;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_init(&r, n, &whole));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_compute(&whole, 0, n, 1));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_init_without_spectra(&r, n, &got));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_compute(&got, 0, n, 3));
    assert_colours_equal(&whole, 0, &got, 0, n);
    table_done(&got);
    for (size_t i = 0; i < sizeof chunks / sizeof *chunks; i++) {
        struct table_maker *maker;
        TEST_ASSERT_EQUAL_INT(STATUS_OK, table_init(&r, chunks[i], &got));
        TEST_ASSERT_EQUAL_INT(STATUS_OK, table_maker_open(&r, 2, &maker));
        for (size_t first = 0; first < n; first += chunks[i]) {
            size_t count = n - first < chunks[i] ? n - first : chunks[i];
            TEST_ASSERT_EQUAL_INT(STATUS_OK, table_maker_rows(maker, first, count, &got));
            assert_colours_equal(&whole, first, &got, 0, count);
            TEST_ASSERT_EQUAL_MEMORY(table_spectrum(&whole, first), table_spectrum(&got, 0),
                                     count * whole.stride * sizeof(float));
        }
        table_maker_close(maker);
        table_done(&got);
    }
    table_done(&whole);
}

/* XYZ of some rows by one kind of vectors. */
enum { SOME = 40 };
static void some_rows(enum vectors v, double XYZ[3][SOME])
{
    struct lattice *l = NULL;
    struct lattice_sums *sums;
    struct grid_place place = { 23, 11, 5 };
    double *const to[3] = { XYZ[0], XYZ[1], XYZ[2] };
    room.layers.vectors = v;
    room.colour.vectors = v;
    make_dermises();
    TEST_ASSERT_EQUAL_INT(STATUS_OK, lattice_open(&room.source, &l));
    TEST_ASSERT_NOT_NULL(l);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, lattice_sums_open(l, &sums));
    lattice_xyz(l, sums, place, SOME, to);
    lattice_sums_close(sums);
    lattice_close(l);
}

static void test_same_by_any_vectors(void)
{
    for (size_t k = 0; k < 2; k++) {
        double best[3][SOME], other[3][SOME];
        struct recipe r = recipe_of(&cases[k]);
        furnish(&r);
        enum vectors widest = vectors_best();
        some_rows(widest, best);
        for (enum vectors v = VECTORS_PLAIN; v < VECTORS_KINDS; v++) {
            if (!vectors_has(v))
                continue;
            bool same = v != VECTORS_PLAIN && widest != VECTORS_PLAIN;
            some_rows(v, other);
            for (int i = 0; i < 3; i++)
                for (size_t row = 0; row < SOME; row++)
                    TEST_ASSERT_DOUBLE_WITHIN(same ? 0.0 : 1e-11, best[i][row], other[i][row]);
        }
    }
}

/* ---- where there is none ------------------------------------------------------------ */

static bool has_lattice(void)
{
    struct lattice *l = NULL;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, lattice_open(&room.source, &l));
    bool has = l != NULL;
    lattice_close(l);
    return has;
}

static void test_none_where_it_does_not_pay_or_reach(void)
{
    static const struct grid small = { { 0.001, 0.5, 30, true },
                                       { 0.0, 1.0, 20, false },
                                       { 0.001, 0.1, 30, true } };
    static const struct grid thin = { { 0.0, 0.5, 50, false },
                                      { 0.0, 1.0, 21, false },
                                      { 0.001, 0.1, 48, true } };
    struct recipe r = recipe_with("half-space", &small);
    furnish(&r);
    TEST_ASSERT_FALSE(has_lattice());
    r.grid = (struct grid){ { 0.001, 0.5, 400, true }, /* as many rows, of one epidermis for a Cm */
                            { 0.5, 0.5, 1, false },
                            { 0.001, 0.1, 100, true } };
    furnish(&r);
    TEST_ASSERT_FALSE(has_lattice());
    r = recipe_with("two-layer", &thin);
    r.epidermis_mm = 0.005;
    furnish(&r);
    TEST_ASSERT_FALSE(has_lattice());
}

/* Dermises that are no smooth function of Ch: in a band that samples look at nodes do not suffice,
 * in one that they pass over the comparison sees it.  expect: none, and one without the damage. */
static void test_none_where_it_would_be_wrong(void)
{
    struct recipe r = recipe_of(&cases[4]);
    static const size_t bands[] = { 200, 195 };
    furnish(&r);
    TEST_ASSERT_TRUE(has_lattice());
    for (size_t k = 0; k < 2; k++) {
        size_t size = room.layers.dermis_size;
        unsigned state = 1;
        make_dermises();
        for (size_t i = 0; i < r.grid.Ch.n; i++) {
            state = state * 1103515245u + 12345u;
            room.dermis[i * size + bands[k]] *= 1.0 + 1e-6 * (double)(state >> 16 & 255);
        }
        TEST_ASSERT_FALSE(has_lattice());
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_colours_are_the_row_makers);
    RUN_TEST(test_same_rows_in_any_pieces);
    RUN_TEST(test_same_by_any_vectors);
    RUN_TEST(test_none_where_it_does_not_pay_or_reach);
    RUN_TEST(test_none_where_it_would_be_wrong);
    free(room.dermis);
    return UNITY_END();
}
