/* grid.h - the (Cm, Bm, Ch) values a table has rows for.
 *
 * Rows run with Ch fastest, then Bm, then Cm.  Where Cm is 0 there is no melanin
 * to blend, so only the first Bm has rows. */
#ifndef SKINSPEC_MATCH_GRID_H
#define SKINSPEC_MATCH_GRID_H

#include <stdbool.h>
#include <stddef.h>

#include "base/status.h"

struct axis {
    double lo, hi;
    size_t n; /* values, 1 .. GRID_AXIS_MAX; 1 only where lo == hi */
    bool log; /* evenly spaced in the logarithm */
};

enum { GRID_AXIS_MAX = 10000 };
#define GRID_ROWS_MAX 100000000u

struct grid {
    struct axis Cm, Bm, Ch;
};

/* About 50 000 rows: Cm and Ch evenly spaced in the logarithm, as skin is. */
struct grid grid_default(void);

/* "LO:HI:N", "log:LO:HI:N", or one value "X".  STATUS_FORMAT for other text;
 * STATUS_RANGE where the axis is empty, reversed, has one value for two ends,
 * more than one for one, too many, or a logarithm of 0 (or so near to it that the
 * ratio of the ends is no double). */
enum status axis_parse(const char *text, struct axis *ret);

/* What axis_parse() reads back as the same axis. */
enum { AXIS_TEXT_SIZE = 96 };
const char *axis_format(const struct axis *axis, char text[AXIS_TEXT_SIZE]);

/* Value i, 0 <= i < n; the ends are exact, and a zero is +0. */
double axis_value(const struct axis *axis, size_t i);

/* STATUS_RANGE where an axis leaves the paper's ranges (optics/tissue.h) or
 * there are more than GRID_ROWS_MAX rows. */
enum status grid_check(const struct grid *grid);

size_t grid_rows(const struct grid *grid);

/* Where on the axes row 0 <= row < grid_rows() is. */
struct grid_place {
    size_t Cm, Bm, Ch;
};
struct grid_place grid_place(const struct grid *grid, size_t row);

/* Parameters of row 0 <= row < grid_rows(). */
void grid_row(const struct grid *grid, size_t row, double *Cm, double *Bm, double *Ch);

#endif
