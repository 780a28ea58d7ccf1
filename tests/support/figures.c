/* figures.c - a reader as small as the tests' own tables allow: no quotes. */
#include "tests/support/figures.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LINE_MAX_LENGTH = 4096 };

/* Splits in place; more cells than FIGURES_MAX_COLUMNS are counted, not stored. */
static size_t split(char *line, char *cell[FIGURES_MAX_COLUMNS])
{
    size_t n = 0;
    line[strcspn(line, "\r\n")] = '\0';
    for (char *at = line; at != NULL; n++) {
        char *comma = strchr(at, ',');
        if (comma != NULL)
            *comma++ = '\0';
        if (n < FIGURES_MAX_COLUMNS)
            cell[n] = at;
        at = comma;
    }
    return n;
}

static double number(const char *text)
{
    char *end;
    double x = strtod(text, &end);
    return end == text || *end != '\0' ? (double)NAN : x;
}

static bool add_header(struct figures *c, char *line)
{
    char *cell[FIGURES_MAX_COLUMNS];
    c->columns = split(line, cell);
    if (c->columns > FIGURES_MAX_COLUMNS)
        return false;
    for (size_t i = 0; i < c->columns; i++)
        if (snprintf(c->name[i], FIGURES_MAX_NAME, "%s", cell[i]) >= FIGURES_MAX_NAME)
            return false;
    return true;
}

static bool add_row(struct figures *c, char *line)
{
    char *cell[FIGURES_MAX_COLUMNS];
    if (split(line, cell) != c->columns)
        return false;
    double *grown = realloc(c->cell, (c->rows + 1) * c->columns * sizeof *grown);
    if (grown == NULL)
        return false;
    c->cell = grown;
    for (size_t i = 0; i < c->columns; i++)
        c->cell[c->rows * c->columns + i] = number(cell[i]);
    c->rows++;
    return true;
}

bool figures_read(const char *path, struct figures *ret)
{
    char line[LINE_MAX_LENGTH];
    struct figures c = { .columns = 0 };
    FILE *f = fopen(path, "r");
    if (f == NULL)
        return false;
    bool good = true;
    while (good && fgets(line, sizeof line, f) != NULL) {
        if (strchr(line, '\n') == NULL && !feof(f))
            good = false; /* longer than a line may be */
        else if (line[0] != '#')
            good = c.columns == 0 ? add_header(&c, line) : add_row(&c, line);
    }
    good = good && !ferror(f) && c.columns > 0;
    fclose(f);
    if (!good) {
        figures_done(&c);
        return false;
    }
    *ret = c;
    return true;
}

void figures_done(struct figures *c)
{
    free(c->cell);
    c->cell = NULL;
    c->rows = 0;
}

size_t figures_column(const struct figures *c, const char *name)
{
    for (size_t i = 0; i < c->columns; i++)
        if (strcmp(c->name[i], name) == 0)
            return i;
    return c->columns;
}

double figures_at(const struct figures *c, size_t row, size_t column)
{
    return c->cell[row * c->columns + column];
}
