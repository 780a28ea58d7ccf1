/* trial.c - tables made, methods made ready, errors of each, then all of them timed in turns. */
#include "trial/trial.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "match/table_maker.h"
#include "trial/front.h"
#include "trial/timing.h"

const char trial_bound_of_transport[] = "transport-8";

enum { ROUNDS = 9, ROUNDS_QUICK = 5, TIMED = 256, BATCHES = 8, BLOCK = 32768 };
#define BUDGET_US 2e5 /* of one method in one round */
#define BUDGET_QUICK_US 5e4

struct trial_table {
    const struct model *model;
    size_t rows, size;
    struct table table;
    double bytes;
};

/* All that a run holds. */
struct run {
    const struct trial_options *options;
    struct trial *trial;
    struct trial_skins skins;
    struct trial_spectra set[MODEL_COUNT]; /* by their place in model_list; else zeroed */
    size_t tables;
    struct trial_table table[TRIAL_METHODS_MAX];
    struct trial_ready ready[TRIAL_METHODS_MAX];
    struct trial_timing timing[TRIAL_METHODS_MAX];
    struct spectrum *timed[MODEL_COUNT]; /* what the times are of */
    struct trial_forward_ready forward[TRIAL_FORWARD_MAX];
    struct trial_timing forward_timing[TRIAL_FORWARD_MAX];
    double done, total; /* rough seconds */
};

/* ---- telling ------------------------------------------------------------------------ */

static void now(struct run *r, const char *what)
{
    if (r->options->now != NULL)
        r->options->now(r->options->context, what);
}

static enum status done(struct run *r, double seconds)
{
    r->done += seconds;
    size_t total = (size_t)(1e3 * r->total), so_far = (size_t)(1e3 * r->done);
    return progress_go_on(r->options->progress, so_far < total ? so_far : total, total)
               ? STATUS_OK
               : STATUS_CANCELLED;
}

/* About how long a spectrum takes, us: for the bar alone. */
static double about_us(const struct model *model)
{
    return strcmp(model->name, "transport-32") == 0  ? 2000.0
           : strcmp(model->name, "transport-8") == 0 ? 140.0
           : strcmp(model->name, "transport-4") == 0 ? 60.0
                                                     : 4.0;
}

static double about_run_us(const struct trial_method *m)
{
    if (m->refine != REFINE_NOT && about_us(m->model) > 10.0)
        return (m->interval ? 100.0 : 12.0) * about_us(m->model);
    return m->by == MATCH_DE2000 ? 100.0 : 5.0;
}

static double about_table(const struct run *r, const struct trial_table *t)
{
    return 1e-6 * (double)t->rows * about_us(t->model) / r->options->threads;
}

static double about_errors(const struct run *r, const struct trial_method *m)
{
    return 2e-6 * (double)r->skins.n * (about_run_us(m) + about_us(m->model)) / r->options->threads;
}

static double budget_us(const struct run *r)
{
    return r->options->quick ? BUDGET_QUICK_US : BUDGET_US;
}

static double about_round(const struct run *r)
{
    double us = 0.0;
    for (size_t i = 0; i < r->trial->results; i++)
        us += fmin(budget_us(r), TIMED * about_run_us(&r->trial->result[i].method));
    return 1e-6 * us + 1e-6 * (double)r->trial->forwards * 0.3 * budget_us(r);
}

static double about_all(const struct run *r)
{
    double s = (double)(r->trial->rounds + 1) * about_round(r);
    s += 2e-3 * (double)r->skins.n / r->options->threads; /* the spectra by transport-32 */
    for (size_t i = 0; i < r->tables; i++)
        s += about_table(r, &r->table[i]);
    for (size_t i = 0; i < r->trial->results; i++)
        s += about_errors(r, &r->trial->result[i].method);
    return s;
}

/* ---- what methods stand on ---------------------------------------------------------- */

static struct trial_spectra *set_of(struct run *r, const struct model *model)
{
    return &r->set[model - model_list];
}

static struct trial_table *table_of(struct run *r, const struct trial_method *m)
{
    for (size_t i = 0; i < r->tables; i++)
        if (r->table[i].model == m->model && r->table[i].rows == m->rows)
            return &r->table[i];
    return NULL;
}

static void list_tables(struct run *r)
{
    for (size_t i = 0; i < r->trial->results; i++) {
        const struct trial_method *m = &r->trial->result[i].method;
        if (m->rows > 0 && table_of(r, m) == NULL)
            r->table[r->tables++] =
                (struct trial_table){ .model = m->model, .rows = m->rows, .size = m->size };
    }
}

/* Rows from `first` on, as a table of their own. */
static struct table part_of(const struct table *table, size_t first)
{
    struct table part = *table;
    double **column[] = { &part.Cm, &part.Bm,  &part.Ch,    &part.L,   &part.a,
                          &part.b,  &part.red, &part.green, &part.blue };
    for (size_t i = 0; i < sizeof column / sizeof *column; i++)
        *column[i] += first;
    if (part.spectrum != NULL)
        part.spectrum += first * part.stride;
    part.n -= first;
    return part;
}

static enum status make_table(struct run *r, struct trial_table *t)
{
    struct recipe recipe = recipe_default(t->model);
    double before = trial_bytes_in_use();
    recipe.grid = trial_grid(t->size);
    enum status s = table_init(&recipe, t->rows, &t->table);
    if (s != STATUS_OK)
        return s;
    t->bytes = trial_bytes_in_use() - before;
    struct table_maker *maker = NULL;
    s = table_maker_open(&recipe, r->options->threads, &maker);
    for (size_t first = 0; first < t->rows && s == STATUS_OK; first += BLOCK) {
        struct table part = part_of(&t->table, first);
        size_t n = t->rows - first < BLOCK ? t->rows - first : BLOCK;
        s = table_maker_rows(maker, first, n, &part);
        if (s == STATUS_OK)
            s = done(r, about_table(r, t) * (double)n / (double)t->rows);
    }
    table_maker_close(maker);
    return s;
}

static enum status make_tables(struct run *r)
{
    enum status s = STATUS_OK;
    now(r, "tables");
    for (size_t i = 0; i < r->tables && s == STATUS_OK; i++)
        s = make_table(r, &r->table[i]);
    return s;
}

static enum status make_set(struct run *r, const struct model *model)
{
    struct trial_spectra *set = set_of(r, model);
    if (set->clean != NULL || model->reflectance == NULL)
        return STATUS_OK;
    return trial_spectra_init(&r->skins, model, r->options->threads, set);
}

static enum status make_sets(struct run *r)
{
    now(r, "spectra");
    enum status s = make_set(r, model_find("transport-32"));
    if (s == STATUS_OK)
        s = done(r, 2e-3 * (double)r->skins.n / r->options->threads);
    for (size_t i = 0; i < r->trial->results && s == STATUS_OK; i++)
        s = make_set(r, r->trial->result[i].method.model);
    return s;
}

static enum status make_bounds(struct run *r)
{
    enum status s = STATUS_OK;
    now(r, "what noise allows");
    for (size_t i = 0; i < MODEL_COUNT && s == STATUS_OK; i++) {
        const struct model *model = &model_list[i];
        struct trial_bound *bound = &r->trial->bound[r->trial->bounds];
        if (r->set[i].clean == NULL || model->slopes == NULL || model->has_noise ||
            strcmp(model->name, "transport-32") == 0)
            continue;
        bound->model = model;
        s = trial_limit(&r->skins, &r->set[i], bound->sd);
        r->trial->bounds++;
        if (s == STATUS_OK)
            s = done(r, 0.0);
    }
    return s;
}

const struct trial_bound *trial_bound_of(const struct trial *trial, const struct model *model)
{
    for (size_t i = 0; i < trial->bounds; i++)
        if (trial->bound[i].model == model)
            return &trial->bound[i];
    return NULL;
}

/* ---- errors ------------------------------------------------------------------------- */

/* A share of one set's errors is done. */
struct watched {
    struct run *run;
    double seconds; /* about, of all */
};

static enum status watch_errors(void *context, double share)
{
    const struct watched *w = context;
    return done(w->run, share * w->seconds);
}

static enum status errors_on(struct run *r, const struct trial_ready *ready,
                             const struct trial_spectra *set, const struct model *bound_of,
                             struct trial_errors *ret)
{
    const struct trial_bound *bound = trial_bound_of(r->trial, bound_of);
    struct watched watched = { r, 0.5 * about_errors(r, &ready->method) };
    const struct trial_watch watch = { watch_errors, &watched };
    enum status s = trial_errors_of(ready, &r->skins, set, r->options->threads, &watch, ret);
    if (s == STATUS_OK && bound != NULL)
        ret->times = trial_times(ret->rmse, bound->sd);
    return s;
}

static enum status errors_of(struct run *r, size_t i)
{
    struct trial_result *result = &r->trial->result[i];
    const struct trial_method *m = &result->method;
    struct trial_table *t = table_of(r, m);
    struct trial_ready *ready = &r->ready[i];
    char name[TRIAL_NAME_SIZE];
    now(r, trial_method_name(m, name));
    enum status s = trial_ready_init(m, t != NULL ? &t->table : NULL, ready);
    if (s != STATUS_OK)
        return s;
    result->bytes = ready->bytes + (t != NULL ? t->bytes : 0.0);
    result->own = result->transport = trial_errors_none();
    if (m->model->reflectance != NULL)
        s = errors_on(r, ready, set_of(r, m->model), m->model, &result->own);
    if (s == STATUS_OK)
        s = errors_on(r, ready, set_of(r, model_find("transport-32")),
                      model_find(trial_bound_of_transport), &result->transport);
    return s;
}

/* ---- times -------------------------------------------------------------------------- */

/* What a contestant's work is given: the method, and its spectra. */
struct contestant {
    const struct trial_ready *ready;
    const struct spectrum *measured;
    double *rows; /* of a batch, [n][TRIAL_BANDS]; an item is all of it */
    size_t n;
};

static enum status contest(const void *context, size_t item)
{
    const struct contestant *c = context;
    struct trial_answer answer;
    if (c->rows != NULL)
        return trial_run_batch(c->ready, c->rows, c->n);
    return trial_run(c->ready, &c->measured[item], &answer);
}

/* Half of them by the method's own model, half by transport-32; spectra of one model are
 * made once. */
static const struct spectrum *timed_spectra(struct run *r, const struct model *model, size_t *n)
{
    struct spectrum **place = &r->timed[model - model_list];
    const struct trial_spectra *own = set_of(r, model);
    const struct trial_spectra *transport = set_of(r, model_find("transport-32"));
    *n = r->skins.n < TIMED ? r->skins.n : TIMED;
    if (*place != NULL)
        return *place;
    *place = calloc(*n, sizeof **place);
    for (size_t i = 0; i < *n && *place != NULL; i++)
        trial_measured(&r->skins, i % 2 == 0 && own->clean != NULL ? own : transport, i,
                       &(*place)[i]);
    return *place;
}

static enum status rows_of_batch(struct contestant *c)
{
    c->rows = calloc(c->n, TRIAL_BANDS * sizeof *c->rows);
    if (c->rows == NULL)
        return STATUS_NO_MEMORY;
    for (size_t i = 0; i < c->n; i++)
        memcpy(c->rows + i * TRIAL_BANDS, c->measured[i].value, TRIAL_BANDS * sizeof *c->rows);
    return STATUS_OK;
}

static enum status begin_times(struct run *r, struct contestant *contestant)
{
    enum status s = STATUS_OK;
    for (size_t i = 0; i < r->trial->results && s == STATUS_OK; i++) {
        size_t n = 0;
        const struct spectrum *measured = timed_spectra(r, r->ready[i].method.model, &n);
        if (measured == NULL)
            return STATUS_NO_MEMORY;
        contestant[i] = (struct contestant){ &r->ready[i], measured, NULL, n };
        if (r->ready[i].many != NULL)
            s = rows_of_batch(&contestant[i]);
        if (s == STATUS_OK)
            s = trial_timing_init(contest, &contestant[i], r->ready[i].many != NULL ? BATCHES : n,
                                  r->trial->rounds, budget_us(r), &r->timing[i]);
    }
    for (size_t i = 0; i < r->trial->forwards && s == STATUS_OK; i++)
        s = trial_timing_init(trial_forward_work, &r->forward[i], r->forward[i].items,
                              r->trial->rounds, budget_us(r), &r->forward_timing[i]);
    return s;
}

static enum status one_round(struct run *r)
{
    char name[TRIAL_NAME_SIZE];
    double each = about_round(r) / (double)(r->trial->results + r->trial->forwards);
    enum status s = STATUS_OK;
    for (size_t i = 0; i < r->trial->results && s == STATUS_OK; i++) {
        now(r, trial_method_name(&r->ready[i].method, name));
        s = trial_timing_round(&r->timing[i]);
        if (s == STATUS_OK)
            s = done(r, each);
    }
    for (size_t i = 0; i < r->trial->forwards && s == STATUS_OK; i++) {
        now(r, trial_forward_name(&r->trial->forward[i], name));
        s = trial_timing_round(&r->forward_timing[i]);
        if (s == STATUS_OK)
            s = done(r, each);
    }
    return s;
}

static enum status times(struct run *r)
{
    struct contestant *contestant = calloc(r->trial->results, sizeof *contestant);
    enum status s = contestant == NULL ? STATUS_NO_MEMORY : begin_times(r, contestant);
    for (size_t round = 0; round <= r->trial->rounds && s == STATUS_OK; round++) {
        s = one_round(r);
        if (round > 0)
            continue;
        for (size_t i = 0; i < r->trial->results; i++)
            trial_timing_again(&r->timing[i]);
        for (size_t i = 0; i < r->trial->forwards; i++)
            trial_timing_again(&r->forward_timing[i]);
    }
    for (size_t i = 0; i < r->trial->results && contestant != NULL; i++)
        free(contestant[i].rows);
    free(contestant);
    for (size_t i = 0; i < r->trial->results && s == STATUS_OK; i++) {
        struct trial_result *result = &r->trial->result[i];
        trial_timing_result(&r->timing[i], &result->us, &result->us_p95);
        result->timed = r->timing[i].group * r->timing[i].groups;
        if (r->ready[i].many != NULL) {
            result->timed = r->skins.n < TIMED ? r->skins.n : TIMED;
            result->us /= (double)result->timed;
            result->us_p95 /= (double)result->timed;
        }
    }
    for (size_t i = 0; i < r->trial->forwards && s == STATUS_OK; i++) {
        struct trial_forward *f = &r->trial->forward[i];
        trial_timing_result(&r->forward_timing[i], &f->us, &f->us_p95);
        f->timed = r->forward_timing[i].group * r->forward_timing[i].groups;
    }
    return s;
}

/* ---- fronts ------------------------------------------------------------------------- */

/* Of the results of one model by its own spectra, or of all by transport's (model NULL). */
static void find_front(struct trial *t, const struct model *model)
{
    double time[TRIAL_METHODS_MAX], error[TRIAL_METHODS_MAX];
    bool front[TRIAL_METHODS_MAX];
    for (size_t i = 0; i < t->results; i++) {
        const struct trial_result *r = &t->result[i];
        bool counts = model == NULL || r->method.model == model;
        time[i] = r->us;
        error[i] = !counts ? NAN : model == NULL ? r->transport.times : r->own.times;
    }
    trial_front(t->results, time, error, front);
    for (size_t i = 0; i < t->results; i++) {
        if (model == NULL)
            t->result[i].transport.front = front[i];
        else if (t->result[i].method.model == model)
            t->result[i].own.front = front[i];
    }
}

static void find_fronts(struct trial *t)
{
    double time[TRIAL_FORWARD_MAX], error[TRIAL_FORWARD_MAX];
    bool front[TRIAL_FORWARD_MAX];
    find_front(t, NULL);
    for (size_t i = 0; i < MODEL_COUNT; i++)
        find_front(t, &model_list[i]);
    for (size_t i = 0; i < t->forwards; i++) {
        time[i] = t->forward[i].us;
        error[i] = t->forward[i].rms_R;
    }
    trial_front(t->forwards, time, error, front);
    for (size_t i = 0; i < t->forwards; i++)
        t->forward[i].front = front[i];
}

/* ---- all of it ---------------------------------------------------------------------- */

static enum status forward_errors(struct run *r)
{
    enum status s = STATUS_OK;
    char name[TRIAL_FORWARD_NAME_SIZE];
    for (size_t i = 0; i < r->trial->forwards && s == STATUS_OK; i++) {
        struct trial_forward *f = &r->trial->forward[i];
        now(r, trial_forward_name(f, name));
        s = trial_forward_ready_init(f, &r->skins, &r->forward[i]);
        if (s == STATUS_OK)
            s = trial_forward_errors(&r->forward[i], set_of(r, model_find("transport-32")),
                                     r->options->threads, f);
        if (s == STATUS_OK)
            s = done(r, 0.0);
    }
    return s;
}

static enum status all(struct run *r)
{
    struct trial_method methods[TRIAL_METHODS_MAX];
    struct trial *t = r->trial;
    enum status s = trial_skins_init(r->options->skins, r->options->seed, &r->skins);
    t->results = trial_methods(r->options->quick, methods);
    for (size_t i = 0; i < t->results; i++)
        t->result[i].method = methods[i];
    t->forwards = trial_forward_list(r->options->quick, t->forward);
    list_tables(r);
    r->total = about_all(r);
    if (s == STATUS_OK)
        s = make_sets(r);
    if (s == STATUS_OK)
        s = make_bounds(r);
    if (s == STATUS_OK)
        s = make_tables(r);
    for (size_t i = 0; i < t->results && s == STATUS_OK; i++)
        s = errors_of(r, i);
    if (s == STATUS_OK)
        s = forward_errors(r);
    if (s == STATUS_OK)
        s = times(r);
    return s;
}

static void let_go(struct run *r)
{
    for (size_t i = 0; i < TRIAL_METHODS_MAX; i++) {
        trial_timing_done(&r->timing[i]);
        trial_ready_done(&r->ready[i]);
    }
    for (size_t i = 0; i < TRIAL_FORWARD_MAX; i++)
        trial_timing_done(&r->forward_timing[i]);
    for (size_t i = 0; i < r->tables; i++)
        table_done(&r->table[i].table);
    for (size_t i = 0; i < MODEL_COUNT; i++) {
        trial_spectra_done(&r->set[i]);
        free(r->timed[i]);
    }
    trial_skins_done(&r->skins);
    free(r);
}

enum status trial_do(const struct trial_options *options, struct trial *ret)
{
    struct run *r = calloc(1, sizeof *r);
    if (r == NULL)
        return STATUS_NO_MEMORY;
    memset(ret, 0, sizeof *ret);
    ret->skins = options->skins;
    ret->seed = options->seed;
    ret->rounds = options->quick ? ROUNDS_QUICK : ROUNDS;
    r->options = options;
    r->trial = ret;
    enum status s = all(r);
    if (s == STATUS_OK)
        find_fronts(ret);
    let_go(r);
    return s;
}
