/* test_deflate_runs.c - what zlib itself makes of the streams. */
#include "cube/deflate_runs.h"

#include <stdlib.h>
#include <string.h>
#include <unity.h>
#include <zlib.h>

void setUp(void)
{
}

void tearDown(void)
{
}

enum { N = 3 * DEFLATE_RUNS_IN + 777 };
static unsigned char in[N], back[N + 1], stream[4 * DEFLATE_RUNS_OUT];

/* n bytes through it, so many at a time; how long the stream is. */
static size_t there_and_back(size_t n, size_t part)
{
    static struct deflate_runs d;
    static unsigned char out[DEFLATE_RUNS_OUT];
    size_t size = 0;
    deflate_runs_begin(&d);
    for (size_t i = 0; i < n; i += part) {
        size_t m = n - i < part ? n - i : part;
        size_t more = deflate_runs_add(&d, in + i, m, i + m == n, out);
        TEST_ASSERT_LESS_OR_EQUAL_size_t(DEFLATE_RUNS_OUT - 8, more);
        TEST_ASSERT_LESS_OR_EQUAL_size_t(sizeof stream, size + more);
        memcpy(stream + size, out, more);
        size += more;
    }
    uLongf got = sizeof back;
    TEST_ASSERT_EQUAL_INT(Z_OK, uncompress(back, &got, stream, size)); /* its sum as well */
    TEST_ASSERT_EQUAL_size_t(n, got);
    TEST_ASSERT_EQUAL_MEMORY(in, back, n);
    return size;
}

static unsigned char next(uint32_t *random, unsigned values)
{
    *random = *random * 1664525u + 1013904223u;
    return (unsigned char)((*random >> 8) % values);
}

static void test_noise_of_so_many_values(void)
{
    static const unsigned values[] = { 1, 2, 3, 17, 100, 250, 256 };
    uint32_t random = 1;
    for (size_t k = 0; k < sizeof values / sizeof *values; k++) {
        for (size_t i = 0; i < N; i++)
            in[i] = next(&random, values[k]);
        there_and_back(N, DEFLATE_RUNS_IN);
        there_and_back(1000, 7);
    }
}

/* Runs of each length up to beyond the longest there is a code for, next to each other. */
static void test_runs_of_each_length(void)
{
    size_t n = 0;
    for (size_t length = 1; length < 300; length++)
        for (size_t i = 0; i < length; i++)
            in[n++] = (unsigned char)(length % 7);
    TEST_ASSERT_LESS_THAN_size_t(N, n);
    there_and_back(n, DEFLATE_RUNS_IN);
    there_and_back(n, 1000);
}

static void test_any_length(void)
{
    uint32_t random = 2;
    for (size_t i = 0; i < N; i++)
        in[i] = next(&random, 2) != 0 ? next(&random, 250) : 3;
    for (size_t n = 1; n < 200; n++)
        there_and_back(n, DEFLATE_RUNS_IN);
}

/* Weights as Fibonacci's numbers ask for codes of 20 bits: more than there may be. */
static void test_codes_that_would_be_too_long(void)
{
    size_t n = 0, many = 1, before = 1;
    for (unsigned k = 0; k < 21; k++) {
        for (size_t i = 0; i < many && n < DEFLATE_RUNS_IN; i++)
            in[n++] = (unsigned char)k;
        size_t sum = many + before;
        before = many;
        many = sum;
    }
    /* Shuffled, so that there are no runs. */
    uint32_t random = 3;
    for (size_t i = n; i-- > 1;) {
        random = random * 1664525u + 1013904223u;
        size_t j = (random >> 4) % (i + 1);
        unsigned char x = in[i];
        in[i] = in[j];
        in[j] = x;
    }
    there_and_back(n, DEFLATE_RUNS_IN);
}

/* To within 2 % of what zlib's own Z_RLE makes of noise, and of a plain with noise in it. */
static void test_as_small_as_zlib(void)
{
    static unsigned char other[2 * N];
    uint32_t random = 4;
    for (int kind = 0; kind < 2; kind++) {
        for (size_t i = 0; i < N; i++)
            in[i] =
                kind == 1 && i / 3000 % 2 == 0
                    ? 7
                    : (unsigned char)((next(&random, 83) + next(&random, 83) + next(&random, 83)) &
                                      0xff);
        z_stream z = { .next_in = in, .avail_in = N, .next_out = other, .avail_out = sizeof other };
        TEST_ASSERT_EQUAL_INT(Z_OK, deflateInit2(&z, 6, Z_DEFLATED, 15, 8, Z_RLE));
        TEST_ASSERT_EQUAL_INT(Z_STREAM_END, deflate(&z, Z_FINISH));
        size_t size = there_and_back(N, DEFLATE_RUNS_IN);
        TEST_ASSERT_LESS_OR_EQUAL_size_t((size_t)z.total_out * 102 / 100, size);
        deflateEnd(&z);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_noise_of_so_many_values);
    RUN_TEST(test_runs_of_each_length);
    RUN_TEST(test_any_length);
    RUN_TEST(test_codes_that_would_be_too_long);
    RUN_TEST(test_as_small_as_zlib);
    return UNITY_END();
}
