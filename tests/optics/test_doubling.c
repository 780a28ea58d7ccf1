/* test_doubling.c - transport's modes against adding and doubling with the same directions. */
#include <math.h>

#include "optics/transport.h"
#include "tests/support/dice.h"
#include "tests/support/doubling.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

/* A skin's two layers, band by band as coefficients by chance. */
static void compare(int streams, unsigned cases, double tolerance)
{
    struct dice dice = { 8 };
    double worst = 0.0;
    for (unsigned i = 0; i < cases; i++) {
        double sa1 = pow(10.0, dice_between(&dice, -2.0, 1.3));
        double sa2 = pow(10.0, dice_between(&dice, -2.0, 1.3));
        double ss1 = dice_between(&dice, 1.0, 8.0), ss2 = dice_between(&dice, 0.5, 8.0);
        double d = dice_between(&dice, 0.02, 0.15), eta = dice_between(&dice, 1.2, 1.6), R;
        struct medium m = { 1, d, eta, &sa1, &sa2, &ss1, &ss2 };
        struct streams s;
        TEST_ASSERT_EQUAL_INT(STATUS_OK, streams_init(streams, eta, &s));
        TEST_ASSERT_EQUAL_INT(STATUS_OK, transport_reflectance(streams, &m, &R));
        double twin = doubling_two_layers(&s, ss1 / (sa1 + ss1), (sa1 + ss1) * d, ss2 / (sa2 + ss2),
                                          1.0 / 256.0);
        worst = fmax(worst, fabs(R - twin));
    }
    TEST_ASSERT_DOUBLE_WITHIN(tolerance, 0.0, worst);
}

/* expect: adding and doubling, another way to solve the same equations; 1/256 of the grazing cosine
 * leaves about 1e-6 of it. */
static void test_eight_streams(void)
{
    compare(8, 200, 2e-6);
}

static void test_four_and_sixteen(void)
{
    compare(4, 200, 2e-6);
    compare(16, 40, 2e-6);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_eight_streams);
    RUN_TEST(test_four_and_sixteen);
    return UNITY_END();
}
