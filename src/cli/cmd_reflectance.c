/* cmd_reflectance.c - the spectrum of one skin by a model, as a spectrum file. */
#include <stdio.h>
#include <stdlib.h>

#include "base/log.h"
#include "base/number.h"
#include "base/parallel.h"
#include "cli/command.h"
#include "cli/options.h"
#include "cli/out.h"
#include "cli/progress_bar.h"
#include "optics/model.h"
#include "optics/monte_carlo.h"

enum { OPTION_MODEL = OPTION_OWN, OPTION_PHOTONS, OPTION_SEED };

#define SEED_MAX ((uint64_t)1 << 53) /* JSON's numbers hold it */

static const struct argp_option options[] = {
    { "model", OPTION_MODEL, "M", 0,
      "two-layer (the default), half-space, kubelka-munk, transport-4, -8, -16, -32 or monte-carlo",
      0 },
    OPTION_ROWS_SKIN,
    OPTION_ROWS_TISSUE,
    OPTION_ROW_ETA,
    OPTION_ROW_BANDS,
    { "photons", OPTION_PHOTONS, "N", 0, "Walks a band of monte-carlo (10000)", 0 },
    { "seed", OPTION_SEED, "S", 0, "Of monte-carlo's random numbers (1)", 0 },
    OPTION_ROWS_JSON,
    { 0 },
};

struct arguments {
    const struct model *model;
    struct option_skin_bands skin;
    struct monte_carlo_run run;
    const char *walks; /* the option given that is for monte-carlo alone, or NULL */
};

/* A spectrum, and where it was found by walks their standard errors. */
struct answer {
    double R[SPECTRUM_MAX_BANDS], error[SPECTRUM_MAX_BANDS];
};

static bool walks(const struct arguments *a)
{
    return a->model->reflectance == monte_carlo_reflectance;
}

static const struct model *spectral_model(struct argp_state *state, const char *name)
{
    const struct model *model = option_model(state, name);
    if (model->reflectance == NULL)
        argp_error(state, "--model: '%s' has no spectra, only R, G, B; use two-layer", name);
    return model;
}

static error_t parse(int key, char *text, struct argp_state *state)
{
    struct arguments *a = state->input;
    switch (key) {
    case OPTION_MODEL:
        a->model = spectral_model(state, text);
        return 0;
    case OPTION_PHOTONS:
        a->run.photons =
            option_count(state, "photons", text, MONTE_CARLO_MIN_PHOTONS, MONTE_CARLO_MAX_PHOTONS);
        a->walks = "photons";
        return 0;
    case OPTION_SEED:
        a->run.seed = option_count(state, "seed", text, 0, SEED_MAX);
        a->walks = "seed";
        return 0;
    case ARGP_KEY_END:
        if (a->walks != NULL && !walks(a))
            argp_error(state, "--%s is for --model monte-carlo only; '%s' draws no random numbers",
                       a->walks, a->model->name);
        break;
    default:
        break;
    }
    return option_parse_skin_bands(key, text, state, &a->skin);
}

/* The names of the bands, after what they hold. */
static void print_bands(struct out *out, const struct option_bands *bands, const char *what)
{
    char text[NUMBER_TEXT_SIZE], name[NUMBER_TEXT_SIZE + 32];
    for (size_t i = 0; i < bands->n; i++) {
        snprintf(name, sizeof name, "%s%s", what,
                 number_format_exact(bands->first_nm + (double)i * bands->step_nm, text));
        out_text(out, name);
    }
}

static void print_csv(struct out *out, const struct arguments *a, const struct answer *answer)
{
    static const char *const names[] = { "model", "Cm", "Bm", "Ch", "epidermis_mm", "specular" };
    const double parameter[] = { a->skin.tissue.Cm, a->skin.tissue.Bm, a->skin.tissue.Ch,
                                 a->skin.tissue.epidermis_mm };
    char text[NUMBER_TEXT_SIZE];
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        out_text(out, names[i]);
    print_bands(out, &a->skin.bands, "");
    if (walks(a))
        print_bands(out, &a->skin.bands, "standard_error_");
    out_row(out);
    out_text(out, a->model->name);
    for (size_t i = 0; i < sizeof parameter / sizeof *parameter; i++)
        out_text(out, number_format_exact(parameter[i], text));
    out_text(out, specular_name(SPECULAR_SCE));
    for (size_t i = 0; i < a->skin.bands.n; i++)
        out_number(out, answer->R[i], 9);
    for (size_t i = 0; i < a->skin.bands.n && walks(a); i++)
        out_number(out, answer->error[i], 3);
    out_row(out);
}

static cJSON *to_json(const struct arguments *a, const struct answer *answer)
{
    cJSON *object = cJSON_CreateObject(), *spectrum = cJSON_CreateObject();
    cJSON_AddStringToObject(object, "model", a->model->name);
    out_member(object, "Cm", a->skin.tissue.Cm);
    out_member(object, "Bm", a->skin.tissue.Bm);
    out_member(object, "Ch", a->skin.tissue.Ch);
    out_member(object, "epidermis_mm", a->skin.tissue.epidermis_mm);
    cJSON_AddStringToObject(object, "specular", specular_name(SPECULAR_SCE));
    out_member(spectrum, "first_nm", a->skin.bands.first_nm);
    out_member(spectrum, "step_nm", a->skin.bands.step_nm);
    cJSON_AddItemToObject(spectrum, "values", out_numbers(answer->R, a->skin.bands.n));
    cJSON_AddItemToObject(object, "spectrum", spectrum);
    if (walks(a)) {
        cJSON_AddItemToObject(object, "standard_error",
                              out_numbers(answer->error, a->skin.bands.n));
        out_member(object, "photons", (double)a->run.photons);
        out_member(object, "seed", (double)a->run.seed);
    }
    return object;
}

static enum status compute(const struct arguments *a, struct answer *ret)
{
    static struct chromophores chromophores;
    static double scratch[MEDIUM_SCRATCH(SPECTRUM_MAX_BANDS)];
    struct medium m;
    enum status s = chromophores_init(a->skin.bands.first_nm, a->skin.bands.step_nm,
                                      a->skin.bands.n, &chromophores);
    if (s == STATUS_OK)
        s = tissue_medium(&a->skin.tissue, &chromophores, scratch, &m);
    if (s != STATUS_OK)
        return s;
    if (!walks(a))
        return a->model->reflectance(&m, ret->R);
    struct progress_bar bar;
    struct progress progress = progress_bar_begin(&bar, a->model->name);
    struct monte_carlo_run run = a->run;
    run.progress = &progress;
    s = monte_carlo_skin(&m, &run, ret->R, ret->error, NULL, NULL);
    progress_bar_end(&bar);
    return s;
}

int cmd_reflectance(int argc, char **argv)
{
    static const struct argp argp = {
        options,
        parse,
        "",
        "Diffuse reflectance of a skin per incident light, without the mirror reflection (what an "
        "SCE measurement gives), as a spectrum file.\v"
        "Model monte-carlo gives the standard error of each band as well: columns "
        "standard_error_NM, "
        "member standard_error.  It is the same for the same --photons and --seed, on any number "
        "of "
        "cores.\n\n"
        "Example: skinspec reflectance --cm 0.03 --bm 0.7 --ch 0.01 | skinspec match -\n",
        NULL,
        NULL,
        NULL
    };
    struct arguments a = {
        .model = model_find("two-layer"),
        .skin = option_skin_bands_default(),
        .run = { MONTE_CARLO_PHOTONS, MONTE_CARLO_SEED, parallel_cores(), NULL },
    };
    static struct answer answer;
    struct out out;
    option_parse(&argp, "reflectance", argc, argv, &a);
    enum status s = compute(&a, &answer);
    if (s != STATUS_OK) { /* the options let nothing through that could fail */
        log_error("%s", status_text(s));
        return EXIT_FAILURE;
    }
    out_begin(&out, a.skin.format);
    if (a.skin.format == OUT_PLAIN)
        print_csv(&out, &a, &answer);
    else
        out_object(&out, to_json(&a, &answer));
    return out_end(&out) == STATUS_OK ? EXIT_SUCCESS : EXIT_FAILURE;
}
