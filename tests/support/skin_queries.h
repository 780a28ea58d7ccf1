/* skin_queries.h - questions to a table of skins, near its surface and off it as real skin is. */
#ifndef SKINSPEC_TESTS_SUPPORT_SKIN_QUERIES_H
#define SKINSPEC_TESTS_SUPPORT_SKIN_QUERIES_H

#include <stdbool.h>
#include <stddef.h>

#include "match/nearest.h"

struct skin_query {
    struct nearest_query query; /* its spectrum is the one below */
    struct spectrum spectrum;
};

/* Cm 0.001 .. 0.5, Bm 0 .. 1, Ch 0.001 .. 0.1, `side` values of each, Cm and Ch evenly in the
 * logarithm: two-layer skins, computed by all cores.  Statuses of table_init(). */
enum status skin_table(size_t side, struct table *ret);

/* n questions, the same every time.  near: a row, its Lab moved by dE*ab 0.5 to 1, its linear RGB
 * by up to 0.003, its spectrum with noise of up to 0.002 in each band; off: by dE*ab 3 to 10, by up
 * to 0.03, by slow waves of 0.02 to 0.05 rms and the noise. */
void skin_queries(const struct table *table, bool off, size_t n, struct skin_query *ret);

#endif
