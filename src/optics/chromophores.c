/* chromophores.c - Eqs. 1-3 and 6 of the paper, and haemoglobin from its table. */
#include "optics/chromophores.h"

#include <math.h>

#include "base/units.h"
#include "optics/haemoglobin_table.h"

double pheomelanin_sigma_a(double nm)
{
    return 2.9e14 * pow(nm, -4.75);
}

double eumelanin_sigma_a(double nm)
{
    /* l^-3.33; the double next to -3.33 alone costs two last places, that next to -0.33 half. */
    return 6.6e10 / (nm * nm * nm) * pow(nm, -0.33);
}

double base_sigma_a(double nm)
{
    return 0.0244 + 8.53 * exp(-(nm - 154.0) / 66.2);
}

double skin_sigma_s_prime(double nm)
{
    return 14.74 * pow(nm, -0.22) + 2.2e11 * pow(nm, -4.0);
}

/* Place in the table: row below and the fraction of the way to the next.  The
 * last wavelength belongs to the last interval. */
static bool table_place(double nm, size_t *row, double *fraction)
{
    if (!(nm >= CHROMOPHORES_MIN_NM && nm <= CHROMOPHORES_MAX_NM))
        return false;
    double place = (nm - HAEMOGLOBIN_TABLE_FIRST_NM) / HAEMOGLOBIN_TABLE_STEP_NM;
    *row = (size_t)place;
    if (*row > HAEMOGLOBIN_TABLE_N - 2)
        *row = HAEMOGLOBIN_TABLE_N - 2;
    *fraction = place - (double)*row;
    return true;
}

double oxyhaemoglobin_epsilon(double nm)
{
    size_t i;
    double f;
    if (!table_place(nm, &i, &f))
        return NAN;
    return (1.0 - f) * haemoglobin_table[i].oxy + f * haemoglobin_table[i + 1].oxy;
}

double deoxyhaemoglobin_epsilon(double nm)
{
    size_t i;
    double f;
    if (!table_place(nm, &i, &f))
        return NAN;
    return (1.0 - f) * haemoglobin_table[i].deoxy + f * haemoglobin_table[i + 1].deoxy;
}

/* 2.303 for ln 10, as the table's author and the paper use it. */
static double whole_blood(double epsilon)
{
    return 2.303 * epsilon * 150.0 / 64500.0 / UNITS_MM_PER_CM;
}

double oxyhaemoglobin_sigma_a(double nm)
{
    return whole_blood(oxyhaemoglobin_epsilon(nm));
}

double deoxyhaemoglobin_sigma_a(double nm)
{
    return whole_blood(deoxyhaemoglobin_epsilon(nm));
}

enum status chromophores_init(double first_nm, double step_nm, size_t n, struct chromophores *ret)
{
    if (n == 0 || n > SPECTRUM_MAX_BANDS || !(step_nm > 0.0))
        return STATUS_RANGE;
    double last_nm = first_nm + (double)(n - 1) * step_nm;
    if (!(first_nm >= CHROMOPHORES_MIN_NM && last_nm <= CHROMOPHORES_MAX_NM))
        return STATUS_RANGE;
    ret->n = n;
    for (size_t i = 0; i < (n + CHROMOPHORES_LANES - 1) / CHROMOPHORES_LANES * CHROMOPHORES_LANES;
         i++) {
        double nm = first_nm + (double)(i < n ? i : n - 1) * step_nm;
        ret->eumelanin[i] = eumelanin_sigma_a(nm);
        ret->pheomelanin[i] = pheomelanin_sigma_a(nm);
        ret->base[i] = base_sigma_a(nm);
        ret->oxy[i] = oxyhaemoglobin_sigma_a(nm);
        ret->deoxy[i] = deoxyhaemoglobin_sigma_a(nm);
        ret->sigma_s_prime[i] = skin_sigma_s_prime(nm);
        ret->log_nm[i] = log(nm / CHROMOPHORES_LOG_NM);
    }
    return STATUS_OK;
}
