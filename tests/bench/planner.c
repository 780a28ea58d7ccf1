/* planner.c - plans beside what they stand for: what planning adds, and what leaving out saves.
 *
 *     planner TABLE.db [ROUNDS]
 *
 * The same skins (two-layer, 31 bands, white noise 0.003), one thread.  Of each scene the bare cost
 * is that of the calls one would write for it by hand, without a plan; they and the plan run by
 * turns, and the medians of the rounds are compared.  Ends with status 1 where a bar is missed. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "colour/lab.h"
#include "colour/xyz.h"
#include "db/table_file.h"
#include "plan/plan_run.h"
#include "tests/bench/rounds.h"
#include "tests/support/dice.h"

enum { BANDS = 31, SKINS = 200, MOST_ROUNDS = 201 };
#define ADDED 1.1
#define SAVED 3.0

static struct table rows;
static struct matcher matcher;
static struct refiner *refiner;
static struct refine_wish wish;
static struct noise noise;
static struct fit fit;
static struct xyz_weights weights;
static struct spectrum *skins;
static volatile double sink; /* answers are looked at */

static void die(const char *what)
{
    fprintf(stderr, "planner: %s\n", what);
    exit(2);
}

static double normal(struct dice *d)
{
    double sum = -6.0;
    for (int i = 0; i < 12; i++)
        sum += dice_between(d, 0.0, 1.0);
    return sum;
}

static void draw_skins(void)
{
    static double scratch[MEDIUM_SCRATCH(BANDS)];
    struct chromophores c;
    struct dice d = { 91 };
    skins = calloc(SKINS, sizeof *skins);
    if (skins == NULL || chromophores_init(400.0, 10.0, BANDS, &c) != STATUS_OK)
        die("no memory");
    for (size_t k = 0; k < SKINS; k++) {
        struct tissue t =
            tissue_of(exp(dice_between(&d, log(0.005), log(0.2))), dice_between(&d, 0.0, 1.0),
                      exp(dice_between(&d, log(0.001), log(0.1))));
        skins[k] = (struct spectrum){ .first_nm = 400.0,
                                      .step_nm = 10.0,
                                      .n = BANDS,
                                      .specular = SPECULAR_SCE,
                                      .aperture_mm = NAN };
        if (model_reflectance(model_find("two-layer"), &t, &c, scratch, skins[k].value) !=
            STATUS_OK)
            die("no skin");
        for (size_t i = 0; i < BANDS; i++)
            skins[k].value[i] += 0.003 * normal(&d);
    }
}

/* ---- by hand ------------------------------------------------------------------------ */

static void bare_colour(const struct spectrum *s)
{
    double XYZ[3], Lab[3];
    xyz_from_reflectance(&weights, s->value, XYZ);
    lab_from_xyz(XYZ, weights.white, Lab);
    sink = Lab[0];
}

/* matcher_match() computes colours besides, so this is the search and the row. */
static void bare_nearest(const struct spectrum *s)
{
    struct nearest_query query = { .spectrum = s };
    struct nearest_hit hits[2]; /* two show a tie */
    struct table_row row;
    size_t found;
    if (nearest_find(matcher.nearest, &query, 2, hits, &found) != STATUS_OK)
        die("no row");
    table_get(&rows, hits[0].row, &row);
    sink = row.Cm + (hits[0].distance == hits[1].distance);
}

static void bare_refined(const struct spectrum *s)
{
    struct nearest_query query = { .spectrum = s };
    struct nearest_hit hits[REFINE_STARTS];
    double starts[REFINE_STARTS][SKIN_PARAMETERS];
    struct refined refined;
    size_t found;
    if (nearest_find(matcher.nearest, &query, REFINE_STARTS, hits, &found) != STATUS_OK)
        die("no row");
    refined_match_starts(&rows, hits, found, &fit, starts);
    if (refiner_run(refiner, &noise, s, 1, (const double(*)[SKIN_PARAMETERS])starts, found,
                    REFINE_NO_SE, &refined, NULL) != STATUS_OK)
        die("no fit");
    sink = refined.value[0];
}

/* What `skinspec match --refine` and `convert` together do. */
static void bare_whole(const struct spectrum *s)
{
    struct nearest_hit hits[REFINE_STARTS];
    struct refined_match match;
    bare_colour(s);
    if (refined_match(&matcher, refiner, &wish, s, 1, s, 1, hits, &match, NULL) != STATUS_OK)
        die("no fit");
    sink = match.refined.value[0];
}

/* ---- by plan ------------------------------------------------------------------------ */

static const struct task {
    const char *name;
    unsigned wanted;
    void (*bare)(const struct spectrum *s);
} tasks[] = {
    { "colour only", SCENE_LAB, bare_colour },
    { "nearest only", SCENE_NEAREST, bare_nearest },
    { "refined only", SCENE_REFINED, bare_refined },
    { "full, with interval", SCENE_LAB | SCENE_NEAREST | SCENE_REFINED | SCENE_INTERVAL,
      bare_whole },
};
enum { TASKS = sizeof tasks / sizeof *tasks };

struct planned {
    struct plan plan;
    struct plan_runner *runner;
};

static struct plan_table at_hand;
static struct plan_at_hand hand;

static double make_plan(const struct task *task, struct planned *ret)
{
    char why[SCENE_WHY_SIZE] = "";
    struct scene scene = scene_empty();
    enum { TIMES = 1000 };
    scene.wanted = task->wanted;
    double begun = now_us();
    for (int i = 0; i < TIMES; i++)
        if (plan_make(&scene, &hand, &ret->plan, why) != STATUS_OK)
            die(why);
    double us = (now_us() - begun) / TIMES;
    if (plan_open(&ret->plan, plan_runs(&ret->plan, PLAN_SEARCH) ? &matcher : NULL, &ret->runner,
                  NULL) != STATUS_OK)
        die("no runner");
    return us;
}

static struct plan_answer answer;
static struct plan_work work[TASKS];

static void run_plan(const struct planned *p, const struct spectrum *s, struct plan_work *w)
{
    static struct nearest_hit hits[SCENE_MAX_K];
    if (plan_run(p->runner, s, 1, s, hits, &answer, w, NULL) != STATUS_OK)
        die("a plan failed");
    sink = answer.Lab[0] + answer.coefficient[0];
}

static void pass(const struct planned *p, void (*bare)(const struct spectrum *s),
                 struct plan_work *w)
{
    for (size_t k = 0; k < SKINS; k++) {
        if (p != NULL)
            run_plan(p, &skins[k], w);
        else
            bare(&skins[k]);
    }
}

/* The second pass counts: the first has the spectra and the rows from memory. */
static double round_of(const struct planned *p, void (*bare)(const struct spectrum *s),
                       struct plan_work *w)
{
    struct plan_work ignored = { 0 };
    pass(p, bare, &ignored);
    double begun = now_us();
    pass(p, bare, w);
    return (now_us() - begun) / SKINS;
}

/* Skins whose whole answer is another than the values alone: it came upon a better fit. */
static size_t count_others(const struct planned *few, const struct planned *all)
{
    size_t others = 0;
    for (size_t k = 0; k < SKINS; k++) {
        double values[SKIN_PARAMETERS];
        run_plan(few, &skins[k], NULL);
        memcpy(values, answer.refined.value, sizeof values);
        run_plan(all, &skins[k], NULL);
        others += memcmp(values, answer.refined.value, sizeof values) != 0 ? 1u : 0u;
    }
    return others;
}

static bool tell(size_t rounds, double (*bare)[MOST_ROUNDS], double (*ours)[MOST_ROUNDS],
                 const double *planning)
{
    double us[TASKS];
    bool good = true;
    printf("  %-20s %9s %9s %7s  %-12s %9s   %s\n", "", "bare us", "plan us", "ratio", "bar",
           "to plan", "colours, rows, evaluations, derivatives each");
    for (size_t t = 0; t < TASKS; t++) {
        const struct plan_work *w = &work[t];
        double ratio[MOST_ROUNDS], n = (double)(rounds * SKINS);
        for (size_t i = 0; i < rounds; i++)
            ratio[i] = ours[t][i] / bare[t][i];
        us[t] = median(ours[t], rounds);
        double added = median(ratio, rounds);
        bool met = added <= ADDED;
        good = good && met;
        printf("  %-20s %9.3f %9.3f %7.3f  %-12s %9.2f   %.0f, %.1f, %.1f, %.1f\n", tasks[t].name,
               median(bare[t], rounds), us[t], added, met ? "<= 1.1 met" : "<= 1.1 MISSED",
               planning[t], (double)w->colours / n, (double)w->rows / n, (double)w->evaluations / n,
               (double)w->derivatives / n);
    }
    bool met = us[TASKS - 1] >= SAVED * us[0];
    printf("  full over the cheapest %.0f, over nearest only %.1f, over refined only %.1f times "
           "(bar: the cheapest %g: %s)\n",
           us[TASKS - 1] / us[0], us[TASKS - 1] / us[1], us[TASKS - 1] / us[2], SAVED,
           met ? "met" : "MISSED");
    return good && met;
}

static void open_all(const char *path)
{
    wish = refine_wish_none();
    wish.kind = REFINE_THREE;
    if (table_file_read(path, &rows) != STATUS_OK ||
        matcher_open(&rows, MATCH_SPECTRUM, &matcher) != STATUS_OK ||
        refine_wish_fit(&wish, &rows.recipe, &fit, NULL) != STATUS_OK ||
        refiner_open(&fit, 400.0, 10.0, BANDS, &refiner, NULL) != STATUS_OK ||
        xyz_weights_init(ILLUMINANT_D65, OBSERVER_10DEG, 400.0, 10.0, BANDS, &weights) != STATUS_OK)
        die("cannot begin");
    noise = noise_default();
    at_hand = (struct plan_table){ rows.name, &rows.recipe, rows.n };
    hand = (struct plan_at_hand){ costs_builtin(), &at_hand, 1, 400.0, 10.0, BANDS };
    draw_skins();
}

int main(int argc, char **argv)
{
    static double bare[TASKS][MOST_ROUNDS], ours[TASKS][MOST_ROUNDS];
    static struct planned planned[TASKS];
    double planning[TASKS];
    size_t rounds = argc > 2 ? (size_t)strtoul(argv[2], NULL, 10) : 101;
    if (argc < 2 || rounds < 1 || rounds > MOST_ROUNDS)
        die("usage: planner TABLE.db [ROUNDS 1..201]");
    open_all(argv[1]);
    for (size_t t = 0; t < TASKS; t++)
        planning[t] = make_plan(&tasks[t], &planned[t]);
    for (size_t t = 0; t < TASKS; t++) /* once for the caches */
        (void)round_of(&planned[t], NULL, NULL);
    for (size_t i = 0; i < rounds; i++)
        for (size_t t = 0; t < TASKS; t++) {
            /* Either is the first of two by turns. */
            if (i % 2 == 0)
                bare[t][i] = round_of(NULL, tasks[t].bare, NULL);
            ours[t][i] = round_of(&planned[t], NULL, &work[t]);
            if (i % 2 == 1)
                bare[t][i] = round_of(NULL, tasks[t].bare, NULL);
        }
    bool good = tell(rounds, bare, ours, planning);
    printf("  of %d skins %zu have another answer where a second solution is looked for\n",
           (int)SKINS, count_others(&planned[2], &planned[3]));
    for (size_t t = 0; t < TASKS; t++)
        plan_close(planned[t].runner);
    refiner_close(refiner);
    matcher_close(&matcher);
    table_done(&rows);
    free(skins);
    return good ? 0 : 1;
}
