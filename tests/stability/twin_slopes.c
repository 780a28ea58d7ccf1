/* twin_slopes.c - derivatives of a twin by differences of so many bits that nothing is seen
 * of their step: 2^-200 of the argument, and its square of error. */
#include "tests/stability/twins.h"

enum { STEP = -200, STEP_AT_0 = -300, BITS = 700 };

static wide shifted(twin_of_one *f, const wide *x, size_t n, size_t i, wide by)
{
    wide moved[TWIN_INPUTS];
    for (size_t j = 0; j < n; j++)
        moved[j] = w_copy(x[j]);
    moved[i] = w_add(moved[i], by);
    return f(moved);
}

wide twin_slope(twin_of_one *f, const wide *x, size_t n, size_t i, wide scale)
{
    mpfr_prec_t narrow = wide_bits;
    wide_bits += BITS;
    wide step = w_mul(w_abs(w_copy(scale)), w_two_to(STEP));
    wide rise = w_sub(shifted(f, x, n, i, step), shifted(f, x, n, i, w_neg(step)));
    wide slope = w_div(rise, w_mul(w_int(2), step));
    wide_bits = narrow;
    return w_copy(slope);
}

wide twin_slope_from_0(twin_of_one *f, const wide *x, size_t n, size_t i, wide scale)
{
    mpfr_prec_t narrow = wide_bits;
    wide_bits += BITS;
    wide step = w_mul(w_abs(w_copy(scale)), w_two_to(STEP_AT_0));
    wide rise = w_sub(shifted(f, x, n, i, step), shifted(f, x, n, i, w_int(0)));
    wide slope = w_div(rise, step);
    wide_bits = narrow;
    return w_copy(slope);
}

/* Of a root, a step of 2^-300 shows 2^-150. */
wide twin_root_slope(twin_of_one *f, const wide *x, size_t n, size_t i, wide scale)
{
    mpfr_prec_t narrow = wide_bits;
    wide_bits += BITS;
    wide step = w_mul(w_abs(w_copy(scale)), w_two_to(STEP_AT_0));
    wide rise = w_sub(shifted(f, x, n, i, step), shifted(f, x, n, i, w_int(0)));
    wide slope = w_div(rise, w_sqrt(step));
    wide_bits = narrow;
    return w_copy(slope);
}
