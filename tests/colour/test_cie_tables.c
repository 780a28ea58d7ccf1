/* test_cie_tables.c - names, and the tables against what the standards print. */
#include "colour/cie_tables.h"

#include <math.h>
#include <stddef.h>

#include "unity.h"

void setUp(void)
{
}
void tearDown(void)
{
}

/* Names as the header states them. */
static const struct illuminant_case {
    const char *text;
    enum illuminant expect;
} illuminant_cases[] = {
    { "A", ILLUMINANT_A },       { "C", ILLUMINANT_C },           { "D50", ILLUMINANT_D50 },
    { "D55", ILLUMINANT_D55 },   { "D65", ILLUMINANT_D65 },       { "D75", ILLUMINANT_D75 },
    { "E", ILLUMINANT_E },       { "FL2", ILLUMINANT_FL2 },       { "FL7", ILLUMINANT_FL7 },
    { "FL11", ILLUMINANT_FL11 }, { "LED-B3", ILLUMINANT_LED_B3 },
};

static void test_illuminant_names(void)
{
    TEST_ASSERT_EQUAL_UINT(ILLUMINANT_COUNT, sizeof illuminant_cases / sizeof *illuminant_cases);
    for (size_t i = 0; i < sizeof illuminant_cases / sizeof *illuminant_cases; i++) {
        const struct illuminant_case *c = &illuminant_cases[i];
        enum illuminant got = ILLUMINANT_COUNT;
        TEST_ASSERT_EQUAL_STRING(c->text, illuminant_name(c->expect));
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, illuminant_parse(c->text, &got), c->text);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->expect, got, c->text);
    }
    TEST_ASSERT_EQUAL_STRING("unknown", illuminant_name(ILLUMINANT_COUNT));
    TEST_ASSERT_EQUAL_STRING("unknown", illuminant_name((enum illuminant)(-1)));
}

static void test_observer_names(void)
{
    enum observer got = OBSERVER_COUNT;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, observer_parse("2", &got));
    TEST_ASSERT_EQUAL_INT(OBSERVER_2DEG, got);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, observer_parse("10", &got));
    TEST_ASSERT_EQUAL_INT(OBSERVER_10DEG, got);
    TEST_ASSERT_EQUAL_STRING("2", observer_name(OBSERVER_2DEG));
    TEST_ASSERT_EQUAL_STRING("10", observer_name(OBSERVER_10DEG));
    TEST_ASSERT_EQUAL_STRING("unknown", observer_name(OBSERVER_COUNT));
}

static void test_names_parse_in_either_case(void)
{
    enum illuminant got = ILLUMINANT_COUNT;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, illuminant_parse("d65", &got));
    TEST_ASSERT_EQUAL_INT(ILLUMINANT_D65, got);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, illuminant_parse("Led-b3", &got));
    TEST_ASSERT_EQUAL_INT(ILLUMINANT_LED_B3, got);
}

/* Near misses; the output stays untouched. */
static void test_other_names_are_not_found(void)
{
    static const char *const wrong[] = { "",   "D",   "D6",   "D650",  " D65", "D65 ",   "F11",
                                         "FL", "FL1", "FL12", "LEDB3", "[",    "D6\x15", "d65\n" };
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        enum illuminant illuminant = ILLUMINANT_FL7;
        enum observer observer = OBSERVER_10DEG;
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_NOT_FOUND, illuminant_parse(wrong[i], &illuminant),
                                      wrong[i]);
        TEST_ASSERT_EQUAL_INT_MESSAGE(ILLUMINANT_FL7, illuminant, wrong[i]);
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_NOT_FOUND, observer_parse(wrong[i], &observer),
                                      wrong[i]);
        TEST_ASSERT_EQUAL_INT_MESSAGE(OBSERVER_10DEG, observer, wrong[i]);
    }
}

/* Sums that CIE 15:2004 prints below Tables T.4 and T.5: 380..780 nm by 5. */
static void test_observers_add_up_as_printed(void)
{
    static const double printed[OBSERVER_COUNT][3] = {
        [OBSERVER_2DEG] = { 21.371524, 21.371327, 21.371540 },
        [OBSERVER_10DEG] = { 23.329353, 23.332036, 23.334153 },
    };
    for (int o = 0; o < OBSERVER_COUNT; o++) {
        double sum[3] = { 0.0, 0.0, 0.0 };
        for (int nm = 380; nm <= 780; nm += 5)
            for (int k = 0; k < 3; k++)
                sum[k] += cie_cmf[o][nm - CIE_CMF_FIRST_NM][k];
        for (int k = 0; k < 3; k++)
            TEST_ASSERT_DOUBLE_WITHIN(2e-6, printed[o][k], sum[k]);
    }
}

/* A is defined by Planck's law: CIE 15, with c2 = 1.435e7 nm K and
 * 2848 K.  The table has six significant digits. */
static void test_illuminant_A_is_planckian(void)
{
    for (int nm = 360; nm <= 780; nm += 5) {
        double got = cie_illuminant[(nm - 360) / 5][ILLUMINANT_A];
        double expect = 100.0 * pow(560.0 / nm, 5.0) * expm1(1.435e7 / (2848.0 * 560.0)) /
                        expm1(1.435e7 / (2848.0 * nm));
        TEST_ASSERT_DOUBLE_WITHIN(5e-6 * expect, expect, got);
    }
}

/* CIE 15 scales the daylights to 100 at 560 nm; E is 100 by definition. */
static void test_daylights_are_100_at_560(void)
{
    static const enum illuminant scaled[] = { ILLUMINANT_D50, ILLUMINANT_D55, ILLUMINANT_D65,
                                              ILLUMINANT_D75, ILLUMINANT_E };
    for (size_t i = 0; i < sizeof scaled / sizeof *scaled; i++)
        TEST_ASSERT_EQUAL_DOUBLE(100.0, cie_illuminant[(560 - 360) / 5][scaled[i]]);
}

static int first_published(int illuminant)
{
    return illuminant >= ILLUMINANT_FL2 ? 380 : 360;
}

static void test_zero_where_not_published(void)
{
    for (int il = 0; il < ILLUMINANT_COUNT; il++) {
        for (int nm = 360; nm < first_published(il); nm += 5)
            TEST_ASSERT_EQUAL_DOUBLE(0.0, cie_illuminant[(nm - 360) / 5][il]);
        for (int nm = 785; nm <= 830; nm += 5)
            TEST_ASSERT_EQUAL_DOUBLE(il == ILLUMINANT_E ? 100.0 : 0.0,
                                     cie_illuminant[(nm - 360) / 5][il]);
    }
}

/* Rows read off the given ASTM E2022 tables, to see that nothing has slipped. */
static const struct weight_case {
    const char *what;
    enum illuminant illuminant;
    enum observer observer;
    int nm;
    double X, Y, Z;
} weight_cases[] = {
    { "C, 10", ILLUMINANT_C, OBSERVER_10DEG, 360, -0.000003, 0.0, -0.000015 },
    { "D65, 10", ILLUMINANT_D65, OBSERVER_10DEG, 550, 4.732429, 8.854550, 0.034538 },
    { "C, 2: first", ILLUMINANT_C, OBSERVER_2DEG, 360, 0.000047, 0.000001, 0.000217 },
    { "D50, 10: last", ILLUMINANT_D50, OBSERVER_10DEG, 780, 0.000109, 0.000043, 0.0 },
    { "FL2, 10: last", ILLUMINANT_FL2, OBSERVER_10DEG, 780, 0.000003, 0.000001, 0.0 },
    { "FL11, 2: first", ILLUMINANT_FL11, OBSERVER_2DEG, 360, 0.000034, 0.000001, 0.000160 },
};

static void test_given_weights_are_transcribed(void)
{
    for (size_t i = 0; i < sizeof weight_cases / sizeof *weight_cases; i++) {
        const struct weight_case *c = &weight_cases[i];
        const double *w = cie_weights_10nm[c->illuminant][c->observer][(c->nm - 360) / 10];
        TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(c->X, w[0], c->what);
        TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(c->Y, w[1], c->what);
        TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(c->Z, w[2], c->what);
    }
}

/* CIE 15: illuminant A is Planck's law, here in its own algebra. */
static double planck(double nm)
{
    return 1.0 / (pow(nm / 560.0, 5.0) * (exp(1.435e7 / 2848.0 / nm) - 1.0));
}

/* The illuminant as E2022's tables have it: straight lines, held below 380; A by
 * Planck's law. */
static double power_1nm(int illuminant, int nm)
{
    int i, past;
    if (illuminant == ILLUMINANT_A)
        return planck(nm);
    if (nm < first_published(illuminant))
        nm = first_published(illuminant);
    i = (nm - 360) / 5;
    past = (nm - 360) % 5;
    return past == 0 ? cie_illuminant[i][illuminant]
                     : (cie_illuminant[i][illuminant] * (5 - past) +
                        cie_illuminant[i + 1][illuminant] * past) /
                           5.0;
}

/* Weights for A made with straight lines between 5 nm points (six
 * decimals, an independent table): near, though Planck's law by 1 nm is better. */
static void test_weights_of_A_are_near_those_from_5nm_points(void)
{
    const double *w = cie_weights_10nm[ILLUMINANT_A][OBSERVER_2DEG][(550 - 360) / 10];
    TEST_ASSERT_DOUBLE_WITHIN(0.002, 3.734887, w[0]);
    TEST_ASSERT_DOUBLE_WITHIN(0.002, 8.570858, w[1]);
    TEST_ASSERT_DOUBLE_WITHIN(0.002, 0.075433, w[2]);
}

/* Property: Lagrange interpolation is exact for a parabola, so on R = (t, t^2, 1),
 * t = (nm - 360)/420, the 43 weights must equal the sum over 421 nm.  All tables,
 * given and computed alike; tolerance: 43 weights, each rounded by 5e-7. */
static void test_weights_are_exact_for_parabolas(void)
{
    for (int il = 0; il < ILLUMINANT_COUNT; il++) {
        for (int o = 0; o < OBSERVER_COUNT; o++) {
            double fine[3][3] = { { 0.0 } }, coarse[3][3] = { { 0.0 } };
            for (int nm = 360; nm <= 780; nm++) {
                double t = (nm - 360) / 420.0, power[3] = { 1.0, t, t * t };
                for (int p = 0; p < 3; p++)
                    for (int k = 0; k < 3; k++)
                        fine[p][k] += power[p] * power_1nm(il, nm) * cie_cmf[o][nm - 360][k];
            }
            for (int i = 0; i < CIE_WEIGHTS_N; i++) {
                double t = i / 42.0, power[3] = { 1.0, t, t * t };
                for (int p = 0; p < 3; p++)
                    for (int k = 0; k < 3; k++)
                        coarse[p][k] += power[p] * cie_weights_10nm[il][o][i][k];
            }
            for (int p = 0; p < 3; p++)
                for (int k = 0; k < 3; k++)
                    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(43 * 5e-7, fine[p][k] * 100.0 / fine[0][1],
                                                      coarse[p][k],
                                                      illuminant_name((enum illuminant)il));
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_illuminant_names);
    RUN_TEST(test_observer_names);
    RUN_TEST(test_names_parse_in_either_case);
    RUN_TEST(test_other_names_are_not_found);
    RUN_TEST(test_observers_add_up_as_printed);
    RUN_TEST(test_illuminant_A_is_planckian);
    RUN_TEST(test_daylights_are_100_at_560);
    RUN_TEST(test_zero_where_not_published);
    RUN_TEST(test_given_weights_are_transcribed);
    RUN_TEST(test_weights_of_A_are_near_those_from_5nm_points);
    RUN_TEST(test_weights_are_exact_for_parabolas);
    return UNITY_END();
}
