/* cmd_demo.c - every spectrum of a file, measured and matched, for a person. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <time.h>
#include <unistd.h>

#include "base/log.h"
#include "cli/colour_row.h"
#include "cli/command.h"
#include "cli/find_table.h"
#include "cli/match_out.h"
#include "cli/options.h"
#include "cli/plot.h"
#include "cli/row_out.h"
#include "cli/spectra.h"
#include "db/table_file.h"
#include "match/match.h"

enum { OPTION_TABLE = OPTION_OWN, OPTION_TABLES, OPTION_K, MAX_K = 20 };

static const struct argp_option options[] = {
    { "table", OPTION_TABLE, "T", 0, "Table by path or name (two-layer)", 0 },
    { "tables", OPTION_TABLES, "DIR", 0, "Where to look for a table given by name", 0 },
    { "k", OPTION_K, "N", 0, "How many of the nearest rows to show, 1..20 (3)", 0 },
    OPTION_ROWS_JSON,
    { 0 },
};

struct arguments {
    const char *path, *table, *tables;
    size_t k;
    enum out_format format;
};

static error_t parse(int key, char *text, struct argp_state *state)
{
    struct arguments *a = state->input;
    switch (key) {
    case OPTION_TABLE:
        a->table = text;
        break;
    case OPTION_TABLES:
        a->tables = text;
        break;
    case OPTION_K:
        a->k = option_count(state, "k", text, 1, MAX_K);
        break;
    case ARGP_KEY_ARG:
        option_file(state, text, &a->path);
        break;
    default:
        return option_format(key, &a->format) ? 0 : ARGP_ERR_UNKNOWN;
    }
    return 0;
}

static double now_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e3 * (double)t.tv_sec + 1e-6 * (double)t.tv_nsec;
}

struct demo {
    struct spectra *spectra;
    const struct table *table;
    struct matcher matcher;
    const struct xyz_weights *weights;
    struct plot_style style;
    size_t k;
    struct out out;
};

/* What the file says of the spectrum beside its values. */
static void print_title(const struct demo *d, const struct spectra_row *row)
{
    printf("\n%s", row->id != NULL ? row->id : "spectrum");
    if (row->id == NULL)
        printf(" %zu", row->number);
    putchar('\n');
    for (size_t i = 0; i < spectra_carried(d->spectra); i++) {
        const char *name = spectra_carried_name(d->spectra, i);
        if (strcasecmp(name, "id") != 0 && strcasecmp(name, "specular") != 0)
            printf("  %s %s", name, spectra_carried_text(d->spectra, row, i));
    }
    puts("\n");
}

static void print_match(const struct demo *d, const struct match *m, const struct nearest_hit *hits)
{
    match_out_skin(&m->row);
    printf("  distance %.4g by %s", m->distance, match_by_name(m->by));
    if (!isnan(m->dE00))
        printf(", dE00 %.2f", m->dE00);
    printf("; row %zu of table %s\n", m->row_index + 1, d->table->name);
    for (size_t i = 1; i < m->found; i++) {
        struct table_row near;
        table_get(d->table, hits[i].row, &near);
        printf("  %s Cm %.4f  Bm %.2f  Ch %.4f   at %.4g\n", i == 1 ? "then    " : "        ",
               near.Cm, near.Bm, near.Ch, hits[i].distance);
    }
    if (m->flags != 0) {
        fputs("  beware  ", stdout);
        for (size_t i = 0; i < MATCH_FLAG_COUNT; i++)
            if (m->flags & 1u << i)
                printf(" %s", match_flag_name(i));
        putchar('\n');
    }
}

static void print_json(struct demo *d, const struct spectra_row *row, const struct colour_row *c,
                       const struct match *match, const struct nearest_hit *hits)
{
    const struct recipe *recipe = &d->table->recipe;
    cJSON *object = row_out_object(row), *colour = cJSON_AddObjectToObject(object, "colour");
    colour_row_json(colour, c, colour_is_adapted(recipe->illuminant, recipe->observer));
    match_out_json(cJSON_AddObjectToObject(object, "match"), d->table, match, hits, d->k);
    out_object(&d->out, object);
}

static bool show(struct demo *d, struct spectra_row *row, double read_ms)
{
    struct colour_row colour;
    struct match match;
    struct nearest_hit hits[MAX_K];
    double begin = now_ms();
    colour_row_of(d->weights, row->spectrum.value, &colour);
    double coloured = now_ms();
    if (row->spectrum.specular != SPECULAR_SCE) {
        spectra_refuse(
            d->spectra, row, SPECTRA_AT_SPECULAR,
            "not marked sce; the demo takes spectra without the mirror reflection, with a "
            "column 'specular' that says sce ('skinspec match' takes others)");
        return false;
    }
    enum status s = matcher_match(&d->matcher, &row->spectrum, d->k, hits, &match);
    double matched = now_ms();
    if (s != STATUS_OK) {
        spectra_refuse(d->spectra, row, SPECTRA_AT_ROW, "%s", status_text(s));
        return false;
    }
    if (d->out.format != OUT_PLAIN) {
        print_json(d, row, &colour, &match, hits);
        return true;
    }
    print_title(d, row);
    plot_spectrum(stdout, d->style, &row->spectrum);
    colour_row_print(d->style, colour.Lab, colour.sRGB, colour.clipped, colour.ITA);
    print_match(d, &match, hits);
    printf("  time     read %.3f ms, colour %.3f ms, search %.3f ms over %zu rows\n", read_ms,
           coloured - begin, matched - coloured, d->table->n);
    return true;
}

static const char legend[] =
    "\nCm: melanin in the epidermis; Bm: its eumelanin share; Ch: blood in the dermis.  Names\n"
    "ending in _true: what the example was made with.  Bm shows least of the three: rows far\n"
    "apart in Bm can be nearly as near ('then').  docs/physics.md tells what to believe.\n";

static int show_all(struct demo *d)
{
    struct spectra_row row = { 0 };
    bool all_good = true;
    enum status s;
    for (;;) {
        double begin = now_ms();
        s = spectra_next(d->spectra, &row);
        if (s != STATUS_OK)
            break;
        if (row.good && show(d, &row, now_ms() - begin))
            continue;
        all_good = false;
        if (d->out.format != OUT_PLAIN)
            row_out_bad(&d->out, d->spectra, &row, 0);
    }
    spectra_row_done(&row);
    if (d->out.format == OUT_PLAIN)
        fputs(legend, stdout);
    return s == STATUS_NOT_FOUND && all_good ? EXIT_SUCCESS : EXIT_FAILURE;
}

static int demo(const struct arguments *a, struct spectra *spectra, const char *table_path)
{
    static struct xyz_weights weights;
    struct table table = { 0 };
    double begin = now_ms();
    if (table_file_read(table_path, &table) != STATUS_OK)
        return EXIT_FAILURE;
    if (a->format == OUT_PLAIN)
        printf("%s against table %s:\n%zu skins of model %s, checked and loaded in %.0f ms\n",
               spectra_path(spectra), table.name, table.n, table.recipe.model->name,
               now_ms() - begin);
    struct demo d = { .spectra = spectra,
                      .table = &table,
                      .weights = &weights,
                      .style = plot_style_of(stdout),
                      .k = a->k };
    out_begin(&d.out, a->format);
    int exit_status = EXIT_FAILURE;
    if (colour_weights(spectra, table.recipe.illuminant, table.recipe.observer, &weights) ==
            STATUS_OK &&
        matcher_open(&table, matcher_default_by(&table), &d.matcher) == STATUS_OK) {
        exit_status = show_all(&d);
        matcher_close(&d.matcher);
    }
    table_done(&table);
    return out_end(&d.out) == STATUS_OK ? exit_status : EXIT_FAILURE;
}

/* Where `make install` puts them, seen from the program: ../share/skinspec. */
static const char *installed_examples(char path[FIND_TABLE_PATH_SIZE])
{
    static const char from_bin[] = "/../share/skinspec/examples/skin.csv";
    ssize_t n = readlink("/proc/self/exe", path, FIND_TABLE_PATH_SIZE - sizeof from_bin);
    path[n > 0 ? n : 0] = '\0';
    char *slash = strrchr(path, '/');
    strcpy(slash != NULL ? slash : path, from_bin);
    return path;
}

/* In the source folder, or installed; NULL where they are in neither. */
static const char *default_examples(char path[FIND_TABLE_PATH_SIZE])
{
    static const char here[] = "docs/examples/skin.csv";
    if (access(here, R_OK) == 0)
        return here;
    if (access(installed_examples(path), R_OK) == 0)
        return path;
    log_error("the example spectra are neither in docs/examples nor in %s; run this in the source "
              "folder, or name a FILE of spectra",
              path);
    return NULL;
}

int cmd_demo(int argc, char **argv)
{
    static const struct argp argp = {
        options,
        parse,
        "[FILE]",
        "Every spectrum of FILE (the example skins) drawn, turned into a colour and matched, with "
        "the time each step took.\v"
        "The examples are synthetic: an independent transport program made them, with noise, so "
        "the truth is known and stands beside each.\n",
        NULL,
        NULL,
        NULL
    };
    struct arguments a = { .table = FIND_TABLE_DEFAULT, .k = 3 };
    struct spectra *spectra;
    char path[FIND_TABLE_PATH_SIZE], examples[FIND_TABLE_PATH_SIZE];
    option_parse(&argp, "demo", argc, argv, &a);
    if (a.path == NULL)
        a.path = default_examples(examples);
    const struct spectra_source source = spectra_source_csv(a.path);
    if (a.path == NULL || spectra_open(&source, &spectra) != STATUS_OK)
        return EXIT_FAILURE;
    int exit_status = EXIT_FAILURE;
    if (find_table(a.table, a.tables, path) == STATUS_OK)
        exit_status = demo(&a, spectra, path);
    spectra_close(spectra);
    return exit_status;
}
