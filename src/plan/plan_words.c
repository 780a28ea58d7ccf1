/* plan_words.c - what a plan leaves out, in words. */
#include <stdio.h>

#include "plan/plan.h"

const char *plan_part_name(enum plan_part part)
{
    static const char *const names[PLAN_PARTS] = {
        "colour",
        "table",
        "spectra",
        "search",
        "closed_form",
        "fit",
        "covariance",
        "intervals",
        "second",
        "fitted_colour",
        "rows",
        "bands",
        "eumelanin",
        "pheomelanin",
        "derivatives_by_Cm",
        "derivatives_by_Bm",
        "derivatives_by_Ch",
        "dermis",
    };
    return (size_t)part < PLAN_PARTS ? names[part] : "unknown";
}

bool plan_runs(const struct plan *plan, enum plan_part part)
{
    return part < PLAN_PARTS_RUN && (plan->run & 1u << part) != 0;
}

/* By parts that run, what it is that is not wanted. */
static const char *unwanted(enum plan_part part)
{
    switch (part) {
    case PLAN_COLOUR:
        return "neither lab nor rgb is wanted";
    case PLAN_SEARCH:
        return "no row of a table is wanted";
    case PLAN_FITTED_COLOUR:
        return "lab is not wanted";
    case PLAN_FIT:
        return "refined is not wanted";
    default:
        return "it is not wanted";
    }
}

void plan_omission_words(const struct plan *plan, size_t i, char text[PLAN_WORDS_SIZE])
{
    const struct plan_omission *o = &plan->omission[i];
    switch (o->reason) {
    case PLAN_NOT_WANTED:
        snprintf(text, PLAN_WORDS_SIZE, "%s", unwanted(o->part));
        break;
    case PLAN_NO_ROWS_WANTED:
        snprintf(text, PLAN_WORDS_SIZE, "the answer takes no row of a table");
        break;
    case PLAN_BY_COLOUR:
        snprintf(text, PLAN_WORDS_SIZE, "rows are searched by %s, which looks at colours alone",
                 match_by_name(plan->scene.by));
        break;
    case PLAN_MEETS_WITHOUT:
        snprintf(text, PLAN_WORDS_SIZE, "what was asked of error or time is met without it");
        break;
    case PLAN_NOTHING_FITTED:
        snprintf(text, PLAN_WORDS_SIZE, "nothing is fitted");
        break;
    case PLAN_NO_INTERVAL:
        snprintf(text, PLAN_WORDS_SIZE, "no interval is wanted");
        break;
    case PLAN_OUT_OF_RANGE:
        snprintf(text, PLAN_WORDS_SIZE, "%.0f of %.0f rows lie outside the ranges", o->x, o->y);
        break;
    case PLAN_NOT_IN_SCENE:
        snprintf(text, PLAN_WORDS_SIZE, "%.0f of %.0f bands are not among the scene's", o->x, o->y);
        break;
    case PLAN_HELD:
        snprintf(text, PLAN_WORDS_SIZE, "it is held at %g", o->x);
        break;
    case PLAN_OTHER_MELANIN:
        snprintf(text, PLAN_WORDS_SIZE, "Bm is held at %g, so all melanin is %s", o->x,
                 o->part == PLAN_PHEOMELANIN ? "eumelanin" : "pheomelanin");
        break;
    case PLAN_OPAQUE:
        snprintf(text, PLAN_WORDS_SIZE,
                 "it changes R by at most %.2g (rms over bands), of which the bound %g leaves room",
                 o->x, o->y);
        break;
    case PLAN_AS_SAID:
        if (o->x <= 1.0)
            snprintf(text, PLAN_WORDS_SIZE,
                     "the scene says so; it changes R by at most %.2g (rms over bands)", o->x);
        else
            snprintf(text, PLAN_WORDS_SIZE,
                     "the scene says so; skin as light as may be here shows it, by how much is not "
                     "known");
        break;
    case PLAN_NOT_BESIDE:
        snprintf(text, PLAN_WORDS_SIZE,
                 "no row lies in the ranges; the fit begins beside them, and %.0f of %.0f do not "
                 "lie there",
                 o->x, o->y);
        break;
    }
}
