/* cmd_table.c - `skinspec table build | info | verify`. */
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/log.h"
#include "base/number.h"
#include "base/parallel.h"
#include "cli/command.h"
#include "cli/find_table.h"
#include "cli/options.h"
#include "cli/out.h"
#include "cli/progress_bar.h"
#include "cli/subcommand.h"
#include "cli/table_out.h"
#include "db/table_build.h"
#include "db/table_file.h"
#include "db/table_schema.h"
#include "db/table_verify.h"
#include "optics/dipole.h"

/* ---- build -------------------------------------------------------------------------- */

enum { OPTION_MODEL = OPTION_OWN, OPTION_OUT, OPTION_RTREE, OPTION_RGB_AS };

static const struct argp_option build_options[] = {
    { "model", OPTION_MODEL, "M", 0,
      "two-layer, half-space, kubelka-munk, transport-4, -8, -16, -32, monte-carlo or paper", 0 },
    { "out", OPTION_OUT, "FILE", 0, "The file to make; table-NAME.db is then found as NAME", 0 },
    { "cm", OPTION_CM, "LO:HI:N", 0, "Melanin axis (log:0.001:0.5:50), within 0..0.5", 0 },
    { "bm", OPTION_BM, "LO:HI:N", 0, "Blend axis (0:1:21), within 0..1", 0 },
    { "ch", OPTION_CH, "LO:HI:N", 0, "Blood axis (log:0.001:0.1:48), within 0.001..0.1", 0 },
    OPTION_ROWS_TISSUE,
    OPTION_ROW_ETA,
    { "bands", OPTION_BANDS, "LO:HI:STEP", 0, "Bands of the spectra, nm (400:700:10)", 0 },
    { "illuminant", OPTION_ILLUMINANT, "NAME", 0, "For L*a*b* and RGB (D65)", 0 },
    { "observer", OPTION_OBSERVER, "DEG", 0, "2 or 10 (10; the paper's model: 2)", 0 },
    { "rgb-as", OPTION_RGB_AS, "linear|coded", 0,
      "How the paper's model's R, G, B are read (linear)", 0 },
    { "rtree", OPTION_RTREE, NULL, 0, "Add an R*Tree on L*a*b* for SQL queries", 0 },
    { "threads", OPTION_THREADS, "N", 0, "Threads (all cores)", 0 },
    { "json", OPTION_JSON, NULL, 0, "Describe the finished table as `table info --json` does", 0 },
    { "ndjson", OPTION_NDJSON, NULL, 0, "The same", 0 },
    { "force", OPTION_FORCE, NULL, 0, "Replace an existing file", 0 },
    { 0 },
};

struct build_arguments {
    const char *out;
    struct recipe recipe;
    struct tissue tissue;
    unsigned given;
    struct table_build_options options;
    /* What the model decides the default of, until it is known. */
    const char *bands, *illuminant, *observer;
    bool json;
};

static void set_axis(struct argp_state *state, const char *option, const char *text,
                     struct axis *axis, double low, double high)
{
    enum status s = axis_parse(text, axis);
    if (s == STATUS_FORMAT)
        argp_error(state, "--%s: '%s' is not LO:HI:N, log:LO:HI:N or one value", option, text);
    if (s == STATUS_RANGE)
        argp_error(state,
                   "--%s: '%s' is no axis: LO must lie below HI, N be 2 to %d, and LO above 0 "
                   "with log:",
                   option, text, (int)GRID_AXIS_MAX);
    if (axis->lo < low || axis->hi > high)
        argp_error(state, "--%s: '%s' leaves the range %g..%g", option, text, low, high);
}

static void set_model(struct argp_state *state, struct build_arguments *a, const char *name)
{
    struct recipe base = recipe_default(option_model(state, name));
    base.grid = a->recipe.grid;
    base.rgb_reading = a->recipe.rgb_reading;
    a->recipe = base;
}

/* What depends on the model, once all options are read. */
static void finish_recipe(struct argp_state *state, struct build_arguments *a)
{
    struct recipe *r = &a->recipe;
    if (r->model == NULL || a->out == NULL) {
        argp_error(state, "--%s is missing", a->out == NULL ? "out" : "model");
        return;
    }
    bool spectral = r->model->reflectance != NULL;
    if (!spectral && (a->bands != NULL || a->illuminant != NULL || a->observer != NULL))
        argp_error(state,
                   "--bands, --illuminant and --observer mean nothing to model '%s', which "
                   "has no spectra and gives sRGB",
                   r->model->name);
    if (spectral && r->rgb_reading != RGB_READING_LINEAR)
        argp_error(state, "--rgb-as is for model 'paper' only");
    if (a->bands != NULL) {
        struct option_bands b = option_bands(state, a->bands);
        r->first_nm = b.first_nm;
        r->step_nm = b.step_nm;
        r->bands = b.n;
    }
    if (a->illuminant != NULL)
        r->illuminant = option_illuminant(state, a->illuminant);
    if (a->observer != NULL)
        r->observer = option_observer(state, a->observer);
    r->gamma = a->tissue.gamma;
    r->eta = a->tissue.eta;
    r->epidermis_mm = a->tissue.epidermis_mm;
    if (grid_check(&r->grid) != STATUS_OK)
        argp_error(state, "the grid has more than %u rows", GRID_ROWS_MAX);
    if (recipe_check(r) != STATUS_OK)
        argp_error(state, "--bands: colour needs bands by 10, 5 or 1 nm that cover 400..700 nm");
}

static error_t parse_build(int key, char *text, struct argp_state *state)
{
    struct build_arguments *a = state->input;
    switch (key) {
    case OPTION_MODEL:
        set_model(state, a, text);
        break;
    case OPTION_OUT:
        a->out = text;
        break;
    case OPTION_CM:
        set_axis(state, "cm", text, &a->recipe.grid.Cm, 0.0, TISSUE_CM_MAX);
        break;
    case OPTION_BM:
        set_axis(state, "bm", text, &a->recipe.grid.Bm, 0.0, 1.0);
        break;
    case OPTION_CH:
        set_axis(state, "ch", text, &a->recipe.grid.Ch, TISSUE_CH_MIN, TISSUE_CH_MAX);
        break;
    case OPTION_BANDS:
        a->bands = text;
        break;
    case OPTION_ILLUMINANT:
        a->illuminant = text;
        break;
    case OPTION_OBSERVER:
        a->observer = text;
        break;
    case OPTION_RGB_AS:
        if (strcmp(text, "linear") != 0 && strcmp(text, "coded") != 0)
            argp_error(state, "--rgb-as: '%s' is neither linear nor coded", text);
        a->recipe.rgb_reading = strcmp(text, "coded") == 0 ? RGB_READING_CODED : RGB_READING_LINEAR;
        break;
    case OPTION_RTREE:
        a->options.rtree = true;
        break;
    case OPTION_FORCE:
        a->options.overwrite = true;
        break;
    case OPTION_JSON:
    case OPTION_NDJSON:
        a->json = true;
        break;
    case OPTION_THREADS:
        a->options.threads =
            (unsigned)option_count(state, "threads", text, 1, PARALLEL_MAX_THREADS);
        break;
    case ARGP_KEY_ARG:
        option_unexpected(state, text);
        break;
    case ARGP_KEY_END:
        finish_recipe(state, a);
        break;
    default:
        return option_skin(key, text, state, &a->tissue, &a->given) ? 0 : ARGP_ERR_UNKNOWN;
    }
    return 0;
}

static int run_build(int argc, char **argv)
{
    static const struct argp argp = {
        build_options,
        parse_build,
        "",
        "Compute a table of skins: for every (Cm, Bm, Ch) of a grid the spectrum and its colour. "
        "An axis is LO:HI:N, log:LO:HI:N or one value; where Cm is 0 there is one Bm.\v"
        "Examples:\n"
        "  skinspec table build --model two-layer --out table-two-layer.db\n"
        "  skinspec table build --model paper --out mine.db --cm log:0.01:0.4:20 --bm 1\n\n"
        "The file appears when it is complete; nothing is left behind by Ctrl-C or an error.\n",
        NULL,
        NULL,
        NULL
    };
    struct build_arguments a = {
        .recipe = { .grid = grid_default() },
        .tissue = tissue_of(0.0, 0.0, 0.0),
        .options = { .threads = parallel_cores() },
    };
    struct progress_bar bar;
    struct table_file_info info;
    char name[TABLE_NAME_SIZE];
    option_parse(&argp, "table build", argc, argv, &a);
    table_file_name(a.out, name);
    a.options.progress = progress_bar_begin(&bar, name);
    enum status s = table_build(a.out, &a.recipe, &a.options);
    progress_bar_end(&bar);
    if (s == STATUS_OK)
        log_info("table '%s' of %zu rows is made: %s", name, grid_rows(&a.recipe.grid), a.out);
    if (s == STATUS_OK && a.json) {
        s = table_file_info(a.out, &info);
        if (s == STATUS_OK)
            table_out_info(true, a.out, &info);
    }
    return out_exit(s == STATUS_OK);
}

/* ---- info and verify ---------------------------------------------------------------- */

enum { OPTION_TABLES = OPTION_OWN };

static const struct argp_option look_options[] = {
    { "tables", OPTION_TABLES, "DIR", 0, "Where to look for a table given by name", 0 },
    OPTION_ROWS_JSON_ONE,
    { 0 },
};

struct look_arguments {
    const char *table, *folder;
    bool json;
};

static error_t parse_look(int key, char *text, struct argp_state *state)
{
    struct look_arguments *a = state->input;
    switch (key) {
    case OPTION_TABLES:
        a->folder = text;
        break;
    case OPTION_JSON:
    case OPTION_NDJSON:
        a->json = true;
        break;
    case ARGP_KEY_ARG:
        if (a->table != NULL)
            argp_error(state, "one table at a time");
        a->table = text;
        break;
    case ARGP_KEY_END:
        if (a->table == NULL)
            argp_error(state, "which table? Give a path or a name");
        break;
    default:
        return ARGP_ERR_UNKNOWN;
    }
    return 0;
}

static int run_info(int argc, char **argv)
{
    static const struct argp argp = { look_options, parse_look,
                                      "TABLE",      "What a table holds and how it was made.",
                                      NULL,         NULL,
                                      NULL };
    struct look_arguments a = { 0 };
    struct table_file_info info;
    char path[FIND_TABLE_PATH_SIZE];
    option_parse(&argp, "table info", argc, argv, &a);
    if (find_table(a.table, a.folder, path) != STATUS_OK ||
        table_file_info(path, &info) != STATUS_OK)
        return EXIT_FAILURE;
    table_out_info(a.json, path, &info);
    return out_exit(true);
}

static void print_report(const struct look_arguments *a, const struct table_verify_report *r,
                         enum status s)
{
    struct out out;
    if (!a->json) {
        printf("%zu rows computed anew: %zu identical bit for bit; largest difference %.3g, in "
               "spectra %.0f units in the last place\ncontent hash %s\n%s\n",
               r->rows, r->identical_rows, r->worst, r->worst_spectrum,
               r->content_hash_matches ? "matches" : "does not match",
               s == STATUS_OK ? "verified" : "NOT verified");
        return;
    }
    cJSON *object = cJSON_CreateObject();
    cJSON_AddBoolToObject(object, "verified", s == STATUS_OK);
    out_member(object, "rows", (double)r->rows);
    out_member(object, "identical_rows", (double)r->identical_rows);
    out_member(object, "worst_difference", r->worst);
    out_member(object, "worst_spectrum_ulps", r->worst_spectrum);
    cJSON_AddBoolToObject(object, "content_hash_matches", r->content_hash_matches);
    out_begin(&out, OUT_NDJSON);
    out_object(&out, object);
}

static int run_verify(int argc, char **argv)
{
    static const struct argp argp = {
        look_options,
        parse_look,
        "TABLE",
        "Compute every row of a table anew from its own description and compare.\v"
        "The same build on the same machine gives the same bits, any other the same numbers to "
        "1e-10; exit status 1 where they differ by more.\n",
        NULL,
        NULL,
        NULL
    };
    struct look_arguments a = { 0 };
    struct table_verify_report report = { 0 }; /* stays so where the file is unreadable */
    struct progress_bar bar;
    char path[FIND_TABLE_PATH_SIZE];
    option_parse(&argp, "table verify", argc, argv, &a);
    if (find_table(a.table, a.folder, path) != STATUS_OK)
        return EXIT_FAILURE;
    struct progress progress = progress_bar_begin(&bar, "verify");
    enum status s = table_verify(path, parallel_cores(), &progress, &report);
    progress_bar_end(&bar);
    if (report.rows > 0)
        print_report(&a, &report, s);
    return out_exit(s == STATUS_OK);
}

static const struct subcommand subcommands[] = {
    { "build", "--model M --out FILE [grid...]   compute a table", run_build },
    { "info", "TABLE                            what it holds and how it was made", run_info },
    { "verify", "TABLE                            compute it anew and compare", run_verify },
};

int cmd_table(int argc, char **argv)
{
    return subcommand_run(argc, argv, "table", "", subcommands,
                          sizeof subcommands / sizeof *subcommands);
}
