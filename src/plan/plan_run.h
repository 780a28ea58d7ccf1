/* plan_run.h - a plan carried out, spectrum by spectrum, and what that took. */
#ifndef SKINSPEC_PLAN_PLAN_RUN_H
#define SKINSPEC_PLAN_PLAN_RUN_H

#include <stdbool.h>
#include <stddef.h>

#include "base/spectrum.h"
#include "base/status.h"
#include "match/match.h"
#include "match/refined_match.h"
#include "plan/plan.h"

/* What was done; runs add to it. */
struct plan_work {
    size_t colours;     /* spectra folded to XYZ, the search's own and the fitted skin's too */
    size_t rows;        /* of the table whose distance was taken */
    size_t judged;      /* points and boxes of the index that were held against a bound */
    size_t evaluations; /* spectra of the model */
    size_t derivatives; /* spectra of derivatives, one a parameter */
    size_t bytes;       /* of rows that were looked at */
};

/* What is not in the plan is not there: has_* false, numbers NAN. */
struct plan_answer {
    bool has_colour, has_nearest, has_refined, has_coefficients;
    enum noise_source source; /* of the refined one */
    double Lab[3], rgb[3];    /* of the spectrum, the scene's light; rgb linear sRGB, not clipped */
    double coefficient[3];    /* Cm, Bm, Ch by the way that was taken */
    double fitted_Lab[3];     /* of the fitted skin, the table's light */
    struct match nearest;     /* hits[] has the rows */
    struct refined refined;   /* se and intervals are NAN where the plan leaves them out */
};

/* A plan ready to run; many threads may run it at a time. */
struct plan_runner;

/* The matcher is of the plan's table and `by` (plan->scene.by), and must outlive the runner; NULL
 * for a plan without PLAN_SEARCH.  STATUS_RANGE where it is not that; statuses of
 * xyz_weights_init() and refiner_open(), *why (may be NULL) as there. */
enum status plan_open(const struct plan *plan, const struct matcher *matcher,
                      struct plan_runner **ret, const char **why);
void plan_close(struct plan_runner *runner); /* takes NULL */

/* replicate[n] are of one site, `mean` is theirs, all on the bands that the plan was made for
 * (else STATUS_RANGE).  hits[] has room for plan->k rows, may be NULL without PLAN_SEARCH.
 * Statuses of matcher_match_asked() and refiner_run(), and STATUS_UNSUPPORTED where a colour is
 * wanted and a band was not measured; *why (may be NULL) says what is wrong where that is known.
 * *work (may be NULL) is added to. */
enum status plan_run(const struct plan_runner *runner, const struct spectrum *replicate, size_t n,
                     const struct spectrum *mean, struct nearest_hit *hits, struct plan_answer *ret,
                     struct plan_work *work, const char **why);

#endif
