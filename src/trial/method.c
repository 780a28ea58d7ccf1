/* method.c - nearest rows, closed form and fits behind one function. */
#include "trial/method.h"

#include <malloc.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "match/start.h"
#include "trial/skins.h"

double trial_bytes_in_use(void)
{
    struct mallinfo2 m = mallinfo2();
    return (double)(m.uordblks + m.hblkhd);
}

/* ---- names -------------------------------------------------------------------------- */

const char *trial_method_name(const struct trial_method *m, char text[TRIAL_NAME_SIZE])
{
    static const char *const what[REFINE_KINDS] = { "nearest", "fit", "skin fit" };
    char from[40];
    if (m->rows == 0 && m->refine == REFINE_NOT) {
        snprintf(text, TRIAL_NAME_SIZE, "%s closed form", m->model->name);
        return text;
    }
    if (m->rows == 0)
        snprintf(from, sizeof from, "from the closed form");
    else
        snprintf(from, sizeof from, "%s %zu by %s", m->refine == REFINE_NOT ? "of" : "from",
                 m->rows, match_by_name(m->by));
    snprintf(text, TRIAL_NAME_SIZE, "%s %s %s%s%s%s", m->model->name, what[m->refine], from,
             m->interval ? ", intervals" : "", m->batch ? ", in batch" : "",
             m->kernel == TRIAL_PLAIN ? ", plain" : "");
    return text;
}

/* ---- which -------------------------------------------------------------------------- */

enum { SMALL = 10000, DEFAULT = 50000, LARGE = 100000, HUGE_ = 1000000 };

struct list {
    size_t n;
    struct trial_method *method;
};

static void add(struct list *l, const char *model, size_t size, enum match_by by,
                enum refine_kind refine, bool interval, enum trial_kernel kernel)
{
    struct grid grid = trial_grid(size);
    l->method[l->n++] = (struct trial_method){ model_find(model),
                                               size > 0 ? grid_rows(&grid) : 0,
                                               size,
                                               by,
                                               refine,
                                               interval,
                                               false,
                                               kernel };
}

static void add_nearest(struct list *l, const char *model, size_t size)
{
    static const enum match_by ways[] = { MATCH_RGB, MATCH_LAB, MATCH_DE2000, MATCH_SPECTRUM };
    for (size_t i = 0; i < sizeof ways / sizeof *ways; i++)
        add(l, model, size, ways[i], REFINE_NOT, false, TRIAL_QUICK);
}

/* From the closed form where size is 0. */
static void add_fit(struct list *l, const char *model, size_t size, enum refine_kind kind,
                    bool with_interval)
{
    add(l, model, size, MATCH_SPECTRUM, kind, false, TRIAL_QUICK);
    if (with_interval)
        add(l, model, size, MATCH_SPECTRUM, kind, true, TRIAL_QUICK);
}

static void add_batch(struct list *l, const char *model, enum refine_kind kind)
{
    add(l, model, 0, MATCH_SPECTRUM, kind, false, TRIAL_QUICK);
    l->method[l->n - 1].batch = true;
}

size_t trial_methods(bool quick, struct trial_method methods[TRIAL_METHODS_MAX])
{
    static const size_t sizes[] = { SMALL, DEFAULT, LARGE, HUGE_ };
    struct list l = { 0, methods };
    for (size_t i = 0; i < (quick ? 2u : 4u); i++) {
        add(&l, "paper", sizes[i], MATCH_RGB, REFINE_NOT, false, TRIAL_QUICK);
        add_nearest(&l, "half-space", sizes[i]);
        add_nearest(&l, "two-layer", sizes[i]);
    }
    if (quick) {
        add(&l, "kubelka-munk", DEFAULT, MATCH_SPECTRUM, REFINE_NOT, false, TRIAL_QUICK);
    } else {
        add_nearest(&l, "kubelka-munk", DEFAULT);
        add_nearest(&l, "transport-8", DEFAULT);
        add_fit(&l, "transport-8", DEFAULT, REFINE_THREE, false);
        add_fit(&l, "two-layer", SMALL, REFINE_THREE, false);
        add_fit(&l, "two-layer", LARGE, REFINE_THREE, false);
        add_fit(&l, "transport-4", 0, REFINE_THREE, false);
        add_fit(&l, "kubelka-munk", 0, REFINE_THREE, false);
    }
    add(&l, "half-space", 0, MATCH_SPECTRUM, REFINE_NOT, false, TRIAL_QUICK);
    add_fit(&l, "half-space", 0, REFINE_THREE, true);
    add_fit(&l, "half-space", DEFAULT, REFINE_THREE, false);
    add(&l, "half-space", 0, MATCH_SPECTRUM, REFINE_THREE, false, TRIAL_PLAIN);
    add_fit(&l, "two-layer", 0, REFINE_THREE, true);
    add_fit(&l, "two-layer", DEFAULT, REFINE_THREE, true);
    add(&l, "two-layer", 0, MATCH_SPECTRUM, REFINE_THREE, false, TRIAL_PLAIN);
    add_fit(&l, "two-layer", 0, REFINE_SKIN, true);
    add_fit(&l, "two-layer", DEFAULT, REFINE_SKIN, true);
    add_fit(&l, "transport-8", 0, REFINE_THREE, !quick);
    add_batch(&l, "half-space", REFINE_THREE);
    add_batch(&l, "two-layer", REFINE_THREE);
    return l.n;
}

static size_t scaled(size_t n, double by)
{
    return (size_t)fmax(2.0, round((double)n * by));
}

struct grid trial_grid(size_t size)
{
    struct grid grid = grid_default();
    double by = cbrt((double)size / (double)DEFAULT); /* its own rows count as DEFAULT */
    grid.Cm.n = scaled(grid.Cm.n, by);
    grid.Bm.n = scaled(grid.Bm.n, by);
    grid.Ch.n = scaled(grid.Ch.n, by);
    return grid;
}

/* ---- ready -------------------------------------------------------------------------- */

struct trial_closed_form {
    struct chromophores chromophores;
    struct start start;
};

static enum status closed_form(struct trial_ready *ready)
{
    struct trial_closed_form *c = calloc(1, sizeof *c);
    struct tissue t = tissue_of(0.0, 0.5, TISSUE_CH_MIN);
    if (c == NULL)
        return STATUS_NO_MEMORY;
    enum status s = chromophores_init(TRIAL_FIRST_NM, TRIAL_STEP_NM, TRIAL_BANDS, &c->chromophores);
    if (s == STATUS_OK)
        start_init(&t, &c->chromophores, &c->start);
    ready->closed_form = c;
    return s;
}

static enum status open_fit(struct trial_ready *ready)
{
    struct refine_wish wish = refine_wish_none();
    struct recipe recipe = recipe_default(ready->method.model);
    wish.kind = ready->method.refine;
    wish.white = TRIAL_NOISE;
    if (ready->method.kernel == TRIAL_PLAIN) {
        ready->plain = *ready->method.model;
        ready->plain.quick = MODEL_QUICK_NONE;
        recipe.model = &ready->plain;
    }
    ready->noise = noise_white(TRIAL_NOISE);
    enum status s = refine_wish_fit(&wish, &recipe, &ready->fit, NULL);
    if (s == STATUS_OK)
        s = refiner_open(&ready->fit, TRIAL_FIRST_NM, TRIAL_STEP_NM, TRIAL_BANDS, &ready->refiner,
                         NULL);
    if (s == STATUS_OK && ready->method.batch)
        s = refine_many_open(&ready->fit, TRIAL_FIRST_NM, TRIAL_STEP_NM, TRIAL_BANDS, &ready->noise,
                             &ready->many, NULL);
    return s;
}

enum status trial_ready_init(const struct trial_method *method, const struct table *table,
                             struct trial_ready *ret)
{
    enum status s = STATUS_OK;
    double before = trial_bytes_in_use();
    *ret = (struct trial_ready){ .method = *method, .table = table };
    if (table != NULL)
        s = matcher_open(table, method->by, &ret->matcher);
    if (s == STATUS_OK && method->refine != REFINE_NOT)
        s = open_fit(ret);
    else if (s == STATUS_OK && table == NULL)
        s = closed_form(ret);
    ret->bytes = trial_bytes_in_use() - before;
    if (s != STATUS_OK)
        trial_ready_done(ret);
    return s;
}

void trial_ready_done(struct trial_ready *ready)
{
    if (ready->matcher.nearest != NULL)
        matcher_close(&ready->matcher);
    refine_many_close(ready->many);
    refiner_close(ready->refiner);
    free(ready->closed_form);
    memset(ready, 0, sizeof *ready);
}

/* ---- run ---------------------------------------------------------------------------- */

static double within(double x, double lo, double hi)
{
    return fmin(fmax(x, lo), hi);
}

static enum status run_closed_form(const struct trial_ready *ready, const struct spectrum *measured,
                                   struct trial_answer *ret)
{
    static const double all[TRIAL_BANDS] = { 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1,
                                             1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1 };
    struct tissue t = tissue_of(0.02, 0.5, 0.01);
    start_guess(&ready->closed_form->start, measured->value, all, &t);
    t.Cm = within(t.Cm, 0.0, TISSUE_CM_MAX);
    t.Bm = within(t.Bm, 0.0, 1.0);
    t.Ch = within(t.Ch, TISSUE_CH_MIN, TISSUE_CH_MAX);
    *ret = (struct trial_answer){ .skin = t };
    return STATUS_OK;
}

static size_t starts_of(const struct trial_ready *ready, const struct nearest_hit *hits,
                        size_t found, double (*starts)[SKIN_PARAMETERS])
{
    for (size_t i = 0; i < found; i++) {
        for (size_t k = 0; k < SKIN_PARAMETERS; k++)
            starts[i][k] = ready->fit.role[k].value;
        starts[i][SKIN_CM] = ready->table->Cm[hits[i].row];
        starts[i][SKIN_BM] = ready->table->Bm[hits[i].row];
        starts[i][SKIN_CH] = ready->table->Ch[hits[i].row];
    }
    return found;
}

/* What a batch says of one spectrum does not depend on the others. */
static enum status run_one_of_many(const struct trial_ready *ready, const struct spectrum *measured,
                                   struct trial_answer *ret)
{
    double value[SKIN_PARAMETERS];
    struct refine_answers answers = { .value = { 0 } };
    const struct refine_rows rows = { .R = measured->value, .stride = TRIAL_BANDS, .n = 1 };
    for (size_t k = 0; k < SKIN_PARAMETERS; k++)
        answers.value[k] = &value[k];
    enum status s = refine_many_run(ready->many, &rows, 1, &answers);
    if (s == STATUS_OK)
        *ret = (struct trial_answer){ .skin = fit_tissue(&ready->fit, value) };
    return s;
}

enum status trial_run_batch(const struct trial_ready *ready, const double *rows, size_t n)
{
    static const enum skin_parameter wanted[3] = { SKIN_CM, SKIN_BM, SKIN_CH };
    double *memory = calloc(n, 7 * sizeof *memory);
    uint32_t *flags = calloc(n, sizeof *flags);
    struct refine_answers answers = { .flags = flags };
    enum status s = memory == NULL || flags == NULL ? STATUS_NO_MEMORY : STATUS_OK;
    if (s == STATUS_OK) {
        for (size_t k = 0; k < 3; k++) {
            answers.value[wanted[k]] = memory + 2 * k * n;
            answers.se[wanted[k]] = memory + (2 * k + 1) * n;
        }
        answers.chi_square = memory + 6 * n;
        s = refine_many_run(ready->many,
                            &(struct refine_rows){ .R = rows, .stride = TRIAL_BANDS, .n = n }, 1,
                            &answers);
    }
    free(memory);
    free(flags);
    return s;
}

enum status trial_run(const struct trial_ready *ready, const struct spectrum *measured,
                      struct trial_answer *ret)
{
    double starts[REFINE_STARTS][SKIN_PARAMETERS];
    struct nearest_hit hits[REFINE_STARTS];
    struct refined refined;
    struct match match = { 0 };
    bool fit = ready->method.refine != REFINE_NOT;
    enum status s = STATUS_OK;
    if (ready->closed_form != NULL)
        return run_closed_form(ready, measured, ret);
    if (ready->many != NULL)
        return run_one_of_many(ready, measured, ret);
    if (ready->table != NULL)
        s = matcher_match(&ready->matcher, measured, fit ? REFINE_STARTS : 1, hits, &match);
    if (s != STATUS_OK)
        return s;
    if (!fit) {
        *ret = (struct trial_answer){ tissue_of(match.row.Cm, match.row.Bm, match.row.Ch), true,
                                      match.row_index, 0 };
        return STATUS_OK;
    }
    size_t n = ready->table != NULL ? starts_of(ready, hits, match.found, starts) : 0;
    s = refiner_run(ready->refiner, &ready->noise, measured, 1,
                    (const double(*)[SKIN_PARAMETERS])starts, n,
                    ready->method.interval ? REFINE_INTERVALS | REFINE_SECOND : 0, &refined, NULL);
    if (s == STATUS_OK)
        *ret = (struct trial_answer){ .skin = fit_tissue(&ready->fit, refined.value),
                                      .evaluations = refined.model_spectra };
    return s;
}
