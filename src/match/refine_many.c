/* refine_many.c - rows handed out to threads, a piece at a time. */
#include "match/refine_many.h"

#include <math.h>
#include <stdlib.h>

#include "base/parallel.h"

/* Rows a thread takes at a time. */
enum { PIECE = 1024 };

struct refine_many {
    struct refiner *refiner;
    struct noise noise;
    double first_nm, step_nm;
    size_t bands;
};

enum status refine_many_open(const struct fit *fit, double first_nm, double step_nm, size_t bands,
                             const struct noise *noise, struct refine_many **ret, const char **why)
{
    enum status s = noise_check(noise, why);
    if (s != STATUS_OK)
        return s;
    struct refine_many *m = calloc(1, sizeof *m);
    if (m == NULL) {
        if (why != NULL)
            *why = "there is no memory left";
        return STATUS_NO_MEMORY;
    }
    *m = (struct refine_many){
        .noise = *noise, .first_nm = first_nm, .step_nm = step_nm, .bands = bands
    };
    s = refiner_open(fit, first_nm, step_nm, bands, &m->refiner, why);
    if (s != STATUS_OK) {
        refine_many_close(m);
        return s;
    }
    *ret = m;
    return STATUS_OK;
}

void refine_many_close(struct refine_many *many)
{
    if (many == NULL)
        return;
    refiner_close(many->refiner);
    free(many);
}

/* ---- one by one ------------------------------------------------------------------------ */

struct job {
    const struct refine_many *many;
    const struct refine_rows *rows;
    const struct refine_answers *ret;
};

static void put(double *array, size_t i, double x)
{
    if (array != NULL)
        array[i] = x;
}

static void answer_refused(const struct refine_answers *ret, size_t i)
{
    for (size_t p = 0; p < SKIN_PARAMETERS; p++) {
        put(ret->value[p], i, NAN);
        put(ret->se[p], i, NAN);
    }
    put(ret->chi_square, i, NAN);
    put(ret->rms, i, NAN);
    if (ret->flags != NULL)
        ret->flags[i] = REFINE_MANY_REFUSED;
}

static void answer(const struct refine_answers *ret, size_t i, const struct refined *r)
{
    for (size_t p = 0; p < SKIN_PARAMETERS; p++) {
        put(ret->value[p], i, r->value[p]);
        put(ret->se[p], i, r->se[p]);
    }
    put(ret->chi_square, i, r->chi_square);
    put(ret->rms, i, r->rms);
    if (ret->flags != NULL)
        ret->flags[i] = r->flags;
}

static void run_one(const struct job *job, size_t i)
{
    const struct refine_many *m = job->many;
    struct spectrum s = {
        .first_nm = m->first_nm, .step_nm = m->step_nm, .n = m->bands, .specular = SPECULAR_SCE
    };
    struct refined r;
    double sum = 0.0;
    for (size_t k = 0; k < m->bands; k++) {
        size_t at = i * job->rows->stride + k;
        s.value[k] = job->rows->R != NULL ? job->rows->R[at] : (double)job->rows->R_float[at];
        sum += s.value[k];
    }
    if (isnan(sum) || refiner_run(m->refiner, &m->noise, &s, 1, NULL, 0, 0, &r, NULL) != STATUS_OK)
        answer_refused(job->ret, i);
    else
        answer(job->ret, i, &r);
}

/* ---- all ------------------------------------------------------------------------------- */

static enum status run_piece(size_t piece, unsigned worker, void *context)
{
    const struct job *job = context;
    size_t from = piece * PIECE, to = from + PIECE;
    (void)worker;
    for (size_t i = from; i < to && i < job->rows->n; i++)
        run_one(job, i);
    return STATUS_OK;
}

enum status refine_many_run(const struct refine_many *many, const struct refine_rows *rows,
                            unsigned threads, const struct refine_answers *ret)
{
    struct job job = { many, rows, ret };
    if (rows->stride < many->bands || (rows->R == NULL) == (rows->R_float == NULL))
        return STATUS_RANGE;
    return parallel_run((rows->n + PIECE - 1) / PIECE, threads, run_piece, &job);
}
