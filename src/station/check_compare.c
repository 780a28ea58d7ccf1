/* check_compare.c - two spectra on their common bands. */
#include "station/check_compare.h"

#include <math.h>
#include <stdlib.h>

#include "colour/delta_e.h"
#include "colour/lab.h"
#include "colour/xyz.h"

struct pair {
    size_t n;
    double first_nm, step_nm;
    double reference[SPECTRUM_MAX_BANDS], measured[SPECTRUM_MAX_BANDS];
    struct xyz_weights weights;
};

/* One run of the bands of `grid` that both have; false where there is none, or it has a gap. */
static bool find_common(const struct spectrum *grid, const struct spectrum *reference,
                        const struct spectrum *measured, struct pair *ret)
{
    size_t last = 0;
    ret->n = 0;
    ret->step_nm = grid->step_nm;
    for (size_t i = 0; i < grid->n; i++) {
        double nm = spectrum_nm(grid, i);
        size_t r = spectrum_band(reference, nm), m = spectrum_band(measured, nm);
        if (r == reference->n || m == measured->n)
            continue;
        if (ret->n == 0)
            ret->first_nm = nm;
        else if (i != last + 1)
            return false;
        last = i;
        ret->reference[ret->n] = reference->value[r];
        ret->measured[ret->n++] = measured->value[m];
    }
    return ret->n > 0;
}

static void lab_of(const struct pair *pair, const double *value, double Lab[3])
{
    double XYZ[3];
    xyz_from_reflectance(&pair->weights, value, XYZ);
    lab_from_xyz(XYZ, pair->weights.white, Lab);
}

static enum status compare(struct pair *pair, struct check_difference *ret)
{
    double Lab[2][3], sum = 0.0;
    if (xyz_weights_init(ILLUMINANT_D65, OBSERVER_10DEG, pair->first_nm, pair->step_nm, pair->n,
                         &pair->weights) != STATUS_OK)
        return STATUS_UNSUPPORTED;
    lab_of(pair, pair->reference, Lab[0]);
    lab_of(pair, pair->measured, Lab[1]);
    for (size_t i = 0; i < pair->n; i++)
        sum += (pair->measured[i] - pair->reference[i]) * (pair->measured[i] - pair->reference[i]);
    struct check_difference made = { delta_e_2000(Lab[0], Lab[1]), sqrt(sum / (double)pair->n) };
    if (!isfinite(made.dE00) || !isfinite(made.rms))
        return STATUS_UNSUPPORTED;
    *ret = made;
    return STATUS_OK;
}

enum status check_compare(const struct spectrum *reference, const struct spectrum *measured,
                          struct check_difference *ret)
{
    const struct spectrum *grid = measured->step_nm > reference->step_nm ? measured : reference;
    struct pair *pair = malloc(sizeof *pair);
    if (pair == NULL)
        return STATUS_NO_MEMORY;
    enum status s =
        find_common(grid, reference, measured, pair) ? compare(pair, ret) : STATUS_UNSUPPORTED;
    free(pair);
    return s;
}
