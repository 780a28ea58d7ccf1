/* costs_default.h - the costs compiled in, text of plan/costs.h line by line; made by
 * `skinspec bench --c-source` (make error-vs-time). */
#ifndef SKINSPEC_PLAN_COSTS_DEFAULT_H
#define SKINSPEC_PLAN_COSTS_DEFAULT_H

extern const char *const costs_default_lines[]; /* each with its end; after the last NULL */

#endif
