/* scene.c - a scene looked through for what contradicts itself. */
#include "plan/scene.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>

#include "match/noise.h"
#include "optics/tissue.h"

/* ---- names -------------------------------------------------------------------------- */

const char *scene_want_name(size_t i)
{
    static const char *const names[SCENE_WANTS] = { "lab",     "rgb",     "coefficients",
                                                    "nearest", "refined", "interval" };
    return i < SCENE_WANTS ? names[i] : "unknown";
}

const char *scene_start_name(enum scene_start start)
{
    static const char *const names[] = { "", "rows", "closed-form" };
    return (size_t)start < sizeof names / sizeof *names ? names[start] : "";
}

/* ---- what is said ------------------------------------------------------------------- */

struct scene scene_empty(void)
{
    struct scene_range any = { NAN, NAN };
    return (struct scene){ .illuminant = ILLUMINANT_D65,
                           .observer = OBSERVER_10DEG,
                           .k = 1,
                           .range = { any, any, any },
                           .first_nm = NAN,
                           .last_nm = NAN,
                           .step_nm = NAN,
                           .white = NAN,
                           .placement = NAN,
                           .bound = { { NAN, NAN, NAN }, NAN, NAN },
                           .budget_us = NAN };
}

bool scene_is_bounded(const struct scene *scene)
{
    const struct scene_bound *b = &scene->bound;
    return !isnan(b->coefficient[0]) || !isnan(b->coefficient[1]) || !isnan(b->coefficient[2]) ||
           !isnan(b->dE00) || !isnan(b->rms);
}

bool scene_wants_skin(const struct scene *scene)
{
    return (scene->wanted & (SCENE_COEFFICIENTS | SCENE_NEAREST | SCENE_REFINED)) != 0;
}

struct scene_range scene_whole_range(size_t i)
{
    static const struct scene_range whole[3] = { { 0.0, TISSUE_CM_MAX },
                                                 { 0.0, 1.0 },
                                                 { TISSUE_CH_MIN, TISSUE_CH_MAX } };
    return whole[i];
}

struct scene_range scene_range_of(const struct scene *scene, size_t i)
{
    return isnan(scene->range[i].lo) ? scene_whole_range(i) : scene->range[i];
}

bool scene_is_held(const struct scene *scene, size_t i)
{
    return scene->range[i].lo == scene->range[i].hi; /* not of NAN */
}

bool scene_is_ranged(const struct scene *scene)
{
    return !isnan(scene->range[0].lo) || !isnan(scene->range[1].lo) || !isnan(scene->range[2].lo);
}

/* ---- looked through ----------------------------------------------------------------- */

__attribute__((format(printf, 2, 3))) static enum status refuse(char *why, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(why, SCENE_WHY_SIZE, format, arguments);
    va_end(arguments);
    return STATUS_RANGE;
}

static enum status check_wanted(const struct scene *s, char *why)
{
    unsigned searched = SCENE_COEFFICIENTS | SCENE_NEAREST | SCENE_REFINED;
    if (s->wanted == 0 || s->wanted >= 1u << SCENE_WANTS)
        return refuse(why, "nothing is wanted; name one or more of lab, rgb, coefficients, "
                           "nearest, refined, interval");
    if ((s->wanted & SCENE_INTERVAL) != 0 && (s->wanted & SCENE_REFINED) == 0)
        return refuse(why, "an interval is that of a fitted skin; want `refined` as well, or leave "
                           "`interval` out");
    if (s->k < 1 || s->k > SCENE_MAX_K)
        return refuse(why, "k is %zu; it must be 1..%d", s->k, (int)SCENE_MAX_K);
    if (s->k > 1 && (s->wanted & SCENE_NEAREST) == 0)
        return refuse(why, "k counts the nearest rows; want `nearest` as well, or leave `k` out");
    if (s->has_by && (s->wanted & searched) == 0)
        return refuse(why, "`by` says how a skin is searched, and none is wanted; want `nearest`, "
                           "or leave `by` out");
    if (s->fit != REFINE_NOT && (s->wanted & (SCENE_REFINED | SCENE_COEFFICIENTS)) == 0)
        return refuse(why, "`fit` says how a skin is refined; want `refined` as well, or leave "
                           "`fit` out");
    if (s->start == SCENE_START_CLOSED_FORM && s->has_by && (s->wanted & SCENE_NEAREST) == 0)
        return refuse(why, "from the closed form no rows are searched; leave `by` out, or `start`");
    return STATUS_OK;
}

static enum status check_range(const struct scene *s, size_t i, char *why)
{
    const char *name = skin_parameter_name(i);
    struct scene_range r = s->range[i], whole = scene_whole_range(i);
    if (isnan(r.lo) && isnan(r.hi))
        return STATUS_OK;
    if (isnan(r.lo) || isnan(r.hi))
        return refuse(why, "the range of %s has one end; give both", name);
    if (r.lo > r.hi)
        return refuse(why, "the range of %s is empty: %g is above %g; give the lower end first",
                      name, r.lo, r.hi);
    if (r.lo >= whole.lo && r.hi <= whole.hi)
        return STATUS_OK;
    if (r.lo == r.hi)
        return refuse(why, "%s is held at %g, outside %g..%g; hold it inside", name, r.lo, whole.lo,
                      whole.hi);
    return refuse(why, "%s may be %g..%g here, beyond %g..%g; keep inside", name, r.lo, r.hi,
                  whole.lo, whole.hi);
}

static enum status check_fit(const struct scene *s, char *why)
{
    bool fits = (s->wanted & SCENE_REFINED) != 0;
    if (fits && scene_is_held(s, SKIN_CM) && scene_is_held(s, SKIN_BM) &&
        (s->no_dermis || scene_is_held(s, SKIN_CH)) && s->fit != REFINE_SKIN)
        return refuse(why,
                      "Cm, Bm and Ch are all held%s, so nothing is left to fit; free one of "
                      "them, or leave `refined` out",
                      s->no_dermis ? " (Ch without the dermis)" : "");
    if (s->fit == REFINE_SKIN && !isnan(s->range[SKIN_BM].lo) && !scene_is_held(s, SKIN_BM))
        return refuse(why, "the fit for measured skin holds Bm, which the data do not tell from "
                           "scattering; hold it at one value, or fit three");
    if (!isnan(s->white) && !(s->white >= NOISE_WHITE_MIN && s->white <= 1.0))
        return refuse(why, "the noise is %g; it must be %g..1", s->white, NOISE_WHITE_MIN);
    if (!isnan(s->placement) && !(s->placement >= 0.0 && s->placement <= 1.0))
        return refuse(why, "the placement noise is %g; it must be 0..1", s->placement);
    if (s->model == NULL || s->model->reflectance != NULL)
        return STATUS_OK;
    if (fits || (s->has_by && s->by == MATCH_SPECTRUM))
        return refuse(why,
                      "model %s has no spectra, so it can neither be refined nor searched by "
                      "spectrum; search it by rgb, or take another model, such as two-layer",
                      s->model->name);
    return STATUS_OK;
}

static enum status check_bands(const struct scene *s, char *why)
{
    int said = !isnan(s->first_nm) + !isnan(s->last_nm) + !isnan(s->step_nm);
    if (said == 0)
        return STATUS_OK;
    if (said < 3)
        return refuse(why, "bands need first_nm, last_nm and step_nm");
    if (!(s->step_nm > 0.0) || !(s->first_nm <= s->last_nm) || !isfinite(s->last_nm) ||
        !isfinite(s->first_nm))
        return refuse(why,
                      "the bands %g..%g nm by %g are none; rise from first_nm to last_nm by a "
                      "step_nm above 0",
                      s->first_nm, s->last_nm, s->step_nm);
    double n = (s->last_nm - s->first_nm) / s->step_nm;
    if (fabs(n - nearbyint(n)) > 1e-6 || n >= SPECTRUM_MAX_BANDS)
        return refuse(why,
                      "from %g nm by %g one does not come to %g nm within %d bands; change "
                      "last_nm or step_nm",
                      s->first_nm, s->step_nm, s->last_nm, (int)SPECTRUM_MAX_BANDS);
    return STATUS_OK;
}

static enum status check_limits(const struct scene *s, char *why)
{
    const double bounds[] = { s->bound.coefficient[0], s->bound.coefficient[1],
                              s->bound.coefficient[2], s->bound.dE00, s->bound.rms };
    static const char *const names[] = { "Cm", "Bm", "Ch", "dE00", "rms" };
    for (size_t i = 0; i < sizeof bounds / sizeof *bounds; i++)
        if (!isnan(bounds[i]) && !(bounds[i] > 0.0 && isfinite(bounds[i])))
            return refuse(why, "the error of %s is to be at most %g; say a number above 0",
                          names[i], bounds[i]);
    for (size_t i = 0; i < 3; i++)
        if (!isnan(bounds[i]) && scene_is_held(s, i))
            return refuse(why,
                          "%s is held at %g, so it has no error to bound; leave one of the two "
                          "out",
                          names[i], s->range[i].lo);
    if (!isnan(s->budget_us) && !(s->budget_us > 0.0 && isfinite(s->budget_us)))
        return refuse(why, "the time is to be %g us; say a number above 0", s->budget_us);
    if (!isnan(s->budget_us) && scene_is_bounded(s))
        return refuse(why, "a time budget and an error bound are both given; give one: the least "
                           "error for a time, or the least time for an error");
    if (scene_is_bounded(s) && s->no_dermis)
        return refuse(why, "no error was measured without the dermis, and both `error` and "
                           "`dermis` are given; leave `dermis` out: where rms alone is bounded and "
                           "has room for it, the dermis is left out by itself");
    if (scene_is_bounded(s) && !scene_wants_skin(s))
        return refuse(why, "an error bound is about the skin that is found, and none is wanted; "
                           "want coefficients, nearest or refined, or leave the bound out");
    return STATUS_OK;
}

enum status scene_check_use(const struct scene *s, char why[SCENE_WHY_SIZE])
{
    static const unsigned colours = SCENE_LAB | SCENE_RGB,
                          fits = SCENE_COEFFICIENTS | SCENE_REFINED,
                          skins = SCENE_COEFFICIENTS | SCENE_NEAREST | SCENE_REFINED;
    const struct scene usual = scene_empty();
    const struct {
        const char *name;
        unsigned by;
        bool said;
    } members[] = {
        { "illuminant", colours, s->illuminant != usual.illuminant },
        { "observer", colours, s->observer != usual.observer },
        { "model", skins, s->model != NULL },
        { "Cm", skins, !isnan(s->range[SKIN_CM].lo) },
        { "Bm", skins, !isnan(s->range[SKIN_BM].lo) },
        { "Ch", skins, !isnan(s->range[SKIN_CH].lo) },
        { "start", fits, s->start != SCENE_START_ANY },
        { "dermis", fits, s->no_dermis },
        { "noise", skins, !isnan(s->white) },
        { "placement", skins, !isnan(s->placement) },
    };
    for (size_t i = 0; i < sizeof members / sizeof *members; i++)
        if (members[i].said && (s->wanted & members[i].by) == 0)
            return refuse(why, "nothing that is wanted uses `%s`; want %s, or leave it out",
                          members[i].name,
                          members[i].by == colours ? "`lab` or `rgb`"
                          : members[i].by == fits  ? "`refined` or `coefficients`"
                                                   : "`coefficients`, `nearest` or `refined`");
    if (s->no_dermis && s->fit == REFINE_SKIN)
        return refuse(why, "the fit for measured skin is about its dermis as well; fit three, or "
                           "leave `dermis` out");
    return STATUS_OK;
}

enum status scene_check(const struct scene *scene, char why[SCENE_WHY_SIZE])
{
    enum status s = check_wanted(scene, why);
    for (size_t i = 0; i < 3 && s == STATUS_OK; i++)
        s = check_range(scene, i, why);
    if (s == STATUS_OK)
        s = check_fit(scene, why);
    if (s == STATUS_OK)
        s = check_bands(scene, why);
    return s == STATUS_OK ? check_limits(scene, why) : s;
}
