/* extremes.h - the grid that every optical study goes over. */
#ifndef SKINSPEC_TESTS_STABILITY_EXTREMES_H
#define SKINSPEC_TESTS_STABILITY_EXTREMES_H

#include "tests/stability/study.h"

/* 0 .. 1e12 mm^-1 */
struct axis_of_cases extreme_sigma_a(void);
/* 1e-6 .. 1e6 mm^-1; with the former, reduced albedos of 1, 1-1e-16, 2/3 and 0 */
struct axis_of_cases extreme_sigma_s_prime(void);
/* From the first to the last index that is accepted, both sides of 1 */
struct axis_of_cases extreme_eta(void);

/* x, or one of its neighbours among the doubles: steps -1, 0, 1. */
double extreme_beside(double x, int steps);

#endif
