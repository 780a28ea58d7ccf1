/* inversion.c - spectra to skins, one at a time by refiner_run() and all together by
 * refine_many_run(), beside cminpack's lmder.
 *
 *     inversion [SPECTRA] [ROUNDS]
 *
 * The same spectra (31 bands, 400..700 nm, white noise 0.003), the same starts, one core.  lmder
 * drives the same models as anybody would write them in double precision, with their
 * derivatives: Eq. 9, and the textbook form of two-layer diffusion (docs/physics.md), what
 * does not change with the skin computed beforehand.  Both end where chi^2 stays the same to
 * some 1e-9.  Rounds by turns; prints the medians of each, their ratio beside the bar, and how
 * far the answers are apart.  Ends with status 1 where a bar is missed or answers differ. */
#include <cminpack.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/parallel.h"
#include "match/refine.h"
#include "match/refine_many.h"
#include "optics/dipole.h"
#include "optics/quick.h"
#include "tests/bench/rounds.h"
#include "tests/support/dice.h"

enum { BANDS = 31, MOST = 20000, MOST_ROUNDS = 101, FREE_MOST = 5 };
#define NOISE 0.003
#define BAR 10.0
#define BAR_MANY 20.0
/* For more threads than one: enough spectra to be worth it, on the clock that they share. */
enum { MANY = 65536, MANY_ROUNDS = 11 };
#define BAR_THREADS 1.8

/* ---- the models as one would write them -------------------------------------------------- */

/* R of a band and its derivatives by sigma_a of either layer and by sigma_s'; `law`: one
 * sigma_s' for both layers, else half of it in the dermis. */
struct band {
    double R, by_epidermis, by_dermis, by_scattering;
};

struct plain {
    bool two_layer, law;
    double A, entering, d;
};

static struct band plain_half_space(const struct plain *p, double sa1, double sa2, double ss)
{
    double sa = sa1 + sa2, st = sa + ss, mu = ss / st, s = sqrt(3.0 * sa / st);
    double steeper = 1.0 + 4.0 / 3.0 * p->A, slow = exp(-s), fast = exp(-steeper * s);
    double g = slow + fast, g_by_s = -slow - steeper * fast;
    double s_by_sa = 1.5 * ss / (st * st) / s, s_by_ss = -1.5 * sa / (st * st) / s;
    double by_sa = 0.5 * p->entering * (-ss / (st * st) * g + mu * g_by_s * s_by_sa);
    double by_ss = 0.5 * p->entering * (sa / (st * st) * g + mu * g_by_s * s_by_ss);
    return (struct band){ 0.5 * p->entering * mu * g, by_sa, by_sa, by_ss };
}

/* What an input changes: the four coefficients' own changes, and so on down to R. */
struct change {
    double sa1, ss1, sa2, ss2;
};

static struct band plain_two_layer(const struct plain *p, double sa1, double sa2, double ss)
{
    double A = p->A, d = p->d, ss1 = ss, ss2 = p->law ? ss : 0.5 * ss;
    double st1 = sa1 + ss1, st2 = sa2 + ss2;
    double k1 = sqrt(3.0 * sa1 * st1), k2 = sqrt(3.0 * sa2 * st2);
    double u1 = k1 / (3.0 * st1), u2 = k2 / (3.0 * st2), rho = (u1 - u2) / (u1 + u2);
    double T = exp(-st1 * d), t = exp(-k1 * d), z = (k1 - st1) * d;
    double grown = expm1(z), E = grown / z, E_by_z = (grown + 1.0 - E) / z;
    double direct = (1.0 - T * t) / (st1 + k1), back = rho * t * t * d * E;
    double beneath = T * t * (1.0 + rho) / (st2 + k2);
    double N = ss1 * (direct + back) + ss2 * beneath;
    double L = 1.0 + 2.0 * A * u1 + rho * t * t * (1.0 - 2.0 * A * u1), R = N / L;
    const struct change by[3] = { { 1.0, 0.0, 0.0, 0.0 },
                                  { 0.0, 0.0, 1.0, 0.0 },
                                  { 0.0, 1.0, 0.0, p->law ? 1.0 : 0.5 } };
    double R_by[3];
    for (int i = 0; i < 3; i++) {
        const struct change *c = &by[i];
        double st1_ = c->sa1 + c->ss1, st2_ = c->sa2 + c->ss2;
        double k1_ = 1.5 * (c->sa1 * st1 + sa1 * st1_) / k1;
        double k2_ = 1.5 * (c->sa2 * st2 + sa2 * st2_) / k2;
        double u1_ = (k1_ / 3.0 - u1 * st1_) / st1, u2_ = (k2_ / 3.0 - u2 * st2_) / st2;
        double rho_ = 2.0 * (u1_ * u2 - u1 * u2_) / ((u1 + u2) * (u1 + u2));
        double T_ = -d * st1_ * T, t_ = -d * k1_ * t, E_ = E_by_z * (k1_ - st1_) * d;
        double direct_ = -(T_ * t + T * t_ + direct * (st1_ + k1_)) / (st1 + k1);
        double back_ = d * (rho_ * t * t * E + 2.0 * rho * t * t_ * E + rho * t * t * E_);
        double beneath_ = ((T_ * t + T * t_) * (1.0 + rho) + T * t * rho_) / (st2 + k2) -
                          beneath * (st2_ + k2_) / (st2 + k2);
        double N_ =
            c->ss1 * (direct + back) + ss1 * (direct_ + back_) + c->ss2 * beneath + ss2 * beneath_;
        double L_ = 2.0 * A * u1_ + (rho_ * t * t + 2.0 * rho * t * t_) * (1.0 - 2.0 * A * u1) -
                    2.0 * A * u1_ * rho * t * t;
        R_by[i] = p->entering * (N_ - R * L_) / L;
    }
    return (struct band){ p->entering * R, R_by[0], R_by[1], R_by[2] };
}

/* R alone, for lmder asks for it alone as well. */
static double plain_R(const struct plain *p, double sa1, double sa2, double ss)
{
    if (!p->two_layer) {
        double sa = sa1 + sa2, st = sa + ss, s = sqrt(3.0 * sa / st);
        return 0.5 * p->entering * ss / st * (1.0 + exp(-4.0 / 3.0 * p->A * s)) * exp(-s);
    }
    double d = p->d, ss2 = p->law ? ss : 0.5 * ss, st1 = sa1 + ss, st2 = sa2 + ss2;
    double k1 = sqrt(3.0 * sa1 * st1), k2 = sqrt(3.0 * sa2 * st2);
    double u1 = k1 / (3.0 * st1), u2 = k2 / (3.0 * st2), rho = (u1 - u2) / (u1 + u2);
    double T = exp(-st1 * d), t = exp(-k1 * d), z = (k1 - st1) * d, E = expm1(z) / z;
    double N = ss * ((1.0 - T * t) / (st1 + k1) + rho * t * t * d * E) +
               ss2 * T * t * (1.0 + rho) / (st2 + k2);
    double A2 = 2.0 * p->A;
    return p->entering * N / (1.0 + A2 * u1 + rho * t * t * (1.0 - A2 * u1));
}

/* ---- for lmder ---------------------------------------------------------------------------- */

struct problem {
    const struct chromophores *c;
    struct plain plain;
    const double *measured;
    bool skin; /* free: Cm, Ch, gamma, a, b; else Cm, Bm, Ch */
};

/* lmder knows no bounds: what steps out of what absorbs at all is kept from being no number. */
static double absorbs(double sigma_a)
{
    return fmax(sigma_a, 1e-6);
}

static int residual(void *context, int m, int n, const double *x, double *r, double *J, int ldj,
                    int what)
{
    const struct problem *p = context;
    const struct chromophores *c = p->c;
    double Cm = x[0], Bm = p->skin ? 0.0 : x[1], Ch = p->skin ? x[1] : x[2];
    double gamma = p->skin ? x[2] : 0.75;
    (void)n;
    for (int i = 0; i < m; i++) {
        double melanin = Bm * c->eumelanin[i] + (1.0 - Bm) * c->pheomelanin[i];
        double blood = gamma * c->oxy[i] + (1.0 - gamma) * c->deoxy[i];
        double sa1 = absorbs(Cm * melanin + (1.0 - Cm) * c->base[i]);
        double sa2 = absorbs(Ch * blood + (1.0 - Ch) * c->base[i]);
        double law = p->skin ? exp(-x[4] * c->log_nm[i]) : 1.0;
        double ss = p->skin ? absorbs(x[3] * law) : c->sigma_s_prime[i];
        if (what == 1) {
            r[i] = (plain_R(&p->plain, sa1, sa2, ss) - p->measured[i]) / NOISE;
            continue;
        }
        struct band b = p->plain.two_layer ? plain_two_layer(&p->plain, sa1, sa2, ss)
                                           : plain_half_space(&p->plain, sa1, sa2, ss);
        J[i] = b.by_epidermis * (melanin - c->base[i]) / NOISE;
        double by_Ch = b.by_dermis * (blood - c->base[i]) / NOISE;
        if (p->skin) {
            J[i + ldj] = by_Ch;
            J[i + 2 * ldj] = b.by_dermis * Ch * (c->oxy[i] - c->deoxy[i]) / NOISE;
            J[i + 3 * ldj] = b.by_scattering * law / NOISE;
            J[i + 4 * ldj] = -b.by_scattering * ss * c->log_nm[i] / NOISE;
        } else {
            J[i + ldj] = b.by_epidermis * Cm * (c->eumelanin[i] - c->pheomelanin[i]) / NOISE;
            J[i + 2 * ldj] = by_Ch;
        }
    }
    return 0;
}

/* chi^2 at the end. */
static double run_lmder(const struct problem *p, double *x, int n, int *evaluations)
{
    double r[BANDS], J[BANDS * FREE_MOST], diag[FREE_MOST], qtf[FREE_MOST], wa[3][FREE_MOST];
    double wa4[BANDS];
    int pivot[FREE_MOST], functions = 0, jacobians = 0;
    (void)lmder(residual, (void *)p, BANDS, n, x, r, J, BANDS, 1e-10, 1e-10, 0.0, 400, diag, 1,
                100.0, 0, &functions, &jacobians, pivot, qtf, wa[0], wa[1], wa[2], wa4);
    double norm = enorm(BANDS, r);
    *evaluations += functions + jacobians;
    return norm * norm;
}

/* ---- spectra ------------------------------------------------------------------------------ */

struct contest {
    const char *what;
    struct fit fit;
    struct problem problem;
    enum skin_parameter free[FREE_MOST];
    int n;
};

struct site {
    double start[SKIN_PARAMETERS];
    struct spectrum spectrum;
};
static struct site site[MOST];
static double rows[MANY][BANDS]; /* the same spectra, one behind the other, again and again */

static double decades(struct dice *dice, double least, double most)
{
    return exp(dice_between(dice, log(least), log(most)));
}

/* Sum of 12 even ones: normal enough. */
static double noise(struct dice *dice)
{
    double sum = -6.0;
    for (int i = 0; i < 12; i++)
        sum += dice_between(dice, 0.0, 1.0);
    return NOISE * sum;
}

/* Starts are off by what the nearest row of a table is: a third of an amount, 0.15 of a share. */
static void make_sites(const struct contest *c, const struct chromophores *chromophores, size_t n)
{
    struct dice dice = { 11 };
    static double scratch[MEDIUM_SCRATCH(BANDS)];
    for (size_t k = 0; k < n; k++) {
        double value[SKIN_PARAMETERS];
        for (size_t i = 0; i < SKIN_PARAMETERS; i++)
            value[i] = c->fit.role[i].value;
        value[SKIN_CM] = decades(&dice, 0.005, 0.2);
        value[SKIN_CH] = decades(&dice, 0.001, 0.1);
        if (c->problem.skin) {
            value[SKIN_SO2] = dice_between(&dice, 0.2, 0.9);
            value[SKIN_SCATTERING_A] = decades(&dice, 5.0, 20.0);
            value[SKIN_SCATTERING_B] = dice_between(&dice, 0.8, 2.0);
        } else {
            value[SKIN_BM] = dice_between(&dice, 0.0, 1.0);
        }
        struct spectrum *s = &site[k].spectrum;
        *s = (struct spectrum){
            .first_nm = 400, .step_nm = 10, .n = BANDS, .specular = SPECULAR_SCE, .aperture_mm = 8
        };
        struct tissue t = fit_tissue(&c->fit, value);
        if (model_reflectance(c->fit.model, &t, chromophores, scratch, s->value) != STATUS_OK)
            exit(1);
        for (size_t i = 0; i < BANDS; i++)
            s->value[i] += noise(&dice);
        memcpy(site[k].start, value, sizeof value);
        for (int i = 0; i < c->n; i++) {
            enum skin_parameter p = c->free[i];
            bool share = p == SKIN_BM || p == SKIN_SO2;
            double x = share ? value[p] + dice_between(&dice, -0.15, 0.15)
                             : value[p] * dice_between(&dice, 0.7, 1.4);
            site[k].start[p] = fmin(fmax(x, c->fit.role[p].lo), c->fit.role[p].hi);
        }
    }
}

/* ---- the contest -------------------------------------------------------------------------- */

static void fail(const char *what, const char *why)
{
    fprintf(stderr, "inversion: %s: %s\n", what, why);
    exit(1);
}

/* Both times a spectrum, microseconds, of one round. */
static double run_ours(const struct contest *c, const struct refiner *refiner, size_t n,
                       double *chi_square, size_t *evaluations)
{
    static struct refined ret;
    struct noise white = noise_white(NOISE);
    const char *why = "";
    double start = now_us();
    *evaluations = 0;
    for (size_t k = 0; k < n; k++) {
        const double(*from)[SKIN_PARAMETERS] = (const double(*)[SKIN_PARAMETERS])site[k].start;
        if (refiner_run(refiner, &white, &site[k].spectrum, 1, from, 1, 0, &ret, &why) != STATUS_OK)
            fail(c->what, why);
        chi_square[k] = ret.flags & REFINE_NOT_CONVERGED ? (double)NAN : ret.chi_square;
        *evaluations += ret.evaluations;
    }
    return (now_us() - start) / (double)n;
}

/* Values, standard errors, chi^2 and flags of all. */
struct many_answers {
    double value[3][MANY], se[3][MANY], chi_square[MANY];
    uint32_t flags[MANY];
};

static void run_many(const struct contest *c, const struct refine_many *many, size_t n,
                     unsigned threads, struct many_answers *ret)
{
    struct refine_rows from = { .R = rows[0], .stride = BANDS, .n = n };
    struct refine_answers to = { .chi_square = ret->chi_square, .flags = ret->flags };
    for (int i = 0; i < 3; i++) {
        to.value[c->free[i]] = ret->value[i];
        to.se[c->free[i]] = ret->se[i];
    }
    if (refine_many_run(many, &from, threads, &to) != STATUS_OK)
        fail(c->what, "the rows were refused");
}

static double run_theirs(struct contest *c, size_t n, double *chi_square, bool *inside,
                         int *evaluations)
{
    double start = now_us();
    *evaluations = 0;
    for (size_t k = 0; k < n; k++) {
        double x[FREE_MOST] = { 0 };
        for (int i = 0; i < c->n; i++)
            x[i] = site[k].start[c->free[i]];
        c->problem.measured = site[k].spectrum.value;
        chi_square[k] = run_lmder(&c->problem, x, c->n, evaluations);
        inside[k] = true;
        for (int i = 0; i < c->n; i++)
            inside[k] = inside[k] && x[i] >= c->fit.role[c->free[i]].lo &&
                        x[i] <= c->fit.role[c->free[i]].hi;
    }
    return (now_us() - start) / (double)n;
}

static double wall_us(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e6 * (double)t.tv_sec + 1e-3 * (double)t.tv_nsec;
}

/* All together by one thread and by two, in turns. */
static bool time_threads(const struct contest *c, const struct refine_many *many, size_t n)
{
    static struct many_answers got[2];
    double took[2][MANY_ROUNDS], ratio[MANY_ROUNDS];
    for (size_t k = n; k < MANY; k++)
        memcpy(rows[k], rows[k - n], sizeof rows[k]);
    for (size_t round = 0; round < MANY_ROUNDS; round++) {
        for (unsigned threads = 1; threads <= 2; threads++) {
            double start = wall_us();
            run_many(c, many, MANY, threads, &got[threads - 1]);
            took[threads - 1][round] = (wall_us() - start) / MANY;
        }
        ratio[round] = took[0][round] / took[1][round];
    }
    if (memcmp(&got[0], &got[1], sizeof got[0]) != 0)
        fail(c->what, "two threads gave other bits");
    double times = median(ratio, MANY_ROUNDS);
    bool met = times >= BAR_THREADS;
    printf("    %d together, on the clock: one thread %.3f us, two %.3f us, %.2f times (bar %.1f): "
           "%s\n",
           MANY, median(took[0], MANY_ROUNDS), median(took[1], MANY_ROUNDS), times, BAR_THREADS,
           met ? "met" : "MISSED");
    return met;
}

static bool contest(struct contest *c, const struct chromophores *chromophores, size_t n,
                    size_t rounds)
{
    static double ours_chi[MOST], theirs_chi[MOST], ours[MOST_ROUNDS], theirs[MOST_ROUNDS];
    static double ratio[MOST_ROUNDS], together[MOST_ROUNDS], ratio_together[MOST_ROUNDS];
    static bool inside[MOST];
    static struct many_answers got;
    struct refiner *refiner;
    struct refine_many *many;
    struct noise white = noise_white(NOISE);
    const char *why = "";
    size_t evaluations = 0, out = 0, worse = 0, other = 0;
    int their_evaluations = 0;
    if (refiner_open(&c->fit, 400.0, 10.0, BANDS, &refiner, &why) != STATUS_OK)
        fail(c->what, why);
    if (refine_many_open(&c->fit, 400.0, 10.0, BANDS, &white, &many, &why) != STATUS_OK)
        fail(c->what, why);
    make_sites(c, chromophores, n);
    for (size_t k = 0; k < n; k++)
        memcpy(rows[k], site[k].spectrum.value, sizeof rows[k]);
    for (size_t round = 0; round < rounds; round++) {
        ours[round] = run_ours(c, refiner, n, ours_chi, &evaluations);
        theirs[round] = run_theirs(c, n, theirs_chi, inside, &their_evaluations);
        double start = now_us();
        run_many(c, many, n, 1, &got);
        together[round] = (now_us() - start) / (double)n;
        ratio[round] = theirs[round] / ours[round];
        ratio_together[round] = theirs[round] / together[round];
    }
    refiner_close(refiner);
    for (size_t k = 0; k < n; k++) {
        out += inside[k] ? 0u : 1u;
        /* Where lmder's answer is one that we may give, ours must be as good. */
        worse += inside[k] && !(ours_chi[k] <= theirs_chi[k] + 1e-3) ? 1u : 0u;
        other += inside[k] && ours_chi[k] < theirs_chi[k] - 1e-3 ? 1u : 0u;
    }
    double times = median(ratio, rounds);
    bool met = times >= BAR;
    printf("  %-30s %7.2f us %7.2f us  %6.1f  %s\n", c->what, median(ours, rounds),
           median(theirs, rounds), times, met ? "met" : "MISSED");
    printf("    evaluations %.1f and %.1f; lmder out of the bounds %.1f %%, ended higher than we "
           "%.1f %%, lower %.1f %%\n",
           (double)evaluations / (double)n, (double)their_evaluations / (double)n,
           100.0 * (double)out / (double)n, 100.0 * (double)other / (double)n,
           100.0 * (double)worse / (double)n);
    worse = 0;
    for (size_t k = 0; k < n; k++)
        worse += inside[k] && !(got.chi_square[k] <= theirs_chi[k] + 1e-3) ? 1u : 0u;
    times = median(ratio_together, rounds);
    bool met_together = c->n > 3 || times >= BAR_MANY; /* other fits go one by one */
    printf("  %-30s %7.3f us %7.2f us  %6.1f  %s\n", "  together", median(together, rounds),
           median(theirs, rounds), times,
           c->n > 3       ? ""
           : met_together ? "met"
                          : "MISSED");
    printf("    ended higher than lmder %.1f %%\n", 100.0 * (double)worse / (double)n);
    if (c->n == 3)
        met_together = time_threads(c, many, n) && met_together;
    refine_many_close(many);
    return met && met_together;
}

static struct skin_role between(double lo, double hi)
{
    return (
        struct skin_role){ .free = true, .value = lo, .lo = lo, .hi = hi, .prior_sd = INFINITY };
}

static struct contest contest_of(const char *what, const char *model, bool skin,
                                 const struct chromophores *c)
{
    struct recipe recipe = recipe_default(model_find(model));
    struct contest ret = {
        .what = what, .fit = fit_three(&recipe), .n = 3, .free = { SKIN_CM, SKIN_BM, SKIN_CH }
    };
    struct plain *plain = &ret.problem.plain;
    if (skin) {
        static const enum skin_parameter free[FREE_MOST] = { SKIN_CM, SKIN_CH, SKIN_SO2,
                                                             SKIN_SCATTERING_A, SKIN_SCATTERING_B };
        ret.fit.role[SKIN_BM].free = false;
        ret.fit.role[SKIN_BM].value = 0.0;
        ret.fit.role[SKIN_SO2] = between(0.0, 1.0);
        ret.fit.role[SKIN_SCATTERING_A] = between(1.0, 100.0);
        ret.fit.role[SKIN_SCATTERING_B] = between(-1.0, 5.0);
        ret.fit.own_scattering = true;
        memcpy(ret.free, free, sizeof free);
        ret.n = FREE_MOST;
    }
    ret.problem.c = c;
    ret.problem.skin = skin;
    plain->two_layer = strcmp(model, "two-layer") == 0;
    plain->law = skin;
    plain->d = recipe.epidermis_mm;
    plain->entering = 1.0 - dipole_Rs(recipe.eta);
    if (dipole_A(recipe.eta, &plain->A) != STATUS_OK)
        exit(1);
    return ret;
}

/* ---- one evaluation ----------------------------------------------------------------------- */

/* Nanoseconds for R and J of 31 bands, median of rounds: plain, and by each kind of vectors. */
static void time_evaluation(const struct contest *c, const struct chromophores *chromophores)
{
    enum { TIMES = 500, ROUNDS = 31 };
    static double scratch[QUICK_SCRATCH(BANDS)], R[QUICK_STRIDE(BANDS)];
    static double J[TISSUE_PARAMETERS * QUICK_STRIDE(BANDS)], took[1 + QUICK_VECTORS][ROUNDS];
    for (size_t round = 0; round < ROUNDS; round++)
        for (int v = -1; v < QUICK_VECTORS; v++) {
            if (v >= 0 && !quick_has((enum quick_vectors)v))
                continue;
            double start = now_us();
            for (size_t k = 0; k < TIMES; k++) {
                struct tissue t = fit_tissue(&c->fit, site[k % 100].start);
                enum status s =
                    v < 0 ? model_slopes(c->fit.model, &t, chromophores, scratch, R, J)
                          : quick_slopes_by((enum quick_vectors)v, c->fit.model, &t, chromophores,
                                            fit_free(&c->fit), scratch, R, J);
                if (s != STATUS_OK)
                    exit(1);
            }
            took[1 + v][round] = 1e3 * (now_us() - start) / TIMES;
        }
    printf("    R and J of %d bands, ns: model_slopes %.0f", BANDS, median(took[0], ROUNDS));
    static const char *const name[QUICK_VECTORS] = { "quick plain", "avx2", "avx512" };
    for (int v = 0; v < QUICK_VECTORS; v++)
        if (quick_has((enum quick_vectors)v))
            printf(", %s %.0f", name[v], median(took[1 + v], ROUNDS));
    printf("\n");
}

int main(int argc, char **argv)
{
    static struct chromophores c;
    size_t n = argc > 1 ? (size_t)strtoul(argv[1], NULL, 10) : 1000;
    size_t rounds = argc > 2 ? (size_t)strtoul(argv[2], NULL, 10) : 21;
    if (n < 100 || n > MOST || rounds == 0 || rounds > MOST_ROUNDS ||
        chromophores_init(400.0, 10.0, BANDS, &c) != STATUS_OK) {
        fprintf(stderr, "inversion: 100 to %d spectra, 1 to %d rounds\n", MOST, MOST_ROUNDS);
        return 2;
    }
    struct contest contests[] = {
        contest_of("half-space: Cm, Bm, Ch", "half-space", false, &c),
        contest_of("two-layer: Cm, Bm, Ch", "two-layer", false, &c),
        contest_of("skin fit: Cm, Ch, SO2, a, b", "two-layer", true, &c),
    };
    bool met = true;
    printf("%zu spectra, %zu rounds by turns, medians; bar %.0f, together %.0f\n", n, rounds, BAR,
           BAR_MANY);
    printf("  %-30s %10s %10s  %6s\n", "", "refine", "lmder", "times");
    for (size_t i = 0; i < sizeof contests / sizeof *contests; i++) {
        met = contest(&contests[i], &c, n, rounds) && met;
        time_evaluation(&contests[i], &c);
    }
    return met ? 0 : 1;
}
