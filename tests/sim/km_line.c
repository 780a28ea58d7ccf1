/* km_line.c - fields and codes. */
#include "tests/sim/km_line.h"

#include <stdlib.h>
#include <string.h>

size_t km_line_split(char *line, char *field[KM_FIELDS])
{
    size_t n = 0;
    for (char *at = line; at != NULL;) {
        if (n == KM_FIELDS)
            return KM_FIELDS + 1;
        field[n++] = at;
        at = strchr(at, ',');
        if (at != NULL)
            *at++ = '\0';
    }
    return n;
}

bool km_line_number(const char *field, long min, long max, long *ret)
{
    char *end;
    long x = strtol(field, &end, 10);
    if (end == field || end[strspn(end, " ")] != '\0' || x < min || x > max)
        return false;
    *ret = x;
    return true;
}

int km_line_ok(const struct handheld *h, bool over_range)
{
    if (over_range)
        return 9;
    bool weak = h->lamp == LAMP_WEAK, low = h->battery == 1;
    return weak && low ? 4 : low ? 3 : weak ? 2 : 0;
}

double km_line_told(const struct fault *f, handheld_spectra R, int mode, size_t band)
{
    switch (f->kind) {
    case FAULT_ZERO:
        return 0.0;
    case FAULT_OVER:
        return 2.5;
    case FAULT_NEGATIVE:
        return -0.05;
    case FAULT_SWAPPED:
        return R[mode == SCI ? SCE : SCI][band];
    default:
        return R[mode][band];
    }
}
