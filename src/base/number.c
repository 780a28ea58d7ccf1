/* number.c - strtod and printf under the C locale, whatever the program's is. */
#define _GNU_SOURCE /* strtod_l */
#include "base/number.h"

#include <errno.h>
#include <locale.h>
#include <math.h>
#include <pthread.h>
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

const char *number_format(double x, int digits, char text[NUMBER_TEXT_SIZE])
{
    locale_t before = uselocale(the_c_locale());
    snprintf(text, NUMBER_TEXT_SIZE, "%.*g", digits, x == 0.0 ? 0.0 : x); /* no "-0" */
    uselocale(before);
    return text;
}

const char *number_format_exact(double x, char text[NUMBER_TEXT_SIZE])
{
    for (int digits = 15; digits < 17; digits++) {
        double back;
        number_format(x, digits, text);
        if (number_parse(text, &back) == STATUS_OK && back == x)
            return text;
    }
    return number_format(x, 17, text);
}
