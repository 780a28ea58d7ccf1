/* exact_transport.c - the transport models against the solutions of their own N-stream equations
 * in 220 digits, tests/reference/transport_exact.csv. */
#include "tests/stability/exact_transport.h"

#include <math.h>
#include <string.h>

#include "optics/transport.h"
#include "tests/support/figures.h"

enum { ROW_STREAMS, ROW_MEDIUM, ROW_R = 7, ROW_SLOPES, SLOPES = 5 };

/* A slope where two effects balance is as good as R per relative change of a coefficient. */
static double slope_error(const double *x, double R, int k, double expect, double got)
{
    double own[SLOPES] = { x[0] + x[1], x[0] + x[1], x[2] + x[3], x[2] + x[3], x[4] };
    if (isinf(expect) || got == expect)
        return got == expect ? 0.0 : (double)INFINITY;
    double size = fmax(fabs(expect), own[k] > 0.0 ? 1e-3 * R / own[k] : 0.0);
    return fabs(got - expect) / size;
}

/* NaN is worse than any number. */
static void keep_worst(double error, const double x[6], double *worst, double at[6])
{
    if (isnan(*worst) || error <= *worst)
        return;
    *worst = error;
    memcpy(at, x, 6 * sizeof *at);
}

static bool judge_row(const struct figures *t, size_t row, int streams, struct exact_transport *v)
{
    double x[6], R, y[SLOPES];
    for (size_t i = 0; i < 6; i++)
        x[i] = figures_at(t, row, ROW_MEDIUM + i);
    struct medium m = { 1, x[4], x[5], &x[0], &x[2], &x[1], &x[3] };
    struct slopes dR = { y, y + 2, y + 1, y + 3, y + 4 };
    if (transport_slopes(streams, &m, &R, &dR) != STATUS_OK)
        return false;
    double expect = figures_at(t, row, ROW_R);
    v->cases++;
    keep_worst(R == expect ? 0.0 : fabs(R - expect) / fabs(expect), x, &v->R, v->R_at);
    for (int k = 0; k < SLOPES; k++) {
        double exact = figures_at(t, row, ROW_SLOPES + (size_t)k);
        keep_worst(slope_error(x, expect, k, exact, y[k]), x, &v->slopes, v->slopes_at);
    }
    return true;
}

bool exact_transport(int streams, struct exact_transport *ret)
{
    struct figures t;
    bool all = true;
    *ret = (struct exact_transport){ 0 };
    if (!figures_read("tests/reference/transport_exact.csv", &t))
        return false;
    for (size_t row = 0; row < t.rows; row++)
        if ((int)figures_at(&t, row, ROW_STREAMS) == streams)
            all = judge_row(&t, row, streams, ret) && all;
    figures_done(&t);
    return all && ret->cases > 0;
}
