/* cmd_match.c - spectra -> the nearest skins of a table: what may be asked for. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "base/parallel.h"
#include "cli/command.h"
#include "cli/find_table.h"
#include "cli/inputs.h"
#include "cli/match_rows.h"
#include "cli/match_scene.h"
#include "cli/match_stream.h"
#include "cli/option_refine.h"
#include "cli/options.h"
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
    OPTION_COSTS,
    OPTION_INPUT,
    OPTION_HEADER,
    OPTION_NO_HEADER,
    OPTION_SHARD,
    OPTION_OUT,
    OPTION_RESUME
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
    { "input", OPTION_INPUT, "csv|ndjson", 0,
      "What FILE is, where its first byte does not say so ('{': ndjson)", 0 },
    { "header", OPTION_HEADER, "CSV", 0,
      "Take the first line of this file for the header that FILE, a piece of one, lacks", 0 },
    { "no-header", OPTION_NO_HEADER, NULL, 0, "Print no line of column names", 0 },
    { "shard", OPTION_SHARD, "I/N", 0,
      "Answer the I-th of N parts of FILE; the parts' outputs, one after the other, are that of "
      "all",
      0 },
    { "out", OPTION_OUT, "ANSWERS", 0,
      "Write to this file; what is done stays there (--json: all or nothing)", 0 },
    { "resume", OPTION_RESUME, NULL, 0, "Go on where a run with --out was stopped", 0 },
    { "force", OPTION_FORCE, NULL, 0, "Replace the file of --out", 0 },
    { "threads", OPTION_THREADS, "N", 0, "Threads (all cores); the answers are the same", 0 },
    { "strict", OPTION_STRICT, NULL, 0, "Stop at the first bad row", 0 },
    OPTION_ROWS_JSON,
    { 0 },
};

struct arguments {
    const char *table, *tables, *scene, *costs;
    struct spectra_source source;
    struct match_wish wish;
    struct match_stream_options stream;
    struct inputs inputs; /* which the answers are not to be written over */
    bool no_header, plan;
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

static enum spectra_format input_of(struct argp_state *state, const char *text)
{
    if (strcmp(text, "csv") == 0)
        return SPECTRA_CSV;
    if (strcmp(text, "ndjson") != 0)
        argp_error(state, "--input: '%s' is neither csv nor ndjson", text);
    return SPECTRA_NDJSON;
}

/* "3/8" */
static void take_shard(struct argp_state *state, char *text, struct spectra_source *source)
{
    enum { MOST = 1000000 };
    char *slash = strchr(text, '/');
    if (slash == NULL) {
        argp_error(state, "--shard: '%s'; expected I/N, as 1/8 .. 8/8", text);
        return;
    }
    *slash = '\0';
    source->shards = option_count(state, "shard", slash + 1, 1, MOST);
    source->shard = option_count(state, "shard", text, 1, source->shards);
}

static void take_mode(struct argp_state *state, struct match_stream_options *o,
                      enum answers_mode mode)
{
    if (o->mode != ANSWERS_NEW && o->mode != mode)
        argp_error(state, "--resume keeps what --force replaces; give one of them");
    o->mode = mode;
}

static void check_output(struct argp_state *state, const struct arguments *a)
{
    const struct match_stream_options *o = &a->stream;
    bool array = a->wish.format == OUT_JSON;
    if (o->mode != ANSWERS_NEW && o->out == NULL)
        argp_error(state, "%s goes with --out ANSWERS",
                   o->mode == ANSWERS_RESUME ? "--resume" : "--force");
    if (array && o->mode == ANSWERS_RESUME)
        argp_error(state, "--resume goes on with lines, not with an array; use --ndjson");
    if (array && a->source.shards > 0)
        argp_error(state, "--shard makes parts of one output, which an array has not; use "
                          "--ndjson");
}

static void check_scene(struct argp_state *state, const struct arguments *a)
{
    const struct match_wish *wish = &a->wish;
    if ((a->plan || a->costs != NULL) && a->scene == NULL)
        argp_error(state, "%s goes with --scene", a->plan ? "--plan" : "--costs");
    if (a->scene == NULL)
        return;
    if (wish->by_given || wish->rgb_float || wish->k > 0 || wish->refine.kind != REFINE_NOT)
        argp_error(state, "--by, --rgb, --k and --refine do not go with --scene: say by, k and "
                          "fit in the scene");
    if (wish->format == OUT_PLAIN && !a->plan)
        argp_error(state, "an answer to --scene is an object; add --json or --ndjson");
}

static void check_arguments(struct argp_state *state, const struct arguments *a)
{
    const struct match_wish *wish = &a->wish;
    if (a->source.path == NULL)
        argp_error(state, "which FILE? '-' reads standard input");
    if (wish->specular == SPECULAR_SCI && isnan(wish->surface))
        argp_error(state, "--specular sci also needs --surface S, the part to take off (skin: "
                          "about 0.04)");
    if (wish->specular == SPECULAR_SCE && !isnan(wish->surface))
        argp_error(state, "--surface is for spectra with the mirror reflection in them "
                          "(--specular sci); these are said to be sce");
    if (wish->rgb_float && wish->by_given && wish->by != MATCH_RGB)
        argp_error(state, "--rgb float goes with --by rgb");
    if (a->source.header != NULL && a->source.format == SPECTRA_NDJSON)
        argp_error(state, "--header is for CSV; a line of NDJSON has names of its own");
    if (a->source.header != NULL && strcmp(a->source.header, "-") == 0)
        argp_error(state, "--header: expected a file");
    option_refine_check(state, &wish->refine);
    check_scene(state, a);
    check_output(state, a);
}

/* Where the spectra come from and the answers go. */
static bool parse_stream(int key, char *text, struct argp_state *state, struct arguments *a)
{
    switch (key) {
    case OPTION_INPUT:
        a->source.format = input_of(state, text);
        return true;
    case OPTION_HEADER:
        a->source.header = text;
        return true;
    case OPTION_NO_HEADER:
        a->no_header = true;
        return true;
    case OPTION_SHARD:
        take_shard(state, text, &a->source);
        return true;
    case OPTION_OUT:
        a->stream.out = text;
        return true;
    case OPTION_RESUME:
        take_mode(state, &a->stream, ANSWERS_RESUME);
        return true;
    case OPTION_FORCE:
        take_mode(state, &a->stream, ANSWERS_REPLACE);
        return true;
    case OPTION_THREADS:
        a->stream.threads = (unsigned)option_count(state, "threads", text, 1, PARALLEL_MAX_THREADS);
        return true;
    case OPTION_STRICT:
        a->stream.strict = true;
        return true;
    default:
        return false;
    }
}

static error_t parse(int key, char *text, struct argp_state *state)
{
    struct arguments *a = state->input;
    struct match_wish *wish = &a->wish;
    switch (key) {
    case OPTION_TABLE:
        a->table = text;
        break;
    case OPTION_TABLES:
        a->tables = text;
        break;
    case OPTION_BY:
        wish->by = by_of(state, text);
        wish->by_given = true;
        break;
    case OPTION_RGB:
        if (strcmp(text, "float") != 0)
            argp_error(state, "--rgb: '%s'; expected float", text);
        wish->rgb_float = true;
        break;
    case OPTION_K:
        wish->k = option_count(state, "k", text, 1, MATCH_OUT_MAX_K);
        break;
    case OPTION_SPECULAR:
        if (specular_parse(text, &wish->specular) != STATUS_OK)
            argp_error(state, "--specular: '%s' is neither sce nor sci", text);
        break;
    case OPTION_SURFACE:
        wish->surface = option_number(state, "surface", text, 0.0, SPECTRUM_SURFACE_MAX);
        break;
    case OPTION_SCENE:
        a->scene = text;
        break;
    case OPTION_COSTS:
        a->costs = text;
        break;
    case OPTION_PLAN:
        a->plan = true;
        break;
    case ARGP_KEY_ARG:
        option_file(state, text, &a->source.path);
        break;
    case ARGP_KEY_END:
        check_arguments(state, a);
        break;
    default:
        if (parse_stream(key, text, state, a) || option_refine(key, text, state, &wish->refine))
            return 0;
        return option_format(key, &wish->format) ? 0 : ARGP_ERR_UNKNOWN;
    }
    return 0;
}

/* Of parts one after the other the first has the columns' names. */
static bool wants_header(const struct arguments *a)
{
    return !a->no_header && a->source.shard <= 1;
}

/* Gives the rows back. */
static int run_rows(struct arguments *a, struct spectra *spectra, struct match_rows *rows)
{
    int exit_status = EXIT_FAILURE;
    a->stream.header = wants_header(a);
    if (inputs_check(&a->inputs, a->stream.out) == STATUS_OK)
        exit_status = match_stream(rows, spectra, a->wish.format, &a->stream);
    match_rows_close(rows);
    return exit_status;
}

static int match_by_table(struct arguments *a, struct spectra *spectra)
{
    struct table table = { 0 };
    char path[FIND_TABLE_PATH_SIZE];
    int exit_status = EXIT_FAILURE;
    if (find_table(a->table != NULL ? a->table : FIND_TABLE_DEFAULT, a->tables, path) ==
            STATUS_OK &&
        table_file_read(path, &table) == STATUS_OK) {
        struct match_rows *rows = match_rows_open(&a->wish, spectra, &table, &exit_status);
        inputs_add_path(&a->inputs, "the table", path);
        if (rows != NULL)
            exit_status = run_rows(a, spectra, rows);
    }
    table_done(&table);
    return exit_status;
}

/* Planned first: what the plan does not need is not loaded. */
static int match_by_scene(struct arguments *a, struct spectra *spectra)
{
    struct match_scene *scene = NULL;
    const struct spectrum *bands = spectra_first_bands(spectra);
    if (bands == NULL)
        return EXIT_FAILURE;
    int exit_status = match_scene_open(a->scene, a->table, a->tables, a->costs, bands, &scene);
    if (exit_status == EXIT_SUCCESS && a->plan) {
        match_scene_show(scene, a->wish.format);
    } else if (exit_status == EXIT_SUCCESS) {
        exit_status = match_scene_prepare(scene);
        if (exit_status == EXIT_SUCCESS) {
            struct match_rows *rows = match_rows_open_scene(&a->wish, spectra, scene);
            match_scene_inputs(scene, &a->inputs);
            exit_status = rows != NULL ? run_rows(a, spectra, rows) : EXIT_FAILURE;
        }
    }
    match_scene_close(scene);
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
        "must say what it holds, by a column 'specular' or by --specular.  Or FILE is NDJSON, an "
        "object "
        "a line: {\"id\", \"spectrum\": {\"first_nm\", \"step_nm\", \"values\"}, "
        "\"specular\"}; --json and --ndjson carry its other members through.\n\n"
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
        "All cores work on the rows, whose order stays; memory does not grow with FILE.  A run "
        "with "
        "--out that was stopped goes on with --resume, to the same bytes (not with --json: an "
        "array appears when it is "
        "whole); docs/scale.md tells how "
        "to share a FILE among processes and machines.\n\n"
        "With --scene no more is computed than the scene wants, by the cheapest way that meets "
        "its error bound or time budget; `plan` in an answer says what ran, what was left out and "
        "why.  It is planned once, for the bands of FILE; of NDJSON for those of its first good "
        "line, and lines of other bands are bad rows.\n\n"
        "Exit status: 0 all rows are answered, 1 some are bad (each has its place, with an error) "
        "or the run failed, 2 usage.\n\n"
        "Examples:\n"
        "  skinspec match docs/examples/skin.csv --k 3\n"
        "  skinspec match docs/examples/skin.csv --json --scene docs/examples/want.json\n"
        "  skinspec match docs/examples/skin.csv --refine --noise 0.003 --json\n"
        "  skinspec match sci.csv --specular sci --surface 0.04 --by de2000 --json\n",
        NULL,
        NULL,
        NULL
    };
    struct arguments a = { .source = { .format = SPECTRA_EITHER },
                           .wish = { .surface = NAN, .refine = refine_wish_none() },
                           .stream = { .threads = parallel_cores() } };
    struct spectra *spectra = NULL;
    int exit_status = EXIT_USAGE;
    option_parse(&argp, "match", argc, argv, &a);
    a.source.look_ahead = a.scene != NULL;
    enum status s = spectra_open(&a.source, &spectra);
    if (s != STATUS_OK)
        return s == STATUS_UNSUPPORTED ? EXIT_USAGE : EXIT_FAILURE;
    inputs_add_file(&a.inputs, a.source.path);
    inputs_add_path(&a.inputs, "the file of --header", a.source.header);
    if (a.wish.specular == SPECULAR_UNKNOWN && !spectra_has_specular(spectra))
        log_error("%s: %s", spectra_path(spectra), match_rows_tell_specular);
    else
        exit_status = a.scene != NULL ? match_by_scene(&a, spectra) : match_by_table(&a, spectra);
    spectra_close(spectra);
    return exit_status;
}
