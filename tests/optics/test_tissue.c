/* test_tissue.c - fractions to coefficients, and what is refused. */
#include "optics/tissue.h"

#include <math.h>
#include <string.h>

#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

static void test_defaults(void)
{
    struct tissue t = tissue_of(0.125, 0.25, 0.0625);
    TEST_ASSERT_EQUAL_DOUBLE(0.125, t.Cm);
    TEST_ASSERT_EQUAL_DOUBLE(0.25, t.Bm);
    TEST_ASSERT_EQUAL_DOUBLE(0.0625, t.Ch);
    TEST_ASSERT_EQUAL_DOUBLE(0.75, t.gamma);
    TEST_ASSERT_EQUAL_DOUBLE(0.08, t.epidermis_mm);
    TEST_ASSERT_EQUAL_DOUBLE(1.4, t.eta);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, tissue_check(&t));
}

/* One member of a good skin is replaced.  expect: the table on top of tissue.h. */
static const struct check_case {
    const char *what;
    size_t member;
    double value;
    enum status status;
} check_cases[] = {
    { "no melanin", offsetof(struct tissue, Cm), 0.0, STATUS_OK },
    { "nothing but melanin", offsetof(struct tissue, Cm), 1.0, STATUS_OK },
    { "more than all", offsetof(struct tissue, Cm), 1.0000000000000002, STATUS_RANGE },
    { "less than none", offsetof(struct tissue, Cm), -1e-300, STATUS_RANGE },
    { "Cm unknown", offsetof(struct tissue, Cm), NAN, STATUS_RANGE },
    { "all pheomelanin", offsetof(struct tissue, Bm), 0.0, STATUS_OK },
    { "all eumelanin", offsetof(struct tissue, Bm), 1.0, STATUS_OK },
    { "Bm above", offsetof(struct tissue, Bm), 1.5, STATUS_RANGE },
    { "Bm below", offsetof(struct tissue, Bm), -0.5, STATUS_RANGE },
    { "Bm unknown", offsetof(struct tissue, Bm), NAN, STATUS_RANGE },
    { "bloodless", offsetof(struct tissue, Ch), 0.0, STATUS_OK },
    { "all blood", offsetof(struct tissue, Ch), 1.0, STATUS_OK },
    { "Ch above", offsetof(struct tissue, Ch), INFINITY, STATUS_RANGE },
    { "Ch below", offsetof(struct tissue, Ch), -INFINITY, STATUS_RANGE },
    { "Ch unknown", offsetof(struct tissue, Ch), NAN, STATUS_RANGE },
    { "no oxygen", offsetof(struct tissue, gamma), 0.0, STATUS_OK },
    { "all oxygen", offsetof(struct tissue, gamma), 1.0, STATUS_OK },
    { "gamma above", offsetof(struct tissue, gamma), 75.0, STATUS_RANGE },
    { "gamma below", offsetof(struct tissue, gamma), -0.1, STATUS_RANGE },
    { "gamma unknown", offsetof(struct tissue, gamma), NAN, STATUS_RANGE },
    { "no epidermis", offsetof(struct tissue, epidermis_mm), 0.0, STATUS_OK },
    { "a metre of it", offsetof(struct tissue, epidermis_mm), 1000.0, STATUS_OK },
    { "more", offsetof(struct tissue, epidermis_mm), 1000.0000000000001, STATUS_RANGE },
    { "inside out", offsetof(struct tissue, epidermis_mm), -0.08, STATUS_RANGE },
    { "thickness unknown", offsetof(struct tissue, epidermis_mm), NAN, STATUS_RANGE },
    { "eta is left to the models", offsetof(struct tissue, eta), NAN, STATUS_OK },
};

/* Pure substances of simple figures: one band, filled by hand. */
static struct chromophores simple;

static void make_simple(void)
{
    simple.n = 1;
    simple.eumelanin[0] = 10.0;
    simple.pheomelanin[0] = 20.0;
    simple.base[0] = 2.0;
    simple.oxy[0] = 4.0;
    simple.deoxy[0] = 8.0;
    simple.sigma_s_prime[0] = 5.0;
}

static void test_check(void)
{
    make_simple();
    for (size_t i = 0; i < sizeof check_cases / sizeof *check_cases; i++) {
        const struct check_case *c = &check_cases[i];
        struct tissue t = tissue_of(0.1, 0.5, 0.05);
        memcpy((char *)&t + c->member, &c->value, sizeof c->value);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->status, tissue_check(&t), c->what);
        double scratch[MEDIUM_SCRATCH(1)] = { 77.0, 77.0, 77.0, 77.0 };
        struct medium m = { .n = 77 };
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->status, tissue_medium(&t, &simple, scratch, &m), c->what);
        if (c->status != STATUS_OK)
            TEST_ASSERT_MESSAGE(m.n == 77 && scratch[0] == 77.0, c->what);
    }
}

/* expect: Eqs. 4 and 5 with the figures of make_simple(), by hand; the dermis
 * scatters half of the epidermis's 5. */
static const struct medium_case {
    const char *what;
    double Cm, Bm, Ch, gamma, sigma_a_epidermis, sigma_a_dermis;
} medium_cases[] = {
    { "neither melanin nor blood", 0.0, 0.5, 0.0, 0.5, 2.0, 2.0 },
    { "Bm multiplies eumelanin", 1.0, 1.0, 0.0, 0.5, 10.0, 2.0 },
    { "the rest is pheomelanin", 1.0, 0.0, 0.0, 0.5, 20.0, 2.0 },
    { "gamma multiplies the oxygenated", 0.0, 0.5, 1.0, 1.0, 2.0, 4.0 },
    { "the rest is deoxygenated", 0.0, 0.5, 1.0, 0.0, 2.0, 8.0 },
    { "a quarter, a half of eumelanin; an eighth, three quarters oxygenated", 0.25, 0.5, 0.125,
      0.75, 5.25, 2.375 },
};

static void test_medium(void)
{
    make_simple();
    for (size_t i = 0; i < sizeof medium_cases / sizeof *medium_cases; i++) {
        const struct medium_case *c = &medium_cases[i];
        double scratch[MEDIUM_SCRATCH(1)];
        struct medium m;
        struct tissue t = tissue_of(c->Cm, c->Bm, c->Ch);
        t.gamma = c->gamma;
        t.epidermis_mm = 0.0625;
        t.eta = 1.375;
        TEST_ASSERT_EQUAL_INT(STATUS_OK, tissue_medium(&t, &simple, scratch, &m));
        TEST_ASSERT_EQUAL_size_t(1, m.n);
        TEST_ASSERT_TRUE(m.epidermis_mm == 0.0625 && m.eta == 1.375);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-14, c->sigma_a_epidermis, m.sigma_a_epidermis[0],
                                          c->what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-14, c->sigma_a_dermis, m.sigma_a_dermis[0], c->what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-14, 5.0, m.sigma_s_prime_epidermis[0], c->what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-14, 2.5, m.sigma_s_prime_dermis[0], c->what);
    }
}

/* Property: the four arrays share the scratch without overlapping. */
static void test_medium_fills_the_scratch(void)
{
    enum { N = 37 };
    static struct chromophores c;
    double scratch[MEDIUM_SCRATCH(N) + 1];
    struct medium m;
    struct tissue t = tissue_of(0.1, 0.5, 0.05);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, chromophores_init(380.0, 10.0, N, &c));
    for (size_t i = 0; i < MEDIUM_SCRATCH(N) + 1; i++)
        scratch[i] = -1.0;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, tissue_medium(&t, &c, scratch, &m));
    for (size_t i = 0; i < MEDIUM_SCRATCH(N); i++)
        TEST_ASSERT_TRUE(scratch[i] > 0.0);
    TEST_ASSERT_TRUE(scratch[MEDIUM_SCRATCH(N)] == -1.0);
    for (size_t i = 0; i < N; i++)
        TEST_ASSERT_TRUE(m.sigma_s_prime_epidermis[i] == c.sigma_s_prime[i]);
}

/* a (l/500)^-b in both layers: 9.7 (400/500)^-1.47 = 13.4657160, 9.7 (700/500)^-1.47 = 5.91511948
 * (decimals of 30 digits).  0 for a is the paper's Eq. 6; b is then not looked at. */
static void test_scattering_of_its_own(void)
{
    static struct chromophores c;
    double scratch[MEDIUM_SCRATCH(4)];
    struct medium m;
    struct tissue t = tissue_of(0.1, 0.5, 0.05);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, chromophores_init(400.0, 100.0, 4, &c));
    t.scattering_a = 9.7;
    t.scattering_b = 1.47;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, tissue_medium(&t, &c, scratch, &m));
    TEST_ASSERT_DOUBLE_WITHIN(1e-7, 13.46571608340, m.sigma_s_prime_epidermis[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-14, 9.7, m.sigma_s_prime_epidermis[1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-7, 5.915119485660, m.sigma_s_prime_epidermis[3]);
    for (size_t i = 0; i < 4; i++)
        TEST_ASSERT_TRUE(m.sigma_s_prime_dermis[i] == m.sigma_s_prime_epidermis[i]);
    static const double refused[][2] = { { -1.0, 1.0 },
                                         { 1e-7, 1.0 },
                                         { 1e7, 1.0 },
                                         { 10.0, 10.000001 },
                                         { 10.0, (double)NAN },
                                         { (double)NAN, 1.0 },
                                         { (double)INFINITY, 1.0 } };
    for (size_t i = 0; i < sizeof refused / sizeof *refused; i++) {
        t.scattering_a = refused[i][0];
        t.scattering_b = refused[i][1];
        TEST_ASSERT_EQUAL_INT(STATUS_RANGE, tissue_check(&t));
    }
    t.scattering_a = 0.0;
    t.scattering_b = 1e6;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, tissue_check(&t));
}

/* One number of two bands of skin is replaced.  expect: the limits in optics/dipole.h, and a
 * thickness as a tissue may have. */
static const struct limit_case {
    const char *what;
    enum { SIGMA_A_EPI, SIGMA_A_DERMIS, SIGMA_S_EPI, SIGMA_S_DERMIS, THICKNESS } which;
    double value;
    enum status status;
} limit_cases[] = {
    { "an epidermis that does not absorb", SIGMA_A_EPI, 0.0, STATUS_OK },
    { "or all", SIGMA_A_EPI, 1e100, STATUS_OK },
    { "or gives light", SIGMA_A_EPI, -1e-300, STATUS_RANGE },
    { "or more than all", SIGMA_A_EPI, 1.1e100, STATUS_RANGE },
    { "a dermis that gives light", SIGMA_A_DERMIS, -1e-300, STATUS_RANGE },
    { "a dermis unknown", SIGMA_A_DERMIS, NAN, STATUS_RANGE },
    { "hardly any scattering", SIGMA_S_EPI, 1e-100, STATUS_OK },
    { "none", SIGMA_S_EPI, 0.0, STATUS_RANGE },
    { "none in the dermis", SIGMA_S_DERMIS, 0.0, STATUS_RANGE },
    { "endless scattering", SIGMA_S_DERMIS, INFINITY, STATUS_RANGE },
    { "no epidermis", THICKNESS, 0.0, STATUS_OK },
    { "a metre", THICKNESS, 1000.0, STATUS_OK },
    { "above", THICKNESS, 1000.0000000000001, STATUS_RANGE },
    { "below", THICKNESS, -5e-324, STATUS_RANGE },
    { "thickness unknown", THICKNESS, NAN, STATUS_RANGE },
};

static void test_medium_check(void)
{
    for (size_t i = 0; i < sizeof limit_cases / sizeof *limit_cases; i++) {
        const struct limit_case *c = &limit_cases[i];
        double x[4][2] = { { 0.5, 0.5 }, { 0.1, 0.1 }, { 5.0, 5.0 }, { 2.5, 2.5 } };
        struct medium m = { 2, 0.08, 1.4, x[0], x[1], x[2], x[3] };
        TEST_ASSERT_EQUAL_INT(STATUS_OK, medium_check(&m));
        *(c->which == THICKNESS ? &m.epidermis_mm : &x[c->which][1]) = c->value;
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->status, medium_check(&m), c->what);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_scattering_of_its_own);
    RUN_TEST(test_defaults);
    RUN_TEST(test_check);
    RUN_TEST(test_medium_check);
    RUN_TEST(test_medium);
    RUN_TEST(test_medium_fills_the_scratch);
    return UNITY_END();
}
