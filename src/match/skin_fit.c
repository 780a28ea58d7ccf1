/* skin_fit.c - what measured skin asked for. */
#include "match/skin_fit.h"

#include <math.h>

static struct skin_role held(double value, double lo, double hi)
{
    return (struct skin_role){ .value = value, .lo = lo, .hi = hi, .prior_sd = INFINITY };
}

static struct skin_role between(double lo, double hi, double start, double spread, bool relative)
{
    struct skin_role role = held(start, lo, hi);
    role.free = true;
    role.spread = spread;
    role.spread_relative = relative;
    return role;
}

struct fit fit_skin(const struct model *model)
{
    return (struct fit){
        .model = model,
        .role = {
            [SKIN_CM] = between(0.0, TISSUE_CM_MAX, 0.02, SKIN_FIT_CM_SPREAD, true),
            [SKIN_BM] = held(SKIN_FIT_BM, 0.0, 1.0),
            [SKIN_CH] = between(TISSUE_CH_MIN, SKIN_FIT_CH_MAX, 0.01, SKIN_FIT_CH_SPREAD, true),
            [SKIN_SO2] = between(0.0, 1.0, 0.75, SKIN_FIT_SO2_SPREAD, false),
            [SKIN_EPIDERMIS_MM] = held(SKIN_FIT_EPIDERMIS_MM, 0.0, TISSUE_EPIDERMIS_MM_MAX),
            [SKIN_SCATTERING_A] = between(0.5, 60.0, 9.0, SKIN_FIT_A_SPREAD, true),
            [SKIN_SCATTERING_B] = between(-2.0, 5.0, 1.4, SKIN_FIT_B_SPREAD, false),
        },
        .own_scattering = true,
        .eta = 1.4,
        .model_error = SKIN_FIT_MODEL_ERROR,
        .spread_degrees = SKIN_FIT_SPREAD_DEGREES,
        .illuminant = ILLUMINANT_D65,
        .observer = OBSERVER_10DEG,
    };
}

struct noise noise_skin(void)
{
    return noise_white(SKIN_FIT_WHITE);
}
