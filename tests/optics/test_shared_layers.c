/* test_shared_layers.c - R of layers put together against the plain models, which have references
 * of their own, and against themselves by other vectors and in other company. */
#include "optics/shared_layers.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

enum { BANDS_MAX = 480, DERMISES = 7 };

/* transport-8 on BANDS_MAX bands; enough for transport-32 on 32. */
enum {
    EPIDERMIS_SIZE_MAX = BANDS_MAX / VECTORS_LANES * TRANSPORT_LANES_EPIDERMIS(8),
    DERMIS_SIZE_MAX = BANDS_MAX / VECTORS_LANES * TRANSPORT_LANES_DERMIS(8)
};

static const double Ch_of[DERMISES] = { 0.0, 0.001, 0.004, 0.013, 0.05, 0.1, 1.0 };
static const double Cm_of[] = { 0.0, 0.001, 0.02, 0.11, 0.5, 1.0 };

/* Room for one epidermis and all dermises, of one grid. */
static struct {
    struct chromophores c;
    double epidermis[EPIDERMIS_SIZE_MAX], dermis[DERMISES * DERMIS_SIZE_MAX];
    double R[DERMISES * BANDS_MAX], other[DERMISES * BANDS_MAX];
    double plain[BANDS_MAX], scratch[MEDIUM_SCRATCH(BANDS_MAX)];
} room;

static const struct shared_case {
    const char *what, *model;
    double first_nm, step_nm, epidermis_mm, gamma, eta;
    size_t bands;
    double tolerance; /* relative */
} cases[] = {
    { "half-space, a table's", "half-space", 400, 10, 0.08, 0.75, 1.4, 31, 2e-14 },
    { "half-space, another skin", "half-space", 380, 10, 0.08, 0.3, 1.33, 37, 2e-14 },
    { "half-space, eta 1", "half-space", 360, 1, 0.08, 0.0, 1.0, 471, 3e-14 },
    { "half-space, the widest", "half-space", 250, 5, 0.08, 1.0, 1.44, 151, 1e-12 },
    { "two-layer, a table's", "two-layer", 400, 10, 0.08, 0.75, 1.4, 31, 2e-14 },
    { "two-layer, thick", "two-layer", 380, 5, 0.3, 0.75, 1.4, 73, 2e-14 },
    { "two-layer, thin", "two-layer", 360, 1, 0.02, 0.4, 1.4, 471, 1e-12 },
    { "two-layer, eta 1.7", "two-layer", 400, 10, 0.06, 0.9, 1.7, 32, 1e-13 },
    { "transport-4, a table's", "transport-4", 400, 10, 0.08, 0.75, 1.4, 31, 2e-13 },
    { "transport-8, a table's", "transport-8", 400, 10, 0.08, 0.75, 1.4, 31, 3e-13 },
    { "transport-8, thin", "transport-8", 380, 10, 0.02, 0.4, 1.33, 37, 1e-12 },
    { "transport-8, thick", "transport-8", 360, 1, 1.0, 0.75, 1.5, 471, 3e-13 },
    { "transport-8, eta 1", "transport-8", 400, 10, 0.1, 0.5, 1.0, 31, 3e-13 },
    { "transport-16, a table's", "transport-16", 400, 10, 0.08, 0.75, 1.4, 31, 1e-12 },
    { "transport-32, a table's", "transport-32", 400, 10, 0.08, 0.75, 1.4, 31, 1e-12 },
};
enum { CASES = sizeof cases / sizeof *cases };

static void init(const struct shared_case *c, struct tissue *t, struct shared_layers *s)
{
    *t = tissue_of(0.0, 0.0, 0.0);
    t->gamma = c->gamma;
    t->epidermis_mm = c->epidermis_mm;
    t->eta = c->eta;
    TEST_ASSERT_EQUAL_INT_MESSAGE(
        STATUS_OK, chromophores_init(c->first_nm, c->step_nm, c->bands, &room.c), c->what);
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK,
                                  shared_layers_init(model_find(c->model), &room.c, t, s), c->what);
}

/* The dermises in range, one after the other; *which are their places in Ch_of. */
static size_t dermises(const struct shared_layers *s, size_t which[DERMISES])
{
    size_t n = 0;
    for (size_t i = 0; i < DERMISES; i++)
        if (shared_dermis(s, Ch_of[i], room.dermis + n * s->dermis_size))
            which[n++] = i;
    return n;
}

/* Property: the plain model's R, wherever the formulas say that they reach. */
static void test_as_the_plain_models(void)
{
    for (size_t k = 0; k < CASES; k++) {
        const struct shared_case *c = &cases[k];
        struct shared_layers s;
        struct tissue t;
        size_t which[DERMISES], pairs = 0;
        double worst = 0.0;
        init(c, &t, &s);
        size_t n = dermises(&s, which);
        TEST_ASSERT_TRUE_MESSAGE(n >= 5, c->what);
        for (size_t i = 0; i < sizeof Cm_of / sizeof *Cm_of; i++)
            for (int blend = 0; blend <= 2; blend++) {
                if (!shared_epidermis(&s, Cm_of[i], 0.5 * blend, room.epidermis))
                    continue;
                shared_reflectance(&s, room.epidermis, n, room.dermis, room.R);
                for (size_t j = 0; j < n; j++, pairs++) {
                    t.Cm = Cm_of[i];
                    t.Bm = 0.5 * blend;
                    t.Ch = Ch_of[which[j]];
                    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK,
                                                  model_reflectance(model_find(c->model), &t,
                                                                    &room.c, room.scratch,
                                                                    room.plain),
                                                  c->what);
                    for (size_t b = 0; b < c->bands; b++)
                        worst = fmax(worst, fabs(room.R[j * s.stride + b] / room.plain[b] - 1.0));
                }
            }
        char text[128];
        snprintf(text, sizeof text, "%s: %.2g", c->what, worst);
        TEST_ASSERT_TRUE_MESSAGE(pairs >= 30, text);
        TEST_ASSERT_TRUE_MESSAGE(worst <= c->tolerance, text);
    }
}

/* Property: the same bits one by one, and by either kind of fused vectors; without any within 1e-13
 * (the thin epidermis magnifies what exponentials are rounded by). */
static void test_same_by_any_vectors_and_company(void)
{
    for (size_t k = 0; k < CASES; k++) {
        struct shared_layers s;
        struct tissue t;
        size_t which[DERMISES];
        init(&cases[k], &t, &s);
        size_t n = dermises(&s, which), size = s.dermis_size;
        TEST_ASSERT_TRUE(shared_epidermis(&s, 0.11, 0.5, room.epidermis));
        shared_reflectance(&s, room.epidermis, n, room.dermis, room.R);
        for (size_t j = 0; j < n; j++)
            shared_reflectance(&s, room.epidermis, 1, room.dermis + j * size,
                               room.other + j * s.stride);
        TEST_ASSERT_EQUAL_MEMORY_MESSAGE(room.R, room.other, n * s.stride * sizeof *room.R,
                                         cases[k].what);
        for (enum vectors v = VECTORS_PLAIN; v < VECTORS_KINDS; v++) {
            if (!vectors_has(v))
                continue;
            bool same = v != VECTORS_PLAIN && s.vectors != VECTORS_PLAIN;
            struct shared_layers by = s;
            by.vectors = by.transport.vectors = v;
            TEST_ASSERT_EQUAL_size_t(n, dermises(&by, which));
            TEST_ASSERT_TRUE(shared_epidermis(&by, 0.11, 0.5, room.epidermis));
            shared_reflectance(&by, room.epidermis, n, room.dermis, room.other);
            for (size_t i = 0; i < n * s.stride; i++)
                TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(same ? 0.0 : 1e-13, room.R[i], room.other[i],
                                                  cases[k].what);
        }
    }
}

/* Where a formula does not reach it says so; expect: the ranges of the headers. */
static void test_says_where_it_does_not_reach(void)
{
    struct shared_layers s;
    struct tissue t;
    struct shared_case thin = cases[4];
    init(&thin, &t, &s);
    TEST_ASSERT_TRUE(shared_epidermis(&s, 0.0, 0.0, room.epidermis));
    thin.epidermis_mm = 0.005; /* k1 d below 1/128 without melanin */
    init(&thin, &t, &s);
    TEST_ASSERT_FALSE(shared_epidermis(&s, 0.0, 0.0, room.epidermis));
    thin.epidermis_mm = 0.0;
    init(&thin, &t, &s);
    TEST_ASSERT_FALSE(shared_epidermis(&s, 0.5, 1.0, room.epidermis));
    thin.epidermis_mm = 100.0; /* sigma_t' d above 150 */
    init(&thin, &t, &s);
    TEST_ASSERT_FALSE(shared_epidermis(&s, 0.5, 1.0, room.epidermis));

    struct shared_layers before;
    memset(&s, 77, sizeof s);
    before = s;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, chromophores_init(400.0, 10.0, 31, &room.c));
    t = tissue_of(0.1, 0.5, 0.01);
    TEST_ASSERT_EQUAL_INT(STATUS_UNSUPPORTED,
                          shared_layers_init(model_find("kubelka-munk"), &room.c, &t, &s));
    TEST_ASSERT_EQUAL_INT(STATUS_UNSUPPORTED,
                          shared_layers_init(model_find("paper"), &room.c, &t, &s));
    t.eta = 1.6; /* the half space's polynomial would leave too much out */
    TEST_ASSERT_EQUAL_INT(STATUS_UNSUPPORTED,
                          shared_layers_init(model_find("half-space"), &room.c, &t, &s));
    t.eta = 3.9;
    TEST_ASSERT_EQUAL_INT(STATUS_UNSUPPORTED,
                          shared_layers_init(model_find("two-layer"), &room.c, &t, &s));
    t.eta = 1.4;
    t.scattering_a = 5.0;
    TEST_ASSERT_EQUAL_INT(STATUS_UNSUPPORTED,
                          shared_layers_init(model_find("two-layer"), &room.c, &t, &s));
    t.scattering_a = 0.0;
    t.gamma = 1.5;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE,
                          shared_layers_init(model_find("two-layer"), &room.c, &t, &s));
    TEST_ASSERT_EQUAL_MEMORY(&before, &s, sizeof s);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_as_the_plain_models);
    RUN_TEST(test_same_by_any_vectors_and_company);
    RUN_TEST(test_says_where_it_does_not_reach);
    return UNITY_END();
}
