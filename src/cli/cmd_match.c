/* cmd_match.c - spectra -> the nearest skins of a table, a batch at a time. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/log.h"
#include "base/parallel.h"
#include "cli/colour_row.h"
#include "cli/command.h"
#include "cli/find_table.h"
#include "cli/match_out.h"
#include "cli/match_scene.h"
#include "cli/option_refine.h"
#include "cli/options.h"
#include "cli/progress_bar.h"
#include "cli/row_out.h"
#include "cli/spectra.h"
#include "db/table_file.h"

enum {
    OPTION_TABLE = OPTION_OWN,
    OPTION_TABLES,
    OPTION_BY,
    OPTION_RGB,
    OPTION_K,
    OPTION_SPECULAR,
    OPTION_SURFACE,
    OPTION_SCENE,
    OPTION_PLAN,
    OPTION_COSTS
};

static const struct argp_option options[] = {
    { "table", OPTION_TABLE, "T", 0, "Table by path or name (two-layer)", 0 },
    { "tables", OPTION_TABLES, "DIR", 0, "Where to look for a table given by name", 0 },
    { "by", OPTION_BY, "HOW", 0,
      "rgb, lab, de2000 or spectrum (spectrum where the table has them, else rgb)", 0 },
    { "rgb", OPTION_RGB, "float", 0, "By rgb, but before rounding to 8 bits", 0 },
    { "k", OPTION_K, "N", 0, "Also give the N nearest rows, 1..100", 0 },
    OPTION_ROWS_REFINE(OPTION_TEXT(NOISE_DEFAULT_PLACEMENT)),
    { "specular", OPTION_SPECULAR, "sce|sci", 0,
      "Whether the mirror reflection is excluded or included, where no column says so", 0 },
    { "surface", OPTION_SURFACE, "S", 0,
      "For sci: the surface reflection to take off, 0..0.1 (skin: about 0.04)", 0 },
    { "scene", OPTION_SCENE, "FILE", 0,
      "What is wanted and known, as JSON (docs/scenes.md); with --json or --ndjson", 0 },
    { "plan", OPTION_PLAN, NULL, 0, "With --scene: show what would be done, and do not do it", 0 },
    { "costs", OPTION_COSTS, "FILE", 0,
      "With --scene: what each way costs, by skinspec bench --calibrate (this machine's)", 0 },
    { "threads", OPTION_THREADS, "N", 0, "Threads (all cores); the answers are the same", 0 },
    { "strict", OPTION_STRICT, NULL, 0, "Stop at the first bad row", 0 },
    OPTION_ROWS_JSON,
    { 0 },
};

struct arguments {
    const char *path, *table, *tables, *scene, *costs;
    bool by_given, rgb_float, strict, plan;
    enum match_by by;
    size_t k;
    struct refine_wish wish;
    enum specular specular;
    double surface; /* NAN: not given */
    unsigned threads;
    enum out_format format;
};

static enum match_by by_of(struct argp_state *state, const char *text)
{
    static const enum match_by ways[] = { MATCH_RGB, MATCH_LAB, MATCH_DE2000, MATCH_SPECTRUM };
    for (size_t i = 0; i < sizeof ways / sizeof *ways; i++)
        if (strcmp(match_by_name(ways[i]), text) == 0)
            return ways[i];
    argp_error(state, "--by: '%s' is none of rgb, lab, de2000, spectrum", text);
    return MATCH_RGB;
}

static void check_arguments(struct argp_state *state, const struct arguments *a)
{
    if (a->path == NULL)
        argp_error(state, "which FILE? '-' reads standard input");
    if (a->specular == SPECULAR_SCI && isnan(a->surface))
        argp_error(state, "--specular sci also needs --surface S, the part to take off (skin: "
                          "about 0.04)");
    if (a->specular == SPECULAR_SCE && !isnan(a->surface))
        argp_error(state, "--surface is for spectra with the mirror reflection in them "
                          "(--specular sci); these are said to be sce");
    if (a->rgb_float && a->by_given && a->by != MATCH_RGB)
        argp_error(state, "--rgb float goes with --by rgb");
    option_refine_check(state, &a->wish);
    if ((a->plan || a->costs != NULL) && a->scene == NULL)
        argp_error(state, "%s goes with --scene", a->plan ? "--plan" : "--costs");
    if (a->scene == NULL)
        return;
    if (a->by_given || a->rgb_float || a->k > 0 || a->wish.kind != REFINE_NOT)
        argp_error(state, "--by, --rgb, --k and --refine do not go with --scene: say by, k and "
                          "fit in the scene");
    if (a->format == OUT_PLAIN && !a->plan)
        argp_error(state, "an answer to --scene is an object; add --json or --ndjson");
}

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
    case OPTION_BY:
        a->by = by_of(state, text);
        a->by_given = true;
        break;
    case OPTION_RGB:
        if (strcmp(text, "float") != 0)
            argp_error(state, "--rgb: '%s'; expected float", text);
        a->rgb_float = true;
        break;
    case OPTION_K:
        a->k = option_count(state, "k", text, 1, MATCH_OUT_MAX_K);
        break;
    case OPTION_SPECULAR:
        if (specular_parse(text, &a->specular) != STATUS_OK)
            argp_error(state, "--specular: '%s' is neither sce nor sci", text);
        break;
    case OPTION_SURFACE:
        a->surface = option_number(state, "surface", text, 0.0, SPECTRUM_SURFACE_MAX);
        break;
    case OPTION_THREADS:
        a->threads = (unsigned)option_count(state, "threads", text, 1, PARALLEL_MAX_THREADS);
        break;
    case OPTION_SCENE:
        a->scene = text;
        break;
    case OPTION_PLAN:
        a->plan = true;
        break;
    case OPTION_COSTS:
        a->costs = text;
        break;
    case OPTION_STRICT:
        a->strict = true;
        break;
    case ARGP_KEY_ARG:
        option_file(state, text, &a->path);
        break;
    case ARGP_KEY_END:
        check_arguments(state, a);
        break;
    default:
        if (option_refine(key, text, state, &a->wish))
            return 0;
        return option_format(key, &a->format) ? 0 : ARGP_ERR_UNKNOWN;
    }
    return 0;
}

/* ---- a batch ------------------------------------------------------------------------ */

/* Rows read, answered on all cores, printed in order; then the next.  So memory
 * does not grow with the input. */
enum { BATCH = 256 };

struct answer {
    struct match match;
    struct refined_match refined;    /* in place of it, where there is a wish */
    struct match_scene_answer scene; /* in place of both, where there is a scene */
    struct nearest_hit hits[MATCH_OUT_MAX_K];
    enum status status;
    const char *why; /* NULL: the status says it all */
};

struct job {
    const struct arguments *arguments;
    struct spectra *spectra;
    const struct table *table;
    struct matcher matcher;
    struct refiner *refiner;   /* NULL: no wish */
    struct match_scene *scene; /* NULL: none, else in place of table, matcher and refiner */
    struct out out;
    struct match_columns columns;
    struct spectra_row row[BATCH];
    struct answer answer[BATCH];
    bool all_good;
    bool unstated; /* SCI without a surface: a matter of usage */
};

static const char tell_specular[] =
    "it is not said whether the mirror reflection is in these spectra: say --specular sce, or "
    "--specular sci --surface S (skin: about 0.04), or add a column 'specular'";

/* Make the row SCE, or refuse it. */
static void settle_specular(struct job *job, struct spectra_row *row)
{
    const struct arguments *a = job->arguments;
    struct spectrum *s = &row->spectrum;
    size_t band;
    if (s->specular == SPECULAR_UNKNOWN)
        s->specular = a->specular;
    else if (a->specular != SPECULAR_UNKNOWN && a->specular != s->specular)
        spectra_refuse(job->spectra, row, SPECTRA_AT_SPECULAR,
                       "the row says %s, the option --specular %s", specular_name(s->specular),
                       specular_name(a->specular));
    if (!row->good || s->specular == SPECULAR_SCE)
        return;
    if (s->specular == SPECULAR_UNKNOWN) {
        spectra_refuse(job->spectra, row, SPECTRA_AT_SPECULAR, "%s", tell_specular);
        job->unstated = true;
    } else if (isnan(a->surface)) {
        spectra_refuse(job->spectra, row, SPECTRA_AT_SPECULAR,
                       "specular is sci: these values include the mirror reflection; say --surface "
                       "S, the part to take off (skin: about 0.04)");
        job->unstated = true;
    } else if (spectrum_remove_surface(s, a->surface, &band) != STATUS_OK) {
        spectra_refuse(job->spectra, row, (int)band,
                       "at %g nm the reflectance %g is less than the surface %g to take off",
                       spectrum_nm(s, band), s->value[band], a->surface);
    }
}

static enum status answer_row(size_t i, unsigned worker, void *context)
{
    struct job *job = context;
    struct answer *answer = &job->answer[i];
    const struct arguments *a = job->arguments;
    const struct spectrum *spectrum = &job->row[i].spectrum;
    size_t k = a->k > 0 ? a->k : 1;
    (void)worker;
    answer->status = STATUS_OK;
    answer->why = NULL;
    if (!job->row[i].good)
        return STATUS_OK;
    if (job->scene != NULL)
        answer->status = match_scene_run(job->scene, spectrum, &answer->scene, &answer->why);
    else if (job->refiner != NULL)
        answer->status = refined_match(&job->matcher, job->refiner, &a->wish, spectrum, 1, spectrum,
                                       k, answer->hits, &answer->refined, &answer->why);
    else
        answer->status = matcher_match(&job->matcher, spectrum, k, answer->hits, &answer->match);
    return STATUS_OK; /* a row that fails is the row's affair */
}

static void print_answer(struct job *job, size_t i)
{
    const struct spectra_row *row = &job->row[i];
    const struct answer *answer = &job->answer[i];
    size_t k = job->arguments->k;
    bool refined = job->refiner != NULL;
    if (job->out.format == OUT_PLAIN) {
        row_out_carried(&job->out, job->spectra, row);
        if (refined)
            match_out_refined_csv(&job->out, job->table, &answer->refined, answer->hits, k);
        else
            match_out_csv(&job->out, job->table, &answer->match, answer->hits, k);
        out_text(&job->out, "");
        out_row(&job->out);
        return;
    }
    cJSON *object = row_out_object(row);
    if (job->scene != NULL)
        match_scene_json(job->scene, &answer->scene, object);
    else if (refined)
        match_out_refined_json(object, job->table, &answer->refined, answer->hits, k);
    else
        match_out_json(object, job->table, &answer->match, answer->hits, k);
    out_object(&job->out, object);
}

/* Read up to BATCH rows; *n of them.  STATUS_NOT_FOUND at the end of the input. */
static enum status read_batch(struct job *job, size_t *n)
{
    for (*n = 0; *n < BATCH; ++*n) {
        struct spectra_row *row = &job->row[*n];
        enum status s = spectra_next(job->spectra, row);
        if (s != STATUS_OK)
            return s;
        if (row->good)
            settle_specular(job, row);
        if (job->arguments->strict && !row->good) {
            ++*n;
            return STATUS_CANCELLED;
        }
    }
    return STATUS_OK;
}

static void print_batch(struct job *job, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        if (job->row[i].good && job->answer[i].status != STATUS_OK)
            spectra_refuse(job->spectra, &job->row[i], SPECTRA_AT_ROW, "%s",
                           job->answer[i].why != NULL ? job->answer[i].why
                                                      : status_text(job->answer[i].status));
        job->all_good = job->all_good && job->row[i].good;
        if (job->row[i].good)
            print_answer(job, i);
        else
            row_out_bad(&job->out, job->spectra, &job->row[i], job->columns.n);
    }
}

static int run(struct job *job)
{
    const struct arguments *a = job->arguments;
    struct progress_bar bar;
    struct progress progress = { NULL, NULL };
    enum status s = STATUS_OK;
    /* A bar among results on the same terminal would be in the way. */
    bool with_bar = isatty(STDOUT_FILENO) != 1;
    if (with_bar)
        progress = progress_bar_begin(&bar, "match");
    out_begin(&job->out, a->format);
    match_columns_init(&job->columns, a->wish.kind, a->k);
    row_out_header(&job->out, job->spectra, job->columns.name, job->columns.n);
    while (s == STATUS_OK) {
        size_t n, done, total;
        s = read_batch(job, &n);
        parallel_run(n, a->threads, answer_row, job);
        print_batch(job, n);
        spectra_position(job->spectra, &done, &total);
        if (ferror(stdout) || !progress_go_on(&progress, done, total))
            s = STATUS_CANCELLED;
    }
    enum status written = out_end(&job->out);
    if (with_bar)
        progress_bar_end(&bar);
    if (job->unstated)
        return EXIT_USAGE;
    bool done = s == STATUS_NOT_FOUND && written == STATUS_OK && job->all_good;
    return done ? EXIT_SUCCESS : EXIT_FAILURE;
}

/* ---- before the first row ----------------------------------------------------------- */

/* What is wrong for all rows is said once. */
static int check_bands(const struct job *job)
{
    const struct recipe *recipe = &job->table->recipe;
    static struct xyz_weights weights;
    struct spectrum ones = *spectra_bands(job->spectra);
    for (size_t i = 0; i < ones.n; i++)
        ones.value[i] = 1.0; /* measured, for the count of common bands */
    if (job->matcher.by != MATCH_SPECTRUM)
        return colour_weights(job->spectra, recipe->illuminant, recipe->observer, &weights) ==
                       STATUS_OK
                   ? EXIT_SUCCESS
                   : EXIT_FAILURE;
    size_t common = nearest_common_bands(job->table, &ones);
    if (common >= NEAREST_MIN_BANDS)
        return EXIT_SUCCESS;
    spectra_bands_error(job->spectra,
                        "%zu bands in common with table '%s' (%g..%g nm by %g); a comparison of "
                        "spectra needs %d",
                        common, job->table->name, recipe->first_nm,
                        recipe->first_nm + (double)(recipe->bands - 1) * recipe->step_nm,
                        recipe->step_nm, (int)NEAREST_MIN_BANDS);
    return EXIT_FAILURE;
}

static int open_matcher(struct job *job)
{
    const struct arguments *a = job->arguments;
    enum match_by by = a->by_given ? a->by : matcher_default_by(job->table);
    if (a->rgb_float)
        by = MATCH_RGB_FLOAT;
    enum status s = matcher_open(job->table, by, &job->matcher);
    if (s == STATUS_UNSUPPORTED) {
        log_error("table '%s' (model %s) has no spectra, so --by spectrum cannot be had of it; use "
                  "rgb, lab or de2000, or another table",
                  job->table->name, job->table->recipe.model->name);
        return EXIT_USAGE;
    }
    if (s != STATUS_OK)
        log_error("%s", status_text(s));
    return s == STATUS_OK ? EXIT_SUCCESS : EXIT_FAILURE;
}

/* The fit for the table and the bands of the file. */
static int open_refiner(struct job *job)
{
    const struct refine_wish *wish = &job->arguments->wish;
    const struct spectrum *bands = spectra_bands(job->spectra);
    const char *why = NULL;
    struct fit fit;
    if (wish->kind == REFINE_NOT)
        return EXIT_SUCCESS;
    enum status s = refine_wish_fit(wish, &job->table->recipe, &fit, &why);
    if (s == STATUS_OK)
        s = refiner_open(&fit, bands->first_nm, bands->step_nm, bands->n, &job->refiner, &why);
    if (s == STATUS_OK)
        return EXIT_SUCCESS;
    log_error("--refine with table '%s' (model %s): %s", job->table->name,
              job->table->recipe.model->name, why != NULL ? why : status_text(s));
    return s == STATUS_NO_MEMORY ? EXIT_FAILURE : EXIT_USAGE;
}

static int match_file(const struct arguments *a, struct spectra *spectra, const struct table *table)
{
    struct job *job = calloc(1, sizeof *job);
    if (job == NULL) {
        log_error("%s", status_text(STATUS_NO_MEMORY));
        return EXIT_FAILURE;
    }
    job->arguments = a;
    job->spectra = spectra;
    job->table = table;
    job->all_good = true;
    int exit_status = open_matcher(job);
    if (exit_status == EXIT_SUCCESS)
        exit_status = check_bands(job);
    if (exit_status == EXIT_SUCCESS)
        exit_status = open_refiner(job);
    if (exit_status == EXIT_SUCCESS)
        exit_status = run(job);
    refiner_close(job->refiner);
    matcher_close(&job->matcher);
    for (size_t i = 0; i < BATCH; i++)
        spectra_row_done(&job->row[i]);
    free(job);
    return exit_status;
}

/* Planned first: what the plan does not need is not loaded. */
static int match_by_scene(const struct arguments *a, struct spectra *spectra)
{
    struct job *job = calloc(1, sizeof *job);
    if (job == NULL) {
        log_error("%s", status_text(STATUS_NO_MEMORY));
        return EXIT_FAILURE;
    }
    job->arguments = a;
    job->spectra = spectra;
    job->all_good = true;
    int exit_status = match_scene_open(a->scene, a->table, a->tables, a->costs,
                                       spectra_bands(spectra), &job->scene);
    if (exit_status == EXIT_SUCCESS && a->plan)
        match_scene_show(job->scene, a->format);
    else if (exit_status == EXIT_SUCCESS)
        exit_status = match_scene_prepare(job->scene);
    if (exit_status == EXIT_SUCCESS && !a->plan)
        exit_status = run(job);
    match_scene_close(job->scene);
    for (size_t i = 0; i < BATCH; i++)
        spectra_row_done(&job->row[i]);
    free(job);
    return exit_status;
}

int cmd_match(int argc, char **argv)
{
    static const struct argp argp = {
        options,
        parse,
        "FILE",
        "The skin of a table that is nearest to each spectrum in FILE ('-': standard input): "
        "melanin Cm, its blend Bm, blood Ch, how near it is and what to beware of, as CSV unless "
        "--json or --ndjson is given.\v"
        "FILE is CSV: a header whose numeric columns are wavelengths in nm, then one spectrum a "
        "row as fractions 0..1.  A table holds SCE spectra (mirror reflection excluded), so FILE "
        "must say what it holds, by a column 'specular' or by --specular.\n\n"
        "Of an answer: 'distance' is by HOW (rgb: codes 0..441; lab: dE*ab; de2000: dE00; "
        "spectrum: "
        "rms of the reflectance).  L, a, b are the table's; 'dE00' is from there to the colour of "
        "the spectrum, 'rms' from its reflectance to that of the spectrum.  'flags' tell what to "
        "beware of: Cm_at_limit, Bm_at_limit, Ch_at_limit (the truth may lie beyond the table), "
        "Bm_undetermined (no melanin to blend), tie (another row is as near), poor_fit (rms above "
        "0.02: the model does not explain the spectrum), no_colour (these bands give none), "
        "bands_zeroed (less was measured than the surface).\n\n"
        "With --refine the answer lies between the rows: Cm, Bm, Ch of the skin that fits best, "
        "the "
        "standard error of each (_se) and the interval that holds the truth 95 times in 100 (_lo, "
        "_hi) where model and noise are right; chi_square of so many degrees of freedom, and p, "
        "the "
        "probability of a larger one; the row it began with as row, nearest_Cm, nearest_Bm, "
        "nearest_Ch, distance.  Its flags: Cm_at_bound and the like (it ended at an end of the "
        "range), Cm_undetermined (the interval spans half of the range), Cm_by_prior (known "
        "beforehand rather than measured), residual_too_large (model or noise do not explain the "
        "spectrum), residual_too_small (the noise stated is too large), second_solution (another "
        "skin fits nearly as well), not_converged.  --json has the residual by band, the second "
        "solution and the flags in words as well (docs/protocol.md, match); docs/inversion.md says "
        "what to make of it.\n\n"
        "With --scene no more is computed than the scene wants, by the cheapest way that meets "
        "its error bound or time budget; `plan` in an answer says what ran, what was left out and "
        "why.\n\n"
        "Examples:\n"
        "  skinspec match docs/examples/skin.csv --k 3\n"
        "  skinspec match docs/examples/skin.csv --json --scene docs/examples/want.json\n"
        "  skinspec match docs/examples/skin.csv --refine --noise 0.003 --json\n"
        "  skinspec match sci.csv --specular sci --surface 0.04 --by de2000 --json\n",
        NULL,
        NULL,
        NULL
    };
    struct arguments a = { .surface = NAN,
                           .wish = refine_wish_none(),
                           .threads = parallel_cores() };
    struct spectra *spectra = NULL;
    struct table table = { 0 };
    char path[FIND_TABLE_PATH_SIZE];
    int exit_status = EXIT_FAILURE;
    option_parse(&argp, "match", argc, argv, &a);
    if (spectra_open(a.path, &spectra) != STATUS_OK)
        return EXIT_FAILURE;
    if (a.specular == SPECULAR_UNKNOWN && !spectra_has_specular(spectra)) {
        log_error("%s: %s", spectra_path(spectra), tell_specular);
        exit_status = EXIT_USAGE;
    } else if (a.scene != NULL) {
        exit_status = match_by_scene(&a, spectra);
    } else if (find_table(a.table != NULL ? a.table : FIND_TABLE_DEFAULT, a.tables, path) ==
                   STATUS_OK &&
               table_file_read(path, &table) == STATUS_OK) {
        exit_status = match_file(&a, spectra, &table);
    }
    table_done(&table);
    spectra_close(spectra);
    return exit_status;
}
