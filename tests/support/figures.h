/* figures.h - tables of numbers for the tests: a header line, then rows.
 *
 * Lines that begin with # are skipped.  A cell that is not a number is NAN, one
 * too small for a double 0. */
#ifndef SKINSPEC_TESTS_SUPPORT_FIGURES_H
#define SKINSPEC_TESTS_SUPPORT_FIGURES_H

#include <stdbool.h>
#include <stddef.h>

enum { FIGURES_MAX_COLUMNS = 160, FIGURES_MAX_NAME = 64 };

struct figures {
    size_t columns, rows;
    char name[FIGURES_MAX_COLUMNS][FIGURES_MAX_NAME];
    double *cell; /* row after row */
};

/* false where the file cannot be read, has no header or a row of another length;
 * on true, give it back with figures_done(). */
bool figures_read(const char *path, struct figures *ret);
void figures_done(struct figures *c);

/* Column of that name, or c->columns. */
size_t figures_column(const struct figures *c, const char *name);

double figures_at(const struct figures *c, size_t row, size_t column);

#endif
