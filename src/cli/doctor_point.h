/* doctor_point.h - what nobody could say about an instrument without having one, as questions for
 * the first owner; docs/drivers.md has the same list. */
#ifndef SKINSPEC_CLI_DOCTOR_POINT_H
#define SKINSPEC_CLI_DOCTOR_POINT_H

#include <stdbool.h>
#include <stddef.h>

struct doctor_point {
    const char *driver; /* "": of every one */
    const char *name;   /* for the note */
    const char *before; /* to be done first, then Enter; NULL: nothing */
    bool shot;          /* a shot is taken then, so that its bytes are in the capture */
    const char *question;
};

/* Number i from 0 of those for the driver; NULL: no more. */
const struct doctor_point *doctor_point(const char *driver, size_t i);

#endif
