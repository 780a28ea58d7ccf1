/* test_transport_published.c - the transport models against others' computations: more streams, by
 * doubling; half spaces and slabs; and a published figure. */
#include "optics/transport.h"

#include <math.h>
#include <stdio.h>

#include "tests/support/figures.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

enum { BANDS = 37, FIRST = 4 }; /* 380..740 nm by 10, after 4 columns */

static void read_skins(const char *path, struct figures *t)
{
    TEST_ASSERT_TRUE_MESSAGE(figures_read(path, t), path);
    TEST_ASSERT_EQUAL_size_t(FIRST + BANDS, t->columns);
    TEST_ASSERT_EQUAL_STRING("epidermis_mm", t->name[3]);
    TEST_ASSERT_EQUAL_STRING("380", t->name[FIRST]);
    TEST_ASSERT_EQUAL_STRING("740", t->name[t->columns - 1]);
    TEST_ASSERT_GREATER_THAN(50, t->rows);
}

/* Rms and largest difference from a table of skins. */
static void compare(const struct figures *t, int streams, double *rms, double *most)
{
    static struct chromophores c;
    double squares = 0.0;
    *most = 0.0;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, chromophores_init(380.0, 10.0, BANDS, &c));
    for (size_t i = 0; i < t->rows; i++) {
        double scratch[MEDIUM_SCRATCH(BANDS)], R[BANDS];
        struct tissue tissue =
            tissue_of(figures_at(t, i, 0), figures_at(t, i, 1), figures_at(t, i, 2));
        struct medium m;
        tissue.epidermis_mm = figures_at(t, i, 3);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, tissue_medium(&tissue, &c, scratch, &m));
        TEST_ASSERT_EQUAL_INT(STATUS_OK, transport_reflectance(streams, &m, R));
        for (size_t k = 0; k < BANDS; k++) {
            double difference = R[k] - figures_at(t, i, FIRST + k);
            TEST_ASSERT_TRUE(isfinite(difference));
            squares += difference * difference;
            *most = fmax(*most, fabs(difference));
        }
    }
    *rms = sqrt(squares / (double)(t->rows * BANDS));
}

/* expect: what optics/transport.h says each number of streams is good for; the bars are 0.0015 and
 * 0.002 with 8, 3e-5 and 2e-4 with 32. */
static const struct skins_case {
    int streams;
    double rms, most;
} skins_cases[] = {
    { 4, 0.005, 0.0075 },
    { 8, 0.0011, 0.0018 },
    { 16, 1.7e-4, 2.8e-4 },
    { 32, 2.0e-5, 3.0e-5 },
};

/* The reference: tests/reference/transport_skins.csv, 64 directions by
 * tests/reference/transport.py. */
static void test_random_skins(void)
{
    struct figures t;
    read_skins("tests/reference/transport_skins.csv", &t);
    for (size_t i = 0; i < sizeof skins_cases / sizeof *skins_cases; i++) {
        const struct skins_case *c = &skins_cases[i];
        double rms, most;
        char what[96];
        compare(&t, c->streams, &rms, &most);
        snprintf(what, sizeof what, "%d streams: rms %.3g, worst %.3g", c->streams, rms, most);
        TEST_ASSERT_TRUE_MESSAGE(rms <= c->rms && most <= c->most, what);
        TEST_ASSERT_TRUE_MESSAGE(rms >= 0.5 * c->rms, what);
    }
    figures_done(&t);
}

/* With as many streams as the reference it is the same computation by another method: what is left
 * is the doubling's and the 8 digits'. */
static void test_same_streams(void)
{
    struct figures t;
    double rms, most;
    read_skins("tests/reference/transport_skins.csv", &t);
    compare(&t, 64, &rms, &most);
    TEST_ASSERT_DOUBLE_WITHIN(2e-8, 0.0, most);
    figures_done(&t);
}

/* expect: tests/reference/transport_grid.csv, 107 half spaces and slabs, good to 1e-5. */
static void test_grid(void)
{
    struct figures t;
    TEST_ASSERT_TRUE_MESSAGE(figures_read("tests/reference/transport_grid.csv", &t),
                             "tests/reference/transport_grid.csv");
    TEST_ASSERT_EQUAL_size_t(6, t.columns);
    TEST_ASSERT_EQUAL_size_t(107, t.rows);
    for (size_t i = 0; i < t.rows; i++) {
        double n = figures_at(&t, i, 0), a = figures_at(&t, i, 1), tau = figures_at(&t, i, 2);
        struct transport_layer layer = { 1.0 - a, a, isfinite(tau) ? tau : INFINITY };
        struct transport_flux f;
        char what[64];
        snprintf(what, sizeof what, "n %g, albedo %g, tau %g", n, a, tau);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, transport_stack(64, n, &layer, 1, &f));
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1.5e-5, figures_at(&t, i, 3), f.R_total, what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1.5e-5, figures_at(&t, i, 4), f.R_diffuse, what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1.5e-5, figures_at(&t, i, 5), f.T_total, what);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, transport_stack(32, n, &layer, 1, &f));
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-4, figures_at(&t, i, 3), f.R_total, what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-4, figures_at(&t, i, 5), f.T_total, what);
    }
    figures_done(&t);
}

/* expect: tests/reference/layers.csv, stacks of one to three layers with 64 directions, by doubling
 * (tests/reference/layers.py); what is left is that doubling's, and the seven digits'. */
static void test_stacks(void)
{
    struct figures t;
    TEST_ASSERT_TRUE_MESSAGE(figures_read("tests/reference/layers.csv", &t),
                             "tests/reference/layers.csv");
    TEST_ASSERT_EQUAL_STRING("mm3", t.name[9]);
    TEST_ASSERT_EQUAL_STRING("T", t.name[11]);
    TEST_ASSERT_GREATER_OR_EQUAL(100, t.rows);
    for (size_t i = 0; i < t.rows; i++) {
        struct transport_layer layer[3];
        struct transport_flux f;
        size_t count = 0;
        char what[64];
        for (; count < 3 && figures_at(&t, i, 3 * count + 3) > 0.0; count++) {
            double mm = figures_at(&t, i, 3 * count + 3);
            layer[count] = (struct transport_layer){ figures_at(&t, i, 3 * count + 1),
                                                     figures_at(&t, i, 3 * count + 2),
                                                     mm < 1e300 ? mm : INFINITY };
        }
        snprintf(what, sizeof what, "layers.csv, row %zu", i + 1);
        TEST_ASSERT_EQUAL_INT_MESSAGE(
            STATUS_OK, transport_stack(64, figures_at(&t, i, 0), layer, count, &f), what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(2e-7, figures_at(&t, i, 10), f.R_diffuse, what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(2e-7, figures_at(&t, i, 11), f.T_total, what);
    }
    figures_done(&t);
}

/* expect: Giovanelli, Reflection by semi-infinite diffusers, Opt. Acta 2, 153 (1955): half space of
 * index 1.5 and albedo 0.9, normal incidence: 0.2600, the mirror reflection of 0.0400 in it. */
static void test_giovanelli(void)
{
    struct transport_layer layer = { 0.1, 0.9, INFINITY };
    struct transport_flux f;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, transport_stack(64, 1.5, &layer, 1, &f));
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0.2600, f.R_total);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0.0400, f.R_total - f.R_diffuse);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_random_skins);
    RUN_TEST(test_same_streams);
    RUN_TEST(test_grid);
    RUN_TEST(test_stacks);
    RUN_TEST(test_giovanelli);
    return UNITY_END();
}
