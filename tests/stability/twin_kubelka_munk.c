/* twin_kubelka_munk.c - Kubelka and Munk's two fluxes carried up through the epidermis by the
 * exponential of their matrix, e^(-Md) = cosh(gd) - M sinh(gd)/g. */
#include "tests/stability/twins.h"

/* sinh(gd)/g is a difference that loses gd, which may be 1e-150. */
enum { BITS = 1400 };

struct wide_sheet {
    wide K, S, g;
};

static struct wide_sheet sheet_of(wide sigma_a, wide sigma_s)
{
    struct wide_sheet s;
    s.K = w_mul(w_int(2), sigma_a);
    s.S = w_mul(w_dec("0.75"), sigma_s);
    s.g = w_sqrt(w_mul(s.K, w_add(s.K, w_mul(w_int(2), s.S))));
    return s;
}

/* J/I at the top of the epidermis, where below it that is x. */
static wide through(const struct wide_sheet *e, wide d, wide x)
{
    wide gd = w_mul(e->g, d), up = w_exp(gd), down = w_exp(w_neg(gd)), KS = w_add(e->K, e->S);
    wide cosh_gd = w_div(w_add(up, down), w_int(2));
    wide s = w_is_zero(gd) ? d : w_div(w_sub(up, down), w_mul(w_int(2), e->g));
    wide I = w_add(cosh_gd, w_mul(s, w_sub(KS, w_mul(e->S, x))));
    wide J = w_add(w_mul(cosh_gd, x), w_mul(s, w_sub(e->S, w_mul(KS, x))));
    return w_div(J, I);
}

wide twin_kubelka_munk(const wide *x)
{
    mpfr_prec_t narrow = wide_bits;
    wide_bits += BITS;
    struct wide_sheet epi = sheet_of(w_copy(x[0]), w_copy(x[1]));
    struct wide_sheet der = sheet_of(w_copy(x[2]), w_copy(x[3]));
    wide eta = w_copy(x[5]), Ri = twin_F_dr(eta), one = w_int(1);
    wide endless = w_div(der.S, w_add(w_add(der.K, der.S), der.g));
    wide inside = through(&epi, w_copy(x[4]), endless);
    wide entering = w_mul(w_sub(one, twin_Rs(eta)), w_sub(one, Ri));
    wide R = w_div(w_mul(entering, inside), w_sub(one, w_mul(Ri, inside)));
    wide_bits = narrow;
    return R;
}
