/* levels.h - the outputs of two builds side by side. */
#ifndef SKINSPEC_TESTS_STABILITY_LEVELS_H
#define SKINSPEC_TESTS_STABILITY_LEVELS_H

/* Doubles between the two, as their bits count them: units of the last place of the larger.  0
 * where both are NAN, or below 1e-300; INFINITY where just one is finite. */
double levels_ulp(double a, double b);

/* All outputs of every study (study.h) and of what has no twin (whole.h) into a file; then the
 * largest differences of two such files on stdout.  0 where all went well and all are alike. */
int levels_write(const char *path);
int levels_compare(const char *path_a, const char *path_b);

#endif
