/* wide.c - a pool of MPFR numbers. */
#include "tests/stability/wide.h"

#include <stdio.h>
#include <stdlib.h>

enum { POOL = 65536 };
static mpfr_t pool[POOL];
static size_t used, made;
mpfr_prec_t wide_bits = WIDE_BITS;

size_t wide_mark(void)
{
    return used;
}

void wide_release(size_t mark)
{
    used = mark;
}

void wide_done(void)
{
    while (made > 0)
        mpfr_clear(pool[--made]);
    used = 0;
    mpfr_free_cache();
}

static wide fresh(void)
{
    if (used == POOL) {
        fprintf(stderr, "stability: a twin makes more than %d numbers\n", POOL);
        abort();
    }
    if (used == made) {
        if (made == 0) { /* e^-1e13 is a number, not 0 */
            mpfr_set_emin(mpfr_get_emin_min());
            mpfr_set_emax(mpfr_get_emax_max());
        }
        mpfr_init2(pool[made++], wide_bits);
    } else if (mpfr_get_prec(pool[used]) != wide_bits) {
        mpfr_set_prec(pool[used], wide_bits);
    }
    return pool[used++];
}

wide w(double x)
{
    wide r = fresh();
    mpfr_set_d(r, x, MPFR_RNDN);
    return r;
}

wide w_int(long n)
{
    wide r = fresh();
    mpfr_set_si(r, n, MPFR_RNDN);
    return r;
}

wide w_dec(const char *decimal)
{
    wide r = fresh();
    if (mpfr_set_str(r, decimal, 10, MPFR_RNDN) != 0) {
        fprintf(stderr, "stability: '%s' is no number\n", decimal);
        abort();
    }
    return r;
}

wide w_copy(wide x)
{
    wide r = fresh();
    mpfr_set(r, x, MPFR_RNDN);
    return r;
}

wide w_two_to(long exponent)
{
    wide r = fresh();
    mpfr_set_si_2exp(r, 1, exponent, MPFR_RNDN);
    return r;
}

wide w_pi(void)
{
    wide r = fresh();
    mpfr_const_pi(r, MPFR_RNDN);
    return r;
}

#define UNARY(name, function) \
    wide name(wide x) \
    { \
        wide r = fresh(); \
        function(r, x, MPFR_RNDN); \
        return r; \
    }
#define BINARY(name, function) \
    wide name(wide x, wide y) \
    { \
        wide r = fresh(); \
        function(r, x, y, MPFR_RNDN); \
        return r; \
    }

BINARY(w_add, mpfr_add)
BINARY(w_sub, mpfr_sub)
BINARY(w_mul, mpfr_mul)
BINARY(w_div, mpfr_div)
BINARY(w_max, mpfr_max)
BINARY(w_pow, mpfr_pow)
BINARY(w_atan2, mpfr_atan2)
UNARY(w_neg, mpfr_neg)
UNARY(w_abs, mpfr_abs)
UNARY(w_square, mpfr_sqr)
UNARY(w_sqrt, mpfr_sqrt)
UNARY(w_cbrt, mpfr_cbrt)
UNARY(w_exp, mpfr_exp)
UNARY(w_log, mpfr_log)
UNARY(w_sin, mpfr_sin)
UNARY(w_cos, mpfr_cos)

void w_add_to(wide sum, wide x)
{
    mpfr_add(sum, sum, x, MPFR_RNDN);
}

bool w_less(wide x, wide y)
{
    return mpfr_less_p(x, y) != 0;
}

bool w_is_zero(wide x)
{
    return mpfr_zero_p(x) != 0;
}

double w_double(wide x)
{
    return mpfr_get_d(x, MPFR_RNDN);
}
