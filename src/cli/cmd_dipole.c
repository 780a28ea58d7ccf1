/* cmd_dipole.c - Eqs. 7 and 9 for one medium. */
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/log.h"
#include "base/number.h"
#include "cli/command.h"
#include "cli/options.h"
#include "cli/out.h"
#include "optics/dipole.h"

enum { OPTION_SIGMA_A = OPTION_OWN, OPTION_SIGMA_S_PRIME, OPTION_R_MM, OPTION_CUMULATIVE };

static const struct argp_option options[] = {
    { "sigma-a", OPTION_SIGMA_A, "X", 0, "Absorption, mm^-1, 0 or more", 0 },
    { "sigma-s-prime", OPTION_SIGMA_S_PRIME, "X", 0, "Reduced scattering, mm^-1, above 0", 0 },
    OPTION_ROW_ETA,
    { "r-mm", OPTION_R_MM, "R", 0, "Also R_d at this distance from the entry point, mm^-2", 0 },
    { "cumulative", OPTION_CUMULATIVE, NULL, 0,
      "With --r-mm: also the share of light that leaves within R", 0 },
    { "json", OPTION_JSON, NULL, 0, "Print a JSON object", 0 },
    { "ndjson", OPTION_NDJSON, NULL, 0, "The same", 0 },
    { 0 },
};

struct arguments {
    double sigma_a, sigma_s_prime, r_mm;
    struct tissue tissue; /* its eta */
    unsigned given;
    bool cumulative, json;
};

static error_t parse(int key, char *text, struct argp_state *state)
{
    struct arguments *a = state->input;
    switch (key) {
    case OPTION_SIGMA_A:
        a->sigma_a = option_number(state, "sigma-a", text, 0.0, DIPOLE_COEFFICIENT_MAX);
        break;
    case OPTION_SIGMA_S_PRIME:
        a->sigma_s_prime = option_number(state, "sigma-s-prime", text, DIPOLE_COEFFICIENT_MIN,
                                         DIPOLE_COEFFICIENT_MAX);
        break;
    case OPTION_R_MM:
        a->r_mm = option_number(state, "r-mm", text, 0.0, 1e100);
        break;
    case OPTION_CUMULATIVE:
        a->cumulative = true;
        break;
    case OPTION_JSON:
    case OPTION_NDJSON:
        a->json = true;
        break;
    case ARGP_KEY_ARG:
        option_unexpected(state, text);
        break;
    case ARGP_KEY_END:
        if (isnan(a->sigma_a) || isnan(a->sigma_s_prime))
            argp_error(state, "--%s is missing", isnan(a->sigma_a) ? "sigma-a" : "sigma-s-prime");
        if (a->cumulative && isnan(a->r_mm))
            argp_error(state, "--cumulative needs --r-mm");
        break;
    default:
        return option_skin(key, text, state, &a->tissue, &a->given) ? 0 : ARGP_ERR_UNKNOWN;
    }
    return 0;
}

static void print(const struct arguments *a, const char *name, const char *unit, double x,
                  cJSON *object)
{
    char text[NUMBER_TEXT_SIZE];
    if (a->json)
        out_member(object, name, x);
    else
        printf("%-13s %s%s\n", name, number_format_exact(x, text), unit);
}

int cmd_dipole(int argc, char **argv)
{
    static const struct argp argp = {
        options,
        parse,
        "",
        "Diffuse reflectance of a semi-infinite medium: the total (Eq. 9) and, "
        "with --r-mm, its radial profile (Eq. 7).\v"
        "Example: skinspec dipole --sigma-a 0.1 --sigma-s-prime 1 --eta 1.3\n",
        NULL,
        NULL,
        NULL
    };
    struct arguments a = { NAN, NAN, NAN, tissue_of(0.0, 0.0, 0.0), 0, false, false };
    struct dipole d;
    struct out out;
    double x;
    option_parse(&argp, "dipole", argc, argv, &a);
    if (dipole_init(a.sigma_a, a.sigma_s_prime, a.tissue.eta, &d) != STATUS_OK) {
        log_error("%s", status_text(STATUS_RANGE));
        return EXIT_FAILURE;
    }
    cJSON *object = cJSON_CreateObject();
    out_begin(&out, a.json ? OUT_NDJSON : OUT_PLAIN);
    print(&a, "R_total", "", dipole_total(&d), object);
    if (!isnan(a.r_mm)) {
        dipole_profile(&d, 1, &a.r_mm, &x);
        print(&a, "R_d", " mm^-2", x, object);
    }
    if (a.cumulative) {
        dipole_cumulative(&d, 1, &a.r_mm, &x);
        print(&a, "R_cumulative", "", x, object);
    }
    if (a.json)
        out_object(&out, object);
    else
        cJSON_Delete(object);
    return out_end(&out) == STATUS_OK ? EXIT_SUCCESS : EXIT_FAILURE;
}
