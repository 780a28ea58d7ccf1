/* twin_xyz.c - [E308] and [CIE15] 7.1: XYZ as a sum over the tables, in wide numbers. */
#include "colour/cie_tables.h"
#include "tests/stability/twins.h"

/* [CIE15] Daylights and A end at 780 nm; FL and LED begin at 380. */
static bool published(enum illuminant illuminant, int nm)
{
    if (illuminant == ILLUMINANT_E)
        return true;
    return nm <= 780 && (nm >= 380 || illuminant < ILLUMINANT_FL2);
}

static wide power_at_5nm(enum illuminant illuminant, int nm)
{
    if (!published(illuminant, nm))
        return w_int(0);
    return w(cie_illuminant[(nm - CIE_ILLUMINANT_FIRST_NM) / CIE_ILLUMINANT_STEP_NM][illuminant]);
}

/* Planck's law at 2848 K, c2 = 1.435e7 nm K, 100 at 560 nm. */
static wide planck(int nm)
{
    wide c2 = w_div(w_dec("1.435e7"), w_int(2848)), one = w_int(1);
    wide at_560 = w_sub(w_exp(w_div(c2, w_int(560))), one);
    wide here = w_sub(w_exp(w_div(c2, w_int(nm))), one);
    wide ratio = w_pow(w_div(w_int(560), w_int(nm)), w_int(5));
    return w_mul(w_int(100), w_mul(ratio, w_div(at_560, here)));
}

/* Straight lines between the 5 nm points, and nothing beyond the last. */
static wide power_at(enum illuminant illuminant, int nm)
{
    int past = nm % CIE_ILLUMINANT_STEP_NM;
    if (past == 0)
        return power_at_5nm(illuminant, nm);
    if (!published(illuminant, nm))
        return w_int(0);
    if (illuminant == ILLUMINANT_A)
        return planck(nm);
    wide low = power_at_5nm(illuminant, nm - past);
    wide high = power_at_5nm(illuminant, nm - past + CIE_ILLUMINANT_STEP_NM);
    return w_add(low, w_div(w_mul(w_sub(high, low), w_int(past)), w_int(CIE_ILLUMINANT_STEP_NM)));
}

/* The band that a wavelength counts to: the first and the last take what lies beyond. */
static size_t band_of(int nm, int first_nm, int step_nm, size_t n)
{
    if (nm < first_nm)
        return 0;
    size_t i = (size_t)((nm - first_nm) / step_nm);
    return i < n ? i : n - 1;
}

static void add(struct twin_xyz *t, wide weight, const double *value, int k, size_t band)
{
    wide term = w_mul(weight, w(value[band]));
    w_add_to(t->white[k], weight);
    w_add_to(t->XYZ[k], term);
    w_add_to(t->size[k], w_abs(term));
    w_add_to(t->white_size[k], w_abs(weight));
}

static wide sum_of_Y(enum illuminant illuminant, enum observer observer, int step_nm)
{
    wide sum = w_int(0);
    size_t mark = wide_mark();
    for (int nm = CIE_CMF_FIRST_NM; nm < CIE_CMF_FIRST_NM + CIE_CMF_N; nm += step_nm) {
        wide y = w(cie_cmf[observer][nm - CIE_CMF_FIRST_NM][1]);
        w_add_to(sum, w_mul(power_at(illuminant, nm), y));
        wide_release(mark);
    }
    return sum;
}

struct twin_xyz twin_xyz_of(enum illuminant illuminant, enum observer observer, int first_nm,
                            int step_nm, size_t n, const double *value)
{
    struct twin_xyz t;
    bool table = step_nm == CIE_WEIGHTS_STEP_NM;
    int last_nm = table ? CIE_WEIGHTS_FIRST_NM + (CIE_WEIGHTS_N - 1) * step_nm
                        : CIE_CMF_FIRST_NM + CIE_CMF_N - 1;
    wide sum_Y = table ? NULL : sum_of_Y(illuminant, observer, step_nm);
    for (int k = 0; k < 3; k++) { /* w_int(0) each: they are added to in place */
        t.XYZ[k] = w_int(0);
        t.white[k] = w_int(0);
        t.size[k] = w_int(0);
        t.white_size[k] = w_int(0);
    }
    size_t mark = wide_mark();
    for (int nm = CIE_CMF_FIRST_NM; nm <= last_nm; nm += step_nm) {
        size_t band = band_of(nm, first_nm, step_nm, n);
        wide S = table ? NULL : w_div(w_mul(w_int(100), power_at(illuminant, nm)), sum_Y);
        for (int k = 0; k < 3; k++) {
            wide weight = table ? w(cie_weights_10nm[illuminant][observer]
                                                    [(nm - CIE_WEIGHTS_FIRST_NM) / step_nm][k])
                                : w_mul(S, w(cie_cmf[observer][nm - CIE_CMF_FIRST_NM][k]));
            add(&t, weight, value, k, band);
        }
        wide_release(mark);
    }
    return t;
}
