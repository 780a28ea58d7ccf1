/* csv.h - a run as CSV, and in the short form that the planner reads. */
#ifndef SKINSPEC_TRIAL_CSV_H
#define SKINSPEC_TRIAL_CSV_H

#include <stdio.h>

#include "plan/costs.h"
#include "trial/trial.h"

/* Lines `# ...` (the machine, the run), names, a line for each method (kind inversion), each
 * bound (kind bound: `us` blank, errors are what noise allows), and each model (kind forward).
 * Blank: not measured, or means nothing there.  The caller looks at ferror(). */
void trial_csv(FILE *stream, const struct trial *trial, const char *machine);

/* What of a run a plan can choose: methods as the program does them for one spectrum. */
void trial_costs(const struct trial *trial, const char *machine, struct costs *ret);

/* "nearest", "closed form", "three", "skin". */
const char *trial_kind_name(const struct trial_method *m);

#endif
