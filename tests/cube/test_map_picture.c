/* test_map_picture.c - where a value stands in a picture, and what its bar says. */
#include "cube/map_picture.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unity.h>

#include "colour/delta_e.h"
#include "colour/lab.h"
#include "colour/srgb.h"
#include "cube/tiny_font.h"

void setUp(void)
{
}

void tearDown(void)
{
}

static unsigned char row[4096];

static void test_values_and_ends(void)
{
    const float value[] = { 0.0f, 0.1f, 0.1999f, 0.2f, 5.0f, -1.0f, NAN };
    const unsigned char expect[] = { PICTURE_LEAST,  125,          249,
                                     PICTURE_MOST,   PICTURE_MOST, PICTURE_LEAST,
                                     PICTURE_NOTHING };
    struct map_picture p;
    size_t line;
    map_picture_init(&p, 7, 3, 0.0, 0.2, "Cm", "melanin");
    TEST_ASSERT_EQUAL_UINT(35, p.zoom); /* 240 pixels at least */
    TEST_ASSERT_FALSE(map_picture_line(&p, 7, &line));
    TEST_ASSERT_TRUE(map_picture_line(&p, 8 + 2 * 35, &line));
    TEST_ASSERT_EQUAL_UINT(2, line);
    TEST_ASSERT_FALSE(map_picture_line(&p, 8 + 3 * 35, &line));
    map_picture_row(&p, 8, value, row);
    TEST_ASSERT_EQUAL_UINT8(PICTURE_PAPER, row[7]);
    TEST_ASSERT_EQUAL_UINT8(PICTURE_PAPER, row[8 + 7 * 35]);
    for (size_t i = 0; i < 7 * 35; i++)
        TEST_ASSERT_EQUAL_UINT8(expect[i / 35], row[8 + i]);
}

/* The bar rises from its least to its most and is found once; ink is only on paper. */
static void test_bar_and_letters(void)
{
    struct map_picture p;
    size_t bars = 0, ink = 0, line;
    map_picture_init(&p, 300, 2, 0.0, 0.2, "Cm", "melanin");
    TEST_ASSERT_EQUAL_STRING("Cm: melanin", p.title);
    TEST_ASSERT_EQUAL_STRING("0.2", p.end[1]);
    for (size_t y = 0; y < p.height; y++) {
        if (map_picture_line(&p, y, &line))
            continue;
        map_picture_row(&p, y, NULL, row);
        bool bar = row[8] == PICTURE_LEAST;
        bars += bar ? 1 : 0;
        for (size_t x = 9; bar && x < 308; x++)
            TEST_ASSERT_TRUE(row[x] >= row[x - 1]);
        if (bar)
            TEST_ASSERT_EQUAL_UINT8(PICTURE_MOST, row[307]);
        for (size_t x = 0; x < p.width && !bar; x++) {
            TEST_ASSERT_TRUE(row[x] == PICTURE_PAPER || row[x] == PICTURE_INK);
            ink += row[x] == PICTURE_INK ? 1 : 0;
        }
    }
    TEST_ASSERT_EQUAL_UINT(12, bars);
    TEST_ASSERT_GREATER_THAN(60, ink);
    map_picture_init(&p, 300, 2, 0.0, 0.2, "Cm",
                     "a meaning that is longer than the picture is wide");
    TEST_ASSERT_EQUAL_STRING("Cm", p.title);
}

/* Each letter that names and numbers need is there, and unlike the others. */
static void test_letters(void)
{
    static const char all[] =
        "0123456789.-+:/ABCDEFGHIJKLMNOPQRSTUVWXYZ_abcdefghijklmnopqrstuvwxyz";
    static bool dots[sizeof all][TINY_FONT_WIDTH * TINY_FONT_HEIGHT];
    for (size_t i = 0; all[i] != '\0'; i++) {
        char text[] = { all[i], '\0' };
        size_t set = 0;
        for (size_t k = 0; k < sizeof dots[i]; k++) {
            dots[i][k] = tiny_font_dot(text, k % TINY_FONT_WIDTH, k / TINY_FONT_WIDTH);
            set += dots[i][k] ? 1 : 0;
        }
        TEST_ASSERT_GREATER_THAN_MESSAGE(0, set, text);
        for (size_t j = 0; j < i; j++)
            TEST_ASSERT_NOT_EQUAL_MESSAGE(0, memcmp(dots[i], dots[j], sizeof dots[i]), text);
    }
    TEST_ASSERT_EQUAL_UINT(11, tiny_font_width("Cm"));
    TEST_ASSERT_FALSE(tiny_font_dot("Cm", 5, 3));
    TEST_ASSERT_FALSE(tiny_font_dot("Cm", 12, 3));
}

static const struct ends_case {
    double lo, hi, expect[2];
} ends_cases[] = {
    { 0.0103, 0.1945, { 0.01, 0.2 } }, { 0.5, 0.5, { 0.4997, 0.5003 } }, /* one value: apart */
    { -0.2, 3.3, { -0.2, 3.3 } },      { 0.0, 0.0, { -5e-7, 5e-7 } },    { NAN, NAN, { 0.0, 1.0 } },
};

static void test_ends(void)
{
    for (size_t i = 0; i < sizeof ends_cases / sizeof *ends_cases; i++) {
        const struct ends_case *c = &ends_cases[i];
        double ends[2];
        map_picture_ends(c->lo, c->hi, ends);
        TEST_ASSERT_TRUE(ends[0] < ends[1]);
        if (!isnan(c->lo)) {
            TEST_ASSERT_TRUE(ends[0] <= c->lo + 1e-12);
            TEST_ASSERT_TRUE(ends[1] >= c->hi - 1e-12);
        }
        double slack = 0.21 * (c->expect[1] - c->expect[0]);
        TEST_ASSERT_DOUBLE_WITHIN(slack, c->expect[0], ends[0]);
        TEST_ASSERT_DOUBLE_WITHIN(slack, c->expect[1], ends[1]);
    }
}

static void lab_of(const unsigned char code[3], double Lab[3])
{
    double linear[3], XYZ[3], white[3];
    for (int k = 0; k < 3; k++)
        linear[k] = srgb_decode(code[k] / 255.0);
    srgb_linear_to_xyz(linear, XYZ, white);
    lab_from_xyz(XYZ, white, Lab);
}

/* Lightness rises all the way, and ten colours on is as far anywhere, as far as 8 bits let it. */
static void test_colours_are_even(void)
{
    unsigned char rgb[PICTURE_COLOURS][3];
    double first[3], next[3], least = 1e9, most = 0.0;
    map_picture_palette(rgb);
    for (size_t i = 0; i + 10 <= PICTURE_MOST; i += 5) {
        lab_of(rgb[i], first);
        lab_of(rgb[i + 10], next);
        TEST_ASSERT_TRUE(next[0] > first[0]);
        double d = delta_e_2000(first, next);
        least = fmin(least, d);
        most = fmax(most, d);
    }
    TEST_ASSERT_TRUE(least > 2.0);
    TEST_ASSERT_TRUE(most < 1.35 * least);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_values_and_ends);
    RUN_TEST(test_bar_and_letters);
    RUN_TEST(test_letters);
    RUN_TEST(test_ends);
    RUN_TEST(test_colours_are_even);
    return UNITY_END();
}
