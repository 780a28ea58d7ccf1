/* measured_skin.h - 100 people's forearms, each measured three times, and how well a fit does on
 * them.
 *
 * nist_forearm_avg_10nm.csv and nist_forearm_repeats_vis.csv (Cooksey, Allen, Tsai, J. Res. NIST
 * 122:26, 2017) in the folder SKINSPEC_MEASURED, else ../shared/measured.  The mirror
 * reflection is in them; 0.04 is taken off.  Bands 400..700 by 10 nm; the repeats are every 3 nm
 * and taken as straight between. */
#ifndef SKINSPEC_TESTS_SUPPORT_MEASURED_SKIN_H
#define SKINSPEC_TESTS_SUPPORT_MEASURED_SKIN_H

#include <stdbool.h>
#include <stddef.h>

#include "match/refine.h"

enum { MEASURED_PEOPLE = 100, MEASURED_REPEATS = 3, MEASURED_BANDS = 31 };
#define MEASURED_SURFACE 0.04

struct measured_skin {
    struct spectrum mean[MEASURED_PEOPLE], repeat[MEASURED_PEOPLE][MEASURED_REPEATS];
};

/* False where the files are not there or not as expected; `ret` is large. */
bool measured_skin_read(struct measured_skin *ret);

/* What is free and held in the skin fit was chosen on the even rows. */
enum half { HALF_EVEN = 0, HALF_ODD = 1 };

struct skin_figures {
    double rms, rms_p95, dE00, dE00_p95;           /* medians and 95 % points over people */
    double at_bound, at_bound_of[SKIN_PARAMETERS]; /* share of people; any parameter, each */
    double middle[SKIN_PARAMETERS];                /* medians of the answers */
    double flagged; /* share whose residual is told to be too large */
    /* Of all pairs of repeats of one person with neither at a bound: the share whose
     * difference is within 1.96 standard deviations by what refine() says of the site. */
    double agree[SKIN_PARAMETERS];
    size_t pairs[SKIN_PARAMETERS];
};

/* The skin fit with the spreads fitted on that half alone (tests/reference/skin_fit_choice.py),
 * so that the other is held out from them too. */
struct fit measured_skin_fit(const struct model *model, enum half fitted_on);

/* STATUS of the first refine() that fails.  repeats false: agree and pairs are not looked at. */
enum status skin_figures_of(const struct fit *fit, const struct noise *noise,
                            const struct measured_skin *skin, enum half half, bool repeats,
                            struct skin_figures *ret);

#endif
