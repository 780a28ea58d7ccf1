/* test_opaque.c - the bound against the whole two-layer model, and the epidermis alone. */
#include "optics/opaque.h"

#include <math.h>
#include <stdio.h>

#include "optics/dipole.h"
#include "optics/two_layer.h"
#include "tests/support/dice.h"
#include "tests/support/legal_skin.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

struct one {
    double sa1, sa2, ss1, ss2;
    struct medium m;
};

static struct medium *medium_of(struct one *o, struct skin s)
{
    o->sa1 = s.sigma_a1;
    o->sa2 = s.sigma_a2;
    o->ss1 = s.sigma_s1;
    o->ss2 = s.sigma_s2;
    o->m = (struct medium){ 1, s.d_mm, s.eta, &o->sa1, &o->sa2, &o->ss1, &o->ss2 };
    return &o->m;
}

/* Coefficients of skin and beyond, decade by decade; any dermis. */
static struct skin some_skin(struct dice *dice)
{
    return (struct skin){ dice_decades(dice, -2, 3), dice_decades(dice, -1, 3),
                          dice_decades(dice, -4, 4), dice_decades(dice, -3, 4),
                          dice_decades(dice, -3, 0), dice_between(dice, 1.0, 1.6) };
}

/* expect: |R - R1| of the full model, whose reference shares no code with it
 * (tests/optics/test_two_layer.c); 1e-15: R's own rounding. */
static void test_bound_holds(void)
{
    struct dice dice = { 61 };
    size_t opaque = 0;
    for (int k = 0; k < 200000; k++) {
        struct one o;
        struct medium *m = medium_of(&o, k % 4 == 0 ? legal_skin(&dice) : some_skin(&dice));
        double R, R1, most;
        if (two_layer_reflectance(m, &R) != STATUS_OK)
            continue;
        TEST_ASSERT_EQUAL_INT(STATUS_OK, opaque_reflectance(m, &R1));
        TEST_ASSERT_EQUAL_INT(STATUS_OK, opaque_bound(m, &most));
        TEST_ASSERT_FALSE(isnan(most));
        if (!(fabs(R - R1) <= most + 1e-15)) {
            char text[200];
            skin_describe(text, sizeof text,
                          (struct skin){ o.sa1, o.ss1, o.sa2, o.ss2, m->epidermis_mm, m->eta });
            TEST_FAIL_MESSAGE(text);
        }
        opaque += most < 0.01 ? 1u : 0u;
    }
    TEST_ASSERT_GREATER_THAN(20000, opaque); /* it is not always a large number */
}

/* It is of use: never more than 100 times what the worst dermis (a white or a black one) does,
 * where that is more than rounding.  Measured: 65. */
static void test_bound_is_near(void)
{
    struct dice dice = { 62 };
    double worst = 0.0;
    for (int k = 0; k < 20000; k++) {
        struct one o;
        struct skin s = some_skin(&dice);
        struct medium *m = medium_of(&o, s);
        double R1, R, most, off = 0.0;
        TEST_ASSERT_EQUAL_INT(STATUS_OK, opaque_bound(m, &most));
        if (most > 0.1)
            continue;
        TEST_ASSERT_EQUAL_INT(STATUS_OK, opaque_reflectance(m, &R1));
        for (int white = 0; white < 2; white++) {
            o.sa2 = white ? 1e-9 : 1e9;
            TEST_ASSERT_EQUAL_INT(STATUS_OK, two_layer_reflectance(m, &R));
            off = fmax(off, fabs(R - R1));
        }
        if (off > 1e-12)
            worst = fmax(worst, most / off);
    }
    TEST_ASSERT_TRUE(worst >= 1.0);
    char text[64];
    snprintf(text, sizeof text, "%g times", worst);
    TEST_ASSERT_TRUE_MESSAGE(worst < 100.0, text);
}

/* expect: the two-layer model with a dermis like its epidermis. */
static void test_epidermis_without_end(void)
{
    struct dice dice = { 63 };
    for (int k = 0; k < 20000; k++) {
        struct one o;
        struct skin s = some_skin(&dice);
        s.sigma_a2 = s.sigma_a1;
        s.sigma_s2 = s.sigma_s1;
        struct medium *m = medium_of(&o, s);
        double R, R1;
        TEST_ASSERT_EQUAL_INT(STATUS_OK, opaque_reflectance(m, &R1));
        TEST_ASSERT_EQUAL_INT(STATUS_OK, two_layer_reflectance(m, &R));
        TEST_ASSERT_DOUBLE_WITHIN(1e-12 * R, R, R1);
    }
}

/* expect: differences over a step; and the slopes of R of lengths that scale out, optics/slopes.h.
 */
static void test_slopes(void)
{
    struct dice dice = { 64 };
    for (int k = 0; k < 2000; k++) {
        struct one o;
        struct medium *m = medium_of(&o, some_skin(&dice));
        double R, rows[5], h = 1e-5 * o.sa1, up, down, sum;
        struct slopes dR = slopes_in(rows, 1);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, opaque_slopes(m, &R, &dR));
        sum = o.sa1 * rows[0] + o.ss1 * rows[2];
        TEST_ASSERT_DOUBLE_WITHIN(1e-13 * fabs(o.sa1 * rows[0]), 0.0, sum);
        TEST_ASSERT_TRUE(rows[1] == 0.0 && rows[3] == 0.0 && rows[4] == 0.0);
        o.sa1 += h;
        TEST_ASSERT_EQUAL_INT(STATUS_OK, opaque_reflectance(m, &up));
        o.sa1 -= 2.0 * h;
        TEST_ASSERT_EQUAL_INT(STATUS_OK, opaque_reflectance(m, &down));
        TEST_ASSERT_DOUBLE_WITHIN(1e-6 * fabs(rows[0]), (up - down) / (2.0 * h), rows[0]);
    }
}

/* Over a range of skins none exceeds what the lightest may do. */
static void test_range_of_skins(void)
{
    struct dice dice = { 65 };
    enum { BANDS = 31 };
    static double scratch[MEDIUM_SCRATCH(BANDS)];
    struct chromophores c;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, chromophores_init(400.0, 10.0, BANDS, &c));
    for (int k = 0; k < 300; k++) {
        struct tissue lightest =
            tissue_of(dice_between(&dice, 0.02, 0.5), dice_between(&dice, 0.0, 0.9), 0.02);
        double Bm_hi = dice_between(&dice, lightest.Bm, 1.0), most;
        lightest.epidermis_mm = dice_between(&dice, 0.05, 0.5);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, opaque_most(&lightest, Bm_hi, 400.0, 10.0, BANDS, &most));
        for (int j = 0; j < 10; j++) {
            struct tissue t = lightest;
            struct medium m;
            double R[BANDS], R1[BANDS], sum = 0.0;
            t.Cm = dice_between(&dice, t.Cm, 0.5);
            t.Bm = dice_between(&dice, t.Bm, Bm_hi);
            t.Ch = dice_between(&dice, 0.001, 0.1);
            TEST_ASSERT_EQUAL_INT(STATUS_OK, tissue_medium(&t, &c, scratch, &m));
            TEST_ASSERT_EQUAL_INT(STATUS_OK, two_layer_reflectance(&m, R));
            TEST_ASSERT_EQUAL_INT(STATUS_OK, opaque_reflectance(&m, R1));
            for (size_t i = 0; i < BANDS; i++)
                sum += (R[i] - R1[i]) * (R[i] - R1[i]);
            TEST_ASSERT_TRUE(sqrt(sum / BANDS) <= most);
        }
    }
}

static void test_refused(void)
{
    struct one o;
    double R = 7.0, most = 7.0;
    struct skin s = { 1.0, 1.0, 1.0, 1.0, 0.1, 4.0 };
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, opaque_reflectance(medium_of(&o, s), &R));
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, opaque_bound(medium_of(&o, s), &most));
    s.eta = 1.4;
    s.sigma_s1 = 0.0;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, opaque_reflectance(medium_of(&o, s), &R));
    TEST_ASSERT_TRUE(R == 7.0 && most == 7.0);
    s.sigma_s1 = 1.0;
    s.sigma_a1 = 0.0; /* clear: the dermis may be all there is */
    TEST_ASSERT_EQUAL_INT(STATUS_OK, opaque_bound(medium_of(&o, s), &most));
    TEST_ASSERT_TRUE(isinf(most));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_bound_holds);
    RUN_TEST(test_bound_is_near);
    RUN_TEST(test_epidermis_without_end);
    RUN_TEST(test_slopes);
    RUN_TEST(test_range_of_skins);
    RUN_TEST(test_refused);
    return UNITY_END();
}
