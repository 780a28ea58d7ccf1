/* front.c - Pareto's front of time and error. */
#include "trial/front.h"

#include <math.h>

void trial_front(size_t n, const double *time, const double *error, bool *front)
{
    for (size_t i = 0; i < n; i++) {
        front[i] = !isnan(time[i]) && !isnan(error[i]);
        for (size_t k = 0; k < n && front[i]; k++)
            if (time[k] <= time[i] && error[k] <= error[i] &&
                (time[k] < time[i] || error[k] < error[i]))
                front[i] = false;
    }
}
