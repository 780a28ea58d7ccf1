/* test_monte_carlo.c - walks against adding-doubling and published slabs, their errors and slopes
 * against what those should be, and their limits. */
#include "optics/monte_carlo.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include "base/parallel.h"
#include "tests/support/figures.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

static struct monte_carlo_run run_of(uint64_t photons, uint64_t seed)
{
    return (struct monte_carlo_run){ photons, seed, parallel_cores(), NULL };
}

static struct monte_carlo_answer answer(const struct monte_carlo_layer *layer, size_t n, double eta,
                                        struct monte_carlo_run run, const char *what)
{
    struct monte_carlo_answer a;
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, monte_carlo_layers(layer, n, eta, &run, &a), what);
    return a;
}

/* ---- against other methods ---------------------------------------------------------- */

/* Standard errors by which means lie from what they should be: how many, the sum of squares,
 * how many beyond 3. */
struct spread {
    int n, beyond_3;
    double squares, most;
};

static void look(struct spread *spread, struct monte_carlo_mean got, double expect, double error)
{
    double z = (got.value - expect) / hypot(got.error, error);
    spread->n++;
    spread->beyond_3 += fabs(z) > 3.0;
    spread->squares += z * z;
    spread->most = fmax(spread->most, fabs(z));
}

enum { ETA, LAYERS, R_COLUMN = 10, T_COLUMN, ERROR_COLUMN, COLUMNS };

/* A row of layers.csv; an absent layer has 0 everywhere. */
static size_t read_layers(const struct figures *t, size_t i, struct monte_carlo_layer layer[3])
{
    size_t n = 0;
    for (size_t at = LAYERS; n < 3 && figures_at(t, i, at + 2) > 0.0; n++, at += 3) {
        double mm = figures_at(t, i, at + 2);
        layer[n] = (struct monte_carlo_layer){ figures_at(t, i, at), figures_at(t, i, at + 1), 0.0,
                                               mm < 1e300 ? mm : INFINITY };
    }
    return n;
}

/* expect: tests/reference/layers.csv, 100 seeded stacks by adding-doubling with 64 directions.
 * Errors that are honest give squares of mean 1: of 100 the sum is 62 to 149 but once in 500
 * (chi-squared); one in 370 lies beyond 3. */
static void test_stacks(void)
{
    struct figures t;
    struct spread R = { 0 }, T = { 0 };
    char what[128];
    TEST_ASSERT_TRUE_MESSAGE(figures_read("tests/reference/layers.csv", &t),
                             "tests/reference/layers.csv");
    TEST_ASSERT_EQUAL_size_t(COLUMNS, t.columns);
    TEST_ASSERT_EQUAL_STRING("R", t.name[R_COLUMN]);
    TEST_ASSERT_EQUAL_size_t(100, t.rows);
    for (size_t i = 0; i < t.rows; i++) {
        struct monte_carlo_layer layer[3];
        double error = figures_at(&t, i, ERROR_COLUMN);
        size_t n = read_layers(&t, i, layer);
        TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0.0, error);
        snprintf(what, sizeof what, "layers.csv, row %zu", i + 1);
        struct monte_carlo_answer a =
            answer(layer, n, figures_at(&t, i, ETA), run_of(20000, i + 1), what);
        look(&R, a.R, figures_at(&t, i, R_COLUMN), error);
        if (figures_at(&t, i, T_COLUMN) > 1e-3) /* else too few get through to know an error */
            look(&T, a.T, figures_at(&t, i, T_COLUMN), error);
    }
    snprintf(what, sizeof what, "R: %d beyond 3, worst %.2f, squares %.1f; T: %d of %d, %.2f, %.1f",
             R.beyond_3, R.most, R.squares, T.beyond_3, T.n, T.most, T.squares);
    TEST_ASSERT_TRUE_MESSAGE(R.beyond_3 <= 1 && R.most < 4.0, what);
    TEST_ASSERT_TRUE_MESSAGE(R.squares > 62.0 && R.squares < 149.0, what);
    TEST_ASSERT_TRUE_MESSAGE(T.n > 20 && T.beyond_3 <= 1 && T.most < 4.0, what);
    TEST_ASSERT_TRUE_MESSAGE(fabs(T.squares - T.n) < 3.5 * sqrt(2.0 * T.n), what);
    figures_done(&t);
}

/* expect: tests/reference/layer_slopes.csv, differences of adding-doubling.  Slopes of a row come
 * from the same walks, so their squares spread more than those of 120 would. */
static void test_slopes(void)
{
    struct figures t;
    struct spread spread = { 0 };
    char what[128];
    TEST_ASSERT_TRUE_MESSAGE(figures_read("tests/reference/layer_slopes.csv", &t),
                             "tests/reference/layer_slopes.csv");
    TEST_ASSERT_EQUAL_size_t(12, t.columns);
    TEST_ASSERT_EQUAL_size_t(24, t.rows);
    for (size_t i = 0; i < t.rows; i++) {
        double x[5], slope[5], error[5], R;
        for (size_t k = 0; k < 5; k++)
            x[k] = figures_at(&t, i, k);
        struct medium m = { 1, x[4], 1.4, &x[0], &x[2], &x[1], &x[3] };
        struct slopes dR = { &slope[0], &slope[2], &slope[1], &slope[3], &slope[4] };
        struct slopes dR_error = { &error[0], &error[2], &error[1], &error[3], &error[4] };
        struct monte_carlo_run run = run_of(20000, i + 1);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, monte_carlo_skin(&m, &run, &R, NULL, &dR, &dR_error));
        for (size_t k = 0; k < 5; k++) {
            double by = figures_at(&t, i, 6 + k);
            if (fabs(x[k] * by) > 1e-3 * R) /* else too few get there to know an error */
                look(&spread, (struct monte_carlo_mean){ slope[k], error[k] }, by, 0.0);
        }
    }
    snprintf(what, sizeof what, "%d slopes: %d beyond 3, worst %.2f, squares %.1f", spread.n,
             spread.beyond_3, spread.most, spread.squares);
    TEST_ASSERT_TRUE_MESSAGE(spread.n > 100 && spread.beyond_3 <= 2 && spread.most < 4.5, what);
    TEST_ASSERT_TRUE_MESSAGE(spread.squares > 60.0 && spread.squares < 180.0, what);
    figures_done(&t);
}

/* expect: as published, R with the mirror reflection.  van de Hulst, Multiple Light Scattering,
 * 1980, table 35; Giovanelli, Optica Acta 2, 153, 1955. */
static const struct published_case {
    const char *what;
    struct monte_carlo_layer layer;
    double eta, R, T, digit;
} published_cases[] = {
    { "van de Hulst's slab", { 0.1, 0.9, 0.75, 2.0 }, 1.0, 0.09739, 0.66096, 0.5e-5 },
    { "Giovanelli's half space", { 0.1, 0.9, 0.0, INFINITY }, 1.5, 0.2600, 0.0, 0.5e-4 },
};

static void test_published(void)
{
    for (size_t i = 0; i < sizeof published_cases / sizeof *published_cases; i++) {
        const struct published_case *c = &published_cases[i];
        struct monte_carlo_answer a = answer(&c->layer, 1, c->eta, run_of(200000, 1), c->what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(3.0 * a.R.error + c->digit, c->R, a.R.value + a.specular,
                                          c->what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(3.0 * a.T.error + c->digit, c->T, a.T.value, c->what);
        TEST_ASSERT_TRUE_MESSAGE(a.R.error > 1e-5 && a.R.error < 1e-3, c->what);
    }
}

/* ---- random numbers ----------------------------------------------------------------- */

static const struct monte_carlo_layer skin_layers[2] = { { 0.3, 4.0, 0.0, 0.1 },
                                                         { 0.1, 2.0, 0.0, INFINITY } };

/* Property: to the last bit the same on any number of threads, and another with another seed. */
static void test_threads_and_seeds(void)
{
    static const unsigned threads[] = { 1, 2, 3, 8 };
    struct monte_carlo_run run = { 5000, 7, 1, NULL };
    struct monte_carlo_answer first = answer(skin_layers, 2, 1.4, run, "one thread");
    for (size_t i = 0; i < sizeof threads / sizeof *threads; i++) {
        run.threads = threads[i];
        struct monte_carlo_answer a = answer(skin_layers, 2, 1.4, run, "threads");
        TEST_ASSERT_EQUAL_MEMORY(&first.R, &a.R, sizeof a.R);
        TEST_ASSERT_EQUAL_MEMORY(&first.slope[0], &a.slope[0], sizeof a.slope[0]);
    }
    run.seed = 8;
    struct monte_carlo_answer other = answer(skin_layers, 2, 1.4, run, "another seed");
    TEST_ASSERT_TRUE(first.R.value != other.R.value);
    TEST_ASSERT_DOUBLE_WITHIN(4.0 * hypot(first.R.error, other.R.error), first.R.value,
                              other.R.value);
}

/* Property: cut in two a layer is the same, by the same walks; so is what is scaled. */
static void test_same_walks(void)
{
    static const struct monte_carlo_layer cut[3] = { { 0.3, 4.0, 0.0, 0.0625 },
                                                     { 0.3, 4.0, 0.0, 0.0375 },
                                                     { 0.1, 2.0, 0.0, INFINITY } };
    static const struct monte_carlo_layer scaled[2] = { { 1.2, 16.0, 0.0, 0.025 },
                                                        { 0.4, 8.0, 0.0, INFINITY } };
    double whole = answer(skin_layers, 2, 1.4, run_of(5000, 1), "whole").R.value;
    double parts = answer(cut, 3, 1.4, run_of(5000, 1), "cut").R.value;
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, whole, parts);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, whole,
                              answer(scaled, 2, 1.4, run_of(5000, 1), "scaled").R.value);
}

/* Property: between neighbouring media the noise is mostly the same, so that R follows its slope
 * far better than its standard error; and bands are independent. */
static void test_common_numbers(void)
{
    double a1[2] = { 0.3, 0.3 }, s1[2] = { 4.0, 4.0 }, a2[2] = { 0.1, 0.1 }, s2[2] = { 2.0, 2.0 };
    double R[2], error[2], near[2], scratch[SLOPES_SCRATCH(2)], alone[2];
    struct medium m = { 2, 0.1, 1.4, a1, a2, s1, s2 };
    struct slopes dR = slopes_in(scratch, 2);
    struct monte_carlo_run run = run_of(20000, 1);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, monte_carlo_skin(&m, &run, R, error, &dR, NULL));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, monte_carlo_skin(&m, &run, alone, NULL, NULL, NULL));
    TEST_ASSERT_EQUAL_MEMORY(alone, R, sizeof R); /* slopes leave R as it is */
    TEST_ASSERT_TRUE(fabs(R[0] - R[1]) > 1e-3 * error[0]);
    a1[0] = 0.303;
    a2[1] = 0.101;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, monte_carlo_skin(&m, &run, near, NULL, NULL, NULL));
    TEST_ASSERT_DOUBLE_WITHIN(error[0] / 10.0, 0.003 * dR.sigma_a_epidermis[0], near[0] - R[0]);
    TEST_ASSERT_DOUBLE_WITHIN(error[1] / 10.0, 0.001 * dR.sigma_a_dermis[1], near[1] - R[1]);
}

/* ---- limits ------------------------------------------------------------------------- */

/* expect: R where it is known: nothing absorbs, so all returns; nothing returns; or NAN. */
static const struct extreme_case {
    const char *what;
    double a1, s1, a2, s2, d_mm, eta, R;
} extreme_cases[] = {
    { "nothing absorbs", 0.0, 5.0, 0.0, 2.5, 0.08, 1.4, 35.0 / 36.0 },
    { "nothing absorbs, no epidermis", 0.0, 5.0, 0.0, 2.5, 0.0, 1.4, 35.0 / 36.0 },
    { "nothing absorbs, no surface", 0.0, 5.0, 0.0, 2.5, 0.08, 1.0, 1.0 },
    { "nothing absorbs, thick", 0.0, 1e9, 0.0, 2.5, 1000.0, 1.4, 35.0 / 36.0 },
    { "black", 1e100, 1e-100, 1e100, 1e-100, 0.08, 1.4, 0.0 },
    { "black, no epidermis", 1.0, 5.0, 1e100, 1e-100, 0.0, 1.4, 0.0 },
    { "black under a sheet of nothing", 0.0, 1e-100, 1e100, 1e-100, 1000.0, 1.4, 0.0 },
    { "clear sheet over what absorbs nothing", 0.0, 1e-100, 0.0, 1e100, 1e-100, 1.4, 35.0 / 36.0 },
    { "no epidermis", 0.3, 5.0, 0.1, 2.5, 0.0, 1.4, NAN },
    { "hardly any", 0.3, 5.0, 0.1, 2.5, 1e-100, 1.4, NAN },
    { "10^12 mean free paths", 1e8, 1e9, 0.1, 2.5, 1000.0, 1.4, NAN },
    { "dermis absorbs next to nothing", 0.3, 5.0, 1e-15, 2.5, 0.08, 1.4, NAN },
    { "into a thinner medium", 0.3, 5.0, 0.1, 2.5, 0.08, 0.27, NAN },
    { "nearly all reflected inside", 0.3, 5.0, 0.1, 2.5, 0.08, 3.84, NAN },
};

static void test_extremes(void)
{
    for (size_t i = 0; i < sizeof extreme_cases / sizeof *extreme_cases; i++) {
        struct extreme_case c = extreme_cases[i];
        struct medium m = { 1, c.d_mm, c.eta, &c.a1, &c.a2, &c.s1, &c.s2 };
        double R, error, scratch[SLOPES_SCRATCH(1)], errors[SLOPES_SCRATCH(1)];
        struct slopes dR = slopes_in(scratch, 1), dR_error = slopes_in(errors, 1);
        struct monte_carlo_run run = run_of(2000, 1);
        TEST_ASSERT_EQUAL_INT_MESSAGE(
            STATUS_OK, monte_carlo_skin(&m, &run, &R, &error, &dR, &dR_error), c.what);
        TEST_ASSERT_TRUE_MESSAGE(R >= 0.0 && R <= 1.0 + 4.0 * error && error >= 0.0, c.what);
        if (!isnan(c.R))
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(4.0 * error + 1e-12, c.R, R, c.what);
        for (int k = 0; k < SLOPES_SCRATCH(1); k++)
            TEST_ASSERT_FALSE_MESSAGE(isnan(scratch[k]) || isnan(errors[k]), c.what);
        TEST_ASSERT_TRUE_MESSAGE(scratch[0] <= 0.0 && scratch[1] <= 0.0, c.what);
        if (c.a2 == 0.0 && c.s1 * c.d_mm < 1e3)
            TEST_ASSERT_TRUE_MESSAGE(scratch[1] == -INFINITY, c.what);
    }
}

/* expect: energy: in a slab that absorbs nothing R + T is all that entered; thin ones are crossed
 * 10^12 times along one path. */
static void test_clear_slabs(void)
{
    static const double any_mm[] = { 1e-100, 1e-12, 1e-3, 0.1, 3.0, 1e12 };
    for (size_t i = 0; i < sizeof any_mm / sizeof *any_mm; i++) {
        for (double g = -0.99; g < 1.0; g += 0.495) {
            struct monte_carlo_layer slab = { 0.0, 1.0, g, any_mm[i] };
            struct monte_carlo_answer a = answer(&slab, 1, 1.5, run_of(1000, 1), "clear slab");
            double error = a.R.error + a.T.error;
            TEST_ASSERT_DOUBLE_WITHIN(4.0 * error + 1e-12, 0.96, a.R.value + a.T.value);
            TEST_ASSERT_TRUE(a.left >= 0.0 && a.left < 0.1);
        }
    }
}

static const struct range_case {
    const char *what;
    struct monte_carlo_layer layer;
    size_t n;
    double eta;
    uint64_t photons;
    enum status status;
} range_cases[] = {
    { "good", { 0.3, 4.0, 0.0, INFINITY }, 1, 1.4, 10, STATUS_OK },
    { "no layer", { 0.3, 4.0, 0.0, INFINITY }, 0, 1.4, 10, STATUS_RANGE },
    { "too many", { 0.3, 4.0, 0.0, INFINITY }, 9, 1.4, 10, STATUS_RANGE },
    { "endless above another", { 0.3, 4.0, 0.0, INFINITY }, 2, 1.4, 10, STATUS_RANGE },
    { "no thickness", { 0.3, 4.0, 0.0, 0.0 }, 1, 1.4, 10, STATUS_RANGE },
    { "thickness unknown", { 0.3, 4.0, 0.0, NAN }, 1, 1.4, 10, STATUS_RANGE },
    { "absorbs less than nothing", { -0.3, 4.0, 0.0, 1.0 }, 1, 1.4, 10, STATUS_RANGE },
    { "does not scatter", { 0.3, 0.0, 0.0, 1.0 }, 1, 1.4, 10, STATUS_RANGE },
    { "only forwards", { 0.3, 4.0, 1.0, 1.0 }, 1, 1.4, 10, STATUS_RANGE },
    { "direction unknown", { 0.3, 4.0, NAN, 1.0 }, 1, 1.4, 10, STATUS_RANGE },
    { "index too high", { 0.3, 4.0, 0.0, 1.0 }, 1, 3.85, 10, STATUS_RANGE },
    { "one photon has no error", { 0.3, 4.0, 0.0, 1.0 }, 1, 1.4, 1, STATUS_RANGE },
    { "more than it can number", { 0.3, 4.0, 0.0, 1.0 }, 1, 1.4, UINT64_MAX, STATUS_RANGE },
};

static void test_ranges(void)
{
    for (size_t i = 0; i < sizeof range_cases / sizeof *range_cases; i++) {
        const struct range_case *c = &range_cases[i];
        struct monte_carlo_layer layer[9];
        struct monte_carlo_answer a = { .specular = 77.0 };
        struct monte_carlo_run run = run_of(c->photons, 1);
        for (int k = 0; k < 9; k++)
            layer[k] = c->layer;
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->status, monte_carlo_layers(layer, c->n, c->eta, &run, &a),
                                      c->what);
        TEST_ASSERT_MESSAGE((a.specular == 77.0) == (c->status != STATUS_OK), c->what);
    }
}

/* As other models: a bad last band leaves R untouched. */
static void test_skin_ranges(void)
{
    double a1[] = { 0.3, 0.3 }, s1[] = { 4.0, 4.0 }, a2[] = { 0.1, -0.1 }, s2[] = { 2.0, 2.0 };
    double R[] = { 77.0, 77.0 };
    struct medium m = { 2, 0.08, 1.4, a1, a2, s1, s2 };
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, monte_carlo_reflectance(&m, R));
    a2[1] = 0.1;
    m.epidermis_mm = -0.08;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, monte_carlo_reflectance(&m, R));
    m.epidermis_mm = 0.08;
    m.eta = NAN;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, monte_carlo_reflectance(&m, R));
    TEST_ASSERT_TRUE(R[0] == 77.0 && R[1] == 77.0);
    m.eta = 1.4;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, monte_carlo_reflectance(&m, R));
    TEST_ASSERT_TRUE(R[0] > 0.1 && R[0] < 0.5);
}

struct seen {
    size_t calls, done, total, stop_at;
};

static bool see(void *context, size_t done, size_t total)
{
    struct seen *seen = context;
    TEST_ASSERT_GREATER_THAN(seen->done, done);
    *seen = (struct seen){ seen->calls + 1, done, total, seen->stop_at };
    return seen->calls != seen->stop_at;
}

static void test_progress(void)
{
    double a1[] = { 30, 30, 30 }, s1[] = { 4, 4, 4 }, a2[] = { 9, 9, 9 }, s2[] = { 2, 2, 2 }, R[3];
    struct medium m = { 3, 0.08, 1.4, a1, a2, s1, s2 };
    struct seen seen = { 0 };
    struct progress progress = { see, &seen };
    struct monte_carlo_run run = { 300000, 1, 2, &progress };
    TEST_ASSERT_EQUAL_INT(STATUS_OK, monte_carlo_skin(&m, &run, R, NULL, NULL, NULL));
    TEST_ASSERT_EQUAL_size_t(6, seen.calls); /* a band is two rounds of at most 262144 */
    TEST_ASSERT_EQUAL_size_t(900000, seen.done);
    TEST_ASSERT_EQUAL_size_t(900000, seen.total);
    seen = (struct seen){ .stop_at = 3 };
    TEST_ASSERT_EQUAL_INT(STATUS_CANCELLED, monte_carlo_skin(&m, &run, R, NULL, NULL, NULL));
    TEST_ASSERT_EQUAL_size_t(3, seen.calls);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_stacks);
    RUN_TEST(test_slopes);
    RUN_TEST(test_published);
    RUN_TEST(test_threads_and_seeds);
    RUN_TEST(test_same_walks);
    RUN_TEST(test_common_numbers);
    RUN_TEST(test_extremes);
    RUN_TEST(test_clear_slabs);
    RUN_TEST(test_ranges);
    RUN_TEST(test_skin_ranges);
    RUN_TEST(test_progress);
    return UNITY_END();
}
