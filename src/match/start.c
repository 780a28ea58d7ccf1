/* start.c - R -> sigma_a/sigma_s' per band, then three linear equations. */
#include "match/start.h"

#include <math.h>
#include <stdbool.h>

#include "optics/dipole.h"

/* Eq. 9 in s, with mu' = 1 - s^2/3. */
static double reflectance(double s, double A, double entering)
{
    double mu = 1.0 - s * s / 3.0;
    return entering * 0.5 * mu * (1.0 + exp(-4.0 / 3.0 * A * s)) * exp(-s);
}

void start_curve_init(double eta, struct start_curve *ret)
{
    double A = 1.0, entering = 1.0 - dipole_Rs(eta);
    (void)dipole_A(eta, &A);
    ret->R_most = entering;
    for (size_t i = 0; i <= START_STEPS; i++) {
        double R = ret->R_most * (double)i / START_STEPS, low = 0.0, high = sqrt(3.0);
        for (int turn = 0; turn < 60; turn++) { /* R falls as s grows */
            double middle = 0.5 * (low + high);
            if (reflectance(middle, A, entering) > R)
                low = middle;
            else
                high = middle;
        }
        ret->s[i] = 0.5 * (low + high);
    }
}

/* s at R, and ds/dR. */
static double look_up(const struct start_curve *curve, double R, double *slope)
{
    double place = R / curve->R_most * START_STEPS;
    /* Not at the very ends: nothing absorbed, or everything. */
    place = place > 0.5 ? (place < START_STEPS - 0.5 ? place : START_STEPS - 0.5) : 0.5;
    size_t i = (size_t)place;
    double rise = curve->s[i + 1] - curve->s[i];
    *slope = rise * START_STEPS / curve->R_most;
    return curve->s[i] + rise * (place - (double)i);
}

/* Sums of a weighted least-squares problem in three unknowns. */
struct equations {
    double a00, a01, a02, a11, a12, a22, b0, b1, b2;
};

static void add_band(struct equations *e, const double x[3], double y)
{
    e->a00 += x[0] * x[0];
    e->a01 += x[0] * x[1];
    e->a02 += x[0] * x[2];
    e->a11 += x[1] * x[1];
    e->a12 += x[1] * x[2];
    e->a22 += x[2] * x[2];
    e->b0 += x[0] * y;
    e->b1 += x[1] * y;
    e->b2 += x[2] * y;
}

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

void start_guess(const struct start_curve *curve, const struct chromophores *c, const double *R,
                 const double *weight, struct tissue *t)
{
    struct equations e = { 0 };
    double x[3];
    for (size_t i = 0; i < c->n; i++) {
        double slope, s = look_up(curve, R[i], &slope), b = s * s / 3.0;
        double sigma_s = t->scattering_a == 0.0
                             ? c->sigma_s_prime[i]
                             : t->scattering_a * exp(-t->scattering_b * c->log_nm[i]);
        /* sigma_a = sigma_s' b/(1-b); an error dR of R makes it sigma_s' (2s/3) ds/(1-b)^2. */
        double rest = 1.0 - b, w = weight[i] * rest * rest / (sigma_s * 2.0 / 3.0 * s * slope);
        double blood = t->gamma * c->oxy[i] + (1.0 - t->gamma) * c->deoxy[i];
        double column[3] = { w * (c->pheomelanin[i] - c->base[i]),
                             w * (c->eumelanin[i] - c->pheomelanin[i]), w * (blood - c->base[i]) };
        add_band(&e, column, w * (sigma_s * b / rest - 2.0 * c->base[i]));
    }
    if (!solve(&e, x))
        return;
    t->Cm = x[0];
    t->Bm = x[0] > 1e-6 ? x[1] / x[0] : t->Bm; /* where there is melanin to blend */
    t->Ch = x[2];
}
