/* study.h - one function under test, its twin in wide numbers, and the judgement.
 *
 *   error      |ours - exact| in units of the last place of exact
 *   condition  sum over the inputs of |x df/dx / f|: how many units of the last place of
 *              f one unit in every input is worth.  df/dx by central differences of the
 *              twin over x (1 +- 2^-50): so a jump less than four units away counts
 *   judged     error / max(1, condition), against the study's bar; where f is 0 the sum
 *              of |x df/dx| stands for |f|
 * What is below 1e-300 on both sides counts as 0. */
#ifndef SKINSPEC_TESTS_STABILITY_STUDY_H
#define SKINSPEC_TESTS_STABILITY_STUDY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "tests/stability/wide.h"
#include "tests/support/dice.h"

enum { STUDY_INPUTS = 14, STUDY_OUTPUTS = 8 };
enum { STUDY_TWIN_BITS = 90 }; /* a twin must hold so many */

/* Inputs to be tried, row after row. */
struct cases {
    size_t inputs, n, room;
    double *x;
    struct dice dice; /* the same for every run */
};

struct axis_of_cases {
    size_t n;
    const double *value;
};

void cases_add(struct cases *c, const double *x);
/* Every combination of the axes' values. */
void cases_product(struct cases *c, const struct axis_of_cases *axis);
/* A power of ten between the two, by chance. */
double cases_decades(struct cases *c, double from, double to);

struct study {
    const char *name;
    const char *input[STUDY_INPUTS]; /* their names, NULL past the last */
    size_t varied;                   /* the first so many are numbers; the others select */
    const char *output[STUDY_OUTPUTS];
    double bar;
    bool (*ours)(const double *x, double *y); /* false where the input is refused */
    void (*twin)(const wide *x, wide *y);
    void (*cases)(struct cases *c);
    /* Sum of |x df/dx| for every output; NULL: by differences of the twin. */
    void (*sensitivity)(const wide *x, wide *sum);
};

struct verdict {
    size_t cases, refused;
    double most_ulp;        /* the largest error */
    double judged;          /* the largest error / max(1, condition) */
    double x[STUDY_INPUTS]; /* where that was */
    double ulp, condition;  /* there */
    size_t output;          /* there */
    double ours, exact;     /* there */
    double twin_bits;       /* the fewest bits to which the twin agrees with itself, wider */
    bool met;
};

/* All cases, or every `every`th; each that misses the bar is printed to misses (NULL: none). */
struct verdict study_run(const struct study *s, size_t every, FILE *misses);
void study_print_case(const struct study *s, const double *x, FILE *to);

/* Our outputs alone, case after case, NAN where refused: what builds are compared by. */
double *study_outputs(const struct study *s, uint64_t *n);

size_t study_input_count(const struct study *s);
size_t study_output_count(const struct study *s);

/* One room's studies, and all rooms. */
struct study_room {
    const char *name;
    const struct study *studies;
    size_t n;
};
extern const struct study_room *const study_rooms[];
extern const size_t study_room_count;

#endif
