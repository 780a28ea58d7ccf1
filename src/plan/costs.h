/* costs.h - what each way to an answer costs and how wrong it is, as `skinspec bench` measured
 * it: the short form of docs/error-vs-time.md, which the planner reads.
 *
 * As text: lines `# ...`, of them "# machine: ..." and "# costs: N", how many there are, by which a
 * text that was cut short is known; a line of column names, a line for each cost:
 *   column         of struct cost     unit          blank
 *   model          model              name          never
 *   rows           rows               -             never
 *   by             by                 name          never
 *   refine         refine             none|three|skin
 *   interval       interval           0|1
 *   us, us_p95     the same           us            never
 *   Cm, Bm, Ch     rmse[]             -             not measured
 *   Cm_transport.. rmse_transport[]   -             not measured
 *   dE00           dE00               -             not measured
 *   rms_R          rms_R              reflectance   not measured
 *   bytes          bytes              -             never */
#ifndef SKINSPEC_PLAN_COSTS_H
#define SKINSPEC_PLAN_COSTS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

#include "base/status.h"
#include "match/nearest.h"
#include "match/refined_match.h"
#include "optics/model.h"
#include "plan/scene.h"

/* Errors are of typical skins (Cm and Ch evenly in the logarithm), 31 bands, white noise; NAN: not
 * measured, or held.  plan/estimate.h says what they are under other conditions. */
#define COSTS_FIRST_NM 400.0
#define COSTS_STEP_NM 10.0
enum { COSTS_BANDS = 31 };
#define COSTS_NOISE 0.003                       /* standard deviation of a band */
extern const struct scene_range costs_skins[3]; /* of Cm, Bm, Ch */

struct cost {
    const struct model *model; /* of the table and of the fit */
    size_t rows;               /* of the table; 0: none, the closed form of match/start.h */
    enum match_by by;          /* how the rows are searched; MATCH_SPECTRUM where rows is 0 */
    enum refine_kind refine;   /* REFINE_NOT: the nearest row, or the closed form, is the answer */
    bool interval;            /* with REFINE_INTERVALS and REFINE_SECOND; else only values and se */
    double us, us_p95;        /* one spectrum, one thread: median and 95th percentile of skins */
    double rmse[3];           /* of Cm, Bm, Ch where spectra are made by the same model */
    double rmse_transport[3]; /* the same where they are made by transport-32 */
    /* The skin found - the skin that was there, both without noise, spectra by transport-32:
     * means over skins. */
    double dE00, rms_R;
    double bytes; /* resident: the table and its index, or what the fit keeps */
};

enum { COSTS_MAX = 256, COSTS_MACHINE_SIZE = 160 };
struct costs {
    size_t n;
    struct cost cost[COSTS_MAX];
    char machine[COSTS_MACHINE_SIZE]; /* which machine, cores, compiler; and when */
    bool counted;                     /* the text says how many: it is whole */
};

/* The default build's own.  Made at the first call, then only read; any thread may call. */
const struct costs *costs_builtin(void);

/* STATUS_FORMAT with *ret untouched and *line (from 1) that of the fault where the text is not
 * as above: an unknown model or name, a number that is none or below 0, no cost at all or more
 * than COSTS_MAX, more or fewer than it says; of fewer, the line that is not there. */
enum status costs_parse(const char *text, struct costs *ret, size_t *line);

/* What costs_parse() reads back: numbers to 4 digits.  The caller looks at ferror(). */
void costs_print(FILE *stream, const struct costs *costs);

#endif
