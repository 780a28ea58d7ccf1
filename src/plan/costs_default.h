/* costs_default.h - the costs compiled in, as text of plan/costs.h; made by
 * `skinspec bench --c-source` (make error-vs-time). */
#ifndef SKINSPEC_PLAN_COSTS_DEFAULT_H
#define SKINSPEC_PLAN_COSTS_DEFAULT_H

extern const char costs_default_text[];

#endif
