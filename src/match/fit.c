/* fit.c - what a fit leaves free, and whether that makes sense. */
#include "match/fit.h"

#include <math.h>

#include "optics/dipole.h"

const char *skin_parameter_name(size_t i)
{
    static const char *const name[SKIN_PARAMETERS] = {
        "Cm", "Bm", "Ch", "SO2", "epidermis_mm", "scattering_a", "scattering_b",
    };
    return i < SKIN_PARAMETERS ? name[i] : "unknown";
}

static struct skin_role held(double value, double lo, double hi)
{
    return (struct skin_role){ .value = value, .lo = lo, .hi = hi, .prior_sd = INFINITY };
}

static struct skin_role between(double lo, double hi, double start)
{
    struct skin_role role = held(start, lo, hi);
    role.free = true;
    return role;
}

struct fit fit_three(const struct recipe *recipe)
{
    return (struct fit){
        .model = recipe->model,
        .role = {
            [SKIN_CM] = between(0.0, TISSUE_CM_MAX, 0.03),
            [SKIN_BM] = between(0.0, 1.0, 0.5),
            [SKIN_CH] = between(TISSUE_CH_MIN, TISSUE_CH_MAX, 0.01),
            [SKIN_SO2] = held(recipe->gamma, 0.0, 1.0),
            [SKIN_EPIDERMIS_MM] = held(recipe->epidermis_mm, 0.0, TISSUE_EPIDERMIS_MM_MAX),
            [SKIN_SCATTERING_A] = held(0.0, 0.0, TISSUE_SCATTERING_A_MAX),
            [SKIN_SCATTERING_B] = held(0.0, -TISSUE_SCATTERING_B_MAX, TISSUE_SCATTERING_B_MAX),
        },
        .eta = recipe->eta,
        .illuminant = recipe->illuminant,
        .observer = recipe->observer,
    };
}

unsigned fit_free(const struct fit *fit)
{
    unsigned free = 0;
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        free |= fit->role[i].free ? 1u << i : 0u;
    return free;
}

struct tissue fit_tissue(const struct fit *fit, const double value[SKIN_PARAMETERS])
{
    return (struct tissue){
        .Cm = value[SKIN_CM],
        .Bm = value[SKIN_BM],
        .Ch = value[SKIN_CH],
        .gamma = value[SKIN_SO2],
        .epidermis_mm = value[SKIN_EPIDERMIS_MM],
        .eta = fit->eta,
        .scattering_a = fit->own_scattering ? value[SKIN_SCATTERING_A] : 0.0,
        .scattering_b = fit->own_scattering ? value[SKIN_SCATTERING_B] : 0.0,
    };
}

/* ---- whether it makes sense ------------------------------------------------------------ */

static const char *role_fault(const struct skin_role *role)
{
    if (!(isfinite(role->lo) && isfinite(role->hi) && role->lo <= role->hi))
        return "the lower bound of a parameter must not lie above the upper one";
    if (!(role->value >= role->lo && role->value <= role->hi))
        return "a parameter must be held, or start, between its bounds";
    if (!(role->spread >= 0.0 && isfinite(role->spread)))
        return "the spread of a parameter between placements must be 0 or above";
    if (!role->free)
        return role->per_replicate ? "a parameter that is held cannot be each replicate's own"
                                   : NULL;
    if (role->lo == role->hi)
        return "a free parameter needs room between its bounds; hold it where there is none";
    if (!(role->prior_sd > 0.0))
        return "a prior's standard deviation must be above 0; hold the parameter where it is known";
    if (isfinite(role->prior_sd) && !(role->prior_mean >= role->lo && role->prior_mean <= role->hi))
        return "a prior contradicts the bounds: its mean must lie between them";
    return NULL;
}

/* Both ends of what is free, and what is held, are skins that the model takes. */
static const char *range_fault(const struct fit *fit)
{
    double A;
    for (int upper = 0; upper < 2; upper++) {
        double value[SKIN_PARAMETERS];
        for (size_t i = 0; i < SKIN_PARAMETERS; i++) {
            const struct skin_role *role = &fit->role[i];
            value[i] = role->free ? (upper ? role->hi : role->lo) : role->value;
        }
        struct tissue t = fit_tissue(fit, value);
        if (tissue_check(&t) != STATUS_OK)
            return "a held value or a bound lies outside what skin can be: Cm, Bm, Ch and SO2 "
                   "0..1, epidermis 0..1000 mm, scattering a 1e-6..1e6 mm^-1, b -10..10";
        if (fit->own_scattering && t.scattering_a == 0.0)
            return "scattering of its own needs an a above 0";
    }
    if (dipole_A(fit->eta, &A) != STATUS_OK)
        return "the refractive index lies outside what the models take; 1.4 is usual";
    return NULL;
}

static const char *spread_fault(const struct fit *fit)
{
    bool own = false, spread = false;
    for (size_t i = 0; i < SKIN_PARAMETERS; i++) {
        own = own || fit->role[i].per_replicate;
        spread = spread || fit->role[i].spread > 0.0;
    }
    if (own && spread)
        return "either replicates have parameters of their own or parameters have a spread, not "
               "both";
    if (!(fit->model_error >= 0.0 && fit->model_error <= 1.0))
        return "the model's error must be a standard deviation of reflectance between 0 and 1";
    if (!(fit->spread_degrees == 0.0 ||
          (fit->spread_degrees > 2.0 && isfinite(fit->spread_degrees))))
        return "the degrees of freedom of the spread must be above 2, or 0 where sites do not "
               "differ";
    return NULL;
}

static const char *fault(const struct fit *fit)
{
    const char *wrong = spread_fault(fit);
    for (size_t i = 0; i < SKIN_PARAMETERS && wrong == NULL; i++)
        wrong = role_fault(&fit->role[i]);
    if (wrong != NULL)
        return wrong;
    if (fit_free(fit) == 0)
        return "nothing is free: there is nothing to fit";
    if (!fit->own_scattering &&
        (fit->role[SKIN_SCATTERING_A].free || fit->role[SKIN_SCATTERING_B].free))
        return "scattering can only be free where the fit has scattering of its own";
    if (fit->role[SKIN_EPIDERMIS_MM].free && !fit->model->has_thickness)
        return "this model has no epidermis whose thickness could be free";
    return range_fault(fit);
}

enum status fit_check(const struct fit *fit, const char **why)
{
    const char *wrong = NULL;
    enum status s = STATUS_OK;
    if (fit->model->slopes == NULL) {
        wrong = "this model has no derivatives, so there is nothing to refine by; take a table of "
                "another model, such as two-layer";
        s = STATUS_UNSUPPORTED;
    } else if (fit->model->has_noise) {
        wrong =
            "this model's own noise leaves no smooth way down to a minimum; take its rows as they "
            "are, or refine with a table of transport-8";
        s = STATUS_UNSUPPORTED;
    } else if ((wrong = fault(fit)) != NULL) {
        s = STATUS_RANGE;
    }
    if (wrong != NULL && why != NULL)
        *why = wrong;
    return s;
}
