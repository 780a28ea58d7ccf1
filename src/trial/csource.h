/* csource.h - costs as the C source of those compiled in. */
#ifndef SKINSPEC_TRIAL_CSOURCE_H
#define SKINSPEC_TRIAL_CSOURCE_H

#include <stdio.h>

#include "base/status.h"
#include "plan/costs.h"

/* src/plan/costs_default.c, laid out as clang-format leaves it.  STATUS_NO_MEMORY; the caller
 * looks at ferror(). */
enum status trial_csource(FILE *stream, const struct costs *costs);

#endif
