/* test_checks.c - the newest check of each tile and port counts. */
#include "station/checks.h"

#include <stdio.h>
#include <string.h>

#include "unity.h"

static struct checks checks;

void setUp(void)
{
}

void tearDown(void)
{
    checks_forget(&checks);
}

static void note(int64_t seq, const char *tile, double aperture_mm, bool passed)
{
    static struct store_check check;
    check.seq = seq;
    snprintf(check.tile, sizeof check.tile, "%s", tile);
    check.aperture_mm = aperture_mm;
    check.passed = passed;
    check.dE00 = 0.1 * (double)seq;
    check.limit_dE00 = 0.5;
    struct checked *checked = checked_make(&check);
    TEST_ASSERT_NOT_NULL(checked);
    checks_note(&checks, checked);
}

/* Checks one after the other, and what they say at the end of 8 mm and 3 mm: the seq that is
 * shown (0: none), and whether there is drift. */
static const struct history_case {
    const char *what;
    struct {
        int64_t seq;
        const char *tile;
        double aperture_mm;
        bool passed;
    } check[4];
    int64_t shown[2];
    bool drift[2];
} history_cases[] = {
    { "none", { { 0, NULL, 0.0, false } }, { 0, 0 }, { false, false } },
    { "one that passed", { { 1, "a", 8.0, true } }, { 1, 0 }, { false, false } },
    { "one that failed", { { 1, "a", 8.0, false } }, { 1, 0 }, { true, false } },
    { "then passed",
      { { 1, "a", 8.0, false }, { 2, "a", 8.0, true } },
      { 2, 0 },
      { false, false } },
    { "then failed", { { 1, "a", 8.0, true }, { 2, "a", 8.0, false } }, { 2, 0 }, { true, false } },
    { "another port passed",
      { { 1, "a", 8.0, false }, { 2, "a", 3.0, true } },
      { 1, 2 },
      { true, false } },
    { "another tile passed",
      { { 1, "a", 8.0, false }, { 2, "b", 8.0, true } },
      { 1, 0 },
      { true, false } },
    { "then the tile itself",
      { { 1, "a", 8.0, false }, { 2, "b", 8.0, true }, { 3, "a", 8.0, true } },
      { 3, 0 },
      { false, false } },
    { "two failed: the newer is shown",
      { { 1, "a", 8.0, false }, { 2, "b", 8.0, false } },
      { 2, 0 },
      { true, false } },
    { "read back later than a newer one was made",
      { { 5, "a", 8.0, true }, { 4, "a", 8.0, false } },
      { 5, 0 },
      { false, false } },
    { "the same twice",
      { { 5, "a", 8.0, false }, { 5, "a", 8.0, false } },
      { 5, 0 },
      { true, false } },
};

static void test_histories(void)
{
    static const double apertures[2] = { 8.0, 3.0 };
    for (size_t i = 0; i < sizeof history_cases / sizeof *history_cases; i++) {
        const struct history_case *c = &history_cases[i];
        checks_forget(&checks);
        for (size_t j = 0; j < 4 && c->check[j].tile != NULL; j++)
            note(c->check[j].seq, c->check[j].tile, c->check[j].aperture_mm, c->check[j].passed);
        for (size_t j = 0; j < 2; j++) {
            const struct checked *shown = checks_shown(&checks, apertures[j]);
            TEST_ASSERT_EQUAL_INT64_MESSAGE(c->shown[j], shown != NULL ? shown->seq : 0, c->what);
            TEST_ASSERT_EQUAL_INT_MESSAGE(c->drift[j], checks_drift(&checks, apertures[j]),
                                          c->what);
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_histories);
    return UNITY_END();
}
