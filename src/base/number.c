/* number.c - strtod and printf under the C locale, whatever the program's is; and for
 * the numbers that answers are full of, exact digits without either. */
#define _GNU_SOURCE /* strtod_l */
#include "base/number.h"

#include <errno.h>
#include <float.h>
#include <locale.h>
#include <math.h>
#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static locale_t c_locale;

static void make_c_locale(void)
{
    c_locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
}

/* Made once, kept for the life of the program.  newlocale("C") needs no memory
 * in glibc; were it to fail, the program's own locale is used. */
static locale_t the_c_locale(void)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    pthread_once(&once, make_c_locale);
    return c_locale != (locale_t)0 ? c_locale : LC_GLOBAL_LOCALE;
}

enum status number_parse(const char *text, double *ret)
{
    /* strtod alone would take " 1", "0x1p3", "nan(...)" and "infinity". */
    if (*text == '\0' || text[strspn(text, "0123456789+-.eE")] != '\0')
        return STATUS_FORMAT;
    char *end;
    double x = strtod_l(text, &end, the_c_locale());
    if (end == text || *end != '\0')
        return STATUS_FORMAT;
    if (!isfinite(x))
        return STATUS_RANGE;
    *ret = x;
    return STATUS_OK;
}

/* "-0.2146": [-]digits[.digits] of at most 15 digits.  Their whole number is below 2^53 and
 * the power of ten at most 1e15: both are exact as doubles, so that the one division
 * rounds as IEEE 754 says, which is what strtod() gives.  False for anything else. */
static bool parse_by_whole_numbers(const char *text, size_t n, double *ret)
{
    static const double power[] = { 1e0, 1e1, 1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                    1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15 };
    const bool negative = n > 0 && text[0] == '-';
    const char *at = text + (negative ? 1 : 0), *end = text + n, *point = NULL;
    int64_t whole = 0;
    /* Beyond the widest precision a compiler may compute in, it would round twice. */
    if (FLT_EVAL_METHOD != 0 || end - at > 16 || at == end || *at == '.' || end[-1] == '.')
        return false;
    for (; at < end; at++) {
        if (*at >= '0' && *at <= '9')
            whole = 10 * whole + (*at - '0');
        else if (*at == '.' && point == NULL)
            point = at;
        else
            return false;
    }
    size_t decimals = point != NULL ? (size_t)(end - point) - 1 : 0;
    if (point == NULL && n > 15)
        return false;
    *ret = (double)whole / power[decimals];
    if (negative)
        *ret = -*ret;
    return true;
}

enum status number_parse_n(const char *text, size_t n, double *ret)
{
    char whole[NUMBER_LONGEST];
    if (parse_by_whole_numbers(text, n, ret))
        return STATUS_OK;
    if (n >= sizeof whole || memchr(text, '\0', n) != NULL)
        return STATUS_FORMAT;
    memcpy(whole, text, n);
    whole[n] = '\0';
    return number_parse(whole, ret);
}

enum status number_parse_count(const char *text, size_t max, size_t *ret)
{
    if (*text == '\0' || text[strspn(text, "0123456789")] != '\0')
        return STATUS_FORMAT;
    errno = 0;
    unsigned long long x = strtoull(text, NULL, 10);
    if (errno != 0 || x > max)
        return STATUS_RANGE;
    *ret = (size_t)x;
    return STATUS_OK;
}

/* printf's own way: any number, any count of digits. */
static const char *format_by_printf(double x, int digits, char text[NUMBER_TEXT_SIZE])
{
    locale_t before = uselocale(the_c_locale());
    snprintf(text, NUMBER_TEXT_SIZE, "%.*g", digits, x == 0.0 ? 0.0 : x); /* no "-0" */
    uselocale(before);
    return text;
}

/* 15, 16 or 17 digits, the first that read back: right for every double. */
static const char *format_by_trying(double x, char text[NUMBER_TEXT_SIZE])
{
    for (int digits = 15; digits < 17; digits++) {
        double back;
        format_by_printf(x, digits, text);
        if (number_parse(text, &back) == STATUS_OK && back == x)
            return text;
    }
    return format_by_printf(x, 17, text);
}

#ifdef __SIZEOF_INT128__
/* ---- the same digits by whole numbers ---------------------------------------------------
 *
 * For 1e-4 <= x < 1e15, which are written without an exponent.  x = m 2^e with
 * 2^52 <= m < 2^53.  With p such that x 10^p has 17 digits before its point,
 * x 10^p = N / 2^s where N = m 5^p and s = -(e + p).  There p is 2 .. 20 (21 while it is
 * looked for) and s 1 .. 46, so N < 2^102 and all of this is exact.  So is the question
 * whether digits read back as x: whether they lie nearer to it than half-way to the
 * next double, 5^p / 2 in units of N.  (Half-way itself has more than 17
 * digits; and powers of 2, below which doubles are closer, here have at most 15.) */

__extension__ typedef unsigned __int128 wide;

static const double by_whole_min = 1e-4, by_whole_max = 1e15;

struct scaled {
    wide N;
    int p, s;
    uint64_t gap; /* 5^p: from x to the next double, in units of N */
};

/* 5^0 .. 5^21 */
static const uint64_t power_of_five[] = { 1u,
                                          5u,
                                          25u,
                                          125u,
                                          625u,
                                          3125u,
                                          15625u,
                                          78125u,
                                          390625u,
                                          1953125u,
                                          9765625u,
                                          48828125u,
                                          244140625u,
                                          1220703125u,
                                          6103515625u,
                                          30517578125u,
                                          152587890625u,
                                          762939453125u,
                                          3814697265625u,
                                          19073486328125u,
                                          95367431640625u,
                                          476837158203125u };

static void scale(double x, struct scaled *ret)
{
    int e;
    uint64_t m = (uint64_t)ldexp(frexp(x, &e), 53);
    e -= 53;
    /* Begin with the decimal exponent of 2^(e + 52): that of x, or one less. */
    int p = 16 - (int)floor(0.3010299956639812 * (e + 52));
    uint64_t gap = power_of_five[p];
    *ret = (struct scaled){ m * (wide)gap, p, -(e + p), gap };
    if (ret->N >> ret->s >= 100000000000000000u)
        *ret = (struct scaled){ m * (wide)power_of_five[p - 1], p - 1, -(e + p - 1),
                                power_of_five[p - 1] };
}

/* x 10^p to a multiple of `unit`, a power of ten up to 1e16: half to even, as printf; the number of
 * units in *ret.  Whether it reads back as x. */
static bool round_scaled(const struct scaled *x, uint64_t unit, uint64_t *ret)
{
    uint64_t whole = (uint64_t)(x->N >> x->s), units = whole / unit;
    wide step = (wide)unit << x->s, rest = x->N - ((wide)(units * unit) << x->s);
    bool up = 2 * rest > step || (2 * rest == step && units % 2 == 1);
    *ret = units + (up ? 1 : 0);
    wide off = up ? step - rest : rest;
    return 2 * off < x->gap;
}

/* units / 10^decimals, decimals <= 20, with no zeros at the end. */
static void write_units(uint64_t units, int decimals, char *text)
{
    char digit[24];
    int n = 0;
    for (; units % 10 == 0; units /= 10)
        decimals--;
    for (; units > 0 || n <= decimals; units /= 10)
        digit[n++] = (char)('0' + units % 10);
    while (n > 0) {
        if (n == decimals)
            *text++ = '.';
        *text++ = digit[--n];
    }
    for (; decimals < 0; decimals++)
        *text++ = '0';
    *text = '\0';
}

static const uint64_t power_of_ten[] = { 1u,
                                         10u,
                                         100u,
                                         1000u,
                                         10000u,
                                         100000u,
                                         1000000u,
                                         10000000u,
                                         100000000u,
                                         1000000000u,
                                         10000000000u,
                                         100000000000u,
                                         1000000000000u,
                                         10000000000000u,
                                         100000000000000u,
                                         1000000000000000u,
                                         10000000000000000u };

/* So many digits of a number below 10^digits - 1/2, which is written without an exponent. */
static void format_digits(double x, int digits, char *text)
{
    struct scaled scaled;
    uint64_t units;
    int dropped = 17 - digits;
    scale(x, &scaled);
    round_scaled(&scaled, power_of_ten[dropped], &units);
    write_units(units, scaled.p - dropped, text);
}

static bool has_plain_digits(double x, int digits)
{
    double most = digits <= 15 ? (double)power_of_ten[digits] - 1.0 : by_whole_max;
    return digits >= 1 && digits <= 17 && x >= by_whole_min && x < by_whole_max && x <= most;
}

static void format_by_whole_numbers(double x, char *text)
{
    static const uint64_t unit[] = { 1, 10, 100 };
    struct scaled scaled;
    uint64_t units;
    int dropped = 2; /* of 17 digits */
    scale(x, &scaled);
    while (!round_scaled(&scaled, unit[dropped], &units) && dropped > 0)
        dropped--;
    write_units(units, scaled.p - dropped, text);
}
#endif

const char *number_format(double x, int digits, char text[NUMBER_TEXT_SIZE])
{
#ifdef __SIZEOF_INT128__
    if (has_plain_digits(fabs(x), digits)) {
        text[0] = '-';
        format_digits(fabs(x), digits, text + (x < 0.0 ? 1 : 0));
        return text;
    }
#endif
    return format_by_printf(x, digits, text);
}

const char *number_format_exact(double x, char text[NUMBER_TEXT_SIZE])
{
#ifdef __SIZEOF_INT128__
    if (fabs(x) >= by_whole_min && fabs(x) < by_whole_max) {
        text[0] = '-';
        format_by_whole_numbers(fabs(x), text + (x < 0.0 ? 1 : 0));
        return text;
    }
#endif
    if (x == 0.0)
        return strcpy(text, "0");
    return format_by_trying(x, text);
}
