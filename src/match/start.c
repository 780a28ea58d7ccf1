/* start.c - R -> sigma_a/sigma_s' per band, then three linear equations. */
#include "match/start.h"

#include <math.h>
#include <stdbool.h>

#include "match/products.h"
#include "optics/dipole.h"

/* Eq. 9 in s = sqrt(3 sigma_a/sigma_t'), with mu' = 1 - s^2/3. */
static double reflectance(double s, double A, double entering)
{
    double mu = 1.0 - s * s / 3.0;
    return entering * 0.5 * mu * (1.0 + exp(-4.0 / 3.0 * A * s)) * exp(-s);
}

/* q = sigma_a/sigma_s', where sigma_a/sigma_t' = s^2/3. */
static double ratio(double s)
{
    double absorbed = s * s / 3.0;
    return absorbed / (1.0 - absorbed);
}

static void curves(double eta, struct start *ret)
{
    double A = 1.0, entering = 1.0 - dipole_Rs(eta);
    (void)dipole_A(eta, &A);
    ret->steps_per_R = START_STEPS / entering;
    for (size_t i = 0; i <= START_STEPS; i++) {
        /* Neither all is absorbed at the one end nor nothing at the other. */
        double place = fmin(fmax((double)i, 0.25), START_STEPS - 0.25);
        double low = 0.0, high = sqrt(3.0);
        for (int turn = 0; turn < 60; turn++) { /* R falls as s grows */
            double middle = 0.5 * (low + high);
            if (reflectance(middle, A, entering) > place / ret->steps_per_R)
                low = middle;
            else
                high = middle;
        }
        double h = 1e-4 * low;
        ret->q[i] = ratio(low);
        ret->dR_dq[i] = (reflectance(low + h, A, entering) - reflectance(low - h, A, entering)) /
                        (ratio(low + h) - ratio(low - h));
    }
}

void start_init(const struct tissue *t, const struct chromophores *c, struct start *ret)
{
    curves(t->eta, ret);
    ret->n = c->n;
    for (size_t i = 0; i < c->n; i++) {
        double scattering = t->scattering_a == 0.0
                                ? c->sigma_s_prime[i]
                                : t->scattering_a * exp(-t->scattering_b * c->log_nm[i]);
        double blood = t->gamma * c->oxy[i] + (1.0 - t->gamma) * c->deoxy[i];
        ret->column[0][i] = (c->pheomelanin[i] - c->base[i]) / scattering;
        ret->column[1][i] = (c->eumelanin[i] - c->pheomelanin[i]) / scattering;
        ret->column[2][i] = (blood - c->base[i]) / scattering;
        ret->without[i] = 2.0 * c->base[i] / scattering;
    }
}

/* q at R between two steps, and how sharply R shows it there. */
static double look_up(const struct start *start, double R, double *dR_dq)
{
    double place = R * start->steps_per_R;
    place = place > 0.0 ? (place < START_STEPS - 0.001 ? place : START_STEPS - 0.001) : 0.0;
    size_t i = (size_t)place;
    double share = place - (double)i;
    *dR_dq = start->dR_dq[i] + share * (start->dR_dq[i + 1] - start->dR_dq[i]);
    return start->q[i] + share * (start->q[i + 1] - start->q[i]);
}

/* Sums of a weighted least-squares problem in three unknowns. */
struct equations {
    double a00, a01, a02, a11, a12, a22, b0, b1, b2;
};

/* By cofactors; false where the three cannot be told apart. */
static bool solve(const struct equations *e, double x[3])
{
    double c00 = e->a11 * e->a22 - e->a12 * e->a12, c01 = e->a02 * e->a12 - e->a01 * e->a22,
           c02 = e->a01 * e->a12 - e->a02 * e->a11, c11 = e->a00 * e->a22 - e->a02 * e->a02,
           c12 = e->a01 * e->a02 - e->a00 * e->a12, c22 = e->a00 * e->a11 - e->a01 * e->a01;
    double det = e->a00 * c00 + e->a01 * c01 + e->a02 * c02;
    if (!(fabs(det) > 1e-12 * fabs(e->a00 * e->a11 * e->a22)))
        return false;
    x[0] = (c00 * e->b0 + c01 * e->b1 + c02 * e->b2) / det;
    x[1] = (c01 * e->b0 + c11 * e->b1 + c12 * e->b2) / det;
    x[2] = (c02 * e->b0 + c12 * e->b1 + c22 * e->b2) / det;
    return isfinite(x[0]) && isfinite(x[1]) && isfinite(x[2]);
}

void start_guess(const struct start *start, const double *R, const double *weight, struct tissue *t)
{
    enum { MOST = SPECTRUM_MAX_BANDS + PRODUCTS_LANES };
    double rows[4][MOST], w[MOST], q[MOST], sum[10], x[3];
    const double *const row[4] = { rows[0], rows[1], rows[2], rows[3] };
    size_t n = start->n, length = (n + PRODUCTS_LANES - 1) / PRODUCTS_LANES * PRODUCTS_LANES;
    for (size_t i = 0; i < n; i++) {
        q[i] = look_up(start, R[i], &w[i]);
        w[i] = weight[i] == 0.0 ? 0.0 : w[i];
    }
    for (size_t k = 0; k < 3; k++)
        for (size_t i = 0; i < n; i++)
            rows[k][i] = w[i] * start->column[k][i];
    for (size_t i = 0; i < n; i++)
        rows[3][i] = w[i] * (q[i] - start->without[i]);
    for (size_t k = 0; k < 4; k++)
        for (size_t i = n; i < length; i++)
            rows[k][i] = 0.0;
    products(row, 4, length, sum);
    struct equations e = { .a00 = sum[0],
                           .a01 = sum[1],
                           .a11 = sum[2],
                           .a02 = sum[3],
                           .a12 = sum[4],
                           .a22 = sum[5],
                           .b0 = sum[6],
                           .b1 = sum[7],
                           .b2 = sum[8] };
    if (!solve(&e, x))
        return;
    t->Cm = x[0];
    t->Bm = x[0] > 1e-6 ? x[1] / x[0] : t->Bm; /* where there is melanin to blend */
    t->Ch = x[2];
}
