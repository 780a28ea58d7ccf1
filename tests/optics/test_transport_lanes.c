/* test_transport_lanes.c - eight bands side by side against 220-digit solutions of the same
 * equations, against the plain model, and against themselves in other places. */
#include "optics/transport_lanes.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "optics/chromophores.h"
#include "optics/transport.h"
#include "tests/support/dice.h"
#include "tests/support/figures.h"
#include "tests/support/legal_skin.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

enum { LANES = VECTORS_LANES, BANDS = 31, MOST = TRANSPORT_LANES_STREAMS_MAX };

/* What is promised of R against the plain model. */
static double promised(double R)
{
    return fmax(1e-12 * R, 2e-15);
}

/* The skins s[LANES], of one thickness and index, into R; the bands that are not within. */
static unsigned solve(const struct transport_lanes *t, const struct skin *s, double *R)
{
    double top[TRANSPORT_LANES_EPIDERMIS(MOST)], under[TRANSPORT_LANES_DERMIS(MOST)];
    double a1[LANES], s1[LANES], a2[LANES], s2[LANES];
    for (size_t l = 0; l < LANES; l++) {
        a1[l] = s[l].sigma_a1;
        s1[l] = s[l].sigma_s1;
        a2[l] = s[l].sigma_a2;
        s2[l] = s[l].sigma_s2;
    }
    unsigned beyond = transport_lanes_epidermis(t, a1, s1, s[0].d_mm, top);
    beyond |= transport_lanes_dermis(t, a2, s2, under);
    transport_lanes_join(t, top, under, R);
    return beyond;
}

enum { BY_SIGMA_A1, BY_SIGMA_S1, BY_SIGMA_A2, BY_SIGMA_S2, BY_D, SLOPES };

/* The slopes of LANES skins, to each its own. */
static void solve_slopes(const struct transport_lanes *t, const struct skin *s, double *R,
                         double (*by)[LANES])
{
    double a1[LANES], s1[LANES], a2[LANES], s2[LANES];
    struct medium m = { LANES, s[0].d_mm, s[0].eta, a1, a2, s1, s2 };
    struct slopes dR = { .sigma_a_epidermis = by[BY_SIGMA_A1],
                         .sigma_a_dermis = by[BY_SIGMA_A2],
                         .sigma_s_prime_epidermis = by[BY_SIGMA_S1],
                         .sigma_s_prime_dermis = by[BY_SIGMA_S2],
                         .epidermis_mm = by[BY_D] };
    for (size_t l = 0; l < LANES; l++) {
        a1[l] = s[l].sigma_a1;
        s1[l] = s[l].sigma_s1;
        a2[l] = s[l].sigma_a2;
        s2[l] = s[l].sigma_s2;
    }
    TEST_ASSERT_EQUAL_INT(STATUS_OK, transport_lanes_slopes(t, &m, R, &dR));
}

/* What is promised of the slopes. */
static void assert_slopes(struct skin s, double R, const double expect[SLOPES], double (*by)[LANES],
                          size_t lane)
{
    const double size[SLOPES] = { s.sigma_a1 + s.sigma_s1, s.sigma_a1 + s.sigma_s1,
                                  s.sigma_a2 + s.sigma_s2, s.sigma_a2 + s.sigma_s2, s.d_mm };
    for (int k = 0; k < SLOPES; k++) {
        char what[256], skin[160];
        double most = 1e-11 * fmax(fabs(expect[k]), fmax(R, 0.002) / size[k]);
        skin_describe(skin, sizeof skin, s);
        snprintf(what, sizeof what, "slope %d, %s: %.3g of %.3g", k, skin, by[k][lane] - expect[k],
                 expect[k]);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(most, expect[k], by[k][lane], what);
    }
}

static double plain_slopes(int streams, struct skin s, double by[SLOPES])
{
    double R = NAN;
    struct medium m = { 1, s.d_mm, s.eta, &s.sigma_a1, &s.sigma_a2, &s.sigma_s1, &s.sigma_s2 };
    struct slopes dR = { .sigma_a_epidermis = &by[BY_SIGMA_A1],
                         .sigma_a_dermis = &by[BY_SIGMA_A2],
                         .sigma_s_prime_epidermis = &by[BY_SIGMA_S1],
                         .sigma_s_prime_dermis = &by[BY_SIGMA_S2],
                         .epidermis_mm = &by[BY_D] };
    TEST_ASSERT_EQUAL_INT(STATUS_OK, transport_slopes(streams, &m, &R, &dR));
    return R;
}

/* expect: tests/reference/transport_exact.csv, as test_transport.c has it; its rows within range.
 */
static void test_exact(void)
{
    struct figures f;
    size_t looked_at = 0;
    TEST_ASSERT_TRUE(figures_read("tests/reference/transport_exact.csv", &f));
    TEST_ASSERT_EQUAL_STRING("R", f.name[7]);
    for (size_t i = 0; i < f.rows; i++) {
        struct transport_lanes t;
        struct skin s[LANES];
        double R[LANES], expect = figures_at(&f, i, 7);
        char what[96];
        if (transport_lanes_init((int)figures_at(&f, i, 0), figures_at(&f, i, 6), &t) != STATUS_OK)
            continue;
        for (size_t l = 0; l < LANES; l++)
            s[l] =
                (struct skin){ figures_at(&f, i, 1), figures_at(&f, i, 2), figures_at(&f, i, 3),
                               figures_at(&f, i, 4), figures_at(&f, i, 5), figures_at(&f, i, 6) };
        if (solve(&t, s, R) != 0)
            continue;
        snprintf(what, sizeof what, "transport_exact.csv, row %zu: %.3g off", i + 1,
                 R[0] / expect - 1.0);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(promised(expect), expect, R[0], what);
        double R_too[LANES], by[SLOPES][LANES], slope[SLOPES];
        for (size_t k = 0; k < SLOPES; k++)
            slope[k] = figures_at(&f, i, 8 + k);
        solve_slopes(&t, s, R_too, by);
        TEST_ASSERT_EQUAL_MEMORY(R, R_too, sizeof R);
        assert_slopes(s[0], expect, slope, by, LANES - 1);
        looked_at++;
    }
    TEST_ASSERT_GREATER_THAN(60, looked_at);
    figures_done(&f);
}

/* ---- against the plain model -------------------------------------------------------- */

static const struct run {
    int streams;
    double eta, tolerance; /* relative */
    size_t skins;
} runs[] = {
    { 4, 1.4, 1e-13, 100 }, { 8, 1.4, 1.5e-13, 323 }, { 8, 1.33, 1.5e-13, 50 },
    { 12, 1.5, 1e-12, 50 }, { 16, 1.4, 1e-12, 30 },   { 32, 1.4, 1e-12, 6 },
};

/* Property: the plain model's R; 323 skins of 31 bands are 10 013 for transport-8. */
static void test_skins(void)
{
    static struct chromophores c;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, chromophores_init(400.0, 10.0, BANDS, &c));
    for (size_t k = 0; k < sizeof runs / sizeof *runs; k++) {
        struct dice dice = { 8 + k };
        struct transport_lanes t;
        double worst = 0.0, scratch[MEDIUM_SCRATCH(BANDS)], R[BANDS], expect[BANDS];
        char text[96];
        TEST_ASSERT_EQUAL_INT(STATUS_OK, transport_lanes_init(runs[k].streams, runs[k].eta, &t));
        for (size_t i = 0; i < runs[k].skins; i++) {
            struct medium m;
            struct tissue skin =
                tissue_of(dice_decades(&dice, -3.0, 0.0), dice_between(&dice, 0.0, 1.0),
                          dice_decades(&dice, -4.0, 0.0));
            skin.epidermis_mm = dice_decades(&dice, -2.0, 0.0);
            skin.eta = runs[k].eta;
            TEST_ASSERT_EQUAL_INT(STATUS_OK, tissue_medium(&skin, &c, scratch, &m));
            TEST_ASSERT_EQUAL_INT(STATUS_OK, transport_lanes_reflectance(&t, &m, R));
            TEST_ASSERT_EQUAL_INT(STATUS_OK, transport_reflectance(runs[k].streams, &m, expect));
            for (size_t b = 0; b < BANDS; b++)
                worst = fmax(worst, fabs(R[b] / expect[b] - 1.0));
        }
        snprintf(text, sizeof text, "%d streams: %.2g", runs[k].streams, worst);
        TEST_ASSERT_TRUE_MESSAGE(worst <= runs[k].tolerance, text);
    }
}

/* Layers as far out as the header goes: the least albedo and the least absorption, the thinnest and
 * one through which nothing comes; with every eta. */
static void test_edges(void)
{
    const double albedo[] = { 0x1p-10, 0.01, 0.5, 0.99, 1.0 - 0x1p-14 };
    const double tau[] = { 0x1p-5, 0.1, 1.0, 30.0, 3000.0 };
    const double eta[] = { 0.35, 0.8, 1.0, 1.01, 1.1, 1.4, 2.0, 3.0 };
    enum { EACH = 5, PAIRS = 25 };
    for (int streams = 4; streams <= 16; streams *= 2)
        for (size_t e = 0; e < sizeof eta / sizeof *eta; e++)
            for (size_t k = 0; k < PAIRS; k++) {
                struct transport_lanes t;
                struct skin s[LANES];
                double R[LANES], by[SLOPES][LANES], a1 = albedo[k % EACH];
                TEST_ASSERT_EQUAL_INT(STATUS_OK, transport_lanes_init(streams, eta[e], &t));
                for (size_t l = 0; l < LANES; l++) {
                    double a2 = albedo[l % EACH];
                    s[l] =
                        (struct skin){ 1e3 * (1.0 - a1),     1e3 * a1, 1e3 * (1.0 - a2), 1e3 * a2,
                                       1e-3 * tau[k / EACH], eta[e] };
                }
                TEST_ASSERT_EQUAL_UINT(0, solve(&t, s, R));
                solve_slopes(&t, s, R, by);
                for (size_t l = 0; l < EACH; l++) {
                    char what[256], skin[160];
                    double slope[SLOPES], expect = plain_slopes(streams, s[l], slope);
                    assert_slopes(s[l], expect, slope, by, l);
                    skin_describe(skin, sizeof skin, s[l]);
                    snprintf(what, sizeof what, "%d, %s: %.3g of %.3g", streams, skin,
                             R[l] - expect, expect);
                    TEST_ASSERT_TRUE_MESSAGE(fabs(R[l] - expect) <= promised(expect), what);
                }
            }
}

/* ---- against itself ----------------------------------------------------------------- */

static void eight_skins(struct dice *dice, struct skin *s)
{
    for (size_t l = 0; l < LANES; l++)
        s[l] = (struct skin){ dice_decades(dice, -1.0, 2.0),
                              dice_decades(dice, 0.0, 1.0),
                              dice_decades(dice, -1.5, 1.0),
                              dice_decades(dice, 0.0, 1.0),
                              0.1,
                              1.4 };
}

/* Property: the same bits at any place beside any others and with AVX2 and AVX-512; without, within
 * 1e-13. */
static void test_same_bits(void)
{
    struct dice dice = { 512 };
    struct transport_lanes t;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, transport_lanes_init(8, 1.4, &t));
    for (int i = 0; i < 100; i++) {
        struct skin s[LANES], turned[LANES];
        double R[LANES], other[LANES], by_s[SLOPES][LANES], slope[SLOPES][LANES];
        eight_skins(&dice, s);
        TEST_ASSERT_EQUAL_UINT(0, solve(&t, s, R));
        solve_slopes(&t, s, R, by_s);
        for (enum vectors v = VECTORS_PLAIN; v < VECTORS_KINDS; v++) {
            struct transport_lanes by = t;
            by.vectors = v;
            if (!vectors_has(v))
                continue;
            TEST_ASSERT_EQUAL_UINT(0, solve(&by, s, other));
            bool same = v != VECTORS_PLAIN && t.vectors != VECTORS_PLAIN;
            for (size_t l = 0; l < LANES; l++)
                TEST_ASSERT_DOUBLE_WITHIN(same ? 0.0 : 1e-13, R[l], other[l]);
            solve_slopes(&by, s, other, slope);
            for (size_t k = 0; k < SLOPES; k++)
                for (size_t l = 0; l < LANES; l++)
                    TEST_ASSERT_DOUBLE_WITHIN(same ? 0.0 : 1e-12, by_s[k][l], slope[k][l]);
        }
        eight_skins(&dice, turned);
        for (size_t l = 0; l < LANES; l += 2)
            turned[LANES - 1 - l] = s[l];
        TEST_ASSERT_EQUAL_UINT(0, solve(&t, turned, other));
        for (size_t l = 0; l < LANES; l += 2)
            TEST_ASSERT_EQUAL_MEMORY(&R[l], &other[LANES - 1 - l], sizeof *R);
    }
}

/* ---- ranges ------------------------------------------------------------------------- */

/* Bands that are not within are the plain model's to the last bit, the others as ever. */
static void test_bands_beyond(void)
{
    enum { N = 11 };
    double a1[N], s1[N], a2[N], s2[N], whole[N], R[N], expect[N];
    struct transport_lanes t;
    struct medium m = { N, 0.1, 1.4, a1, a2, s1, s2 };
    for (size_t i = 0; i < N; i++) {
        a1[i] = 1.0 + (double)i;
        a2[i] = 0.1 * (double)(i + 1);
        s1[i] = 5.0;
        s2[i] = 2.5;
    }
    TEST_ASSERT_EQUAL_INT(STATUS_OK, transport_lanes_init(8, 1.4, &t));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, transport_lanes_reflectance(&t, &m, whole));
    a2[0] = 0.0;          /* nothing absorbs */
    a1[3] = 1e6;          /* nothing scatters that counts */
    s1[5] = a1[5] = 0.01; /* thin */
    a1[10] = 1e-5;        /* next to nothing absorbs */
    TEST_ASSERT_EQUAL_INT(STATUS_OK, transport_lanes_reflectance(&t, &m, R));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, transport_reflectance(8, &m, expect));
    for (size_t i = 0; i < N; i++) {
        bool beyond = i == 0 || i == 3 || i == 5 || i == 10;
        TEST_ASSERT_EQUAL_MEMORY(beyond ? &expect[i] : &whole[i], &R[i], sizeof *R);
        TEST_ASSERT_TRUE(beyond == (R[i] != whole[i]));
    }
    enum { ALL = 55 };
    double ours[ALL], theirs[ALL];
    const struct slopes dR = slopes_in(ours, N), dR_plain = slopes_in(theirs, N);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, transport_lanes_slopes(&t, &m, whole, &dR));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, transport_slopes(8, &m, expect, &dR_plain));
    TEST_ASSERT_EQUAL_MEMORY(R, whole, sizeof R);
    for (size_t k = 0; k < ALL; k++)
        if (k % N == 0 || k % N == 3 || k % N == 5 || k % N == 10)
            TEST_ASSERT_EQUAL_MEMORY(&theirs[k], &ours[k], sizeof *ours);
    m.epidermis_mm = 0.0;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, transport_lanes_reflectance(&t, &m, R));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, transport_reflectance(8, &m, expect));
    TEST_ASSERT_EQUAL_MEMORY(expect, R, sizeof R);
}

/* What the plain model refuses is refused, and nothing written. */
static void test_refused(void)
{
    struct transport_lanes t, before;
    double a1[2] = { 1.0, NAN }, good[2] = { 1.0, 1.0 }, R[2] = { 7.0, 7.0 };
    struct medium m = { 2, 0.1, 1.4, a1, good, good, good };
    TEST_ASSERT_EQUAL_INT(STATUS_OK, transport_lanes_init(8, 1.4, &t));
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, transport_lanes_reflectance(&t, &m, R));
    TEST_ASSERT_TRUE(R[0] == 7.0 && R[1] == 7.0);
    before = t;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, transport_lanes_init(6, 1.4, &t));
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, transport_lanes_init(8, 4.0, &t));
    TEST_ASSERT_EQUAL_INT(STATUS_UNSUPPORTED, transport_lanes_init(64, 1.4, &t));
    TEST_ASSERT_EQUAL_INT(STATUS_UNSUPPORTED, transport_lanes_init(8, 1.005, &t));
    TEST_ASSERT_EQUAL_INT(STATUS_UNSUPPORTED, transport_lanes_init(8, 3.5, &t));
    TEST_ASSERT_EQUAL_MEMORY(&before, &t, sizeof t);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_exact);
    RUN_TEST(test_skins);
    RUN_TEST(test_edges);
    RUN_TEST(test_same_bits);
    RUN_TEST(test_bands_beyond);
    RUN_TEST(test_refused);
    return UNITY_END();
}
