/* whole.h - what has no twin in wide numbers, as numbers that two builds are compared by:
 * transport, random walks, spectra by vectors, whole fits. */
#ifndef SKINSPEC_TESTS_STABILITY_WHOLE_H
#define SKINSPEC_TESTS_STABILITY_WHOLE_H

#include <stddef.h>
#include <stdint.h>

struct whole {
    const char *name;
    /* All outputs over cases that are the same every time, *n of them, to be freed; NAN where a
     * case is refused.  NULL without memory or without a file that it reads. */
    double *(*outputs)(uint64_t *n);
};

extern const struct whole whole_list[];
extern const size_t whole_count;

#endif
