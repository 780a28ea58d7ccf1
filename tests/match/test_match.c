/* test_match.c - what an answer says about itself: flags, colour, consistency. */
#include "match/match.h"

#include <math.h>
#include <string.h>

#include "colour/lab.h"
#include "colour/srgb.h"
#include "colour/xyz.h"
#include "tests/support/dice.h"
#include "tests/support/textbook.h"
#include "unity.h"

/* Cm 0, .1, .2, .3, .4; Bm 0, .25, .5, .75, 1; Ch .02 .. .1 by .02: row counting by
 * hand, Cm 0 has rows 0..4, then 25 rows a Cm, 5 a Bm. */
static const struct grid grid = { { 0.0, 0.4, 5, false },
                                  { 0.0, 1.0, 5, false },
                                  { 0.02, 0.1, 5, false } };
enum { ROWS = 5 + 4 * 25, BANDS = 31 };

static size_t row_of(size_t cm, size_t bm, size_t ch)
{
    return cm == 0 ? ch : 5 + 25 * (cm - 1) + 5 * bm + ch;
}

static struct table spectral, paper;

void setUp(void)
{
    struct recipe recipe = recipe_default(model_find("two-layer"));
    recipe.grid = grid;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_init(&recipe, ROWS, &spectral));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_compute(&spectral, 0, ROWS, 1));
    recipe = recipe_default(model_find("paper"));
    recipe.grid = grid;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_init(&recipe, ROWS, &paper));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_compute(&paper, 0, ROWS, 1));
}

void tearDown(void)
{
    table_done(&spectral);
    table_done(&paper);
}

static struct spectrum empty_spectrum(double first_nm, double step_nm, size_t n)
{
    return (struct spectrum){ .first_nm = first_nm,
                              .step_nm = step_nm,
                              .n = n,
                              .specular = SPECULAR_SCE,
                              .aperture_mm = NAN };
}

/* A reading that is exactly a row, plus `offset` up and down by turns: its rms
 * from the row is the offset. */
static struct spectrum spectrum_of_row(const struct table *t, size_t row, double offset)
{
    struct spectrum s = empty_spectrum(400.0, 10.0, BANDS);
    for (size_t i = 0; i < BANDS; i++)
        s.value[i] = (double)table_spectrum(t, row)[i] + (i % 2 == 0 ? offset : -offset);
    return s;
}

static struct match match_once(const struct table *t, enum match_by by, const struct spectrum *s)
{
    struct matcher matcher;
    struct nearest_hit hit;
    struct match match;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, matcher_open(t, by, &matcher));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, matcher_match(&matcher, s, 1, &hit, &match));
    TEST_ASSERT_EQUAL_size_t(1, match.found);
    TEST_ASSERT_EQUAL_size_t(match.row_index, hit.row);
    TEST_ASSERT_EQUAL_DOUBLE(match.distance, hit.distance);
    matcher_close(&matcher);
    TEST_ASSERT_NULL(matcher.nearest);
    return match;
}

/* expect: where on the grid the row lies, by match.h; indices count from 0. */
static const struct limit_case {
    const char *what;
    size_t cm, bm, ch;
    unsigned flags;
} limit_cases[] = {
    { "inside", 2, 2, 2, 0 },
    { "most melanin", 4, 2, 2, MATCH_CM_AT_LIMIT },
    { "least melanin is none: Bm means nothing", 0, 0, 2,
      MATCH_CM_AT_LIMIT | MATCH_BM_UNDETERMINED },
    { "only pheomelanin", 2, 0, 2, MATCH_BM_AT_LIMIT },
    { "only eumelanin", 2, 4, 2, MATCH_BM_AT_LIMIT },
    { "least blood", 2, 2, 0, MATCH_CH_AT_LIMIT },
    { "most blood", 2, 2, 4, MATCH_CH_AT_LIMIT },
    { "a corner", 4, 4, 4, MATCH_CM_AT_LIMIT | MATCH_BM_AT_LIMIT | MATCH_CH_AT_LIMIT },
    { "the other corner", 0, 0, 0, MATCH_CM_AT_LIMIT | MATCH_BM_UNDETERMINED | MATCH_CH_AT_LIMIT },
};

static void test_limits(void)
{
    for (size_t i = 0; i < sizeof limit_cases / sizeof *limit_cases; i++) {
        const struct limit_case *c = &limit_cases[i];
        size_t row = row_of(c->cm, c->bm, c->ch);
        struct spectrum s = spectrum_of_row(&spectral, row, 0.0);
        struct match m = match_once(&spectral, MATCH_SPECTRUM, &s);
        TEST_ASSERT_EQUAL_size_t_MESSAGE(row, m.row_index, c->what);
        TEST_ASSERT_EQUAL_HEX_MESSAGE(c->flags, m.flags, c->what);
        TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(0.0, m.distance, c->what);
        TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(0.0, m.rms, c->what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-4, 0.0, m.dE00, c->what); /* float32 spectra */
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-15, 0.1 * (double)c->cm, m.row.Cm, c->what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-15, 0.25 * (double)c->bm, m.row.Bm, c->what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-15, 0.02 + 0.02 * (double)c->ch, m.row.Ch, c->what);
    }
}

/* An axis of one value has no ends to be at. */
static void test_fixed_axes_have_no_limits(void)
{
    struct recipe recipe = recipe_default(model_find("two-layer"));
    struct table t;
    recipe.grid =
        (struct grid){ { 0.1, 0.1, 1, false }, { 1.0, 1.0, 1, false }, { 0.05, 0.05, 1, false } };
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_init(&recipe, 1, &t));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_compute(&t, 0, 1, 1));
    struct spectrum s = spectrum_of_row(&t, 0, 0.0);
    TEST_ASSERT_EQUAL_HEX(0, match_once(&t, MATCH_SPECTRUM, &s).flags);
    table_done(&t);
}

/* expect: more than 0.02 of rms is poor; at 0.02 less a rounding it is not yet. */
static const struct fit_case {
    const char *what;
    double offset;
    unsigned flags;
} fit_cases[] = {
    { "exact", 0.0, 0 },
    { "just good", 0.01999, 0 },
    { "just poor", 0.02001, MATCH_POOR_FIT },
};

static void test_poor_fit(void)
{
    size_t row = row_of(2, 2, 2);
    for (size_t i = 0; i < sizeof fit_cases / sizeof *fit_cases; i++) {
        const struct fit_case *c = &fit_cases[i];
        struct spectrum s = spectrum_of_row(&spectral, row, c->offset);
        struct match m = match_once(&spectral, MATCH_SPECTRUM, &s);
        double expect =
            textbook_rms(&s, 400.0, 10.0, BANDS, table_spectrum(&spectral, m.row_index), NULL);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-15, expect, m.rms, c->what);
        TEST_ASSERT_EQUAL_HEX_MESSAGE(c->flags, m.flags & MATCH_POOR_FIT, c->what);
        if (c->offset == 0.02001) /* a row may fit a little better than the one it was made of */
            TEST_ASSERT_TRUE_MESSAGE(m.rms > 0.02, c->what);
    }
}

/* Another row with the same spectrum: a tie, seen with k = 1 as well. */
static void test_tie(void)
{
    size_t row = row_of(2, 2, 2), other = row_of(3, 2, 2);
    struct table_row values;
    struct nearest_hit hits[2];
    struct matcher matcher;
    struct match m;
    struct spectrum s = spectrum_of_row(&spectral, row, 0.001);
    TEST_ASSERT_EQUAL_HEX(0, match_once(&spectral, MATCH_SPECTRUM, &s).flags);
    table_get(&spectral, other, &values);
    table_set(&spectral, other, &values, table_spectrum(&spectral, row));
    m = match_once(&spectral, MATCH_SPECTRUM, &s);
    TEST_ASSERT_EQUAL_HEX(MATCH_TIE, m.flags);
    TEST_ASSERT_EQUAL_size_t(row, m.row_index);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, matcher_open(&spectral, MATCH_SPECTRUM, &matcher));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, matcher_match(&matcher, &s, 2, hits, &m));
    TEST_ASSERT_EQUAL_HEX(MATCH_TIE, m.flags);
    TEST_ASSERT_EQUAL_size_t(2, m.found);
    TEST_ASSERT_EQUAL_size_t(row, hits[0].row);
    TEST_ASSERT_EQUAL_size_t(other, hits[1].row);
    matcher_close(&matcher);
}

static void test_zeroed_bands(void)
{
    struct spectrum s = spectrum_of_row(&spectral, row_of(2, 2, 2), 0.0);
    s.flag[30] = SPECTRUM_BAND_ZEROED;
    TEST_ASSERT_EQUAL_HEX(MATCH_BANDS_ZEROED, match_once(&spectral, MATCH_SPECTRUM, &s).flags);
    s.flag[30] = (unsigned char)~SPECTRUM_BAND_ZEROED; /* some other flag */
    TEST_ASSERT_EQUAL_HEX(0, match_once(&spectral, MATCH_SPECTRUM, &s).flags);
}

/* expect: names as the answers carry them, in the order of the bits. */
static void test_flag_names(void)
{
    static const struct {
        enum match_flag flag;
        const char *name;
    } flags[MATCH_FLAG_COUNT] = {
        { MATCH_CM_AT_LIMIT, "Cm_at_limit" },
        { MATCH_BM_AT_LIMIT, "Bm_at_limit" },
        { MATCH_CH_AT_LIMIT, "Ch_at_limit" },
        { MATCH_BM_UNDETERMINED, "Bm_undetermined" },
        { MATCH_TIE, "tie" },
        { MATCH_POOR_FIT, "poor_fit" },
        { MATCH_NO_COLOUR, "no_colour" },
        { MATCH_BANDS_ZEROED, "bands_zeroed" },
    };
    for (size_t i = 0; i < MATCH_FLAG_COUNT; i++) {
        TEST_ASSERT_EQUAL_INT(1 << i, flags[i].flag);
        TEST_ASSERT_EQUAL_STRING(flags[i].name, match_flag_name(i));
    }
    TEST_ASSERT_EQUAL_STRING("unknown", match_flag_name(MATCH_FLAG_COUNT));
    TEST_ASSERT_EQUAL_STRING("unknown", match_flag_name((size_t)-1));
}

/* By 3 nm there is no colour (colour/xyz.h), but eleven bands in common: 400, 430
 * .. 700.  Searches by colour are refused, by spectrum answered and flagged. */
static void test_no_colour(void)
{
    size_t row = row_of(2, 2, 2);
    struct spectrum s = empty_spectrum(358.0, 3.0, 140);
    double Lab[3], rgb[3];
    for (size_t i = 0; i < s.n; i++)
        s.value[i] = 0.9; /* where the table has no band it does not count */
    for (size_t i = 0; i < BANDS; i += 3)
        s.value[spectrum_band(&s, 400.0 + 10.0 * (double)i)] =
            (double)table_spectrum(&spectral, row)[i];
    TEST_ASSERT_EQUAL_INT(STATUS_UNSUPPORTED, matcher_colour(&spectral, &s, Lab, rgb));
    struct match m = match_once(&spectral, MATCH_SPECTRUM, &s);
    TEST_ASSERT_EQUAL_size_t(row, m.row_index);
    TEST_ASSERT_EQUAL_HEX(MATCH_NO_COLOUR, m.flags);
    TEST_ASSERT_TRUE(isnan(m.dE00));
    TEST_ASSERT_EQUAL_DOUBLE(0.0, m.rms);
}

/* A hole in the spectrum takes away the colour, and its band from the rms. */
static void test_band_not_measured(void)
{
    size_t row = row_of(2, 2, 2);
    struct spectrum s = spectrum_of_row(&spectral, row, 0.0);
    s.value[13] = NAN;
    struct match m = match_once(&spectral, MATCH_SPECTRUM, &s);
    TEST_ASSERT_EQUAL_size_t(row, m.row_index);
    TEST_ASSERT_EQUAL_HEX(MATCH_NO_COLOUR, m.flags);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, m.rms);
}

/* expect: the contract of matcher_match(). */
static const struct refusal_case {
    const char *what;
    enum match_by by;
    enum specular specular;
    double first_nm, step_nm;
    size_t n, k;
    double value;
    enum status status;
} refusal_cases[] = {
    { "good", MATCH_SPECTRUM, SPECULAR_SCE, 400, 10, 31, 1, 0.3, STATUS_OK },
    { "k is 0", MATCH_SPECTRUM, SPECULAR_SCE, 400, 10, 31, 0, 0.3, STATUS_RANGE },
    { "SCI", MATCH_SPECTRUM, SPECULAR_SCI, 400, 10, 31, 1, 0.3, STATUS_UNSUPPORTED },
    { "SCI", MATCH_LAB, SPECULAR_SCI, 400, 10, 31, 1, 0.3, STATUS_UNSUPPORTED },
    { "nobody knows", MATCH_RGB, SPECULAR_UNKNOWN, 400, 10, 31, 1, 0.3, STATUS_UNSUPPORTED },
    { "nine bands", MATCH_SPECTRUM, SPECULAR_SCE, 400, 10, 9, 1, 0.3, STATUS_UNSUPPORTED },
    { "ten bands", MATCH_SPECTRUM, SPECULAR_SCE, 400, 10, 10, 1, 0.3, STATUS_OK },
    { "nothing measured", MATCH_SPECTRUM, SPECULAR_SCE, 400, 10, 31, 1, NAN, STATUS_UNSUPPORTED },
    { "no colour, not asked for", MATCH_SPECTRUM, SPECULAR_SCE, 358, 3, 140, 1, 0.3, STATUS_OK },
    { "no colour", MATCH_RGB, SPECULAR_SCE, 358, 3, 140, 1, 0.3, STATUS_UNSUPPORTED },
    { "no colour", MATCH_RGB_FLOAT, SPECULAR_SCE, 358, 3, 140, 1, 0.3, STATUS_UNSUPPORTED },
    { "no colour", MATCH_LAB, SPECULAR_SCE, 358, 3, 140, 1, 0.3, STATUS_UNSUPPORTED },
    { "no colour", MATCH_DE2000, SPECULAR_SCE, 358, 3, 140, 1, 0.3, STATUS_UNSUPPORTED },
    { "colour with a hole", MATCH_LAB, SPECULAR_SCE, 400, 10, 31, 1, NAN, STATUS_UNSUPPORTED },
    { "400..690 is too short for it", MATCH_LAB, SPECULAR_SCE, 400, 10, 30, 1, 0.3,
      STATUS_UNSUPPORTED },
};

static void test_refusals(void)
{
    for (size_t i = 0; i < sizeof refusal_cases / sizeof *refusal_cases; i++) {
        const struct refusal_case *c = &refusal_cases[i];
        struct spectrum s = empty_spectrum(c->first_nm, c->step_nm, c->n);
        struct matcher matcher;
        struct nearest_hit hit = { 77, 78.0 };
        struct match m, before;
        memset(&m, 77, sizeof m);
        before = m;
        s.specular = c->specular;
        for (size_t band = 0; band < s.n; band++)
            s.value[band] = c->value;
        TEST_ASSERT_EQUAL_INT(STATUS_OK, matcher_open(&spectral, c->by, &matcher));
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->status, matcher_match(&matcher, &s, c->k, &hit, &m),
                                      c->what);
        if (c->status != STATUS_OK) {
            TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&before, &m, sizeof m, c->what);
            TEST_ASSERT_EQUAL_size_t_MESSAGE(77, hit.row, c->what);
        }
        matcher_close(&matcher);
    }
}

static void test_open(void)
{
    struct matcher matcher = { .table = NULL };
    TEST_ASSERT_EQUAL_INT(MATCH_SPECTRUM, matcher_default_by(&spectral));
    TEST_ASSERT_EQUAL_INT(MATCH_RGB, matcher_default_by(&paper));
    TEST_ASSERT_EQUAL_INT(STATUS_UNSUPPORTED, matcher_open(&paper, MATCH_SPECTRUM, &matcher));
    TEST_ASSERT_NULL(matcher.table);
    matcher_close(&matcher); /* nothing to give back */
}

/* The paper's table: no spectra, so no rms; colour under its 2 degrees. */
static void test_paper_table(void)
{
    struct spectrum s = spectrum_of_row(&spectral, row_of(1, 2, 2), 0.0);
    struct xyz_weights weights;
    double XYZ[3], Lab[3], white_Lab[3], rgb[3];
    struct match m = match_once(&paper, MATCH_RGB, &s);
    TEST_ASSERT_TRUE(isnan(m.rms));
    /* Without rms the colour tells: the paper's table is far from a two-layer skin. */
    TEST_ASSERT_EQUAL_INT(m.dE00 > 5.0, (m.flags & MATCH_POOR_FIT) != 0);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, matcher_colour(&paper, &s, Lab, rgb));
    TEST_ASSERT_EQUAL_INT(
        STATUS_OK, xyz_weights_init(ILLUMINANT_D65, OBSERVER_2DEG, 400.0, 10.0, BANDS, &weights));
    xyz_from_reflectance(&weights, s.value, XYZ);
    lab_from_xyz(XYZ, weights.white, white_Lab);
    TEST_ASSERT_EQUAL_MEMORY(white_Lab, Lab, sizeof Lab);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, textbook_de2000(Lab, m.row.Lab), m.dE00);
}

/* expect: a spectrum on the table's grid is cut to the table's bands, so what lies
 * beyond is nothing to its colour, and a row has its own colour again. */
static void test_colour_over_the_tables_bands(void)
{
    size_t row = row_of(2, 1, 3);
    struct spectrum exact = spectrum_of_row(&spectral, row, 0.0);
    struct spectrum wide = empty_spectrum(360.0, 10.0, 43);
    double Lab[3], rgb[3], wide_Lab[3], wide_rgb[3];
    for (size_t i = 0; i < wide.n; i++)
        wide.value[i] = i % 2 == 0 ? NAN : 5.0;
    memcpy(wide.value + 4, exact.value, BANDS * sizeof *exact.value);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, matcher_colour(&spectral, &exact, Lab, rgb));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, matcher_colour(&spectral, &wide, wide_Lab, wide_rgb));
    TEST_ASSERT_EQUAL_MEMORY(Lab, wide_Lab, sizeof Lab);
    TEST_ASSERT_EQUAL_MEMORY(rgb, wide_rgb, sizeof rgb);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, spectral.L[row], Lab[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, spectral.a[row], Lab[1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, spectral.b[row], Lab[2]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, spectral.red[row], rgb[0]);
    /* The paper's table has no bands: then all of the spectrum counts. */
    TEST_ASSERT_EQUAL_INT(STATUS_UNSUPPORTED, matcher_colour(&paper, &wide, Lab, rgb));
}

/* Other grids: all their bands, by colour/xyz.h called by hand. */
static const struct colour_case {
    const char *what;
    double first_nm, step_nm;
    size_t n;
    enum status status;
} colour_cases[] = {
    { "by 5 nm", 380, 5, 81, STATUS_OK },
    { "by 1 nm", 400, 1, 301, STATUS_OK },
    { "10 nm, but not on the table's", 405, 10, 40, STATUS_UNSUPPORTED },
    { "starts too late", 410, 10, 40, STATUS_RANGE },
    { "ends too early", 360, 10, 34, STATUS_RANGE },
    { "by 3 nm", 358, 3, 140, STATUS_UNSUPPORTED },
};

static void test_colour_of_other_grids(void)
{
    for (size_t i = 0; i < sizeof colour_cases / sizeof *colour_cases; i++) {
        const struct colour_case *c = &colour_cases[i];
        static struct xyz_weights weights;
        struct spectrum s = empty_spectrum(c->first_nm, c->step_nm, c->n);
        double XYZ[3], expect[3], expect_rgb[3];
        double Lab[3] = { 77.0, 77.0, 77.0 }, rgb[3] = { 77.0, 77.0, 77.0 };
        for (size_t band = 0; band < s.n; band++)
            s.value[band] = 0.2 + 0.001 * (double)band;
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->status, matcher_colour(&spectral, &s, Lab, rgb), c->what);
        if (c->status != STATUS_OK) {
            TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(77.0, Lab[0], c->what);
            TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(77.0, rgb[2], c->what);
            continue;
        }
        TEST_ASSERT_EQUAL_INT(STATUS_OK, xyz_weights_init(ILLUMINANT_D65, OBSERVER_10DEG,
                                                          c->first_nm, c->step_nm, c->n, &weights));
        xyz_from_reflectance(&weights, s.value, XYZ);
        lab_from_xyz(XYZ, weights.white, expect);
        srgb_linear_from_xyz(XYZ, weights.white, expect_rgb);
        TEST_ASSERT_EQUAL_MEMORY_MESSAGE(expect, Lab, sizeof Lab, c->what);
        TEST_ASSERT_EQUAL_MEMORY_MESSAGE(expect_rgb, rgb, sizeof rgb, c->what);
    }
}

/* A table on bands that colour/xyz.h has no weights for is searched all the same. */
static void test_table_on_bands_without_colour(void)
{
    struct recipe recipe = spectral.recipe;
    struct spectrum s = empty_spectrum(400.0, 20.0, 16);
    float row_spectrum[16];
    struct table_row row;
    struct table t;
    recipe.step_nm = 20.0;
    recipe.bands = 16;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_init(&recipe, 2, &t));
    for (size_t i = 0; i < 2; i++) {
        for (int band = 0; band < 16; band++)
            row_spectrum[band] = i == 0 ? 0.25f : 0.5f;
        table_get(&spectral, i, &row);
        table_set(&t, i, &row, row_spectrum);
    }
    for (size_t band = 0; band < s.n; band++)
        s.value[band] = 0.4375;
    struct match m = match_once(&t, MATCH_SPECTRUM, &s);
    TEST_ASSERT_EQUAL_size_t(1, m.row_index);
    TEST_ASSERT_EQUAL_DOUBLE(0.0625, m.distance);
    TEST_ASSERT_TRUE(isnan(m.dE00));
    TEST_ASSERT_TRUE(m.flags & MATCH_NO_COLOUR);
    table_done(&t);
}

/* Property, 300 readings by chance: whatever it is searched by, dE00 and rms are
 * those of the row that is named, and distance is the one that was asked for. */
static void test_answers_are_consistent(void)
{
    struct dice dice = { 5 };
    struct matcher matcher[5];
    for (int by = 0; by < 5; by++)
        TEST_ASSERT_EQUAL_INT(STATUS_OK, matcher_open(&spectral, (enum match_by)by, &matcher[by]));
    for (int number = 0; number < 300; number++) {
        struct spectrum s = spectrum_of_row(&spectral, dice_below(&dice, ROWS), 0.0);
        double Lab[3], rgb[3];
        for (size_t i = 0; i < s.n; i++)
            s.value[i] = fmax(0.0, s.value[i] + dice_between(&dice, -0.05, 0.05));
        TEST_ASSERT_EQUAL_INT(STATUS_OK, matcher_colour(&spectral, &s, Lab, rgb));
        for (int by = 0; by < 5; by++) {
            struct nearest_hit hits[4];
            struct match m;
            struct table_row row;
            TEST_ASSERT_EQUAL_INT(STATUS_OK, matcher_match(&matcher[by], &s, 4, hits, &m));
            TEST_ASSERT_EQUAL_size_t(4, m.found);
            TEST_ASSERT_EQUAL_INT(by, m.by);
            TEST_ASSERT_EQUAL_size_t(hits[0].row, m.row_index);
            TEST_ASSERT_EQUAL_DOUBLE(hits[0].distance, m.distance);
            table_get(&spectral, m.row_index, &row);
            TEST_ASSERT_EQUAL_MEMORY(&row, &m.row, sizeof row);
            double rms =
                textbook_rms(&s, 400.0, 10.0, BANDS, table_spectrum(&spectral, m.row_index), NULL);
            TEST_ASSERT_DOUBLE_WITHIN(1e-14, rms, m.rms);
            TEST_ASSERT_DOUBLE_WITHIN(1e-9, textbook_de2000(Lab, row.Lab), m.dE00);
            if (by == MATCH_SPECTRUM)
                TEST_ASSERT_DOUBLE_WITHIN(1e-14, rms, m.distance);
            if (by == MATCH_DE2000)
                TEST_ASSERT_DOUBLE_WITHIN(1e-9, m.dE00, m.distance);
            if (by == MATCH_LAB)
                TEST_ASSERT_DOUBLE_WITHIN(1e-12,
                                          sqrt(pow(Lab[0] - row.Lab[0], 2.0) +
                                               pow(Lab[1] - row.Lab[1], 2.0) +
                                               pow(Lab[2] - row.Lab[2], 2.0)),
                                          m.distance);
        }
    }
    for (int by = 0; by < 5; by++)
        matcher_close(&matcher[by]);
}

/* k = 1 writes one hit, and a table of one row has no second. */
static void test_k_is_the_callers_room(void)
{
    struct spectrum s = spectrum_of_row(&spectral, 7, 0.0);
    struct nearest_hit hits[3] = { { 77, 0 }, { 77, 0 }, { 77, 0 } };
    struct matcher matcher;
    struct match m;
    struct table one;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, matcher_open(&spectral, MATCH_SPECTRUM, &matcher));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, matcher_match(&matcher, &s, 1, hits, &m));
    TEST_ASSERT_EQUAL_size_t(7, hits[0].row);
    TEST_ASSERT_EQUAL_size_t(77, hits[1].row);
    matcher_close(&matcher);

    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_init(&spectral.recipe, 1, &one));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_compute(&one, 7, 1, 1));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, matcher_open(&one, MATCH_SPECTRUM, &matcher));
    for (size_t k = 1; k <= 3; k++) {
        TEST_ASSERT_EQUAL_INT(STATUS_OK, matcher_match(&matcher, &s, k, hits, &m));
        TEST_ASSERT_EQUAL_size_t(1, m.found);
        TEST_ASSERT_EQUAL_size_t(0, hits[0].row);
        TEST_ASSERT_EQUAL_size_t(77, hits[1].row);
        TEST_ASSERT_FALSE(m.flags & MATCH_TIE);
    }
    matcher_close(&matcher);
    table_done(&one);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_limits);
    RUN_TEST(test_fixed_axes_have_no_limits);
    RUN_TEST(test_poor_fit);
    RUN_TEST(test_tie);
    RUN_TEST(test_zeroed_bands);
    RUN_TEST(test_flag_names);
    RUN_TEST(test_no_colour);
    RUN_TEST(test_band_not_measured);
    RUN_TEST(test_refusals);
    RUN_TEST(test_open);
    RUN_TEST(test_paper_table);
    RUN_TEST(test_colour_over_the_tables_bands);
    RUN_TEST(test_colour_of_other_grids);
    RUN_TEST(test_table_on_bands_without_colour);
    RUN_TEST(test_answers_are_consistent);
    RUN_TEST(test_k_is_the_callers_room);
    return UNITY_END();
}
