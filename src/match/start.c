/* start.c - R -> sigma_a/sigma_s' per band, then three linear equations. */
#include "match/start.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "match/products.h"
#include "optics/dipole.h"
#include "optics/quick.h"

/* Lanes depend on nothing but themselves. */
#if defined(__clang__)
#define START_LOOP _Pragma("clang loop vectorize(assume_safety)")
#define START_WIDE "avx512f,avx512dq,avx512vl"
#else
#define START_LOOP _Pragma("GCC ivdep")
#define START_WIDE "avx512f,avx512dq,avx512vl,prefer-vector-width=512,tune=icelake-server"
#endif
#define START_INLINE static inline __attribute__((always_inline))

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
    ret->wide = quick_has(QUICK_AVX512);
    for (size_t k = 0; k < 3; k++)
        memset(ret->column[k], 0, sizeof ret->column[k]);
    memset(ret->without, 0, sizeof ret->without);
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

/* The equations' rows: three columns and what they are to give, all by how sharply R shows q. */
enum { ROWS = 4, LANES = PRODUCTS_LANES, MOST = SPECTRUM_MAX_BANDS + LANES };
typedef double equation_rows[ROWS][MOST];

/* Rows of `length`, whole vectors.  R[length] and weight[length] are 0 past the last band. */
START_INLINE void fill_rows(const struct start *start, const double *restrict R,
                            const double *restrict weight, size_t length, equation_rows rows)
{
    const double *restrict q = start->q, *restrict dR_dq = start->dR_dq;
    double steps_per_R = start->steps_per_R;
    for (size_t at = 0; at < length; at += LANES) {
        double place[LANES]; /* between two steps of the curves */
        START_LOOP
        for (size_t l = 0; l < LANES; l++) {
            double x = R[at + l] * steps_per_R, least = x > 0.0 ? x : 0.0;
            place[l] = least < START_STEPS - 0.001 ? least : START_STEPS - 0.001;
        }
        START_LOOP
        for (size_t l = 0; l < LANES; l++) {
            size_t k = at + l;
            int i = (int)place[l];
            double share = place[l] - (double)i;
            double there = q[i] + share * (q[i + 1] - q[i]);
            double w = weight[k] * (dR_dq[i] + share * (dR_dq[i + 1] - dR_dq[i]));
            rows[0][k] = w * start->column[0][k];
            rows[1][k] = w * start->column[1][k];
            rows[2][k] = w * start->column[2][k];
            rows[3][k] = w * (there - start->without[k]);
        }
    }
}

static void fill_rows_plain(const struct start *start, const double *R, const double *weight,
                            size_t length, equation_rows rows)
{
    fill_rows(start, R, weight, length, rows);
}

#if defined(__x86_64__) && defined(__GNUC__)
/* Only these vectors look curves up quickly. */
__attribute__((target(START_WIDE))) static void fill_rows_avx512(const struct start *start,
                                                                 const double *R,
                                                                 const double *weight,
                                                                 size_t length, equation_rows rows)
{
    fill_rows(start, R, weight, length, rows);
}
#else
#define fill_rows_avx512 fill_rows_plain
#endif

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
    double given[MOST], counts[MOST], sum[10], x[3];
    equation_rows rows;
    const double *const row[ROWS] = { rows[0], rows[1], rows[2], rows[3] };
    size_t n = start->n, length = (n + LANES - 1) / LANES * LANES;
    memcpy(given, R, n * sizeof *R);
    memcpy(counts, weight, n * sizeof *weight);
    for (size_t i = n; i < length; i++)
        given[i] = counts[i] = 0.0;
    if (start->wide)
        fill_rows_avx512(start, given, counts, length, rows);
    else
        fill_rows_plain(start, given, counts, length, rows);
    products(row, ROWS, length, sum);
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

double start_by_root(double x, double y)
{
    double root = 0.5 * (1.0 + y / x);              /* over that of x */
    return root > 0.3 ? x * root * root : 0.09 * x; /* not past 0 */
}
