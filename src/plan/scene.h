/* scene.h - what is wanted of a measured skin, what is known of it beforehand, and how good or
 * how quick the answer has to be.
 *
 *   wanted        what it is                                                   needs
 *   lab, rgb      colour of the spectrum under the scene's light               bands of colour
 *   coefficients  Cm, Bm, Ch by whatever way is chosen                         -
 *   nearest       the nearest rows of a table                                  a table
 *   refined       Cm, Bm, Ch of the skin between the rows (match/refine.h)     derivatives
 *   interval      its standard errors, 95 % intervals and second solution      refined
 * docs/scenes.md has it as JSON.  plan/plan.h makes a plan of it. */
#ifndef SKINSPEC_PLAN_SCENE_H
#define SKINSPEC_PLAN_SCENE_H

#include <stdbool.h>
#include <stddef.h>

#include "base/status.h"
#include "colour/cie_tables.h"
#include "match/nearest.h"
#include "match/refined_match.h"
#include "optics/model.h"

enum scene_want {
    SCENE_LAB = 1 << 0,
    SCENE_RGB = 1 << 1,
    SCENE_COEFFICIENTS = 1 << 2,
    SCENE_NEAREST = 1 << 3,
    SCENE_REFINED = 1 << 4,
    SCENE_INTERVAL = 1 << 5,
};
enum { SCENE_WANTS = 6, SCENE_MAX_K = 100, SCENE_WHY_SIZE = 320 };

/* "lab" "rgb" "coefficients" "nearest" "refined" "interval" of bit 1 << i; "unknown" past them. */
const char *scene_want_name(size_t i);

/* Where a fit begins. */
enum scene_start { SCENE_START_ANY, SCENE_START_ROWS, SCENE_START_CLOSED_FORM };
/* "" "rows" "closed-form". */
const char *scene_start_name(enum scene_start start);

/* Values that one of Cm, Bm, Ch may have; lo = hi: it is held there.  Both NAN: not said, so that
 * the paper's range holds (optics/tissue.h). */
struct scene_range {
    double lo, hi;
};

/* Errors allowed; NAN: not said.  Of Cm, Bm, Ch: root mean square against the truth; dE00 and
 * rms (of R): the skin found against the skin that was there.  All as plan/costs.h has them; of
 * Cm, Bm, Ch rmse where the scene names the model, which is then believed, else rmse_transport. */
struct scene_bound {
    double coefficient[3];
    double dE00, rms;
};

struct scene {
    unsigned wanted;            /* enum scene_want */
    enum illuminant illuminant; /* of lab and rgb; a table is searched under its own light */
    enum observer observer;
    const struct model *model; /* NULL: any that is at hand */
    bool has_by;
    enum match_by by;     /* has_by: how rows are searched */
    enum refine_kind fit; /* REFINE_NOT: fit_three() where one is made */
    enum scene_start start;
    size_t k; /* rows of `nearest`, 1 .. SCENE_MAX_K */
    struct scene_range range[3];
    double first_nm, last_nm, step_nm; /* bands to use; NAN: all that were measured */
    bool no_dermis;          /* a fit leaves it out (optics/opaque.h); else where a bound allows */
    double white, placement; /* noise of a fit, as struct refine_wish has it */
    struct scene_bound bound;
    double budget_us; /* time for one spectrum on one thread; NAN: not said */
};

/* Nothing wanted, nothing said: D65, 10 degrees, k 1. */
struct scene scene_empty(void);

/* Whether an error is bounded at all. */
bool scene_is_bounded(const struct scene *scene);

/* Whether a skin is wanted, and not just the colour of the spectrum. */
bool scene_wants_skin(const struct scene *scene);

/* STATUS_RANGE where a number is outside what it may be, or what is said contradicts itself;
 * why[] then says in a sentence without full stop what is wrong and what to do; else it is
 * untouched. */
enum status scene_check(const struct scene *scene, char why[SCENE_WHY_SIZE]);

/* The same for what is said and nothing that is wanted can use: of a scene as a person gives it,
 * whose wish it would not be to have that passed over.  Not of one that was settled once. */
enum status scene_check_use(const struct scene *scene, char why[SCENE_WHY_SIZE]);

/* The paper's range of Cm, Bm, Ch (i = 0, 1, 2), or what the scene leaves of it. */
struct scene_range scene_whole_range(size_t i);
struct scene_range scene_range_of(const struct scene *scene, size_t i);
bool scene_is_held(const struct scene *scene, size_t i);
bool scene_is_ranged(const struct scene *scene); /* of any something is said */

#endif
