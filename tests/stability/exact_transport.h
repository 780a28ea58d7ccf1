/* exact_transport.h - how far transport-N is from its own equations. */
#ifndef SKINSPEC_TESTS_STABILITY_EXACT_TRANSPORT_H
#define SKINSPEC_TESTS_STABILITY_EXACT_TRANSPORT_H

#include <stdbool.h>
#include <stddef.h>

#define EXACT_TRANSPORT_BAR 1e-11

struct exact_transport {
    size_t cases;
    double R, slopes; /* worst relative errors */
    /* Where each was: sigma_a1, sigma_s1', sigma_a2, sigma_s2', d, eta. */
    double R_at[6], slopes_at[6];
};

/* false where the file cannot be read, has no row of so many streams, or one is refused. */
bool exact_transport(int streams, struct exact_transport *ret);

#endif
