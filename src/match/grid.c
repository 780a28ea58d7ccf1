/* grid.c - axes as text and as values; row numbers to parameters. */
#include "match/grid.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/number.h"
#include "optics/tissue.h"

struct grid grid_default(void)
{
    return (struct grid){
        .Cm = { 0.001, TISSUE_CM_MAX, 50, true },
        .Bm = { 0.0, 1.0, 21, false },
        .Ch = { TISSUE_CH_MIN, TISSUE_CH_MAX, 48, true },
    };
}

static enum status axis_check(const struct axis *axis)
{
    bool good = axis->n >= 1 && axis->n <= GRID_AXIS_MAX && axis->lo <= axis->hi &&
                (axis->n == 1) == (axis->lo == axis->hi);
    if (good && axis->log) /* values in between go by the ratio of the ends */
        good = axis->lo > 0.0 && isfinite(axis->hi / axis->lo);
    return good ? STATUS_OK : STATUS_RANGE;
}

/* Split "a:b:c" in place; returns the number of parts, 0 where there are more
 * than three. */
static size_t split(char *text, char *part[3])
{
    size_t n = 0;
    part[n++] = text;
    for (char *colon = strchr(text, ':'); colon != NULL; colon = strchr(colon + 1, ':')) {
        if (n == 3)
            return 0;
        *colon = '\0';
        part[n++] = colon + 1;
    }
    return n;
}

enum status axis_parse(const char *text, struct axis *ret)
{
    char copy[AXIS_TEXT_SIZE], *part[3];
    struct axis axis = { 0.0, 0.0, 1, false };
    if (strncmp(text, "log:", 4) == 0) {
        axis.log = true;
        text += 4;
    }
    if (strlen(text) >= sizeof copy)
        return STATUS_FORMAT;
    strcpy(copy, text);
    size_t parts = split(copy, part);
    if (parts != 3 && (parts != 1 || axis.log))
        return STATUS_FORMAT;
    enum status s = number_parse(part[0], &axis.lo);
    axis.hi = axis.lo;
    if (s == STATUS_OK && parts == 3)
        s = number_parse(part[1], &axis.hi);
    if (s == STATUS_OK && parts == 3)
        s = number_parse_count(part[2], GRID_AXIS_MAX, &axis.n);
    if (s == STATUS_OK)
        s = axis_check(&axis);
    if (s == STATUS_OK)
        *ret = axis;
    return s;
}

const char *axis_format(const struct axis *axis, char text[AXIS_TEXT_SIZE])
{
    char lo[NUMBER_TEXT_SIZE], hi[NUMBER_TEXT_SIZE];
    snprintf(text, AXIS_TEXT_SIZE, "%s%s:%s:%zu", axis->log ? "log:" : "",
             number_format_exact(axis->lo, lo), number_format_exact(axis->hi, hi), axis->n);
    return text;
}

double axis_value(const struct axis *axis, size_t i)
{
    /* + 0.0 takes the sign off a zero: a database would not keep it, and hashes
     * are over bits. */
    if (i == 0)
        return axis->lo + 0.0;
    if (i == axis->n - 1)
        return axis->hi + 0.0;
    double steps = (double)(axis->n - 1), f = (double)i / steps;
    if (axis->log) {
        /* What f was rounded by, times the logarithm, is seen where the axis spans decades. */
        double ratio = axis->hi / axis->lo, rest = fma(-f, steps, (double)i) / steps;
        return axis->lo * pow(ratio, f) * (1.0 + rest * log(ratio));
    }
    return axis->lo + f * (axis->hi - axis->lo);
}

static bool within(const struct axis *axis, double lo, double hi)
{
    return axis_check(axis) == STATUS_OK && axis->lo >= lo && axis->hi <= hi;
}

enum status grid_check(const struct grid *grid)
{
    bool good = within(&grid->Cm, 0.0, TISSUE_CM_MAX) && within(&grid->Bm, 0.0, 1.0) &&
                within(&grid->Ch, TISSUE_CH_MIN, TISSUE_CH_MAX) &&
                grid_rows(grid) <= GRID_ROWS_MAX; /* at most 1e12, so nothing overflows */
    return good ? STATUS_OK : STATUS_RANGE;
}

/* Rows at Cm = 0, which have one Bm only; 0 where the axis does not hold it. */
static size_t rows_without_melanin(const struct grid *grid)
{
    return grid->Cm.lo == 0.0 ? grid->Ch.n : 0;
}

size_t grid_rows(const struct grid *grid)
{
    size_t bare = rows_without_melanin(grid);
    size_t with_melanin = bare > 0 ? grid->Cm.n - 1 : grid->Cm.n;
    return bare + with_melanin * grid->Bm.n * grid->Ch.n;
}

struct grid_place grid_place(const struct grid *grid, size_t row)
{
    struct grid_place place = { 0, 0, 0 };
    size_t bare = rows_without_melanin(grid);
    if (row >= bare) {
        size_t blend = (row - bare) / grid->Ch.n;
        place.Bm = blend % grid->Bm.n;
        place.Cm = blend / grid->Bm.n + (bare > 0 ? 1 : 0);
        row -= bare;
    }
    place.Ch = row % grid->Ch.n;
    return place;
}

void grid_row(const struct grid *grid, size_t row, double *Cm, double *Bm, double *Ch)
{
    struct grid_place place = grid_place(grid, row);
    *Cm = axis_value(&grid->Cm, place.Cm);
    *Bm = axis_value(&grid->Bm, place.Bm);
    *Ch = axis_value(&grid->Ch, place.Ch);
}
