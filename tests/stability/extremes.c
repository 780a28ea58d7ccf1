/* extremes.c - from no absorption to nothing else, and eta from refusal to refusal. */
#include "tests/stability/extremes.h"

#include <math.h>

#include "optics/dipole.h"

#define AXIS(values) ((struct axis_of_cases){ sizeof(values) / sizeof *(values), values })

double extreme_beside(double x, int steps)
{
    if (steps == 0)
        return x;
    return nextafter(x, steps < 0 ? -(double)INFINITY : (double)INFINITY);
}

struct axis_of_cases extreme_sigma_a(void)
{
    static const double value[] = { 0.0,   1e-290, 1e-100, 1e-30, 1e-22, 1e-17, 1e-16, 3e-13,
                                    1e-10, 1e-7,   1e-5,   1e-3,  0.03,  0.1,   0.5,   1.5,
                                    3.7,   30.0,   400.0,  1e4,   1e6,   1e9,   1e12 };
    return AXIS(value);
}

struct axis_of_cases extreme_sigma_s_prime(void)
{
    static const double value[] = { 1e-6, 1e-4, 0.01, 0.2, 1.0, 3.0, 7.4, 50.0, 1e3, 1e6 };
    return AXIS(value);
}

struct axis_of_cases extreme_eta(void)
{
    static double value[] = { 0.0, 0.2601, 0.27, 0.3,  0.5, 0.75, 0.99, 0.0,  1.0,   0.0, 1.01,
                              1.1, 1.33,   1.4,  1.55, 2.0, 3.0,  3.8,  3.84, 3.847, 0.0 };
    value[0] = extreme_beside(DIPOLE_ETA_ABOVE, 1);
    value[7] = extreme_beside(1.0, -1);
    value[9] = extreme_beside(1.0, 1);
    value[20] = extreme_beside(DIPOLE_ETA_BELOW, -1);
    return AXIS(value);
}
