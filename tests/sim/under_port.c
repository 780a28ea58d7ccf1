/* under_port.c - a few smooth curves. */
#include "tests/sim/under_port.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

bool under_port_find(const char *name, enum under_port *ret)
{
    static const char *const names[] = { "white", "black", "skin", "user", "bright" };
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (strcmp(names[i], name) == 0) {
            *ret = (enum under_port)i;
            return true;
        }
    return false;
}

static double dip(double nm, double at_nm, double width_nm, double depth)
{
    double x = (nm - at_nm) / width_nm;
    return 1.0 - depth * exp(-0.5 * x * x);
}

static double skin(double lightness, double nm)
{
    double Y = pow((lightness + 16.0) / 116.0, 3.0); /* CIE L* backwards */
    double red = nm / 555.0;
    return Y * red * red * dip(nm, 415, 18, 0.15) * dip(nm, 542, 12, 0.08) * dip(nm, 577, 10, 0.10);
}

double under_port_truth(enum under_port what, double lightness, double nm, bool sci)
{
    double blue = 550.0 / nm;
    double gloss = sci ? 0.042 * (0.96 + 0.04 * blue * blue) : 0.0;
    switch (what) {
    case UNDER_WHITE:
        return 0.935 - 0.00004 * (700.0 - nm) + gloss;
    case UNDER_SKIN:
        return skin(lightness, nm) + gloss;
    case UNDER_USER:
        return 0.61 + 0.00002 * (nm - 550.0) + gloss;
    case UNDER_BRIGHT:
        return 2.1 + gloss;
    case UNDER_BLACK:
        break;
    }
    return 0.0;
}
