/* growth.c - how cost grows with what there is: rows of a table, bands, spectra, cores.
 *
 *     growth rows [MOST] | bands | spectra [MOST] | cores
 *
 * Each size in turns with the others, rounds by rounds, medians; a line of JSON for each: what was
 * done, the size, nanoseconds of CPU for one (cores: seconds by the clock and of CPU for all).
 * MOST: no size beyond, 10 000 000 rows (4 GB) and 1 000 000 spectra if not said. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/parallel.h"
#include "match/refine.h"
#include "match/refine_many.h"
#include "match/table_maker.h"
#include "tests/support/dice.h"
#include "tests/support/skin_queries.h"

enum { ROUNDS = 7, SIZES = 5 };
#define NOISE 0.003

static double clock_ns(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

static double cpu_ns(void)
{
    return clock_ns(CLOCK_PROCESS_CPUTIME_ID);
}

static int by_value(const void *x, const void *y)
{
    double a, b;
    memcpy(&a, x, sizeof a);
    memcpy(&b, y, sizeof b);
    return (a > b) - (a < b);
}

static double median(double took[ROUNDS])
{
    qsort(took, ROUNDS, sizeof *took, by_value);
    return took[ROUNDS / 2];
}

static void must(enum status s, const char *what)
{
    if (s == STATUS_OK)
        return;
    fprintf(stderr, "growth: %s: %s\n", what, status_text(s));
    exit(1);
}

static void *memory(size_t n, size_t size)
{
    void *p = calloc(n, size);
    must(p == NULL ? STATUS_NO_MEMORY : STATUS_OK, "memory");
    return p;
}

static void tell(const char *what, size_t n, double took[ROUNDS])
{
    printf("{\"what\": \"%s\", \"n\": %zu, \"ns\": %.1f}\n", what, n, median(took));
    fflush(stdout);
}

/* ---- rows of a table ---------------------------------------------------------------- */

enum { SEARCHES = 5000, WAYS = 3, SORTS = 2 };
static const enum match_by way[WAYS] = { MATCH_LAB, MATCH_SPECTRUM, MATCH_DE2000 };

struct searched {
    struct table table;
    struct nearest *nearest[WAYS];
    struct skin_query *query[SORTS];
    double made[1 + WAYS][ROUNDS], took[WAYS][SORTS][ROUNDS];
};

/* The rows computed and the indices made: once, by all cores. */
static void make_searched(size_t side, struct searched *s)
{
    double begun = cpu_ns(), one;
    must(skin_table(side, &s->table), "table");
    one = (cpu_ns() - begun) / (double)s->table.n;
    for (int round = 0; round < ROUNDS; round++)
        s->made[0][round] = one;
    for (int i = 0; i < WAYS; i++) {
        begun = cpu_ns();
        must(nearest_open(&s->table, way[i], &s->nearest[i]), "index");
        one = (cpu_ns() - begun) / (double)s->table.n;
        for (int round = 0; round < ROUNDS; round++)
            s->made[1 + i][round] = one;
    }
    for (int sort = 0; sort < SORTS; sort++) {
        s->query[sort] = memory(SEARCHES, sizeof *s->query[sort]);
        skin_queries(&s->table, sort == 1, SEARCHES, s->query[sort]);
    }
}

static double search_ns(const struct nearest *nearest, const struct skin_query *query)
{
    struct nearest_hit hit;
    size_t found;
    double begun = cpu_ns();
    for (size_t i = 0; i < SEARCHES; i++)
        must(nearest_find(nearest, &query[i].query, 1, &hit, &found), "search");
    return (cpu_ns() - begun) / SEARCHES;
}

static int grow_rows(size_t most)
{
    static const size_t side[] = { 22, 47, 100, 215 }; /* values of each of three axes */
    static const char *const sort_name[SORTS] = { "near", "off" };
    enum { TABLES = sizeof side / sizeof *side };
    static struct searched at[TABLES];
    int tables = 0;
    char what[80];
    while (tables < TABLES && side[tables] * side[tables] * side[tables] <= most) {
        make_searched(side[tables], &at[tables]);
        tables++;
    }
    for (int round = 0; round < ROUNDS; round++)
        for (int t = 0; t < tables; t++)
            for (int i = 0; i < WAYS; i++)
                for (int sort = 0; sort < SORTS; sort++)
                    at[t].took[i][sort][round] = search_ns(at[t].nearest[i], at[t].query[sort]);
    for (int t = 0; t < tables; t++) {
        struct searched *s = &at[t];
        tell("a row computed, its memory new", s->table.n, s->made[0]);
        for (int i = 0; i < WAYS; i++) {
            snprintf(what, sizeof what, "a row in the index by %s", match_by_name(way[i]));
            tell(what, s->table.n, s->made[1 + i]);
            for (int sort = 0; sort < SORTS; sort++) {
                snprintf(what, sizeof what, "nearest by %s, %s", match_by_name(way[i]),
                         sort_name[sort]);
                tell(what, s->table.n, s->took[i][sort]);
            }
            nearest_close(s->nearest[i]);
        }
        for (int sort = 0; sort < SORTS; sort++)
            free(s->query[sort]);
        table_done(&s->table);
    }
    return 0;
}

/* ---- skins and their spectra -------------------------------------------------------- */

static struct tissue chance_skin(struct dice *dice)
{
    return tissue_of(exp(dice_between(dice, log(0.005), log(0.2))), dice_between(dice, 0.0, 1.0),
                     exp(dice_between(dice, log(0.001), log(0.1))));
}

static double noise(struct dice *dice)
{
    double sum = -6.0; /* of 12 even ones: normal enough */
    for (int i = 0; i < 12; i++)
        sum += dice_between(dice, 0.0, 1.0);
    return NOISE * sum;
}

/* n spectra on the bands of c, with noise. */
static void make_spectra(const struct chromophores *c, size_t n, float *R)
{
    const struct model *model = model_find("two-layer");
    double *scratch = memory(MEDIUM_SCRATCH(c->n), sizeof *scratch);
    double *value = memory(c->n, sizeof *value);
    struct dice dice = { 11 };
    for (size_t i = 0; i < n; i++) {
        struct tissue t = chance_skin(&dice);
        must(model_reflectance(model, &t, c, scratch, value), "spectrum");
        for (size_t band = 0; band < c->n; band++)
            R[i * c->n + band] = (float)(value[band] + noise(&dice));
    }
    free(value);
    free(scratch);
}

struct grid_of_bands {
    double step_nm;
    size_t n;
};

static struct refine_many *open_many(const struct grid_of_bands *g)
{
    struct recipe recipe = recipe_default(model_find("two-layer"));
    struct fit fit = fit_three(&recipe);
    struct noise white = noise_white(NOISE);
    struct refine_many *many;
    const char *why = "";
    must(refine_many_open(&fit, 400.0, g->step_nm, g->n, &white, &many, &why), why);
    return many;
}

/* Values, standard errors, residual and flags: memory for n. */
struct answers {
    struct refine_answers to;
    double *memory;
};

static struct answers answers_for(size_t n)
{
    struct answers a = { .memory = memory(9 * n, sizeof(double)) };
    for (size_t i = 0; i < 3; i++) {
        a.to.value[SKIN_CM + i] = a.memory + i * n;
        a.to.se[SKIN_CM + i] = a.memory + (3 + i) * n;
    }
    a.to.chi_square = a.memory + 6 * n;
    a.to.rms = a.memory + 7 * n;
    a.to.flags = (uint32_t *)(a.memory + 8 * n);
    return a;
}

/* ---- bands -------------------------------------------------------------------------- */

enum { BAND_SKINS = 64, BAND_FITS = 512, BAND_MODELS = 3, BAND_WORKS = BAND_MODELS + 3 };
static const char *const band_model[BAND_MODELS] = { "half-space", "two-layer", "transport-8" };

static double reflectance_ns(const char *name, const struct chromophores *c, double *scratch,
                             double *R)
{
    const struct model *model = model_find(name);
    struct dice dice = { 5 };
    double begun = cpu_ns();
    for (int i = 0; i < BAND_SKINS; i++) {
        struct tissue t = chance_skin(&dice);
        must(model_reflectance(model, &t, c, scratch, R), name);
    }
    return (cpu_ns() - begun) / BAND_SKINS;
}

/* Rows of a table, what they share computed once; 0 for steps that colours have no weights for. */
static double row_ns(const struct grid_of_bands *g)
{
    enum { ROWS = 8192 };
    struct recipe recipe = recipe_default(model_find("two-layer"));
    struct table_maker *maker;
    struct table table;
    recipe.step_nm = g->step_nm;
    recipe.bands = g->n;
    if (recipe_check(&recipe) == STATUS_UNSUPPORTED)
        return 0.0;
    must(table_init(&recipe, ROWS, &table), "memory");
    must(table_maker_open(&recipe, 1, &maker), "table");
    must(table_maker_rows(maker, 0, ROWS, &table), "rows"); /* the pages are there then */
    double begun = cpu_ns();
    must(table_maker_rows(maker, ROWS, ROWS, &table), "rows");
    double took = (cpu_ns() - begun) / ROWS;
    table_maker_close(maker);
    table_done(&table);
    return took;
}

static double fit_ns(const struct grid_of_bands *g, const float *R)
{
    struct recipe recipe = recipe_default(model_find("two-layer"));
    struct fit fit = fit_three(&recipe);
    struct noise white = noise_white(NOISE);
    struct spectrum *s = memory(BAND_FITS, sizeof *s);
    struct refined ret;
    struct refiner *refiner;
    const char *why = "";
    for (size_t i = 0; i < BAND_FITS; i++) {
        s[i] = (struct spectrum){ .first_nm = 400,
                                  .step_nm = g->step_nm,
                                  .n = g->n,
                                  .specular = SPECULAR_SCE,
                                  .aperture_mm = 8 };
        for (size_t band = 0; band < g->n; band++)
            s[i].value[band] = (double)R[i * g->n + band];
    }
    must(refiner_open(&fit, 400.0, g->step_nm, g->n, &refiner, &why), why);
    double begun = cpu_ns();
    for (size_t i = 0; i < BAND_FITS; i++)
        must(refiner_run(refiner, &white, &s[i], 1, NULL, 0, 0, &ret, &why), why);
    double took = (cpu_ns() - begun) / BAND_FITS;
    refiner_close(refiner);
    free(s);
    return took;
}

static double together_ns(const struct grid_of_bands *g, const float *R)
{
    struct refine_many *many = open_many(g);
    struct answers a = answers_for(BAND_FITS);
    struct refine_rows rows = { .R_float = R, .stride = g->n, .n = BAND_FITS };
    must(refine_many_run(many, &rows, 1, &a.to), "fits"); /* the pages are there then */
    double begun = cpu_ns();
    must(refine_many_run(many, &rows, 1, &a.to), "fits");
    double took = (cpu_ns() - begun) / BAND_FITS;
    refine_many_close(many);
    free(a.memory);
    return took;
}

static int grow_bands(void)
{
    static const struct grid_of_bands grid[SIZES] = {
        { 20, 16 }, { 10, 31 }, { 5, 61 }, { 2, 151 }, { 1, 341 } /* 400..700, 400..740 nm */
    };
    static const char *const what[BAND_WORKS] = {
        "half-space, plain",           "two-layer, plain",      "transport-8, plain",
        "a two-layer row, by vectors", "one fit of Cm, Bm, Ch", "a fit of many together"
    };
    static double took[SIZES][BAND_WORKS][ROUNDS];
    static struct chromophores c[SIZES];
    float *R[SIZES];
    double *scratch = memory(MEDIUM_SCRATCH(SPECTRUM_MAX_BANDS), sizeof *scratch);
    double *value = memory(SPECTRUM_MAX_BANDS, sizeof *value);
    for (int i = 0; i < SIZES; i++) {
        must(chromophores_init(400.0, grid[i].step_nm, grid[i].n, &c[i]), "bands");
        R[i] = memory(BAND_FITS * grid[i].n, sizeof *R[i]);
        make_spectra(&c[i], BAND_FITS, R[i]);
    }
    for (int round = 0; round < ROUNDS; round++)
        for (int i = 0; i < SIZES; i++) {
            for (int m = 0; m < BAND_MODELS; m++)
                took[i][m][round] = reflectance_ns(band_model[m], &c[i], scratch, value);
            took[i][BAND_MODELS][round] = row_ns(&grid[i]);
            took[i][BAND_MODELS + 1][round] = fit_ns(&grid[i], R[i]);
            took[i][BAND_MODELS + 2][round] = together_ns(&grid[i], R[i]);
        }
    for (int i = 0; i < SIZES; i++) {
        for (int k = 0; k < BAND_WORKS; k++)
            if (took[i][k][0] > 0.0)
                tell(what[k], grid[i].n, took[i][k]);
        free(R[i]);
    }
    free(value);
    free(scratch);
    return 0;
}

/* ---- spectra ------------------------------------------------------------------------ */

static const struct grid_of_bands usual = { 10, 31 };

/* The same DIFFERENT ones again and again. */
static float *many_spectra(size_t n)
{
    enum { DIFFERENT = 50000 };
    static struct chromophores c;
    float *R = memory(n * usual.n, sizeof *R);
    must(chromophores_init(400.0, usual.step_nm, usual.n, &c), "bands");
    make_spectra(&c, n < DIFFERENT ? n : DIFFERENT, R);
    for (size_t i = DIFFERENT; i < n; i++)
        memcpy(R + i * usual.n, R + (i - DIFFERENT) * usual.n, usual.n * sizeof *R);
    return R;
}

static int grow_spectra(size_t most)
{
    static const size_t count[] = { 1000, 10000, 100000, 1000000 };
    enum { COUNTS = sizeof count / sizeof *count };
    static double took[COUNTS][ROUNDS];
    size_t counts = 0;
    while (counts < COUNTS && count[counts] <= most)
        counts++;
    if (counts == 0)
        must(STATUS_RANGE, "spectra");
    struct refine_many *many = open_many(&usual);
    struct answers a = answers_for(count[counts - 1]);
    float *R = many_spectra(count[counts - 1]);
    for (int round = -1; round < ROUNDS; round++) /* the first for the pages */
        for (size_t i = 0; i < counts; i++) {
            struct refine_rows rows = { .R_float = R, .stride = usual.n, .n = count[i] };
            double begun = cpu_ns();
            must(refine_many_run(many, &rows, 1, &a.to), "fits");
            if (round >= 0)
                took[i][round] = (cpu_ns() - begun) / (double)count[i];
        }
    for (size_t i = 0; i < counts; i++)
        tell("a fit of many together", count[i], took[i]);
    refine_many_close(many);
    free(a.memory);
    free(R);
    return 0;
}

/* ---- cores -------------------------------------------------------------------------- */

struct cores_task {
    struct refine_many *many;
    struct refine_rows rows;
    struct answers answers;
    struct table table;
    const struct nearest *nearest;
    const struct skin_query *query;
};

/* A hundred searches. */
static enum status search_some(size_t piece, unsigned worker, void *context)
{
    const struct cores_task *task = context;
    struct nearest_hit hit;
    size_t found;
    (void)worker;
    for (size_t i = 0; i < 100; i++) {
        size_t number = (100 * piece + i) % SEARCHES;
        enum status s = nearest_find(task->nearest, &task->query[number].query, 1, &hit, &found);
        if (s != STATUS_OK)
            return s;
    }
    return STATUS_OK;
}

static void do_work(int work, struct cores_task *task, unsigned threads)
{
    if (work == 0)
        must(table_compute(&task->table, 0, task->table.n, threads), "rows");
    else if (work == 1)
        must(refine_many_run(task->many, &task->rows, threads, &task->answers.to), "fits");
    else
        must(parallel_run(1000, threads, search_some, task), "searches");
}

/* One thread and as many as there are cores, doubled from one to the other. */
static int grow_cores(void)
{
    enum { WORKS = 3, STEPS = 9, FITS = 200000 };
    static const char *const what[WORKS] = { "1 000 000 rows computed", "200 000 fits together",
                                             "100 000 searches by spectrum" };
    static double wall[WORKS][STEPS][ROUNDS], cpu[WORKS][STEPS][ROUNDS];
    struct cores_task task = { .many = open_many(&usual), .answers = answers_for(FITS) };
    struct skin_query *query = memory(SEARCHES, sizeof *query);
    struct nearest *nearest;
    float *R = many_spectra(FITS);
    unsigned cores = parallel_cores();
    int steps = 0;
    task.rows = (struct refine_rows){ .R_float = R, .stride = usual.n, .n = FITS };
    must(skin_table(100, &task.table), "table");
    must(nearest_open(&task.table, MATCH_SPECTRUM, &nearest), "index");
    skin_queries(&task.table, false, SEARCHES, query);
    task.nearest = nearest;
    task.query = query;
    while (steps < STEPS && 1u << steps <= cores)
        steps++;
    for (int round = -1; round < ROUNDS; round++) /* the first for the pages */
        for (int work = 0; work < WORKS; work++)
            for (int step = 0; step < steps; step++) {
                double begun = clock_ns(CLOCK_MONOTONIC), cpu_begun = cpu_ns();
                do_work(work, &task, 1u << step);
                if (round < 0)
                    continue;
                wall[work][step][round] = 1e-9 * (clock_ns(CLOCK_MONOTONIC) - begun);
                cpu[work][step][round] = 1e-9 * (cpu_ns() - cpu_begun);
            }
    for (int work = 0; work < WORKS; work++)
        for (int step = 0; step < steps; step++)
            printf("{\"what\": \"%s\", \"n\": %u, \"wall_s\": %.5f, \"cpu_s\": %.5f}\n", what[work],
                   1u << step, median(wall[work][step]), median(cpu[work][step]));
    nearest_close(nearest);
    table_done(&task.table);
    refine_many_close(task.many);
    free(task.answers.memory);
    free(query);
    free(R);
    return 0;
}

int main(int argc, char **argv)
{
    size_t most = argc > 2 ? strtoul(argv[2], NULL, 10) : 10000000;
    if (argc > 1 && strcmp(argv[1], "rows") == 0)
        return grow_rows(most);
    if (argc > 1 && strcmp(argv[1], "bands") == 0)
        return grow_bands();
    if (argc > 1 && strcmp(argv[1], "spectra") == 0)
        return grow_spectra(most);
    if (argc > 1 && strcmp(argv[1], "cores") == 0)
        return grow_cores();
    fprintf(stderr, "usage: growth rows [MOST] | bands | spectra [MOST] | cores\n");
    return 2;
}
