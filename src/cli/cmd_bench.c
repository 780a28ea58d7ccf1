/* cmd_bench.c - `skinspec bench`: error against run time of every method, in one run. */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/log.h"
#include "base/parallel.h"
#include "cli/trial_out.h"
#include "cli/command.h"
#include "cli/inputs.h"
#include "cli/machine.h"
#include "cli/new_file.h"
#include "cli/options.h"
#include "cli/out.h"
#include "cli/progress_bar.h"
#include "db/costs_file.h"
#include "trial/csource.h"
#include "trial/csv.h"
#include "trial/markdown.h"
#include "trial/svg.h"
#include "trial/trial.h"

/* ---- options ------------------------------------------------------------------------ */

enum {
    OPTION_OUT = OPTION_OWN,
    OPTION_QUICK,
    OPTION_SKINS,
    OPTION_SEED,
    OPTION_SVG,
    OPTION_MARKDOWN,
    OPTION_CALIBRATE,
    OPTION_COSTS,
    OPTION_C_SOURCE
};

static const struct argp_option options[] = {
    { "quick", OPTION_QUICK, NULL, 0, "Tables of 10 and 50 thousand rows, fewer skins", 0 },
    { "skins", OPTION_SKINS, "N", 0, "Skins that errors are of (2000; with --quick 500)", 0 },
    { "seed", OPTION_SEED, "N", 0, "Which skins and which noise (1)", 0 },
    { "out", OPTION_OUT, "FILE", 0, "CSV into a file (standard output)", 0 },
    { "svg", OPTION_SVG, "FILE", 0, "A picture of the fronts", 0 },
    { "markdown", OPTION_MARKDOWN, "FILE", 0, "A page; it shows the picture of --svg", 0 },
    { "calibrate", OPTION_CALIBRATE, NULL, 0, "Have plans made by this machine's figures", 0 },
    { "costs", OPTION_COSTS, "FILE", 0,
      "Where --calibrate writes ($XDG_STATE_HOME/skinspec/costs.csv)", 0 },
    { "c-source", OPTION_C_SOURCE, "FILE", 0, "The same as the source of those compiled in", 0 },
    { "json", OPTION_JSON, NULL, 0, "Print a JSON object", 0 },
    { "ndjson", OPTION_NDJSON, NULL, 0, "The same", 0 },
    { "threads", OPTION_THREADS, "N", 0, "For what is not timed (all cores)", 0 },
    { "force", OPTION_FORCE, NULL, 0, "Replace existing files", 0 },
    { 0 },
};

/* Files to write, in the order of their options. */
enum { FILE_CSV, FILE_SVG, FILE_MARKDOWN, FILE_COSTS, FILE_C_SOURCE, FILES };

struct arguments {
    struct trial_options trial;
    const char *path[FILES]; /* NULL: not wanted */
    bool calibrate, force, json;
    char costs[COSTS_PATH_SIZE];
};

static void finish(struct argp_state *state, struct arguments *a)
{
    if (a->path[FILE_COSTS] != NULL && !a->calibrate)
        argp_error(state, "--costs says where --calibrate writes; add --calibrate");
    if (a->calibrate && a->path[FILE_COSTS] == NULL) {
        if (costs_file_path(a->costs) != STATUS_OK)
            argp_error(state, "--calibrate: neither XDG_STATE_HOME nor HOME names a folder; say "
                              "where by --costs FILE");
        a->path[FILE_COSTS] = a->costs;
    }
    for (size_t i = 0; i < FILES; i++)
        for (size_t k = 0; k < i; k++)
            if (a->path[i] != NULL && a->path[k] != NULL && inputs_same(a->path[i], a->path[k]))
                argp_error(state, "'%s' cannot be two files", a->path[i]);
    if (a->trial.skins == 0)
        a->trial.skins = a->trial.quick ? TRIAL_SKINS_QUICK : TRIAL_SKINS;
}

static error_t parse(int key, char *text, struct argp_state *state)
{
    struct arguments *a = state->input;
    switch (key) {
    case OPTION_QUICK:
        a->trial.quick = true;
        break;
    case OPTION_SKINS:
        a->trial.skins = option_count(state, "skins", text, TRIAL_SKINS_MIN, TRIAL_SKINS_MAX);
        break;
    case OPTION_SEED:
        a->trial.seed = option_count(state, "seed", text, 0, (size_t)1 << 53);
        break;
    case OPTION_OUT:
        a->path[FILE_CSV] = text;
        break;
    case OPTION_SVG:
        a->path[FILE_SVG] = text;
        break;
    case OPTION_MARKDOWN:
        a->path[FILE_MARKDOWN] = text;
        break;
    case OPTION_CALIBRATE:
        a->calibrate = true;
        break;
    case OPTION_COSTS:
        a->path[FILE_COSTS] = text;
        break;
    case OPTION_C_SOURCE:
        a->path[FILE_C_SOURCE] = text;
        break;
    case OPTION_JSON:
    case OPTION_NDJSON:
        a->json = true;
        break;
    case OPTION_THREADS:
        a->trial.threads = (unsigned)option_count(state, "threads", text, 1, PARALLEL_MAX_THREADS);
        break;
    case OPTION_FORCE:
        a->force = true;
        break;
    case ARGP_KEY_ARG:
        option_unexpected(state, text);
        break;
    case ARGP_KEY_END:
        finish(state, a);
        break;
    default:
        return ARGP_ERR_UNKNOWN;
    }
    return 0;
}

/* ---- files -------------------------------------------------------------------------- */

/* The folders of a path that are not there yet. */
static enum status make_folders(const char *path)
{
    char folder[COSTS_PATH_SIZE];
    snprintf(folder, sizeof folder, "%s", path);
    for (char *slash = strchr(folder + 1, '/'); slash != NULL; slash = strchr(slash + 1, '/')) {
        *slash = '\0';
        if (mkdir(folder, 0755) != 0 && errno != EEXIST) {
            log_error("cannot make the folder %s: %s", folder, strerror(errno));
            return STATUS_IO;
        }
        *slash = '/';
    }
    return STATUS_OK;
}

/* Costs are made anew without a word, but not in place of what is none. */
static bool may_replace(const struct arguments *a, size_t i)
{
    return a->force ||
           (i == FILE_COSTS && (a->path[i] == a->costs || costs_file_is_one(a->path[i])));
}

/* All are begun before anything is measured: what cannot be written is told at once. */
static enum status begin_files(const struct arguments *a, struct new_file file[FILES])
{
    enum status s = a->path[FILE_COSTS] == a->costs ? make_folders(a->costs) : STATUS_OK;
    for (size_t i = 0; i < FILES && s == STATUS_OK; i++)
        if (a->path[i] != NULL)
            s = new_file_begin(a->path[i], may_replace(a, i), &file[i]);
    return s;
}

static enum status write_file(const struct arguments *a, size_t i, FILE *stream,
                              const struct trial *trial, const char *machine)
{
    static struct costs costs;
    switch (i) {
    case FILE_CSV:
        trial_csv(stream, trial, machine);
        return STATUS_OK;
    case FILE_SVG:
        trial_svg(stream, trial, machine);
        return STATUS_OK;
    case FILE_MARKDOWN:
        trial_markdown(stream, trial, machine, a->path[FILE_SVG]);
        return STATUS_OK;
    case FILE_COSTS:
        trial_costs(trial, machine, &costs);
        costs_print(stream, &costs);
        return STATUS_OK;
    default:
        trial_costs(trial, machine, &costs);
        return trial_csource(stream, &costs);
    }
}

static enum status end_files(const struct arguments *a, struct new_file file[FILES],
                             const struct trial *trial, const char *machine, bool keep)
{
    enum status all = STATUS_OK;
    for (size_t i = 0; i < FILES; i++) {
        enum status s = STATUS_OK;
        if (file[i].stream == NULL)
            continue;
        if (keep)
            s = write_file(a, i, file[i].stream, trial, machine);
        enum status ended = new_file_end(&file[i], keep && s == STATUS_OK);
        s = s == STATUS_OK ? ended : s;
        if (keep && s == STATUS_OK)
            log_info("%s is made", a->path[i]);
        all = all == STATUS_OK ? s : all;
    }
    return all;
}

/* ---- the command -------------------------------------------------------------------- */

/* The bar's text, as wide as the longest name so that none is left of the one before. */
struct telling {
    struct progress_bar bar;
    char what[TRIAL_NAME_SIZE];
};

static void tell(void *context, const char *what)
{
    struct telling *t = context;
    snprintf(t->what, sizeof t->what, "%-56s", what);
}

static enum status measure(struct arguments *a, struct telling *telling, struct trial *trial)
{
    tell(telling, "");
    struct progress progress = progress_bar_begin(&telling->bar, telling->what);
    a->trial.progress = &progress;
    a->trial.now = tell;
    a->trial.context = telling;
    enum status s = trial_do(&a->trial, trial);
    if (s == STATUS_NO_MEMORY)
        log_error("there is not memory enough for all tables: 1.5 GB; --quick wants 60 MB");
    else if (s != STATUS_OK && s != STATUS_CANCELLED)
        log_error("bench: %s", status_text(s));
    return s;
}

static bool wants_csv(const struct arguments *a)
{
    for (size_t i = 0; i < FILES; i++)
        if (a->path[i] != NULL)
            return false;
    return !a->json;
}

static bool run(struct arguments *a)
{
    static struct trial trial;
    struct new_file file[FILES] = { 0 };
    struct telling telling;
    char machine[MACHINE_TEXT_SIZE];
    (void)machine_text(machine); /* before: its load is that of others */
    enum status s = begin_files(a, file);
    if (s != STATUS_OK) {
        (void)end_files(a, file, &trial, machine, false);
        return false;
    }
    s = measure(a, &telling, &trial);
    enum status written = end_files(a, file, &trial, machine, s == STATUS_OK);
    progress_bar_end(&telling.bar); /* a signal takes its course when files are whole, or gone */
    if (s == STATUS_OK && a->json)
        trial_out_json(&trial, machine);
    if (s == STATUS_OK && wants_csv(a))
        trial_csv(stdout, &trial, machine);
    return s == STATUS_OK && written == STATUS_OK;
}

int cmd_bench(int argc, char **argv)
{
    static const struct argp argp = {
        options,
        parse,
        "",
        "Measure every way from a spectrum to a skin on the same skins: error of Cm, Bm and Ch, "
        "time of a spectrum on one thread, memory; and the models themselves. Spectra are made by "
        "the method's own model, which tells what noise does, and by transport-32, which tells "
        "what "
        "the model's error does besides. CSV on standard output, or what the options say.\v"
        "Examples:\n"
        "  skinspec bench --quick --json\n"
        "  skinspec bench --out all.csv --svg error-vs-time.svg --markdown error-vs-time.md\n"
        "  skinspec bench --quick --calibrate\n\n"
        "All of it takes minutes and 1.5 GB, --quick half a minute and 60 MB. Files appear when "
        "they "
        "are complete; nothing is left behind by Ctrl-C or an error.\n",
        NULL,
        NULL,
        NULL
    };
    struct arguments a = { .trial = { .seed = 1, .threads = parallel_cores() } };
    option_parse(&argp, "bench", argc, argv, &a);
    return out_exit(run(&a));
}
