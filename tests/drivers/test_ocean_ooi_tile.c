/* test_ocean_ooi_tile.c - certificates as people write them, and addresses. */
#include "drivers/ocean_ooi/tile_file.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "drivers/ocean_ooi/address.h"
#include "unity.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct ooi_tile_file file;
static struct driver_error error;
static char text[65536];

void setUp(void)
{
    memset(&error, 0, sizeof error);
}

void tearDown(void)
{
}

/* ---- tile files --------------------------------------------------------------------- */

/* 400..700 by 10: header behind `columns`, value behind `row`. */
static void write_file(const char *columns, const char *row, double first, double step, int n,
                       double value, double slope)
{
    size_t at = (size_t)snprintf(text, sizeof text, "# certificate\r\n\r\n%s", columns);
    for (int i = 0; i < n; i++)
        at += (size_t)snprintf(text + at, sizeof text - at, ",%g", first + step * i);
    at += (size_t)snprintf(text + at, sizeof text - at, "\r\n%s", row);
    for (int i = 0; i < n; i++)
        at += (size_t)snprintf(text + at, sizeof text - at, ",%g", value + slope * i);
    snprintf(text + at, sizeof text - at, "\r\n");
}

static enum driver_result parse(void)
{
    enum driver_result r = ooi_tile_parse(text, strlen(text), "tile.csv", &file, &error);
    return r == DRIVER_OK ? ooi_tile_is_white(&file, "tile.csv", &error) : r;
}

static void test_tile(void)
{
    write_file("id,specular,geometry", "WS-1 4711,SCE,8/d", 380, 10, 36, 0.95, 0.001);
    TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, parse(), error.text);
    TEST_ASSERT_EQUAL_STRING("WS-1 4711", file.row[0].id);
    TEST_ASSERT_EQUAL_size_t(36, file.columns);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.952, ooi_tile_at(&file, 0, 400.0));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.9525, ooi_tile_at(&file, 0, 405.0));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.9827, ooi_tile_at(&file, 0, 707.0));
}

/* expect: what sha256sum prints of the same bytes. */
static void test_hash_of_the_file(void)
{
    strcpy(text, "id,specular,400,420,440,460,480,500,520,540,560,580,600,620,640,660,680,700\r\n"
                 "W,sce,0.9,0.9,0.9,0.9,0.9,0.9,0.9,0.9,0.9,0.9,0.9,0.9,0.9,0.9,0.9,0.9\r\n");
    TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, parse(), error.text);
    TEST_ASSERT_EQUAL_STRING("abfc9ad38d4a1fefdc1a2a20bb0535aef0f710f740f4aa08353264a7fde1a581",
                             file.sha256);
}

/* By hand: the line of the first two, and of the last two, goes on. */
static void test_tile_goes_on_beyond_its_ends(void)
{
    write_file("id,specular", "W,sce", 400, 10, 31, 0.9, 0.002);
    TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, parse(), error.text);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.898, ooi_tile_at(&file, 0, 390.0));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.962, ooi_tile_at(&file, 0, 710.0));
}

static void test_tile_from_a_spreadsheet(void)
{
    char with_mark[sizeof text + 3];
    write_file("id,note,specular", " W 7 ,\tclean , sce ", 380, 5, 80, 0.97, 0.0);
    snprintf(with_mark, sizeof with_mark, "\xef\xbb\xbf%s", strstr(text, "id,"));
    TEST_ASSERT_EQUAL_INT_MESSAGE(
        DRIVER_OK, ooi_tile_parse(with_mark, strlen(with_mark), "tile.csv", &file, &error),
        error.text);
    TEST_ASSERT_EQUAL_STRING("W 7", file.row[0].id);
}

static const struct bad_case {
    const char *what, *columns, *row;
    double first, step;
    int n;
    double value;
    const char *says; /* what to do, or what is wrong */
} bad_cases[] = {
    { "sci stated", "id,specular", "W,sci", 400, 10, 31, 0.97, "sce values" },
    { "neither", "id,specular", "W,", 400, 10, 31, 0.97, "must say sce" },
    { "not stated", "id,note", "W,sce", 400, 10, 31, 0.97, "columns id and specular" },
    { "percent", "id,specular", "W,sce", 400, 10, 31, 97.0, "percent" },
    { "negative", "id,specular", "W,sce", 400, 10, 31, -0.1, "negative" },
    { "um", "id,specular", "W,sce", 0.4, 0.01, 31, 0.97, "in nm" },
    { "angstrom", "id,specular", "W,sce", 4000, 100, 31, 0.97, "in nm" },
    { "begins too late", "id,specular", "W,sce", 410, 10, 31, 0.97, "400 to 700" },
    { "ends too early", "id,specular", "W,sce", 400, 10, 30, 0.97, "400 to 700" },
    { "too coarse", "id,specular", "W,sce", 400, 25, 13, 0.97, "missing" },
    { "falling", "id,specular", "W,sce", 700, -10, 31, 0.97, "must rise" },
    { "45/0", "id,specular,geometry", "W,sce,45/0", 400, 10, 31, 0.97, "d/8" },
    { "a grey", "id,specular", "W,sce", 400, 10, 31, 0.3, "no white tile" },
    { "measured", "id,specular,what", "W,sce,measured", 400, 10, 31, 0.97, "certified" },
    { "nameless", "id,specular", ",sce", 400, 10, 31, 0.97, "name the tile" },
    { "a field too few", "id,specular,note", "W,sce", 400, 10, 31, 0.97, "fewer" },
    { "a field too many", "id,specular", "W,sce,0.9", 400, 10, 31, 0.97, "more fields" },
    { "no wavelengths", "id,specular", "W,sce", 400, 10, 0, 0.97, "needs wavelengths" },
};

static void test_bad_tiles(void)
{
    for (size_t i = 0; i < COUNT(bad_cases); i++) {
        const struct bad_case *c = &bad_cases[i];
        write_file(c->columns, c->row, c->first, c->step, c->n, c->value, 0.0);
        TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_UNSUPPORTED, parse(), c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_UNSUPPORTED, error.result, c->what);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, c->says), error.text);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "tile.csv"), error.text);
    }
}

/* One band left out of an even grid. */
static void test_missing_band(void)
{
    write_file("id,specular", "W,sce", 400, 10, 31, 0.97, 0.0);
    char *at = strstr(text, ",550");
    memmove(at, at + 4, strlen(at + 4) + 1);
    TEST_ASSERT_EQUAL_INT(DRIVER_UNSUPPORTED, parse());
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "tile.csv:3: bands are missing"), error.text);
}

static const char *const bad_texts[] = {
    "",
    "\n\n# only this\n",
    "id;specular;400;410\nW;sce;0,97;0,97\n",
    "id,specular,400,700\n",
    "\x89PNG\r\n",
    "id,specular,400,400\nW,sce,1,1\n",
    "id,specular,390,400,410\nW,sce,nan,1,1\n",
};

static void test_bad_texts(void)
{
    for (size_t i = 0; i < COUNT(bad_texts); i++) {
        strcpy(text, bad_texts[i]);
        TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_UNSUPPORTED, parse(), bad_texts[i]);
        TEST_ASSERT_TRUE(strlen(error.text) > 0);
    }
    write_file("id,specular", "W,sce", 400, 10, 31, 0.97, 0.0);
    TEST_ASSERT_EQUAL_INT(DRIVER_UNSUPPORTED,
                          ooi_tile_parse(text, strlen(text) + 1, "t", &file, &error));
    TEST_ASSERT_EQUAL_INT(DRIVER_UNSUPPORTED, ooi_tile_read("/nowhere/at/all", &file, &error));
    TEST_ASSERT_EQUAL_INT(DRIVER_UNSUPPORTED, ooi_tile_read("/", &file, &error));
    TEST_ASSERT_EQUAL_INT(DRIVER_UNSUPPORTED, ooi_tile_read("/dev/zero", &file, &error));
}

/* ---- greys
 * --------------------------------------------------------------------------------------- */

static double measured[OOI_TILE_ROWS][OOI_BANDS], certified[OOI_TILE_ROWS][OOI_BANDS];

static void write_greys(const char *const *rows, size_t n)
{
    size_t at = (size_t)snprintf(text, sizeof text, "id,what,specular,400,410");
    for (int i = 420; i <= 700; i += 10)
        at += (size_t)snprintf(text + at, sizeof text - at, ",%d", i);
    for (size_t r = 0; r < n; r++) {
        at += (size_t)snprintf(text + at, sizeof text - at, "\n%s,sce", rows[r]);
        for (int i = 400; i <= 700; i += 10)
            at += (size_t)snprintf(text + at, sizeof text - at, ",0.%d", 30 + (int)r);
    }
}

static enum driver_result read_greys(size_t *n)
{
    enum driver_result r = ooi_tile_parse(text, strlen(text), "greys.csv", &file, &error);
    return r == DRIVER_OK ? ooi_tile_greys(&file, "greys.csv", n, measured, certified, &error) : r;
}

static void test_greys(void)
{
    static const char *const rows[] = { "G1,measured", "G2,certified", "G1,certified",
                                        "G2,measured" };
    size_t n = 0;
    write_greys(rows, 4);
    TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, read_greys(&n), error.text);
    TEST_ASSERT_EQUAL_size_t(2, n);
    TEST_ASSERT_EQUAL_DOUBLE(0.30, measured[0][7]);
    TEST_ASSERT_EQUAL_DOUBLE(0.32, certified[0][7]);
    TEST_ASSERT_EQUAL_DOUBLE(0.33, measured[1][30]);
    TEST_ASSERT_EQUAL_DOUBLE(0.31, certified[1][0]);
}

static void test_bad_greys(void)
{
    static const char *const lonely[] = { "G1,measured", "G2,certified" };
    static const char *const twice[] = { "G1,measured", "G1,measured", "G1,certified" };
    static const char *const other[] = { "G1,guessed" };
    size_t n = 77;
    write_greys(lonely, 2);
    TEST_ASSERT_EQUAL_INT(DRIVER_UNSUPPORTED, read_greys(&n));
    TEST_ASSERT_NOT_NULL(strstr(error.text, "'G1'"));
    write_greys(twice, 3);
    TEST_ASSERT_EQUAL_INT(DRIVER_UNSUPPORTED, read_greys(&n));
    write_greys(other, 1);
    TEST_ASSERT_EQUAL_INT(DRIVER_UNSUPPORTED, read_greys(&n));
    TEST_ASSERT_EQUAL_size_t(77, n);
}

/* ---- addresses
 * -------------------------------------------------------------------------------------- */

static void test_address(void)
{
    struct ooi_address a;
    TEST_ASSERT_EQUAL_INT(DRIVER_OK,
                          ooi_address_parse("ocean_ooi:usb:2457:101e,port_mm=8,tile=/a/b.csv,"
                                            "greys=g.csv,model=usb4000",
                                            &a, &error));
    TEST_ASSERT_EQUAL_STRING("usb:2457:101e", a.link);
    TEST_ASSERT_EQUAL_STRING("/a/b.csv", a.tile);
    TEST_ASSERT_EQUAL_STRING("g.csv", a.greys);
    TEST_ASSERT_EQUAL_DOUBLE(8.0, a.port_mm);
    TEST_ASSERT_EQUAL_STRING("USB4000", a.model->name);
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, ooi_address_parse("usb,tile=t,port_mm=10.5", &a, &error));
    TEST_ASSERT_EQUAL_STRING("usb", a.link);
    TEST_ASSERT_EQUAL_STRING("", a.greys);
    TEST_ASSERT_NULL(a.model);
}

static const struct {
    const char *address, *says;
} bad_addresses[] = {
    { "", "usb" },
    { "usb", "tile" },
    { "usb,port_mm=8", "tile" },
    { "usb,tile=t", "port_mm" },
    { "usb,tile=,port_mm=8", "path" },
    { "usb,tile=t,tile=u,port_mm=8", "twice" },
    { "usb,tile=t,port_mm=8,port_mm=8", "twice" },
    { "usb,tile=t,port_mm=0", "1 to 100" },
    { "usb,tile=t,port_mm=eight", "1 to 100" },
    { "usb,tile=t,port_mm=8,model=usb2000", "usb2000+" },
    { "usb,tile=t,port_mm=8,colour=red", "no such option" },
    { "usb,tile=t,port_mm=8,", "key=value" },
    { "usb,tile", "key=value" },
};

static void test_bad_addresses(void)
{
    for (size_t i = 0; i < COUNT(bad_addresses); i++) {
        struct ooi_address a = { .port_mm = 77.0 };
        TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_UNSUPPORTED,
                                      ooi_address_parse(bad_addresses[i].address, &a, &error),
                                      bad_addresses[i].address);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, bad_addresses[i].says), error.text);
        TEST_ASSERT_EQUAL_DOUBLE(77.0, a.port_mm);
    }
    memset(text, 'x', 3000);
    memcpy(text, "usb,tile=", 9);
    text[3000] = '\0';
    struct ooi_address a;
    TEST_ASSERT_EQUAL_INT(DRIVER_UNSUPPORTED, ooi_address_parse(text, &a, &error));
    memset(text, 'x', 9);
    TEST_ASSERT_EQUAL_INT(DRIVER_UNSUPPORTED, ooi_address_parse(text, &a, &error));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_tile);
    RUN_TEST(test_hash_of_the_file);
    RUN_TEST(test_tile_goes_on_beyond_its_ends);
    RUN_TEST(test_tile_from_a_spreadsheet);
    RUN_TEST(test_bad_tiles);
    RUN_TEST(test_missing_band);
    RUN_TEST(test_bad_texts);
    RUN_TEST(test_greys);
    RUN_TEST(test_bad_greys);
    RUN_TEST(test_address);
    RUN_TEST(test_bad_addresses);
    return UNITY_END();
}
