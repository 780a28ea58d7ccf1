/* number.h - numbers as text, the same in every locale: '.' for the point. */
#ifndef SKINSPEC_BASE_NUMBER_H
#define SKINSPEC_BASE_NUMBER_H

#include <stddef.h>

#include "base/status.h"

/* The whole text as one finite decimal number: sign, digits, point, exponent.
 * STATUS_FORMAT for anything else, white space, hexadecimal, "nan" and "inf"
 * included; STATUS_RANGE where it overflows a double. */
enum status number_parse(const char *text, double *ret);

/* The same of n bytes that need no NUL behind them: STATUS_FORMAT also where they are
 * NUMBER_LONGEST or more.  What has up to 15 digits and no exponent is read by whole numbers,
 * many times as fast as strtod() and to the same bits. */
enum { NUMBER_LONGEST = 64 };
enum status number_parse_n(const char *text, size_t n, double *ret);

/* The whole text as an integer 0 .. max. */
enum status number_parse_count(const char *text, size_t max, size_t *ret);

/* Room for any number below, the closing NUL included. */
enum { NUMBER_TEXT_SIZE = 32 };

/* x with at most `digits` significant digits (1..17), shortest form ("0.08"). */
const char *number_format(double x, int digits, char text[NUMBER_TEXT_SIZE]);

/* The fewest digits that read back as the same double. */
const char *number_format_exact(double x, char text[NUMBER_TEXT_SIZE]);

#endif
