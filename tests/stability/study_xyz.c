/* study_xyz.c - spectra to XYZ and to L*a*b*: every illuminant, observer and step. */
#include <math.h>
#include <string.h>

#include "base/spectrum.h"
#include "colour/xyz.h"
#include "tests/stability/rooms.h"
#include "tests/stability/twins.h"

/* x: illuminant, observer, grid, kind of spectrum, seed. */
static const struct {
    int first_nm, step_nm;
    size_t n;
} grids[] = { { 400, 10, 31 }, { 380, 10, 37 }, { 360, 10, 43 }, { 400, 5, 61 },
              { 360, 5, 95 },  { 400, 1, 301 }, { 360, 1, 471 } };

enum kind { WHITE, BLACK, ONE_BAND, FAINT, ANY, DECADES, STEEP, KINDS };

static void spectrum_of(const double *x, double *value)
{
    size_t n = grids[(size_t)x[2]].n;
    struct dice dice = { (uint64_t)x[4] * 1000 + (uint64_t)x[3] };
    size_t band = dice_below(&dice, n);
    for (size_t i = 0; i < n; i++) {
        double decade = dice_between(&dice, -12.0, 0.0);
        switch ((enum kind)x[3]) {
        case WHITE:
            value[i] = 1.0;
            break;
        case BLACK:
            value[i] = 0.0;
            break;
        case ONE_BAND:
            value[i] = i == band ? 0.3 : 0.0;
            break;
        case FAINT:
            value[i] = 1e-290 * dice_between(&dice, 1.0, 2.0);
            break;
        case DECADES:
            value[i] = pow(10.0, decade);
            break;
        case STEEP:
            value[i] = exp(-0.3 * (double)i);
            break;
        default:
            value[i] = dice_between(&dice, 0.0, 1.0);
            break;
        }
    }
}

static bool xyz_ours(const double *x, double *y)
{
    static struct xyz_weights weights;
    double value[SPECTRUM_MAX_BANDS];
    size_t g = (size_t)x[2];
    if (xyz_weights_init((enum illuminant)x[0], (enum observer)x[1], grids[g].first_nm,
                         grids[g].step_nm, grids[g].n, &weights) != STATUS_OK)
        return false;
    spectrum_of(x, value);
    xyz_from_reflectance(&weights, value, y);
    memcpy(y + 3, weights.white, sizeof weights.white);
    return true;
}

static struct twin_xyz twin_of(const wide *x)
{
    double chosen[5], value[SPECTRUM_MAX_BANDS];
    for (int i = 0; i < 5; i++)
        chosen[i] = w_double(x[i]);
    size_t g = (size_t)chosen[2];
    spectrum_of(chosen, value);
    return twin_xyz_of((enum illuminant)chosen[0], (enum observer)chosen[1], grids[g].first_nm,
                       grids[g].step_nm, grids[g].n, value);
}

static void xyz_twin(const wide *x, wide *y)
{
    struct twin_xyz t = twin_of(x);
    memcpy(y, t.XYZ, sizeof t.XYZ);
    memcpy(y + 3, t.white, sizeof t.white);
}

/* A sum's: of its terms' magnitudes. */
static void xyz_sensitivity(const wide *x, wide *sum)
{
    struct twin_xyz t = twin_of(x);
    memcpy(sum, t.size, sizeof t.size);
    memcpy(sum + 3, t.white_size, sizeof t.white_size);
}

static void spectra(struct cases *c)
{
    for (int lamp = 0; lamp < ILLUMINANT_COUNT; lamp++)
        for (int observer = 0; observer < OBSERVER_COUNT; observer++)
            for (size_t grid = 0; grid < sizeof grids / sizeof *grids; grid++)
                for (int kind = 0; kind < KINDS; kind++)
                    for (int seed = 0; seed < (kind >= ANY ? 2 : 1); seed++)
                        cases_add(c, (double[]){ lamp, observer, (double)grid, kind, seed });
}

static const struct study studies[] = {
    { "xyz_weights_init and XYZ",
      { "illuminant", "observer", "grid", "spectrum", "seed" },
      0,
      { "X", "Y", "Z", "Xn", "Yn", "Zn" },
      8.0,
      xyz_ours,
      xyz_twin,
      spectra,
      xyz_sensitivity },
};

const struct study_room study_xyz = { "spectrum to XYZ (colour/xyz)", studies,
                                      sizeof studies / sizeof *studies };
