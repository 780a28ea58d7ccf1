/* option_refine.c - a wish put together from options. */
#include "cli/option_refine.h"

#include <math.h>
#include <string.h>

#include "base/number.h"
#include "cli/options.h"

static void take_kind(const char *text, struct argp_state *state, struct refine_wish *wish)
{
    if (refine_kind_parse(text != NULL ? text : "three", &wish->kind) != STATUS_OK)
        argp_error(state, "--refine: '%s' is neither three nor skin", text);
}

/* SKIN_PARAMETERS where there is none of that name. */
static size_t parameter_of(const char *text, size_t n)
{
    size_t i = 0;
    while (i < SKIN_PARAMETERS &&
           (strlen(skin_parameter_name(i)) != n || strncmp(skin_parameter_name(i), text, n) != 0))
        i++;
    return i;
}

static void take_fix(const char *text, struct argp_state *state, struct refine_wish *wish)
{
    size_t n = strcspn(text, "="), i = parameter_of(text, n);
    double x;
    if (text[n] == '\0' || i == SKIN_PARAMETERS)
        argp_error(state,
                   "--fix: '%s'; expected NAME=X, NAME one of Cm, Bm, Ch, SO2, epidermis_mm, "
                   "scattering_a, scattering_b",
                   text);
    else if (number_parse(text + n + 1, &x) != STATUS_OK || !isfinite(x))
        argp_error(state, "--fix: '%s' is no number", text + n + 1);
    else if (!isnan(wish->fix[i]))
        argp_error(state, "--fix: %s is fixed twice, at %g and at %g; give it once",
                   skin_parameter_name(i), wish->fix[i], x);
    else
        wish->fix[i] = x;
}

bool option_refine(int key, const char *text, struct argp_state *state, struct refine_wish *wish)
{
    switch (key) {
    case OPTION_REFINE:
        take_kind(text, state, wish);
        return true;
    case OPTION_NOISE:
        wish->white = option_number(state, "noise", text, NOISE_WHITE_MIN, 1.0);
        return true;
    case OPTION_PLACEMENT:
        wish->placement = option_number(state, "placement", text, 0.0, 1.0);
        return true;
    case OPTION_FIX:
        take_fix(text, state, wish);
        return true;
    default:
        return false;
    }
}

void option_refine_check(struct argp_state *state, const struct refine_wish *wish)
{
    bool fixes = false;
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        fixes = fixes || !isnan(wish->fix[i]);
    if (wish->kind != REFINE_NOT)
        return;
    if (!isnan(wish->white))
        argp_error(state, "--noise goes with --refine");
    if (!isnan(wish->placement))
        argp_error(state, "--placement goes with --refine");
    if (fixes)
        argp_error(state, "--fix goes with --refine");
}
