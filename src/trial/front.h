/* front.h - which of many is beaten by none in both time and error. */
#ifndef SKINSPEC_TRIAL_FRONT_H
#define SKINSPEC_TRIAL_FRONT_H

#include <stdbool.h>
#include <stddef.h>

/* front[i]: both numbers are there, and no other has both at most as large and one of them
 * smaller. */
void trial_front(size_t n, const double *time, const double *error, bool *front);

#endif
