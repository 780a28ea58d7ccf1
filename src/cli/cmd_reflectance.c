/* cmd_reflectance.c - the spectrum of one skin by a model, as a spectrum file. */
#include <stdio.h>
#include <stdlib.h>

#include "base/log.h"
#include "base/number.h"
#include "cli/command.h"
#include "cli/options.h"
#include "cli/out.h"
#include "optics/model.h"

enum { OPTION_MODEL = OPTION_OWN };

static const struct argp_option options[] = {
    { "model", OPTION_MODEL, "M", 0, "two-layer (the default), half-space or kubelka-munk", 0 },
    OPTION_ROWS_SKIN,
    OPTION_ROWS_TISSUE,
    OPTION_ROW_ETA,
    OPTION_ROW_BANDS,
    OPTION_ROWS_JSON,
    { 0 },
};

struct arguments {
    const struct model *model;
    struct option_skin_bands skin;
};

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
    if (key != OPTION_MODEL)
        return option_parse_skin_bands(key, text, state, &a->skin);
    a->model = spectral_model(state, text);
    return 0;
}

static void print_csv(struct out *out, const struct arguments *a, const double *R)
{
    static const char *const names[] = { "model", "Cm", "Bm", "Ch", "epidermis_mm", "specular" };
    const double parameter[] = { a->skin.tissue.Cm, a->skin.tissue.Bm, a->skin.tissue.Ch,
                                 a->skin.tissue.epidermis_mm };
    char text[NUMBER_TEXT_SIZE];
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        out_text(out, names[i]);
    for (size_t i = 0; i < a->skin.bands.n; i++)
        out_text(out, number_format_exact(
                          a->skin.bands.first_nm + (double)i * a->skin.bands.step_nm, text));
    out_row(out);
    out_text(out, a->model->name);
    for (size_t i = 0; i < sizeof parameter / sizeof *parameter; i++)
        out_text(out, number_format_exact(parameter[i], text));
    out_text(out, specular_name(SPECULAR_SCE));
    for (size_t i = 0; i < a->skin.bands.n; i++)
        out_number(out, R[i], 9);
    out_row(out);
}

static cJSON *to_json(const struct arguments *a, const double *R)
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
    cJSON_AddItemToObject(spectrum, "values", out_numbers(R, a->skin.bands.n));
    cJSON_AddItemToObject(object, "spectrum", spectrum);
    return object;
}

int cmd_reflectance(int argc, char **argv)
{
    static const struct argp argp = {
        options,
        parse,
        "",
        "Diffuse reflectance of a skin per incident light, without the mirror reflection (what an "
        "SCE measurement gives), as a spectrum file.\v"
        "Example: skinspec reflectance --cm 0.03 --bm 0.7 --ch 0.01 | skinspec match -\n",
        NULL,
        NULL,
        NULL
    };
    struct arguments a = { model_find("two-layer"), option_skin_bands_default() };
    static struct chromophores chromophores;
    static double scratch[MEDIUM_SCRATCH(SPECTRUM_MAX_BANDS)], R[SPECTRUM_MAX_BANDS];
    struct out out;
    option_parse(&argp, "reflectance", argc, argv, &a);
    enum status s = chromophores_init(a.skin.bands.first_nm, a.skin.bands.step_nm, a.skin.bands.n,
                                      &chromophores);
    if (s == STATUS_OK)
        s = model_reflectance(a.model, &a.skin.tissue, &chromophores, scratch, R);
    if (s != STATUS_OK) { /* the options let nothing through that could fail */
        log_error("%s", status_text(s));
        return EXIT_FAILURE;
    }
    out_begin(&out, a.skin.format);
    if (a.skin.format == OUT_PLAIN)
        print_csv(&out, &a, R);
    else
        out_object(&out, to_json(&a, R));
    return out_end(&out) == STATUS_OK ? EXIT_SUCCESS : EXIT_FAILURE;
}
