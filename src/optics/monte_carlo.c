/* monte_carlo.c - photons in blocks of fixed size on all threads, their sums added in order. */
#include "optics/monte_carlo.h"

#include <math.h>
#include <stdbool.h>

#include "base/parallel.h"
#include "optics/dipole.h"
#include "optics/monte_carlo_walk.h"

enum { BLOCK = 1024, ROUND = 256 }; /* photons in a block, blocks between two reports */
#define THIN 0.01 /* mean free paths, below which the slope by the thickness drowns in noise */

/* ---- sums over photons -------------------------------------------------------------- */

struct moments {
    double sum, squares;
};

enum { BY_SIGMA_A, BY_SIGMA_S, BY_MM, BY_COUNT };

struct sums {
    struct moments R, T, slope[MONTE_CARLO_MAX_LAYERS][BY_COUNT];
    double left;
};

static inline void add(struct moments *m, double x)
{
    m->sum += x;
    m->squares += x * x;
}

static void join(struct moments *m, struct moments other)
{
    m->sum += other.sum;
    m->squares += other.squares;
}

static struct monte_carlo_mean mean_of(struct moments m, uint64_t photons, double factor)
{
    double n = (double)photons, mean = m.sum / n;
    double variance = fmax(0.0, m.squares / n - mean * mean) / (n - 1.0);
    double error = sqrt(variance) * fabs(factor);
    return (struct monte_carlo_mean){ mean * factor, error };
}

struct job {
    struct monte_carlo_stack stack;
    double excess[MONTE_CARLO_MAX_LAYERS]; /* sigma_t/sigma_s; sigma_a/sigma_s where endless */
    uint64_t key, photons, begun;          /* photons of the rounds before */
    bool counting;
    struct sums block[ROUND];
};

/* Contributions of a photon to the slopes, without the unit: d R/d sigma_a and d sigma_s times
 * sigma_t, dR/dmm times mm.  A walk's share of light goes as sigma_s^scatterings e^-path in each
 * layer.  An endless one has no length, only an albedo: there the scatterings alone say it. */
static void add_slopes(const struct job *job, const struct monte_carlo_score *s, struct sums *to)
{
    for (size_t k = 0; k < job->stack.n; k++) {
        struct moments *slope = to->slope[k];
        if (job->stack.end[k] < INFINITY) {
            add(&slope[BY_SIGMA_A], -s->gone[k]);
            add(&slope[BY_SIGMA_S], s->scattered[k] * job->excess[k] - s->gone[k]);
            add(&slope[BY_MM], s->scattered[k] - s->gone[k]);
        } else {
            add(&slope[BY_SIGMA_A], -s->scattered[k]);
            add(&slope[BY_SIGMA_S], s->scattered[k] * job->excess[k]);
        }
    }
}

static enum status run_block(size_t piece, unsigned worker, void *context)
{
    struct job *job = context;
    struct sums sums = { 0 };
    uint64_t first = job->begun + (uint64_t)piece * BLOCK;
    uint64_t end = first + BLOCK < job->photons ? first + BLOCK : job->photons;
    (void)worker;
    for (uint64_t photon = first; photon < end; photon++) {
        struct monte_carlo_score s;
        monte_carlo_walk(&job->stack, job->key, photon, job->counting, &s);
        add(&sums.R, s.R);
        add(&sums.T, s.T);
        sums.left += s.left;
        if (job->counting)
            add_slopes(job, &s, &sums);
    }
    job->block[piece] = sums;
    return STATUS_OK;
}

/* Progress of a run over several bands. */
struct course {
    const struct monte_carlo_run *run;
    uint64_t done, total;
};

static enum status run_job(struct job *job, struct course *course, struct sums *ret)
{
    *ret = (struct sums){ 0 };
    for (job->begun = 0; job->begun < job->photons; job->begun += (uint64_t)ROUND * BLOCK) {
        uint64_t left = job->photons - job->begun;
        size_t blocks =
            left < (uint64_t)ROUND * BLOCK ? (size_t)((left + BLOCK - 1) / BLOCK) : ROUND;
        enum status s = parallel_run(blocks, course->run->threads, run_block, job);
        if (s != STATUS_OK)
            return s;
        for (size_t i = 0; i < blocks; i++) {
            const struct sums *block = &job->block[i];
            join(&ret->R, block->R);
            join(&ret->T, block->T);
            ret->left += block->left;
            for (size_t k = 0; k < job->stack.n; k++)
                for (int by = 0; by < BY_COUNT; by++)
                    join(&ret->slope[k][by], block->slope[k][by]);
        }
        uint64_t now = left < (uint64_t)ROUND * BLOCK ? left : (uint64_t)ROUND * BLOCK;
        course->done += now;
        if (!progress_go_on(course->run->progress, course->done, course->total))
            return STATUS_CANCELLED;
    }
    return STATUS_OK;
}

/* ---- layers ------------------------------------------------------------------------- */

static struct monte_carlo_stack stack_of(const struct monte_carlo_layer *layer, size_t n,
                                         double eta, double A)
{
    struct monte_carlo_stack stack = {
        .n = n, .eta = eta, .entering = 1.0 - dipole_Rs(eta), .losing_no_more = 2.0 * A
    };
    double depth = 0.0;
    for (size_t k = 0; k < n; k++) {
        double sigma_t = layer[k].sigma_a + layer[k].sigma_s;
        depth += sigma_t * layer[k].mm;
        stack.albedo[k] = layer[k].sigma_s / sigma_t;
        stack.absorbed[k] = layer[k].sigma_a / sigma_t;
        stack.g[k] = layer[k].g;
        stack.end[k] = depth;
    }
    return stack;
}

/* Layers, eta and run are good. */
static enum status compute(const struct monte_carlo_layer *layer, size_t n, double eta,
                           uint64_t band, bool counting, struct course *course,
                           struct monte_carlo_answer *ret)
{
    struct job job;
    struct sums sums;
    double A = 0.0;
    enum status s = dipole_A(eta, &A);
    if (s != STATUS_OK)
        return s;
    job.stack = stack_of(layer, n, eta, A);
    job.key = monte_carlo_mix(monte_carlo_mix(course->run->seed) ^ monte_carlo_mix(~band));
    job.photons = course->run->photons;
    job.counting = counting;
    for (size_t k = 0; k < n; k++)
        job.excess[k] =
            (layer[k].mm < INFINITY ? layer[k].sigma_a + layer[k].sigma_s : layer[k].sigma_a) /
            layer[k].sigma_s;
    s = run_job(&job, course, &sums);
    if (s != STATUS_OK)
        return s;
    *ret = (struct monte_carlo_answer){ .specular = dipole_Rs(eta),
                                        .R = mean_of(sums.R, job.photons, 1.0),
                                        .T = mean_of(sums.T, job.photons, 1.0),
                                        .left = sums.left / (double)job.photons };
    for (size_t k = 0; k < n; k++) {
        double per_sigma_t = 1.0 / (layer[k].sigma_a + layer[k].sigma_s);
        ret->slope[k] = (struct monte_carlo_slopes){
            mean_of(sums.slope[k][BY_SIGMA_A], job.photons, per_sigma_t),
            mean_of(sums.slope[k][BY_SIGMA_S], job.photons, per_sigma_t),
            mean_of(sums.slope[k][BY_MM], job.photons, 1.0 / layer[k].mm),
        };
    }
    return STATUS_OK;
}

static bool run_is_good(const struct monte_carlo_run *run)
{
    return run->photons >= MONTE_CARLO_MIN_PHOTONS && run->photons <= MONTE_CARLO_MAX_PHOTONS;
}

static bool layer_is_good(const struct monte_carlo_layer *l, bool last)
{
    return dipole_accepts(l->sigma_a, l->sigma_s) && l->mm > 0.0 &&
           (l->mm <= DIPOLE_COEFFICIENT_MAX || (last && isinf(l->mm))) &&
           fabs(l->g) <= MONTE_CARLO_MAX_G;
}

enum status monte_carlo_layers(const struct monte_carlo_layer *layer, size_t n, double eta,
                               const struct monte_carlo_run *run, struct monte_carlo_answer *ret)
{
    struct course course = { run, 0, run->photons };
    if (n < 1 || n > MONTE_CARLO_MAX_LAYERS || !run_is_good(run))
        return STATUS_RANGE;
    for (size_t k = 0; k < n; k++)
        if (!layer_is_good(&layer[k], k + 1 == n))
            return STATUS_RANGE;
    return compute(layer, n, eta, 0, true, &course, ret);
}

/* ---- skin --------------------------------------------------------------------------- */

static enum status check(const struct medium *m, const struct monte_carlo_run *run)
{
    double A;
    bool good =
        dipole_A(m->eta, &A) == STATUS_OK && run_is_good(run) && medium_check(m) == STATUS_OK;
    return good ? STATUS_OK : STATUS_RANGE;
}

struct skin_slopes {
    struct monte_carlo_slopes epidermis, dermis;
};

/* One band; slopes are wanted where dR is not NULL. */
static enum status band_answer(const struct medium *m, size_t i, struct course *course,
                               struct monte_carlo_mean *R, struct skin_slopes *dR)
{
    struct monte_carlo_layer skin[2] = {
        { m->sigma_a_epidermis[i], m->sigma_s_prime_epidermis[i], 0.0, m->epidermis_mm },
        { m->sigma_a_dermis[i], m->sigma_s_prime_dermis[i], 0.0, INFINITY },
    };
    struct monte_carlo_answer a = { 0 };
    size_t none = skin[0].mm > 0.0 ? 0 : 1; /* no epidermis */
    enum status s = compute(skin + none, 2 - none, m->eta, i, dR != NULL, course, &a);
    if (s != STATUS_OK)
        return s;
    *R = a.R;
    if (dR == NULL)
        return STATUS_OK;
    *dR = (struct skin_slopes){ { { 0.0, 0.0 }, { 0.0, 0.0 }, { 0.0, 0.0 } }, a.slope[1 - none] };
    if (none == 0)
        dR->epidermis = a.slope[0];
    if (dR->dermis.by_sigma_a.value < 0.0 && skin[1].sigma_a == 0.0)
        dR->dermis.by_sigma_a = (struct monte_carlo_mean){ -INFINITY, INFINITY };
    double sigma_t = skin[0].sigma_a + skin[0].sigma_s;
    if (skin[0].mm * sigma_t < THIN) {
        skin[0].mm = THIN / sigma_t;
        course->total += course->run->photons;
        s = compute(skin, 2, m->eta, i, true, course, &a);
        if (s != STATUS_OK)
            return s;
        dR->epidermis.by_mm = a.slope[0].by_mm;
    }
    return STATUS_OK;
}

static void put(const struct slopes *to, size_t i, double sigma_a1, double sigma_a2,
                double sigma_s1, double sigma_s2, double mm)
{
    to->sigma_a_epidermis[i] = sigma_a1;
    to->sigma_a_dermis[i] = sigma_a2;
    to->sigma_s_prime_epidermis[i] = sigma_s1;
    to->sigma_s_prime_dermis[i] = sigma_s2;
    to->epidermis_mm[i] = mm;
}

enum status monte_carlo_skin(const struct medium *m, const struct monte_carlo_run *run, double *R,
                             double *R_error, const struct slopes *dR,
                             const struct slopes *dR_error)
{
    struct course course = { run, 0, run->photons * m->n };
    enum status s = check(m, run);
    for (size_t i = 0; i < m->n && s == STATUS_OK; i++) {
        struct monte_carlo_mean mean;
        struct skin_slopes x;
        s = band_answer(m, i, &course, &mean, dR != NULL || dR_error != NULL ? &x : NULL);
        if (s != STATUS_OK)
            return s;
        R[i] = mean.value;
        if (R_error != NULL)
            R_error[i] = mean.error;
        if (dR != NULL)
            put(dR, i, x.epidermis.by_sigma_a.value, x.dermis.by_sigma_a.value,
                x.epidermis.by_sigma_s.value, x.dermis.by_sigma_s.value, x.epidermis.by_mm.value);
        if (dR_error != NULL)
            put(dR_error, i, x.epidermis.by_sigma_a.error, x.dermis.by_sigma_a.error,
                x.epidermis.by_sigma_s.error, x.dermis.by_sigma_s.error, x.epidermis.by_mm.error);
    }
    return s;
}

static const struct monte_carlo_run model_run = { MONTE_CARLO_PHOTONS, MONTE_CARLO_SEED, 1, NULL };

enum status monte_carlo_reflectance(const struct medium *m, double *R)
{
    return monte_carlo_skin(m, &model_run, R, NULL, NULL, NULL);
}

enum status monte_carlo_slopes(const struct medium *m, double *R, const struct slopes *dR)
{
    return monte_carlo_skin(m, &model_run, R, NULL, dR, NULL);
}
