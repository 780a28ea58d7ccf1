/* wide.h - numbers of wide_bits bits (MPFR) that read like expressions, for the twins of
 * the functions under test.
 *
 * A number lives in a pool until the pool is released to a mark taken before it was made. */
#ifndef SKINSPEC_TESTS_STABILITY_WIDE_H
#define SKINSPEC_TESTS_STABILITY_WIDE_H

/* Functions, not macros: they would drown -Wconversion. */
#define MPFR_USE_NO_MACRO
#include <mpfr.h>
#include <stdbool.h>
#include <stddef.h>

typedef mpfr_ptr wide;

/* Of numbers made from now on; 200 unless a twin that cancels asks for more. */
extern mpfr_prec_t wide_bits;
enum { WIDE_BITS = 200 };

size_t wide_mark(void);
void wide_release(size_t mark);
void wide_done(void); /* gives all memory back */

wide w(double x);
wide w_int(long n);
wide w_dec(const char *decimal); /* "0.668": the decimal, not the double next to it */
wide w_copy(wide x);             /* at the width of now */
wide w_two_to(long exponent);
wide w_pi(void);

wide w_add(wide x, wide y);
void w_add_to(wide sum, wide x); /* in place: what x was made of may be released */
wide w_sub(wide x, wide y);
wide w_mul(wide x, wide y);
wide w_div(wide x, wide y);
wide w_neg(wide x);
wide w_abs(wide x);
wide w_max(wide x, wide y);
wide w_square(wide x);
wide w_sqrt(wide x);
wide w_cbrt(wide x);
wide w_exp(wide x);
wide w_log(wide x);
wide w_pow(wide x, wide y);
wide w_sin(wide x);
wide w_cos(wide x);
wide w_atan2(wide y, wide x);

bool w_less(wide x, wide y);
bool w_is_zero(wide x);
double w_double(wide x);

#endif
