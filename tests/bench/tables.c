/* tables.c - rows of a table: what they take, by vectors and plain, on one thread and on all; and
 * the file of them.
 *
 *   tables --columns MODEL            what peers compute rows from, as a line of JSON
 *   tables --rows MODEL               ns of CPU a row on one thread: by vectors, by the plain row
 *                                     maker; and of opening, which is once for a table
 *   tables --threads MODEL ROWS       seconds of all rows on one thread and on two, by turns
 *   tables --file FILE MODEL ROWS     seconds to build and to read a file of about so many rows
 *   tables --sql                      the settings and the schema of such a file
 *
 * tests/bench/tables.py calls it beside its peers and holds what it says against the bars. */
#define _POSIX_C_SOURCE 200809L
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/parallel.h"
#include "colour/srgb.h"
#include "colour/xyz.h"
#include "db/table_build.h"
#include "db/table_file.h"
#include "db/table_schema.h"
#include "match/table_maker.h"
#include "optics/dipole.h"

enum { CHUNK = 8192, ROUNDS = 15, TURNS = 5 };

/* ---- helpers ----------------------------------------------------------------------------- */

static double clock_s(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static double now_s(void)
{
    return clock_s(CLOCK_MONOTONIC);
}

/* Of this program alone, all threads: other work on the machine does not count. */
static double cpu_s(void)
{
    return clock_s(CLOCK_PROCESS_CPUTIME_ID);
}

static int by_value(const void *x, const void *y)
{
    double a, b;
    memcpy(&a, x, sizeof a);
    memcpy(&b, y, sizeof b);
    return (a > b) - (a < b);
}

static double median(double *value, size_t n)
{
    qsort(value, n, sizeof *value, by_value);
    return value[n / 2];
}

static void must(enum status s, const char *what)
{
    if (s == STATUS_OK)
        return;
    fprintf(stderr, "tables: %s: %s\n", what, status_text(s));
    exit(1);
}

/* 380..740 nm by 10, the default grid. */
static struct recipe recipe_of(const char *name)
{
    const struct model *model = model_find(name);
    if (model == NULL || model->reflectance == NULL)
        must(STATUS_UNSUPPORTED, name);
    struct recipe recipe = recipe_default(model);
    recipe.first_nm = 380.0;
    recipe.bands = 37;
    return recipe;
}

/* ---- what peers compute from ------------------------------------------------------------- */

static void print_list(const char *name, const double *value, size_t n)
{
    printf("\"%s\": [", name);
    for (size_t i = 0; i < n; i++)
        printf("%s%.17g", i > 0 ? ", " : "", value[i]);
    printf("], ");
}

static void print_axis(const char *name, const struct axis *axis, const char *end)
{
    printf("\"%s\": [", name);
    for (size_t i = 0; i < axis->n; i++)
        printf("%s%.17g", i > 0 ? ", " : "", axis_value(axis, i));
    printf("]%s", end);
}

static int print_columns(const char *name)
{
    enum { ROW = 30000 };
    struct recipe recipe = recipe_of(name);
    struct chromophores c;
    struct xyz_weights w;
    struct row_maker *maker;
    struct table_row row;
    double blood[SPECTRUM_MAX_BANDS], A;
    must(chromophores_init(recipe.first_nm, recipe.step_nm, recipe.bands, &c), "bands");
    must(xyz_weights_init(recipe.illuminant, recipe.observer, recipe.first_nm, recipe.step_nm,
                          recipe.bands, &w),
         "weights");
    must(dipole_A(recipe.eta, &A), "eta");
    must(row_maker_open(&recipe, &maker), "row maker");
    must(row_maker_make(maker, ROW, &row, NULL), "row");
    row_maker_close(maker);
    for (size_t i = 0; i < c.n; i++)
        blood[i] = recipe.gamma * c.oxy[i] + (1.0 - recipe.gamma) * c.deoxy[i];
    printf("{\"model\": \"%s\", ", name);
    print_list("eumelanin", c.eumelanin, c.n);
    print_list("pheomelanin", c.pheomelanin, c.n);
    print_list("base", c.base, c.n);
    print_list("blood", blood, c.n);
    print_list("sigma_s_prime", c.sigma_s_prime, c.n);
    print_list("white", w.white, 3);
    printf("\"A\": %.17g, \"entering\": %.17g, \"epidermis_mm\": %.17g, ", A,
           1.0 - dipole_Rs(recipe.eta), recipe.epidermis_mm);
    printf("\"weights\": [");
    for (size_t i = 0; i < w.n; i++)
        printf("%s[%.17g, %.17g, %.17g]", i > 0 ? ", " : "", w.weight[i][0], w.weight[i][1],
               w.weight[i][2]);
    printf("], \"rgb_of_xyz\": [");
    double column[3][3];
    for (int k = 0; k < 3; k++) {
        double axis[3] = { 0.0 };
        axis[k] = 1.0;
        srgb_linear_from_xyz(axis, w.white, column[k]);
    }
    for (int i = 0; i < 3; i++)
        printf("%s[%.17g, %.17g, %.17g]", i > 0 ? ", " : "", column[0][i], column[1][i],
               column[2][i]);
    printf("], \"grid\": {");
    print_axis("Cm", &recipe.grid.Cm, ", ");
    print_axis("Bm", &recipe.grid.Bm, ", ");
    print_axis("Ch", &recipe.grid.Ch, "}, ");
    printf("\"row\": %d, \"Lab\": [%.17g, %.17g, %.17g]}\n", ROW, row.Lab[0], row.Lab[1],
           row.Lab[2]);
    return 0;
}

/* ---- rows -------------------------------------------------------------------------------- */

static double plain_s(struct row_maker *maker, struct table *t, size_t first, size_t count)
{
    float spectrum[SPECTRUM_MAX_BANDS];
    struct table_row row;
    double begun = cpu_s();
    for (size_t i = 0; i < count; i++) {
        must(row_maker_make(maker, first + i, &row, spectrum), "row");
        table_set(t, i, &row, spectrum);
    }
    return cpu_s() - begun;
}

/* CPU of opening and closing; opening is once for all rows of a table. */
static double opening_s(const struct recipe *recipe)
{
    double took[ROUNDS];
    for (size_t round = 0; round < ROUNDS; round++) {
        struct table_maker *maker;
        double begun = cpu_s();
        must(table_maker_open(recipe, 1, &maker), "table maker");
        table_maker_close(maker);
        took[round] = cpu_s() - begun;
    }
    return median(took, ROUNDS);
}

/* Chunks of a large table, as a file is built: into memory that stays in the cache.  Without the
 * spectra as well, as numpy does it. */
static int time_rows(const char *name)
{
    enum { PLAIN = 1024 };
    struct recipe recipe = recipe_of(name);
    struct table whole, colours;
    struct table_maker *maker;
    struct row_maker *plain;
    double ns[3][ROUNDS];
    must(table_init(&recipe, CHUNK, &whole), "memory");
    must(table_init_without_spectra(&recipe, CHUNK, &colours), "memory");
    must(table_maker_open(&recipe, 1, &maker), "table maker");
    must(row_maker_open(&recipe, &plain), "row maker");
    for (size_t round = 0; round < ROUNDS; round++) {
        size_t first = round * 2531;
        double begun = cpu_s();
        must(table_maker_rows(maker, first, CHUNK, &whole), "rows");
        double between = cpu_s();
        must(table_maker_rows(maker, first, CHUNK, &colours), "rows");
        ns[1][round] = 1e9 / CHUNK * (cpu_s() - between);
        ns[0][round] = 1e9 / CHUNK * (between - begun);
        ns[2][round] = 1e9 / PLAIN * plain_s(plain, &whole, first, PLAIN);
    }
    printf("{\"vectors\": %.2f, \"without_spectra\": %.2f, \"plain\": %.2f, \"bands\": %zu, ",
           median(ns[0], ROUNDS), median(ns[1], ROUNDS), median(ns[2], ROUNDS), recipe.bands);
    printf("\"rows\": %zu, \"opening_us\": %.1f}\n", grid_rows(&recipe.grid),
           1e6 * opening_s(&recipe));
    row_maker_close(plain);
    table_maker_close(maker);
    table_done(&whole);
    table_done(&colours);
    return 0;
}

/* A recipe of about so many rows: the axes of the default grid in proportion. */
static struct recipe recipe_of_rows(const char *name, double rows)
{
    struct recipe recipe = recipe_default(model_find(name));
    double scale = cbrt(rows / (50.0 * 21.0 * 48.0));
    recipe.grid.Cm.n = (size_t)ceil(50.0 * scale);
    recipe.grid.Bm.n = (size_t)ceil(21.0 * scale);
    recipe.grid.Ch.n = (size_t)ceil(48.0 * scale);
    return recipe;
}

static int time_threads(const char *name, double rows)
{
    struct recipe recipe = recipe_of_rows(name, rows);
    size_t n = grid_rows(&recipe.grid);
    double took[2][TURNS], cpu[2][TURNS];
    struct table t;
    must(table_init(&recipe, n, &t), "memory");
    must(table_compute(&t, 0, n, 2), "rows"); /* the pages are there then */
    for (int turn = 0; turn < TURNS; turn++)
        for (unsigned threads = 1; threads <= 2; threads++) {
            double begun = now_s(), cpu_begun = cpu_s();
            must(table_compute(&t, 0, n, threads), "rows");
            took[threads - 1][turn] = now_s() - begun;
            cpu[threads - 1][turn] = cpu_s() - cpu_begun;
        }
    double one = median(took[0], TURNS), two = median(took[1], TURNS);
    printf("{\"rows\": %zu, \"one_s\": %.6f, \"two_s\": %.6f, \"ratio\": %.3f, ", n, one, two,
           one / two);
    printf("\"one_cpu_s\": %.6f, \"two_cpu_s\": %.6f, \"cores\": %u}\n", median(cpu[0], TURNS),
           median(cpu[1], TURNS), parallel_cores());
    table_done(&t);
    return 0;
}

/* ---- the file ---------------------------------------------------------------------------- */

/* Seconds as they pass, and of the processor: built by two threads, by one; read; without spectra.
 */
static int time_file(const char *path, const char *name, double rows)
{
    static const char *const what[4] = { "build_two", "build_one", "read", "read_without_spectra" };
    struct recipe recipe = recipe_of_rows(name, rows);
    struct table_file_bytes bytes;
    struct table t;
    printf("{\"rows\": %zu, ", grid_rows(&recipe.grid));
    for (int i = 0; i < 4; i++) {
        struct table_build_options options = { .overwrite = true, .threads = i == 0 ? 2 : 1 };
        double begun = now_s(), cpu = cpu_s();
        if (i < 2)
            must(table_build(path, &recipe, &options), path);
        else
            must(table_file_read_parts(path, i == 2 ? TABLE_FILE_WHOLE : TABLE_FILE_WITHOUT_SPECTRA,
                                       &t, &bytes),
                 path);
        printf("\"%s_s\": %.6f, \"%s_cpu_s\": %.6f, ", what[i], now_s() - begun, what[i],
               cpu_s() - cpu);
        if (i >= 2)
            table_done(&t);
    }
    printf("\"bytes\": %zu}\n", bytes.file);
    return 0;
}

int main(int argc, char **argv)
{
    if (argc == 2 && strcmp(argv[1], "--sql") == 0)
        return printf("%s\n%s", table_settings_sql, table_schema_sql) > 0 ? 0 : 1;
    if (argc == 3 && strcmp(argv[1], "--columns") == 0)
        return print_columns(argv[2]);
    if (argc == 3 && strcmp(argv[1], "--rows") == 0)
        return time_rows(argv[2]);
    if (argc == 4 && strcmp(argv[1], "--threads") == 0)
        return time_threads(argv[2], atof(argv[3]));
    if (argc == 5 && strcmp(argv[1], "--file") == 0)
        return time_file(argv[2], argv[3], atof(argv[4]));
    fprintf(stderr, "usage: tables --columns MODEL | --rows MODEL | --threads MODEL ROWS | "
                    "--file FILE MODEL ROWS | --sql\n");
    return 2;
}
