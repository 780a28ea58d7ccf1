/* test_chance.c - numbers by chance: the stream, and that they are spread as they should be. */
#include "base/chance.h"

#include <math.h>

#include "unity.h"

void setUp(void)
{
}
void tearDown(void)
{
}

/* expect: the first three of splitmix64 from seed 1234567 as the test vectors of other
 * implementations have them (Rosetta Code, "Pseudo-random numbers/Splitmix64"). */
static void test_stream(void)
{
    static const uint64_t expected[] = { 6457827717110365317u, 3203168211198807973u,
                                         9817491932198370423u };
    uint64_t state = 1234567;
    for (size_t i = 0; i < 3; i++)
        TEST_ASSERT_EQUAL_DOUBLE(((double)(expected[i] >> 11) + 0.5) / 9007199254740992.0,
                                 chance_even(&state));
}

/* Mean and variance within five standard errors. */
static void test_spread(void)
{
    enum { N = 100000 };
    uint64_t state = 1;
    double sum = 0.0, square = 0.0, even = 0.0, log_sum = 0.0;
    for (size_t i = 0; i < N; i++) {
        double x = chance_normal(&state), y = chance_even(&state);
        double z = chance_decades(&state, 0.01, 1.0);
        TEST_ASSERT_TRUE(y > 0.0 && y < 1.0 && z > 0.01 && z < 1.0);
        sum += x;
        square += x * x;
        even += y;
        log_sum += log10(z);
    }
    TEST_ASSERT_DOUBLE_WITHIN(5.0 / sqrt(N), 0.0, sum / N);
    TEST_ASSERT_DOUBLE_WITHIN(5.0 * sqrt(2.0 / N), 1.0, square / N);
    TEST_ASSERT_DOUBLE_WITHIN(5.0 * sqrt(1.0 / 12.0 / N), 0.5, even / N);
    TEST_ASSERT_DOUBLE_WITHIN(5.0 * 2.0 * sqrt(1.0 / 12.0 / N), -1.0, log_sum / N);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_stream);
    RUN_TEST(test_spread);
    return UNITY_END();
}
