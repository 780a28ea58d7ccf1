/* plan_choice.h - the ways there are to what a scene wants, and the one of them that is taken:
 * the inner part of plan/plan.h, which has the contract. */
#ifndef SKINSPEC_PLAN_PLAN_CHOICE_H
#define SKINSPEC_PLAN_PLAN_CHOICE_H

#include "plan/plan.h"

/* One way to an answer. */
struct way {
    int table; /* PLAN_NO_TABLE: none */
    enum match_by by;
    bool fits;
    const struct model *model;
    const struct cost *cost;       /* NULL: not measured */
    struct plan_estimate expected; /* the same for the scene at hand, with its colour */
    double unfinished;             /* share of fits that are expected not to end */
};

/* What the choice is made from, and how it stands. */
struct choice {
    const struct scene *scene;
    const struct plan_at_hand *at_hand;
    double first_nm, step_nm;
    size_t first, every, bands;
    bool asked;            /* an error bound or a budget is given */
    double colour_us;      /* beside each way */
    bool any, any_miss;    /* best, miss are set */
    struct way best, miss; /* miss: of those that are not as asked the nearest to it */
    double best_score, miss_score;
    bool no_memory; /* a way could not be estimated */
    /* Why the first way that would else be one is none; "" while there is no such. */
    enum status status;
    char why[SCENE_WHY_SIZE];
};

/* The way into choice->best; STATUS_OK, or as plan_make() with why[]. */
enum status choice_make(const struct scene *scene, const struct plan_at_hand *at_hand,
                        struct choice *ret, char why[SCENE_WHY_SIZE]);

/* How many of the recipe's bands are used too. */
size_t choice_common_bands(const struct choice *choice, const struct recipe *recipe);

/* The table's recipe; the model's default one without a table. */
struct recipe choice_recipe(const struct plan_at_hand *at_hand, const struct way *way);

/* Rows of a table whose Cm, Bm, Ch are inside ranges (NAN: any). */
size_t choice_rows(const struct scene_range range[3], const struct plan_table *table);

/* Where a way looks for rows: inside the scene's ranges.  Where they are no more than where a fit
 * begins, of a parameter that the table has no value of inside its range the values beside it; then
 * there is always a row, and true is returned. */
bool choice_searched(const struct scene *scene, const struct way *way,
                     const struct plan_table *table, struct scene_range ret[3]);

/* What a scene asks of a fit; and the fit, held and narrowed as the scene says.  Statuses and
 * *why of refine_wish_fit(). */
struct refine_wish choice_wish(const struct scene *scene);
enum status choice_fit(const struct scene *scene, const struct refine_wish *wish,
                       const struct recipe *recipe, struct fit *ret, const char **why);

#endif
