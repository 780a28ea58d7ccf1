/* test_quick.c - the quick formulas against the plain ones, and vectors against each other. */
#include "optics/quick.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "optics/opaque.h"
#include "optics/quick_exp.h"
#include "tests/support/dice.h"
#include "unity.h"

enum { BANDS = 31, MODELS = 3, STRIDE = QUICK_STRIDE(BANDS), ROWS = TISSUE_PARAMETERS };

static struct chromophores chromophores;
static double scratch[QUICK_SCRATCH(BANDS)];
static double R[STRIDE], J[ROWS * STRIDE], plain_R[BANDS], plain_J[ROWS * BANDS];

void setUp(void)
{
    TEST_ASSERT_EQUAL_INT(STATUS_OK, chromophores_init(400.0, 10.0, BANDS, &chromophores));
}

void tearDown(void)
{
}

static const struct model *quick_model(size_t i)
{
    static const char *const name[] = { "half-space", "two-layer" };
    return i < 2 ? model_find(name[i]) : &opaque_model;
}

static double decades(struct dice *dice, double least, double most)
{
    return exp(dice_between(dice, log(least), log(most)));
}

/* A skin as people have. */
static struct tissue human(struct dice *dice)
{
    struct tissue t = tissue_of(decades(dice, 0.001, 0.5), dice_between(dice, 0.0, 1.0),
                                decades(dice, 0.001, 0.1));
    if (dice_below(dice, 8) == 0) /* one melanin alone */
        t.Bm = nearbyint(t.Bm);
    t.gamma = dice_between(dice, 0.0, 1.0);
    t.epidermis_mm = decades(dice, 0.02, 0.2);
    if (dice_below(dice, 2) == 0) {
        t.scattering_a = decades(dice, 2.0, 60.0);
        t.scattering_b = dice_between(dice, -1.0, 4.0);
    }
    return t;
}

/* Anything that tissue_check() lets pass. */
static struct tissue accepted(struct dice *dice)
{
    struct tissue t = tissue_of(dice_between(dice, 0.0, 1.0), dice_between(dice, 0.0, 1.0),
                                dice_between(dice, 0.0, 1.0));
    t.gamma = dice_between(dice, 0.0, 1.0);
    t.epidermis_mm = decades(dice, 1e-6, 1000.0);
    t.eta = dice_between(dice, 0.27, 3.84);
    if (dice_below(dice, 3) > 0) {
        t.scattering_a = decades(dice, 1e-6, 1e6);
        t.scattering_b = dice_between(dice, -10.0, 10.0);
    }
    return t;
}

/* How far each is from the plain one: R and the rows relatively, the thickness's row, which
 * passes through 0, against R over the thickness. */
static void compare(const struct tissue *t, const struct model *model, double worst[1 + ROWS])
{
    TEST_ASSERT_EQUAL_INT(STATUS_OK,
                          quick_slopes(model, t, &chromophores, QUICK_WANT_ALL, scratch, R, J));
    TEST_ASSERT_EQUAL_INT(STATUS_OK,
                          model_slopes(model, t, &chromophores, scratch, plain_R, plain_J));
    for (size_t i = 0; i < BANDS; i++) {
        TEST_ASSERT_TRUE(isfinite(R[i])); /* fmax() passes NaN over */
        worst[0] = fmax(worst[0], fabs(R[i] - plain_R[i]) / plain_R[i]);
        for (size_t p = 0; p < ROWS; p++) {
            double expect = plain_J[p * BANDS + i], size = fabs(expect);
            if (p == TISSUE_EPIDERMIS_MM)
                size = fmax(size, plain_R[i] / t->epidermis_mm);
            double off = fabs(J[p * STRIDE + i] - expect);
            TEST_ASSERT_TRUE(isfinite(J[p * STRIDE + i]));
            if (off > 1e-290) /* what is below 1e-300 counts as 0 */
                worst[1 + p] = fmax(worst[1 + p], off / size);
        }
    }
}

/* expect: the plain twin; the bars of quick.h.  Measured: R 4e-15, by Cm and Bm 2e-13, the
 * others 2e-14. */
static void test_human_skin(void)
{
    struct dice dice = { 41 };
    double worst[1 + ROWS] = { 0.0 };
    for (int k = 0; k < 6000; k++) {
        struct tissue t = human(&dice);
        compare(&t, quick_model((size_t)k % MODELS), worst);
    }
    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-14, 0.0, worst[0], "R");
    for (size_t p = 0; p < ROWS; p++) {
        char what[32];
        snprintf(what, sizeof what, "parameter %zu", p);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(p <= TISSUE_BM ? 5e-13 : 1e-13, 0.0, worst[1 + p], what);
    }
}

/* Whatever is accepted: by the quick formulas up to the ends of their range, or the plain ones.
 * Measured: R 2e-13, by Cm and Bm 4e-13. */
static void test_accepted_skin(void)
{
    struct dice dice = { 42 };
    double worst[1 + ROWS] = { 0.0 };
    for (int k = 0; k < 30000; k++) {
        struct tissue t = accepted(&dice);
        compare(&t, quick_model((size_t)k % MODELS), worst);
    }
    for (size_t p = 0; p < 1 + ROWS; p++)
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0, worst[p]);
}

/* Fused and plain exponentials differ in last bits, and so do R and the derivatives. */
static void check_apart(const struct tissue *t, const double *other_R, const double *other_J)
{
    for (size_t i = 0; i < STRIDE; i++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-14 * R[i], R[i], other_R[i]);
        for (size_t p = 0; p < ROWS; p++) {
            double one = J[p * STRIDE + i], size = fabs(one);
            if (p == TISSUE_EPIDERMIS_MM && t->epidermis_mm > 0.0)
                size = fmax(size, R[i] / t->epidermis_mm);
            TEST_ASSERT_DOUBLE_WITHIN(2e-13 * size + 1e-290, one, other_J[p * STRIDE + i]);
        }
    }
}

/* The vectors that fuse give the same bits, all of the last one the processor has; the plain loop
 * is near.  Measured between them: R 1.4e-15, derivatives 4e-14. */
static void test_vectors_agree(void)
{
    struct dice dice = { 43 };
    static double other_R[STRIDE], other_J[ROWS * STRIDE];
    TEST_ASSERT_TRUE(quick_has(QUICK_PLAIN));
    for (int k = 0; k < 2000; k++) {
        struct tissue t = k % 2 == 0 ? human(&dice) : accepted(&dice);
        const struct model *model = quick_model((size_t)k / 2 % MODELS);
        TEST_ASSERT_EQUAL_INT(
            STATUS_OK, quick_slopes(model, &t, &chromophores, QUICK_WANT_ALL, scratch, R, J));
        for (int v = 0; v < QUICK_VECTORS; v++) {
            if (!quick_has((enum quick_vectors)v))
                continue;
            TEST_ASSERT_EQUAL_INT(STATUS_OK,
                                  quick_slopes_by((enum quick_vectors)v, model, &t, &chromophores,
                                                  QUICK_WANT_ALL, scratch, other_R, other_J));
            if (v == QUICK_PLAIN) {
                check_apart(&t, other_R, other_J);
                continue;
            }
            TEST_ASSERT_EQUAL_MEMORY(R, other_R, sizeof R);
            TEST_ASSERT_EQUAL_MEMORY(J, other_J, sizeof J);
        }
    }
}

/* Rows that are not wanted stay; those that are end in zeros; what is wanted does not change
 * the others. */
static void test_wanted(void)
{
    static double some[ROWS * STRIDE];
    struct tissue t = tissue_of(0.03, 0.4, 0.02);
    t.scattering_a = 9.7;
    t.scattering_b = 1.4;
    for (size_t m = 0; m < MODELS; m++) {
        TEST_ASSERT_EQUAL_INT(STATUS_OK, quick_slopes(quick_model(m), &t, &chromophores,
                                                      QUICK_WANT_ALL, scratch, R, J));
        for (size_t p = 0; p < ROWS; p++) {
            for (size_t i = 0; i < ROWS * STRIDE; i++)
                some[i] = 77.0;
            TEST_ASSERT_EQUAL_INT(STATUS_OK,
                                  quick_slopes(quick_model(m), &t, &chromophores,
                                               QUICK_WANT((unsigned)p), scratch, R, some));
            for (size_t i = 0; i < ROWS * STRIDE; i++) {
                double expect = i / STRIDE != p ? 77.0 : i % STRIDE >= BANDS ? 0.0 : J[i];
                TEST_ASSERT_TRUE(some[i] == expect);
            }
        }
        for (size_t i = 0; i < STRIDE; i++)
            some[i] = R[i];
        TEST_ASSERT_EQUAL_INT(STATUS_OK,
                              quick_slopes(quick_model(m), &t, &chromophores, 0, scratch, R, NULL));
        TEST_ASSERT_EQUAL_MEMORY(some, R, sizeof R);
        for (size_t i = BANDS; i < STRIDE; i++)
            TEST_ASSERT_TRUE(R[i] == 0.0);
    }
}

/* Out of range: the plain ones to the last bit.  Refused: as model_slopes() does, untouched. */
static void test_out_of_range(void)
{
    struct tissue thin = tissue_of(0.03, 0.4, 0.02), glass = thin, bad = thin, none = thin;
    thin.epidermis_mm = 1e-4;
    none.epidermis_mm = 0.0;
    glass.eta = 3.84;
    const struct tissue *const skins[] = { &thin, &none, &glass };
    for (size_t k = 0; k < 3; k++) {
        TEST_ASSERT_EQUAL_INT(STATUS_OK, quick_slopes(quick_model(1), skins[k], &chromophores,
                                                      QUICK_WANT_ALL, scratch, R, J));
        TEST_ASSERT_EQUAL_INT(STATUS_OK, model_slopes(quick_model(1), skins[k], &chromophores,
                                                      scratch, plain_R, plain_J));
        TEST_ASSERT_EQUAL_MEMORY(plain_R, R, sizeof plain_R);
        for (size_t p = 0; p < ROWS; p++)
            TEST_ASSERT_EQUAL_MEMORY(plain_J + p * BANDS, J + p * STRIDE, BANDS * sizeof *J);
    }
    bad.Cm = 1.5;
    glass.eta = 3.9;
    R[0] = J[0] = 77.0;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, quick_slopes(quick_model(1), &bad, &chromophores,
                                                     QUICK_WANT_ALL, scratch, R, J));
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, quick_slopes(quick_model(0), &glass, &chromophores,
                                                     QUICK_WANT_ALL, scratch, R, J));
    TEST_ASSERT_EQUAL_INT(
        STATUS_UNSUPPORTED,
        quick_slopes(model_find("paper"), &none, &chromophores, QUICK_WANT_ALL, scratch, R, J));
    TEST_ASSERT_TRUE(R[0] == 77.0 && J[0] == 77.0);
}

/* (1 - (1+z) e^-z)/z^2, below 1/50 by its series: sum of (-z)^k (k+1)/(k+2)!. */
static long double mean_decay_fall(long double z)
{
    if (z > 0.02L)
        return (-expm1l(-z) / z - expl(-z)) / z;
    static const long double term[] = { 2.0L, -3.0L, 8.0L, -30.0L, 144.0L, -840.0L, 5760.0L };
    long double sum = 0.0L;
    for (size_t k = 7; k-- > 0;)
        sum = sum * z + 1.0L / term[k];
    return sum;
}

/* expect: the C library's, in long doubles.  Measured: 0.8, 0.8, 1.5 and 11 ulp. */
static void check_exponentials(bool fused)
{
    struct dice dice = { 44 };
    for (int k = 0; k < 100000; k++) {
        double x = dice_between(&dice, -700.0, 700.0), z = decades(&dice, 1e-20, 700.0);
        double expect = (double)expl((long double)x);
        TEST_ASSERT_DOUBLE_WITHIN(DBL_EPSILON * expect, expect, quick_exp(fused, x));
        struct quick_decay d = quick_decay_of(fused, z, 1.0 / z);
        double mean = (double)(-expm1l(-(long double)z) / (long double)z);
        TEST_ASSERT_DOUBLE_WITHIN(DBL_EPSILON * exp(-z) + 1e-300, (double)expl(-(long double)z),
                                  d.e);
        TEST_ASSERT_DOUBLE_WITHIN(4e-16 * mean, mean, d.mean);
        double fall = (double)mean_decay_fall((long double)z);
        TEST_ASSERT_DOUBLE_WITHIN(3e-15 * fall, fall, d.fall);
    }
    TEST_ASSERT_TRUE(quick_exp(fused, 0.0) == 1.0);
    double none = quick_not_zero(0.0);
    struct quick_decay d = quick_decay_of(fused, none, 1.0 / none);
    TEST_ASSERT_TRUE(d.e == 1.0 && d.mean == 1.0 && d.fall == 0.5);
}

static void test_exponentials(void)
{
    check_exponentials(false);
    check_exponentials(true);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_human_skin);
    RUN_TEST(test_accepted_skin);
    RUN_TEST(test_vectors_agree);
    RUN_TEST(test_wanted);
    RUN_TEST(test_out_of_range);
    RUN_TEST(test_exponentials);
    return UNITY_END();
}
