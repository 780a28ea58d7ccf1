/* test_ocean_ooi_wire.c - the OOI dialect, by the tables of the makers and of the free drivers. */
#include "drivers/ocean_ooi/ocean_ooi_wire.h"

#include <locale.h>
#include <string.h>

#include "unity.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

void setUp(void)
{
}

void tearDown(void)
{
}

/* ---- requests ----------------------------------------------------------------------- */

static void expect_request(const char *what, size_t n_expect, const uint8_t *expect, size_t n,
                           const uint8_t *bytes)
{
    TEST_ASSERT_EQUAL_size_t_MESSAGE(n_expect, n, what);
    TEST_ASSERT_EQUAL_MEMORY_MESSAGE(expect, bytes, n, what);
}

/* expect: the command tables; u32 and u16 little-endian */
static void test_requests(void)
{
    uint8_t b[OOI_MAX_REQUEST];
    expect_request("initialise", 1, (const uint8_t[]){ 0x01 }, ooi_ask_initialise(b), b);
    expect_request("100 ms", 5, (const uint8_t[]){ 0x02, 0xa0, 0x86, 0x01, 0x00 },
                   ooi_ask_integration(b, 100000), b);
    expect_request("65 535 000 us", 5, (const uint8_t[]){ 0x02, 0x18, 0xfc, 0xe7, 0x03 },
                   ooi_ask_integration(b, 65535000), b);
    expect_request("lamp on", 3, (const uint8_t[]){ 0x03, 1, 0 }, ooi_ask_lamp(b, true), b);
    expect_request("lamp off", 3, (const uint8_t[]){ 0x03, 0, 0 }, ooi_ask_lamp(b, false), b);
    expect_request("slot 17", 2, (const uint8_t[]){ 0x05, 0x11 },
                   ooi_ask_slot(b, OOI_SLOT_AUTO_NULL), b);
    expect_request("spectrum", 1, (const uint8_t[]){ 0x09 }, ooi_ask_spectrum(b), b);
    expect_request("register 4", 2, (const uint8_t[]){ 0x6b, 4 },
                   ooi_ask_register(b, OOI_FPGA_VERSION), b);
    expect_request("temperature", 1, (const uint8_t[]){ 0x6c }, ooi_ask_temperature(b), b);
    expect_request("status", 1, (const uint8_t[]){ 0xfe }, ooi_ask_status(b), b);
}

/* ---- replies ------------------------------------------------------------------------ */

static const struct slot_case {
    const char *what;
    uint8_t bytes[18];
    size_t n;
    uint8_t slot;
    const char *expect; /* NULL: no such reply */
} slot_cases[] = {
    { "a serial number, garbage behind the NUL",
      { 5, 0, 'U', 'S', 'B', '2', '+', 'H', '0', '4', '7', '1', 0, 0xff, 0xee, 'x', 'y' },
      17,
      0,
      "USB2+H0471" },
    { "no NUL in fifteen characters",
      { 5, 1, '1', '2', '3', '4', '5', '6', '7', '8', '9', '0', '1', '2', '3', '4', '5' },
      17,
      1,
      "123456789012345" },
    { "empty", { 5, 9, 0, 'o', 'l', 'd' }, 17, 9, "" },
    { "spaces around", { 5, 2, ' ', ' ', '3', '.', '5', ' ', 0 }, 17, 2, "3.5" },
    { "binary", { 5, 0, 0x80, 'A', 0x1b, 0x7f, '\n', 0 }, 17, 0, "?A???" },
    { "another slot", { 5, 3, '1' }, 17, 2, NULL },
    { "another reply", { 8, 2, '1' }, 17, 2, NULL },
    { "a byte too few", { 5, 2, '1' }, 16, 2, NULL },
    { "a byte too many", { 5, 2, '1' }, 18, 2, NULL },
    { "nothing", { 0 }, 0, 2, NULL },
};

static void test_slots(void)
{
    for (size_t i = 0; i < COUNT(slot_cases); i++) {
        const struct slot_case *c = &slot_cases[i];
        char text[OOI_SLOT_TEXT] = "untouched";
        bool is = ooi_read_slot(c->bytes, c->n, c->slot, text);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->expect != NULL, is, c->what);
        TEST_ASSERT_EQUAL_STRING_MESSAGE(is ? c->expect : "untouched", text, c->what);
    }
}

static const struct number_case {
    const char *text;
    bool is;
    double expect;
} number_cases[] = {
    { "339.5167", true, 339.5167 },
    { "3.795437E-01", true, 0.3795437 },
    { "-1.5e-05", true, -1.5e-05 },
    { "+7", true, 7.0 },
    { "0", true, 0.0 },
    { "3,795", false, 0.0 },
    { "", false, 0.0 },
    { "nan", false, 0.0 },
    { "0x10", false, 0.0 },
    { "1.5 nm", false, 0.0 },
    { "1e999", false, 0.0 },
};

static void test_numbers_in_any_locale(void)
{
    static const char *const locales[] = { "C", "de_DE.UTF-8", "C.UTF-8" };
    for (size_t l = 0; l < COUNT(locales); l++) {
        (void)setlocale(LC_ALL, locales[l]); /* where there is none it stays */
        for (size_t i = 0; i < COUNT(number_cases); i++) {
            const struct number_case *c = &number_cases[i];
            double value = -99.0;
            TEST_ASSERT_EQUAL_INT_MESSAGE(c->is, ooi_read_number(c->text, &value), c->text);
            TEST_ASSERT_EQUAL_DOUBLE(c->is ? c->expect : -99.0, value);
        }
    }
    (void)setlocale(LC_ALL, "C");
}

static void test_level(void)
{
    uint8_t bytes[17] = { 5, 0x11, 1, 2, 3, 4, 0x60, 0xea };
    uint16_t level = 7;
    TEST_ASSERT_TRUE(ooi_read_level(bytes, 17, &level));
    TEST_ASSERT_EQUAL_UINT(60000, level);
    bytes[1] = 0x10;
    TEST_ASSERT_FALSE(ooi_read_level(bytes, 17, &level));
    TEST_ASSERT_FALSE(ooi_read_level(bytes, 3, &level));
}

static void test_register(void)
{
    uint16_t value = 7;
    TEST_ASSERT_TRUE(ooi_read_register((const uint8_t[]){ 4, 0x03, 0x30 }, 3, 4, &value));
    TEST_ASSERT_EQUAL_HEX16(0x3003, value);
    TEST_ASSERT_TRUE(ooi_read_register((const uint8_t[]){ 0xfe, 0x01, 0x20 }, 3, 4, &value));
    TEST_ASSERT_EQUAL_HEX16(0x2001, value);
    TEST_ASSERT_FALSE(ooi_read_register((const uint8_t[]){ 8, 0, 0 }, 3, 4, &value));
    TEST_ASSERT_FALSE(ooi_read_register((const uint8_t[]){ 4, 0, 0, 0 }, 4, 4, &value));
    TEST_ASSERT_FALSE(ooi_read_register((const uint8_t[]){ 4, 0 }, 2, 4, &value));
}

/* expect: value x 0.003906, by hand */
static void test_temperature(void)
{
    double celsius = -99.0;
    TEST_ASSERT_TRUE(ooi_read_temperature((const uint8_t[]){ 8, 0x00, 0x19 }, 3, &celsius));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 24.9984, celsius); /* 6400 */
    TEST_ASSERT_TRUE(ooi_read_temperature((const uint8_t[]){ 8, 0x00, 0xfe }, 3, &celsius));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, -1.999872, celsius); /* -512 */
    TEST_ASSERT_FALSE(ooi_read_temperature((const uint8_t[]){ 0xff, 0, 0x19 }, 3, &celsius));
    TEST_ASSERT_FALSE(ooi_read_temperature((const uint8_t[]){ 8, 0 }, 2, &celsius));
}

static void test_status(void)
{
    uint8_t b[16] = { 0x00, 0x08, 0xa0, 0x86, 0x01, 0x00, 1, 0, 0, 9, 1, 0, 0, 0, 0x80, 0 };
    struct ooi_status status = { .pixels = 7 };
    TEST_ASSERT_TRUE(ooi_read_status(b, 16, &status));
    TEST_ASSERT_EQUAL_size_t(2048, status.pixels);
    TEST_ASSERT_EQUAL_UINT32(100000, status.integration_us);
    TEST_ASSERT_TRUE(status.lamp && status.high_speed);
    TEST_ASSERT_EQUAL_UINT(0, status.trigger);
    b[14] = 0;
    b[6] = 0;
    TEST_ASSERT_TRUE(ooi_read_status(b, 16, &status));
    TEST_ASSERT_FALSE(status.lamp || status.high_speed);
    b[14] = 0x40;
    TEST_ASSERT_FALSE(ooi_read_status(b, 16, &status));
    b[14] = 0;
    TEST_ASSERT_FALSE(ooi_read_status(b, 15, &status));
}

/* ---- spectra ------------------------------------------------------------------------ */

static uint8_t bytes[OOI_MAX_FRAME + 1];
static uint16_t counts[OOI_MAX_PIXELS];

static const struct frame_case {
    const char *option;
    size_t bytes;
    uint8_t low, high; /* of pixel 5 on the wire */
    uint16_t expect;
} frame_cases[] = {
    { "usb2000+", 4097, 0x34, 0x12, 0x1234 },
    { "usb4000", 7681, 0xff, 0xff, 0xffff },
    { "hr2000+", 4097, 0x34, 0x32, 0x1234 }, /* 14 bits, bit 13 inverted */
    { "hr4000", 7681, 0xff, 0x1f, 0x3fff },
};

static void test_frames(void)
{
    for (size_t i = 0; i < COUNT(frame_cases); i++) {
        const struct frame_case *c = &frame_cases[i];
        const struct ooi_model *m = ooi_model_of_option(c->option);
        TEST_ASSERT_NOT_NULL_MESSAGE(m, c->option);
        TEST_ASSERT_EQUAL_size_t_MESSAGE(c->bytes, ooi_frame_bytes(m), c->option);
        memset(bytes, 0, sizeof bytes);
        bytes[10] = c->low;
        bytes[11] = c->high;
        bytes[c->bytes - 1] = 0x69;
        TEST_ASSERT_EQUAL_INT(OOI_FRAME_OK, ooi_read_frame(m, bytes, c->bytes, counts));
        TEST_ASSERT_EQUAL_HEX16_MESSAGE(c->expect, counts[5], c->option);
        TEST_ASSERT_EQUAL_HEX16_MESSAGE(m->flipped, counts[6], c->option);
        TEST_ASSERT_EQUAL_INT(OOI_FRAME_COUNT, ooi_read_frame(m, bytes, c->bytes - 1, counts));
        TEST_ASSERT_EQUAL_INT(OOI_FRAME_COUNT, ooi_read_frame(m, bytes, c->bytes + 1, counts));
        TEST_ASSERT_EQUAL_INT(OOI_FRAME_COUNT, ooi_read_frame(m, bytes, 0, counts));
        bytes[c->bytes - 1] = 0x96;
        TEST_ASSERT_EQUAL_INT(OOI_FRAME_SYNC, ooi_read_frame(m, bytes, c->bytes, counts));
    }
}

static void test_fourteen_bits_are_no_more(void)
{
    const struct ooi_model *m = ooi_model_of_option("hr2000+");
    memset(bytes, 0, sizeof bytes);
    bytes[4096] = 0x69;
    bytes[101] = 0x40;
    counts[50] = 77;
    TEST_ASSERT_EQUAL_INT(OOI_FRAME_RANGE, ooi_read_frame(m, bytes, 4097, counts));
    TEST_ASSERT_EQUAL_UINT(77, counts[50]);
}

/* ---- models ------------------------------------------------------------------------- */

/* expect: the data sheets' steps */
static const struct integration_case {
    const char *option;
    double us;
    uint32_t expect;
} integration_cases[] = {
    { "usb2000+", 10.0, 1000 },       { "usb2000+", 12344.0, 12340 },
    { "usb2000+", 700400.0, 700000 }, { "usb2000+", 1e12, 65535000 },
    { "usb4000", 1.0, 10 },           { "usb4000", 1234.4, 1234 },
    { "usb4000", 3806.0, 3810 },      { "usb4000", 1e12, 65535000 },
    { "hr4000", 12400.0, 12000 },
};

static void test_integration_times(void)
{
    for (size_t i = 0; i < COUNT(integration_cases); i++) {
        const struct integration_case *c = &integration_cases[i];
        TEST_ASSERT_EQUAL_UINT32_MESSAGE(
            c->expect, ooi_model_integration_us(ooi_model_of_option(c->option), c->us), c->option);
    }
}

static void test_models_are_consistent(void)
{
    size_t n = 0;
    for (const struct ooi_model *m = ooi_models; m->name != NULL; m++, n++) {
        TEST_ASSERT_EQUAL_PTR(m, ooi_model_of_pid(m->pid));
        TEST_ASSERT_TRUE(m->black_first <= m->black_last && m->black_last < m->active_first);
        TEST_ASSERT_TRUE(m->active_first < m->active_last && m->active_last < m->pixels);
        TEST_ASSERT_TRUE(m->pixels <= OOI_MAX_PIXELS && m->early_bytes % OOI_PACKET == 0);
    }
    TEST_ASSERT_EQUAL_size_t(4, n);
    TEST_ASSERT_NULL(ooi_model_of_pid(0x1002)); /* the old USB2000: another frame */
    TEST_ASSERT_NULL(ooi_model_of_option("usb2000"));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_requests);
    RUN_TEST(test_slots);
    RUN_TEST(test_numbers_in_any_locale);
    RUN_TEST(test_level);
    RUN_TEST(test_register);
    RUN_TEST(test_temperature);
    RUN_TEST(test_status);
    RUN_TEST(test_frames);
    RUN_TEST(test_fourteen_bits_are_no_more);
    RUN_TEST(test_integration_times);
    RUN_TEST(test_models_are_consistent);
    return UNITY_END();
}
