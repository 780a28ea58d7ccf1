/* cmd_coefficients.c - Eqs. 4-6 for one skin, by wavelength. */
#include <stdlib.h>

#include "cli/command.h"
#include "cli/options.h"
#include "cli/out.h"

static const struct argp_option options[] = {
    OPTION_ROWS_SKIN, OPTION_ROW_GAMMA, OPTION_ROW_BANDS, OPTION_ROWS_JSON, { 0 },
};

static error_t parse(int key, char *text, struct argp_state *state)
{
    return option_parse_skin_bands(key, text, state, state->input);
}

enum { COLUMNS = 5 };
static const char *const column_names[COLUMNS] = { "wavelength_nm", "sigma_a_epidermis",
                                                   "sigma_a_dermis", "sigma_s_prime_epidermis",
                                                   "sigma_s_prime_dermis" };

static void print_header(struct out *out)
{
    for (int c = 0; c < COLUMNS; c++)
        out_text(out, column_names[c]);
    out_row(out);
}

static void print_band(struct out *out, double nm, const struct medium *m, size_t i)
{
    const double value[COLUMNS] = { nm, m->sigma_a_epidermis[i], m->sigma_a_dermis[i],
                                    m->sigma_s_prime_epidermis[i], m->sigma_s_prime_dermis[i] };
    if (out->format == OUT_PLAIN) {
        for (int c = 0; c < COLUMNS; c++)
            out_number(out, value[c], 9);
        out_row(out);
        return;
    }
    cJSON *object = cJSON_CreateObject();
    for (int c = 0; c < COLUMNS; c++)
        out_member(object, column_names[c], value[c]);
    out_object(out, object);
}

int cmd_coefficients(int argc, char **argv)
{
    static const struct argp argp = {
        options,
        parse,
        "",
        "Absorption and reduced scattering of a skin's two layers, mm^-1, by wavelength "
        "(Eqs. 4-6; the dermis has half of Eq. 6).\v"
        "Example: skinspec coefficients --cm 0.03 --bm 0.7 --ch 0.01\n",
        NULL,
        NULL,
        NULL
    };
    struct option_skin_bands a = option_skin_bands_default();
    static struct chromophores chromophores;
    static double scratch[MEDIUM_SCRATCH(SPECTRUM_MAX_BANDS)];
    struct medium medium;
    struct out out;
    option_parse(&argp, "coefficients", argc, argv, &a);
    /* Both cannot fail on what the options let through. */
    if (chromophores_init(a.bands.first_nm, a.bands.step_nm, a.bands.n, &chromophores) !=
            STATUS_OK ||
        tissue_medium(&a.tissue, &chromophores, scratch, &medium) != STATUS_OK)
        return EXIT_FAILURE;
    out_begin(&out, a.format);
    if (a.format == OUT_PLAIN)
        print_header(&out);
    for (size_t i = 0; i < medium.n; i++)
        print_band(&out, a.bands.first_nm + (double)i * a.bands.step_nm, &medium, i);
    return out_end(&out) == STATUS_OK ? EXIT_SUCCESS : EXIT_FAILURE;
}
