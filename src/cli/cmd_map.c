/* cmd_map.c - a hyperspectral cube -> maps of the skin in it. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <time.h>

#include "base/log.h"
#include "base/number.h"
#include "base/parallel.h"
#include "cli/command.h"
#include "cli/cube_file.h"
#include "cli/map_file.h"
#include "cli/map_fit.h"
#include "cli/map_out.h"
#include "cli/map_pictures.h"
#include "cli/map_run.h"
#include "cli/option_refine.h"
#include "cli/options.h"
#include "cli/progress_bar.h"

enum {
    OPTION_MODEL = OPTION_OWN,
    OPTION_DATA,
    OPTION_NM,
    OPTION_SCALE,
    OPTION_SPECULAR,
    OPTION_SURFACE,
    OPTION_OUT,
    OPTION_RANGE,
    OPTION_NO_PICTURES,
    OPTION_INTERVALS,
    OPTION_RESUME
};

static const struct argp_option options[] = {
    { "data", OPTION_DATA, "FILE", 0, "The cube's values (by the header's name)", 0 },
    { "model", OPTION_MODEL, "M", 0, "two-layer (the default) or half-space", 0 },
    { "refine", OPTION_REFINE, "three|skin", OPTION_ARG_OPTIONAL,
      "Cm, Bm, Ch (three, the default), or for measured skin Cm, Ch, oxygen saturation and "
      "scattering (skin)",
      0 },
    { "noise", OPTION_NOISE, "S", 0,
      "Standard deviation of each band by itself (three: " NOISE_WHITE_TEXT ")", 0 },
    { "placement", OPTION_PLACEMENT, "P", 0,
      "Size of the noise that bands share, such as from slopes of the skin (" OPTION_TEXT(
          NOISE_DEFAULT_PLACEMENT) "; 0 beside --noise)",
      0 },
    { "fix", OPTION_FIX, "NAME=X", 0,
      "Hold Cm, Bm, Ch, SO2, epidermis_mm, scattering_a or scattering_b at X; may be given again",
      0 },
    { "epidermis-mm", OPTION_EPIDERMIS_MM, "D", 0, "Thickness of the epidermis (0.08)", 0 },
    { "nm", OPTION_NM, "LO:HI", 0, "Bands to use, nm (400:700)", 0 },
    { "scale", OPTION_SCALE, "X", 0, "What stands for R = 1 (the header's scale factor)", 0 },
    { "specular", OPTION_SPECULAR, "sce|sci", 0,
      "Whether the mirror reflection is excluded or included", 0 },
    { "surface", OPTION_SURFACE, "S", 0,
      "For sci: the surface reflection to take off, 0..0.1 (skin: about 0.04)", 0 },
    { "out", OPTION_OUT, "NAME", 0, "Begin the names of the maps with this (CUBE-map)", 0 },
    { "range", OPTION_RANGE, "BAND=LO:HI", 0,
      "Ends of a picture's colours (what 98 % of its pixels have); may be given again", 0 },
    { "intervals", OPTION_INTERVALS, NULL, 0,
      "Both ends of each 95 % interval as well, Cm_lo and Cm_hi ...", 0 },
    { "no-pictures", OPTION_NO_PICTURES, NULL, 0, "Make no PNG files", 0 },
    { "resume", OPTION_RESUME, NULL, 0, "Go on with a map that was stopped", 0 },
    { "force", OPTION_FORCE, NULL, 0, "Replace maps that are there", 0 },
    { "threads", OPTION_THREADS, "N", 0, "Threads (all cores); the maps are the same", 0 },
    OPTION_ROWS_JSON_ONE,
    { 0 },
};

enum { RANGES_MAX = 2 * MAP_BANDS_MAX };

struct arguments {
    const char *path, *data, *out;
    struct map_fit_options fit;
    double lo_nm, hi_nm;
    enum specular specular;
    size_t ranges;
    const char *range[RANGES_MAX];
    bool no_pictures, resume, force;
    unsigned threads;
    enum out_format format;
};

/* ---- options ------------------------------------------------------------------------ */

/* "LO:HI"; false where it is none. */
static bool two_numbers(const char *text, double *lo, double *hi)
{
    const char *colon = strchr(text, ':');
    return colon != NULL && number_parse_n(text, (size_t)(colon - text), lo) == STATUS_OK &&
           number_parse(colon + 1, hi) == STATUS_OK && *lo < *hi;
}

static const struct model *model_of(struct argp_state *state, const char *text)
{
    const struct model *model = option_model(state, text);
    if (model->slopes == NULL)
        argp_error(state, "--model: '%s' cannot be fitted; two-layer and half-space can", text);
    return model;
}

static void check_arguments(struct argp_state *state, const struct arguments *a)
{
    if (a->path == NULL)
        argp_error(state, "which CUBE.hdr?");
    if (a->resume && a->force)
        argp_error(state, "--resume keeps what --force replaces; give one of them");
    if (a->specular == SPECULAR_UNKNOWN)
        argp_error(state, "it is not said whether the mirror reflection is in this cube: say "
                          "--specular sce, or --specular sci --surface S (skin: about 0.04)");
    if (a->specular == SPECULAR_SCI && isnan(a->fit.surface))
        argp_error(state, "--specular sci also needs --surface S, the part to take off (skin: "
                          "about 0.04)");
    if (a->specular == SPECULAR_SCE && !isnan(a->fit.surface))
        argp_error(state, "--surface is for cubes with the mirror reflection in them "
                          "(--specular sci); this one is said to be sce");
}

static void take_range(struct argp_state *state, struct arguments *a, const char *text)
{
    const char *equals = strchr(text, '=');
    double lo, hi;
    if (equals == NULL || equals == text || !two_numbers(equals + 1, &lo, &hi))
        argp_error(state, "--range: '%s'; expected BAND=LO:HI, such as Cm=0:0.2", text);
    if (a->ranges == RANGES_MAX)
        argp_error(state, "--range is given too often");
    a->range[a->ranges++] = text;
}

static error_t parse_more(int key, char *text, struct argp_state *state, struct arguments *a)
{
    switch (key) {
    case OPTION_RANGE:
        take_range(state, a, text);
        break;
    case OPTION_INTERVALS:
        a->fit.intervals = true;
        break;
    case OPTION_NO_PICTURES:
        a->no_pictures = true;
        break;
    case OPTION_RESUME:
        a->resume = true;
        break;
    case OPTION_FORCE:
        a->force = true;
        break;
    case OPTION_THREADS:
        a->threads = (unsigned)option_count(state, "threads", text, 1, PARALLEL_MAX_THREADS);
        break;
    case ARGP_KEY_ARG:
        option_file(state, text, &a->path);
        break;
    case ARGP_KEY_END:
        check_arguments(state, a);
        break;
    default:
        if (option_refine(key, text, state, &a->fit.wish))
            return 0;
        return option_format(key, &a->format) ? 0 : ARGP_ERR_UNKNOWN;
    }
    return 0;
}

static error_t parse(int key, char *text, struct argp_state *state)
{
    struct arguments *a = state->input;
    switch (key) {
    case OPTION_DATA:
        a->data = text;
        return 0;
    case OPTION_OUT:
        a->out = text;
        return 0;
    case OPTION_MODEL:
        a->fit.model = model_of(state, text);
        return 0;
    case OPTION_EPIDERMIS_MM:
        a->fit.epidermis_mm = option_number(state, "epidermis-mm", text, 0.0, 1000.0);
        return 0;
    case OPTION_NM:
        if (!two_numbers(text, &a->lo_nm, &a->hi_nm) || a->lo_nm < 250.0 || a->hi_nm > 1000.0)
            argp_error(state, "--nm: '%s'; expected LO:HI within 250..1000", text);
        return 0;
    case OPTION_SCALE:
        a->fit.scale = option_number(state, "scale", text, 1e-30, 1e30);
        return 0;
    case OPTION_SPECULAR:
        if (specular_parse(text, &a->specular) != STATUS_OK)
            argp_error(state, "--specular: '%s' is neither sce nor sci", text);
        return 0;
    case OPTION_SURFACE:
        a->fit.surface = option_number(state, "surface", text, 0.0, SPECTRUM_SURFACE_MAX);
        return 0;
    default:
        return parse_more(key, text, state, a);
    }
}

/* ---- a map -------------------------------------------------------------------------- */

/* Scale and fill value of the cube, where the options do not say. */
static int settle_values(struct arguments *a, const struct cube_file *cube)
{
    const struct envi_header *h = &cube->header;
    if (isnan(a->fit.scale))
        a->fit.scale = h->scale;
    if (isnan(a->fit.scale) && h->type == ENVI_UINT16) {
        log_error("%s: what stands for R = 1 is not said: add 'reflectance scale factor = 10000', "
                  "or whatever it is, or say --scale 10000",
                  cube->path);
        return EXIT_USAGE;
    }
    if (isnan(a->fit.scale))
        a->fit.scale = 1.0;
    a->fit.has_ignore = h->has_ignore;
    a->fit.ignore = h->ignore;
    return EXIT_SUCCESS;
}

static int open_fit(const struct arguments *a, const struct band_grid *grid, struct map_fit **ret)
{
    const char *why = NULL;
    enum status s = map_fit_open(&a->fit, grid, ret, &why);
    if (s == STATUS_OK)
        return EXIT_SUCCESS;
    log_error("%s", why != NULL ? why : status_text(s));
    return s == STATUS_NO_MEMORY ? EXIT_FAILURE : EXIT_USAGE;
}

/* Ends of colours as asked for, by the names of bands that the fit has. */
static int settle_ranges(const struct arguments *a, const struct map_fit *fit,
                         struct map_contents *contents)
{
    size_t bands = map_fit_bands(fit) - 1;
    for (size_t i = 0; i < bands; i++)
        contents->band[i].range[0] = contents->band[i].range[1] = NAN;
    for (size_t k = 0; k < a->ranges; k++) {
        size_t n = strcspn(a->range[k], "="), i = 0;
        while (i < bands && (strlen(map_fit_band_name(fit, i)) != n ||
                             strncmp(map_fit_band_name(fit, i), a->range[k], n) != 0))
            i++;
        if (i == bands) {
            log_error("--range: this map has no band '%.*s'", (int)n, a->range[k]);
            return EXIT_USAGE;
        }
        double *range = contents->band[i].range;
        (void)two_numbers(a->range[k] + n + 1, &range[0], &range[1]);
    }
    return EXIT_SUCCESS;
}

/* CUBE-map beside CUBE.hdr, unless it is said otherwise. */
static const char *prefix_of(const struct arguments *a, char text[MAP_FILE_PATH_SIZE])
{
    size_t n = strlen(a->path);
    if (a->out != NULL)
        return a->out;
    if (n > 4 && strcasecmp(a->path + n - 4, ".hdr") == 0)
        n -= 4;
    snprintf(text, MAP_FILE_PATH_SIZE, "%.*s-map", (int)n, a->path);
    return text;
}

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* The pixels, the pictures and the header of a map that is open.  A signal on the way stops it
 * where it can be gone on with. */
static enum status fill(const struct arguments *a, struct map_file *file, struct map_report *report,
                        struct map_contents *contents)
{
    struct progress_bar bar;
    struct progress progress = progress_bar_begin(&bar, "map");
    size_t before = file->done;
    double began = now();
    enum status s = map_run(file, report->cube, report->grid, report->fit, a->threads, &progress);
    report->seconds = now() - began;
    report->lines = file->done - before;
    if (s == STATUS_OK)
        s = map_pictures_make(file, report->fit, report->pictures, a->threads, contents);
    if (s == STATUS_OK && !progress_go_on(&progress, file->lines, file->lines))
        s = STATUS_CANCELLED;
    if (s == STATUS_OK)
        s = map_out_finish(report, file);
    else if (bar.terminal && bar.shown > 0.0)
        fputc('\n', stderr);
    if (s == STATUS_CANCELLED || (s != STATUS_OK && file->done > 0))
        log_info("%s has %zu of %zu lines; the same command with --resume%s goes on from there",
                 file->part, file->done, file->lines, a->force ? " in place of --force" : "");
    map_file_close(file);
    progress_bar_end(&bar); /* a signal that came takes its course */
    return s;
}

/* From this share of pixels on that the model does not explain, it is worth a word. */
#define STRANGE_SHARE 0.95

static uint64_t flagged(const struct map_contents *c, unsigned flag)
{
    size_t i = 0;
    while (flag >> i != 1)
        i++;
    return c->flagged[i];
}

/* A cube read as what it is not looks like nothing, or like no skin at all. */
static bool has_skin(const struct map_report *report)
{
    static const char what[] = "'interleave', 'byte order', 'data type', 'header offset' of the "
                               "header, and --scale";
    const struct map_contents *c = report->contents;
    uint64_t strange = flagged(c, MAP_RESIDUAL_TOO_LARGE);
    if (c->fitted == 0 && c->pixels > flagged(c, MAP_IGNORED)) {
        log_error("%s: no pixel is a spectrum of skin: all have R <= 0 or above %g, or no number; "
                  "are %s right?",
                  report->cube->path, MAP_R_MAX, what);
        return false;
    }
    if (c->fitted > 0 && (double)strange >= STRANGE_SHARE * (double)c->fitted)
        log_warning("%s: in %.1f %% of the pixels the fit leaves more than noise explains; "
                    "measured skin wants --refine=skin; else, are %s right?",
                    report->cube->path, 100.0 * (double)strange / (double)c->fitted, what);
    return true;
}

/* The map file, begun or gone on with, and what comes of it. */
static int make(const struct arguments *a, const struct cube_file *cube,
                const struct band_grid *grid, const struct map_fit *fit,
                struct map_contents *contents)
{
    struct map_file file = { .samples = cube->header.samples,
                             .lines = cube->header.lines,
                             .bands = map_fit_bands(fit),
                             .replace = a->force,
                             .go_on = a->resume };
    struct map_report report = { .cube = cube,
                                 .grid = grid,
                                 .fit = fit,
                                 .options = &a->fit,
                                 .contents = contents,
                                 .file = &file,
                                 .pictures = !a->no_pictures };
    char prefix[MAP_FILE_PATH_SIZE], *key = map_out_key(&report);
    const char *name = prefix_of(a, prefix);
    file.key = key;
    enum status s = map_run_check_names(name, cube);
    if (s == STATUS_OK && report.pictures && !a->force && !a->resume)
        s = map_pictures_look(name, fit);
    if (s == STATUS_OK)
        s = map_file_open(name, &file);
    bool was_whole = s == STATUS_OK && file.done == file.lines && file.fd < 0;
    if (was_whole)
        log_info("%s is whole already; there is nothing to go on with", file.image);
    if (s == STATUS_OK && !was_whole)
        s = fill(a, &file, &report, contents);
    if (s == STATUS_OK && !was_whole)
        map_out_report(&report, a->format);
    free(key);
    return out_exit(s == STATUS_OK && (was_whole || has_skin(&report)));
}

static int map_cube(struct arguments *a, struct cube_file *cube)
{
    static struct band_grid grid;
    static struct map_contents contents;
    struct envi_fault fault;
    struct map_fit *fit = NULL;
    if (cube_file_open(a->path, a->data, cube) != STATUS_OK)
        return EXIT_FAILURE;
    int exit_status = settle_values(a, cube);
    if (exit_status != EXIT_SUCCESS)
        return exit_status;
    if (band_grid_init(&cube->header, a->lo_nm, a->hi_nm, &grid, &fault) != STATUS_OK) {
        log_error("%s: %s", cube->path, fault.text);
        return EXIT_FAILURE;
    }
    exit_status = open_fit(a, &grid, &fit);
    if (exit_status == EXIT_SUCCESS)
        exit_status = settle_ranges(a, fit, &contents);
    if (exit_status == EXIT_SUCCESS)
        exit_status = make(a, cube, &grid, fit, &contents);
    map_fit_close(fit);
    return exit_status;
}

int cmd_map(int argc, char **argv)
{
    static const struct argp argp = {
        options,
        parse,
        "CUBE.hdr",
        "Maps of the skin in a hyperspectral cube (ENVI: float32 or uint16; bil, bip or bsq): "
        "melanin Cm, its blend Bm, blood Ch, their standard errors, and what the fit leaves, as an "
        "ENVI cube NAME.img with NAME.hdr and as pictures NAME-Cm.png ...\v"
        "Bands within --nm are taken as they are where they stand evenly by 5 to 30 nm, else laid "
        "on a grid of 10 nm.  Pixels without a value, with R <= 0 or above 1.5 are left out: no "
        "number in the map, grey in the pictures.  What Ctrl-C or a full disk stopped goes on with "
        "--resume, to the same bytes.\n\n"
        "Examples:\n"
        "  skinspec map hand.hdr --specular sce\n"
        "  skinspec map hand.hdr --specular sci --surface 0.04 --out /tmp/hand --json\n"
        "  skinspec map hand.hdr --specular sce --refine=skin --range Cm=0:0.1\n",
        NULL,
        NULL,
        NULL
    };
    static struct cube_file cube;
    struct arguments a = { .fit = { .model = model_find("two-layer"),
                                    .wish = refine_wish_none(),
                                    .epidermis_mm = NAN,
                                    .scale = NAN,
                                    .surface = NAN },
                           .lo_nm = BAND_GRID_LO,
                           .hi_nm = BAND_GRID_HI,
                           .threads = parallel_cores() };
    cube.fd = -1;
    a.fit.wish.kind = REFINE_THREE;
    option_parse(&argp, "map", argc, argv, &a);
    int exit_status = map_cube(&a, &cube);
    cube_file_close(&cube);
    return exit_status;
}
