/* plan.h - a scene, the tables at hand and what each way costs -> the cheapest way that does it,
 * and what is left out and why.
 *
 * Nothing is read, searched or computed of a spectrum.  What a way costs and how wrong it is
 * comes from plan/costs.h, measured, and for a scene unlike what was measured from plan/estimate.h;
 * what is not known is NAN, and such a way is chosen only where neither an error nor a time is
 * asked for.  Without a dermis nothing was: then
 * the errors of Cm, Bm, Ch and dE00 are told where leaving it out is proven to change R by less
 * than the way's own rms, and rms is that and the proven bound, NAN where this says nothing.
 *
 *   said                     chosen
 *   an error bound           of the ways that meet it the quickest
 *   a time budget            of the ways that fit it (by the median) the least wrong
 *   neither                  what `skinspec match` does with the first table that can: by spectrum
 *                            where it has spectra, else by rgb; fits begin at its rows
 * What is left out never changes what remains, to the last bit - with one exception: the search
 * for a second solution, and intervals, may come upon a better fit than the first. */
#ifndef SKINSPEC_PLAN_PLAN_H
#define SKINSPEC_PLAN_PLAN_H

#include <stdbool.h>
#include <stddef.h>

#include "base/status.h"
#include "match/fit.h"
#include "match/recipe.h"
#include "plan/costs.h"
#include "plan/scene.h"

/* What runs, or is left out. */
enum plan_part {
    PLAN_COLOUR,                /* the spectrum's colour */
    PLAN_TABLE,                 /* a table is loaded */
    PLAN_SPECTRA,               /* and its spectra */
    PLAN_SEARCH,                /* its nearest rows are found */
    PLAN_CLOSED_FORM,           /* the half space solved for Cm, Bm, Ch */
    PLAN_FIT,                   /* model and its derivatives, step by step */
    PLAN_COVARIANCE,            /* of the fit: standard errors */
    PLAN_INTERVALS,             /* 95 %, along chi-square */
    PLAN_SECOND,                /* another skin that fits nearly as well is looked for */
    PLAN_FITTED_COLOUR,         /* of the fitted skin, and dE00 */
    PLAN_PARTS_RUN,             /* those above can run; these are parts of them: */
    PLAN_ROWS = PLAN_PARTS_RUN, /* rows outside the ranges */
    PLAN_BANDS,                 /* bands that were measured and are not used */
    PLAN_EUMELANIN,
    PLAN_PHEOMELANIN,
    PLAN_BY_CM, /* derivatives by Cm, Bm, Ch */
    PLAN_BY_BM,
    PLAN_BY_CH,
    PLAN_DERMIS,
    PLAN_PARTS
};

/* "colour" "table" "spectra" ... "dermis": stable, for records and programs. */
const char *plan_part_name(enum plan_part part);

enum plan_reason {
    PLAN_NOT_WANTED,
    PLAN_NO_ROWS_WANTED, /* the answer needs no table */
    PLAN_BY_COLOUR,      /* the search looks at colours alone */
    PLAN_MEETS_WITHOUT,  /* error bound or time are met without it */
    PLAN_NOTHING_FITTED,
    PLAN_NO_INTERVAL,
    PLAN_OUT_OF_RANGE,  /* x of y rows can be answers */
    PLAN_NOT_IN_SCENE,  /* x of y bands are used */
    PLAN_HELD,          /* at x */
    PLAN_OTHER_MELANIN, /* Bm is held at x, so all melanin is of the other kind */
    PLAN_OPAQUE,        /* the dermis changes R by at most x (rms over bands); the bound is y */
    PLAN_AS_SAID,       /* in the scene; the dermis: R changes by at most x (rms over bands) */
    PLAN_NOT_BESIDE,    /* x of y rows: none is in the ranges, a fit begins at those beside them */
};

struct plan_omission {
    enum plan_part part;
    enum plan_reason reason;
    double x, y;
};
enum { PLAN_OMISSIONS_MAX = PLAN_PARTS, PLAN_WORDS_SIZE = 160 };

/* A table that can be had. */
struct plan_table {
    const char *name;
    const struct recipe *recipe;
    size_t rows;
};

struct plan_at_hand {
    const struct costs *costs;
    const struct plan_table *table; /* [tables], the default one first */
    size_t tables;
    double first_nm, step_nm; /* of the spectra to come */
    size_t bands;
};

/* What is to be expected under the scene's own conditions; NAN: not known.  Of a table of another
 * size than was measured, the one nearest in size. */
struct plan_estimate {
    double us, us_p95; /* one spectrum, one thread */
    double coefficient[3], dE00, rms;
    double white, placement; /* the noise that errors are expected under, as match/noise.h has it */
};

enum { PLAN_NO_TABLE = -1 };

struct plan {
    /* The scene with all that was chosen said in it, and neither bound nor budget: a plan made of
     * it anew does the same, whatever the costs are by then. */
    struct scene scene;
    unsigned run;             /* bit per enum plan_part that runs */
    int table;                /* which of those at hand, or PLAN_NO_TABLE */
    size_t k;                 /* rows to search for */
    struct fit fit;           /* with PLAN_FIT, PLAN_CLOSED_FORM */
    struct refine_wish wish;  /* what it is made from, ranges apart */
    unsigned want;            /* enum refine_want */
    double first_nm, step_nm; /* bands that are used: every `every`th from `first` on */
    size_t first, every, bands;
    double given_first_nm, given_step_nm; /* of the spectra that it was made for */
    size_t given_bands;
    struct plan_estimate estimated;
    size_t rows; /* of the table that can be answers; 0 without */
    /* Cm, Bm, Ch that these rows have; NAN: any.  The scene's ranges, but where rows are no more
     * than where a fit begins and a range is between the values of the table: those beside it. */
    struct scene_range searched[3];
    size_t omissions;
    struct plan_omission omission[PLAN_OMISSIONS_MAX];
};

/* STATUS_RANGE: the scene contradicts itself, the tables or the bands, or no way at hand is as
 * good or as quick as asked; STATUS_NOT_FOUND: no table at hand can do it; STATUS_UNSUPPORTED: the
 * model cannot be fitted.  why[] then says in a sentence without full stop what is wrong, what
 * comes nearest, and what to do; else it is untouched.  *ret is set with STATUS_OK alone.
 * Models, recipes and names are used as long as *ret is. */
enum status plan_make(const struct scene *scene, const struct plan_at_hand *at_hand,
                      struct plan *ret, char why[SCENE_WHY_SIZE]);

/* Whether a part runs. */
bool plan_runs(const struct plan *plan, enum plan_part part);

/* Why omission i was left out, without full stop. */
void plan_omission_words(const struct plan *plan, size_t i, char text[PLAN_WORDS_SIZE]);

/* One spectrum of 31 bands to L*a*b*, microseconds: the median of tests/bench/planner.c,
 * Intel Xeon (family 6, model 207), gcc 12.2. */
#define PLAN_COLOUR_US 0.11

#endif
