/* refined_match.c - the rows found are where the fit begins. */
#include "match/refined_match.h"

#include <math.h>
#include <string.h>

#include "match/skin_fit.h"

/* ---- names -------------------------------------------------------------------------- */

static const char *const kind_names[REFINE_KINDS] = { "", "three", "skin" };

const char *refine_kind_name(enum refine_kind kind)
{
    return (size_t)kind < REFINE_KINDS ? kind_names[kind] : "";
}

enum status refine_kind_parse(const char *text, enum refine_kind *ret)
{
    for (int i = REFINE_THREE; i < REFINE_KINDS; i++) {
        if (strcmp(text, kind_names[i]) == 0) {
            *ret = (enum refine_kind)i;
            return STATUS_OK;
        }
    }
    return STATUS_NOT_FOUND;
}

const char *noise_source_name(enum noise_source source)
{
    static const char *const names[NOISE_SOURCES] = { "stated", "population", "replicates" };
    return (size_t)source < NOISE_SOURCES ? names[source] : "unknown";
}

/* ---- what is asked ------------------------------------------------------------------ */

struct refine_wish refine_wish_none(void)
{
    struct refine_wish wish = { .kind = REFINE_NOT, .white = NAN, .placement = NAN };
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        wish.fix[i] = NAN;
    return wish;
}

static enum status refuse(enum status s, const char **why, const char *what)
{
    if (why != NULL)
        *why = what;
    return s;
}

static enum status hold(struct fit *fit, size_t i, double value, const char **why)
{
    static const char *const outside[SKIN_PARAMETERS] = {
        "the fixed Cm lies outside the fit's bounds, 0..0.5",
        "the fixed Bm lies outside the fit's bounds, 0..1",
        "the fixed Ch lies outside the fit's bounds, 0.001..0.1 (skin: ..0.2)",
        "the fixed SO2 lies outside the fit's bounds, 0..1",
        "the fixed epidermis_mm lies outside the fit's bounds, 0..1000; 0.08 is usual",
        "the fixed scattering_a lies outside the fit's bounds, 0.5..60 mm^-1",
        "the fixed scattering_b lies outside the fit's bounds, -2..5",
    };
    struct skin_role *role = &fit->role[i];
    if (!fit->own_scattering && i >= SKIN_SCATTERING_A)
        return refuse(STATUS_RANGE, why,
                      "this fit has the scattering of the table; to fix another, fit skin");
    if (i == SKIN_EPIDERMIS_MM && !fit->model->has_thickness)
        return refuse(STATUS_RANGE, why,
                      "this model has no epidermis, so its thickness cannot be fixed; take a "
                      "table of another, such as two-layer");
    if (!(value >= role->lo && value <= role->hi))
        return refuse(STATUS_RANGE, why, outside[i]);
    *role =
        (struct skin_role){ .value = value, .lo = role->lo, .hi = role->hi, .prior_sd = INFINITY };
    return STATUS_OK;
}

static bool noise_is_stated(const struct refine_wish *wish)
{
    return !isnan(wish->white) || !isnan(wish->placement);
}

/* What placements change of a skin is noise too: where noise is stated it is all there is. */
static void forget_spreads(struct fit *fit)
{
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        fit->role[i].spread = 0.0;
    fit->spread_degrees = 0.0;
}

enum status refine_wish_fit(const struct refine_wish *wish, const struct recipe *recipe,
                            struct fit *ret, const char **why)
{
    bool skin = wish->kind == REFINE_SKIN;
    struct fit fit = skin ? fit_skin(recipe->model) : fit_three(recipe);
    enum status s = STATUS_OK;
    fit.illuminant = recipe->illuminant;
    fit.observer = recipe->observer;
    if (noise_is_stated(wish))
        forget_spreads(&fit);
    for (size_t i = 0; i < SKIN_PARAMETERS && s == STATUS_OK; i++)
        if (!isnan(wish->fix[i]))
            s = hold(&fit, i, wish->fix[i], why);
    if (s == STATUS_OK)
        s = fit_check(&fit, why);
    if (s == STATUS_OK)
        *ret = fit;
    return s;
}

enum status refine_wish_noise(const struct refine_wish *wish, const struct spectrum *replicate,
                              size_t n, struct noise *ret, enum noise_source *source)
{
    struct noise noise = noise_default();
    *source = noise_is_stated(wish) ? NOISE_STATED : n > 1 ? NOISE_REPLICATES : NOISE_POPULATION;
    if (*source != NOISE_STATED && wish->kind == REFINE_SKIN)
        noise = noise_skin(); /* its parameters spread from placement to placement themselves */
    else if (*source == NOISE_REPLICATES)
        return noise_from_replicates(&noise, replicate, n, ret);
    if (!isnan(wish->white))
        noise.white = wish->white;
    if (*source == NOISE_STATED)
        noise.placement = isnan(wish->placement) ? 0.0 : wish->placement;
    enum status s = noise_check(&noise, NULL);
    if (s == STATUS_OK)
        *ret = noise;
    return s;
}

/* ---- the answer --------------------------------------------------------------------- */

/* Rows know three parameters; the others begin as the fit says. */
void refined_match_starts(const struct table *table, const struct nearest_hit *hits, size_t n,
                          const struct fit *fit, double (*starts)[SKIN_PARAMETERS])
{
    for (size_t i = 0; i < n; i++) {
        struct table_row row;
        table_get(table, hits[i].row, &row);
        for (size_t j = 0; j < SKIN_PARAMETERS; j++)
            starts[i][j] = fit->role[j].value;
        starts[i][SKIN_CM] = row.Cm;
        starts[i][SKIN_BM] = row.Bm;
        starts[i][SKIN_CH] = row.Ch;
    }
}

void refined_match_colour(const struct table *table, const struct spectrum *mean,
                          const struct refined *refined, double Lab[3])
{
    struct spectrum fitted = *mean;
    double rgb[3];
    for (size_t i = 0; i < fitted.n; i++)
        fitted.value[i] -= refined->residual[i];
    if (matcher_colour(table, &fitted, Lab, rgb) != STATUS_OK)
        Lab[0] = Lab[1] = Lab[2] = NAN;
}

enum status refined_match(const struct matcher *matcher, const struct refiner *refiner,
                          const struct refine_wish *wish, const struct spectrum *replicate,
                          size_t n, const struct spectrum *mean, size_t k, struct nearest_hit *hits,
                          struct refined_match *ret, const char **why)
{
    struct refined_match made = { .wish = *wish };
    double starts[REFINE_STARTS][SKIN_PARAMETERS];
    struct noise noise;
    struct fit fit;
    if (why != NULL)
        *why = NULL;
    if (refiner_model(refiner) != matcher->table->recipe.model)
        return refuse(STATUS_UNSUPPORTED, why,
                      "the fit was made for another model than the table's, so rows and fit are "
                      "not of the same skin; open it for the table's recipe");
    enum status s =
        matcher_match(matcher, mean, k > REFINE_STARTS ? k : REFINE_STARTS, hits, &made.nearest);
    if (s == STATUS_OK)
        s = refine_wish_fit(wish, &matcher->table->recipe, &fit, why);
    if (s == STATUS_OK)
        s = refine_wish_noise(wish, replicate, n, &noise, &made.source);
    if (s != STATUS_OK)
        return s;
    size_t starts_n = made.nearest.found < REFINE_STARTS ? made.nearest.found : REFINE_STARTS;
    refined_match_starts(matcher->table, hits, starts_n, &fit, starts);
    s = refiner_run(refiner, &noise, replicate, n, (const double(*)[SKIN_PARAMETERS])starts,
                    starts_n, REFINE_ALL, &made.refined, why);
    if (s != STATUS_OK)
        return s;
    refined_match_colour(matcher->table, mean, &made.refined, made.Lab);
    *ret = made;
    return STATUS_OK;
}
