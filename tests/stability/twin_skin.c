/* twin_skin.c - Eqs. 1-6 of the paper with their constants as printed decimals. */
#include "optics/haemoglobin_table.h"
#include "tests/stability/twins.h"

/* a l^-b */
static wide power(const char *a, wide nm, const char *minus_b)
{
    return w_mul(w_dec(a), w_pow(nm, w_dec(minus_b)));
}

wide twin_pheomelanin(wide nm)
{
    return power("2.9e14", nm, "-4.75");
}

wide twin_eumelanin(wide nm)
{
    return power("6.6e10", nm, "-3.33");
}

wide twin_base(wide nm)
{
    wide fall = w_exp(w_neg(w_div(w_sub(nm, w_int(154)), w_dec("66.2"))));
    return w_add(w_dec("0.0244"), w_mul(w_dec("8.53"), fall));
}

wide twin_scattering(wide nm)
{
    return w_add(power("14.74", nm, "-0.22"), power("2.2e11", nm, "-4"));
}

/* Linear between the points of the table; beyond its ends by the last line. */
wide twin_epsilon(wide nm, bool oxygenated)
{
    wide place = w_div(w_sub(nm, w(HAEMOGLOBIN_TABLE_FIRST_NM)), w(HAEMOGLOBIN_TABLE_STEP_NM));
    size_t row = 0;
    while (row < HAEMOGLOBIN_TABLE_N - 2 && !w_less(place, w_int((long)row + 1)))
        row++;
    double low = haemoglobin_table[row].deoxy, high = haemoglobin_table[row + 1].deoxy;
    if (oxygenated) {
        low = haemoglobin_table[row].oxy;
        high = haemoglobin_table[row + 1].oxy;
    }
    wide past = w_sub(place, w_int((long)row));
    return w_add(w(low), w_mul(w_sub(w(high), w(low)), past));
}

/* 2.303 eps 150 / 64500 / 10 */
wide twin_blood(wide nm, bool oxygenated)
{
    wide share = w_div(w_mul(w_dec("2.303"), w_int(150)), w_int(645000));
    return w_mul(share, twin_epsilon(nm, oxygenated));
}

/* p x + (1-p) y */
static wide blend(wide p, wide x, wide y)
{
    return w_add(w_mul(p, x), w_mul(w_sub(w_int(1), p), y));
}

struct twin_skin twin_skin_of(const wide *x)
{
    wide Cm = x[0], Bm = x[1], Ch = x[2], gamma = x[3], a = x[4], b = x[5], nm = x[6];
    struct twin_skin s;
    s.sigma_a1 = blend(Cm, blend(Bm, twin_eumelanin(nm), twin_pheomelanin(nm)), twin_base(nm));
    s.sigma_a2 =
        blend(Ch, blend(gamma, twin_blood(nm, true), twin_blood(nm, false)), twin_base(nm));
    if (w_is_zero(a)) {
        s.sigma_s1 = twin_scattering(nm);
        s.sigma_s2 = w_div(s.sigma_s1, w_int(2));
    } else {
        s.sigma_s1 = s.sigma_s2 = w_mul(a, w_pow(w_div(nm, w_int(500)), w_neg(b)));
    }
    return s;
}
