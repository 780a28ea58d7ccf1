/* cmd_convert.c - spectra -> XYZ, Lab, LCh, sRGB, ITA. */
#include <stdlib.h>

#include "cli/colour_row.h"
#include "cli/command.h"
#include "cli/inputs.h"
#include "cli/options.h"
#include "cli/out.h"
#include "cli/row_out.h"
#include "cli/spectra.h"
#include "colour/lab.h"

static const struct argp_option options[] = {
    { "illuminant", OPTION_ILLUMINANT, "NAME", 0, "A C D50 D55 D65 D75 E FL2 FL7 FL11 LED-B3 (D65)",
      0 },
    { "observer", OPTION_OBSERVER, "DEG", 0, "2 or 10 degrees (10)", 0 },
    { "strict", OPTION_STRICT, NULL, 0, "Stop at the first bad row", 0 },
    OPTION_ROWS_JSON,
    { 0 },
};

struct arguments {
    const char *path;
    enum illuminant illuminant;
    enum observer observer;
    enum out_format format;
    bool strict;
};

static error_t parse(int key, char *text, struct argp_state *state)
{
    struct arguments *a = state->input;
    switch (key) {
    case OPTION_ILLUMINANT:
        a->illuminant = option_illuminant(state, text);
        break;
    case OPTION_OBSERVER:
        a->observer = option_observer(state, text);
        break;
    case OPTION_STRICT:
        a->strict = true;
        break;
    case ARGP_KEY_ARG:
        option_file(state, text, &a->path);
        break;
    case ARGP_KEY_END:
        if (a->path == NULL)
            argp_error(state, "which FILE? '-' reads standard input");
        break;
    default:
        return option_format(key, &a->format) ? 0 : ARGP_ERR_UNKNOWN;
    }
    return 0;
}

static const char *const names[] = { "X", "Y", "Z", "L",       "a",   "b",         "C",      "h",
                                     "R", "G", "B", "clipped", "ITA", "ITA_class", "adapted" };
enum { NAMES = sizeof names / sizeof *names };

static void print_csv(struct out *out, const struct arguments *a, const struct colour_row *c)
{
    enum { DIGITS = 9 };
    for (int i = 0; i < 3; i++)
        out_number(out, c->XYZ[i], DIGITS);
    for (int i = 0; i < 3; i++)
        out_number(out, c->Lab[i], DIGITS);
    for (int i = 1; i < 3; i++)
        out_number(out, c->LCh[i], DIGITS);
    for (int i = 0; i < 3; i++)
        out_number(out, c->sRGB[i], DIGITS);
    out_text(out, c->clipped ? "true" : "false");
    out_number(out, c->ITA, DIGITS);
    out_text(out, lab_ita_class(c->ITA));
    out_text(out, colour_is_adapted(a->illuminant, a->observer) ? "true" : "false");
    out_text(out, "");
    out_row(out);
}

static void print_row(struct out *out, const struct arguments *a, const struct spectra *spectra,
                      const struct spectra_row *row, const struct xyz_weights *weights)
{
    struct colour_row colour;
    if (!row->good) {
        row_out_bad(out, spectra, row, NAMES);
        return;
    }
    colour_row_of(weights, row->spectrum.value, &colour);
    if (out->format == OUT_PLAIN) {
        row_out_carried(out, spectra, row);
        print_csv(out, a, &colour);
    } else {
        cJSON *object = row_out_object(row);
        colour_row_json(object, &colour, colour_is_adapted(a->illuminant, a->observer));
        out_object(out, object);
    }
}

static int convert(const struct arguments *a, struct spectra *spectra,
                   const struct xyz_weights *weights)
{
    struct spectra_row row = { 0 };
    struct out out;
    bool all_good = true;
    enum status s;
    out_begin(&out, a->format);
    row_out_header(&out, spectra, names, NAMES);
    while ((s = spectra_next(spectra, &row)) == STATUS_OK) {
        print_row(&out, a, spectra, &row, weights);
        all_good = all_good && row.good;
        if (a->strict && !row.good)
            break;
    }
    spectra_row_done(&row);
    bool written = out_end(&out) == STATUS_OK;
    return written && all_good && s == STATUS_NOT_FOUND ? EXIT_SUCCESS : EXIT_FAILURE;
}

int cmd_convert(int argc, char **argv)
{
    static const struct argp argp = {
        options,
        parse,
        "FILE",
        "Colour of every spectrum in FILE ('-': standard input): XYZ (Y = 100 for white), L*a*b*, "
        "LCh, sRGB codes and ITA, as CSV unless --json or --ndjson is given.\v"
        "FILE is CSV: a header whose numeric columns are wavelengths in nm (by 10, 5 or 1, "
        "400..700 at least), then one spectrum a row as fractions 0..1.  Other columns are carried "
        "through.  sRGB is adapted to its own white by Bradford; 'adapted' says when another white "
        "than D65 / 2 degrees was used, 'clipped' when the colour lies outside sRGB.\n\n"
        "Example: skinspec convert docs/examples/skin.csv --illuminant D50 --observer 2\n",
        NULL,
        NULL,
        NULL
    };
    struct arguments a = { NULL, ILLUMINANT_D65, OBSERVER_10DEG, OUT_PLAIN, false };
    struct spectra *spectra;
    static struct xyz_weights weights;
    option_parse(&argp, "convert", argc, argv, &a);
    const struct spectra_source source = spectra_source_csv(a.path);
    if (spectra_open(&source, &spectra) != STATUS_OK)
        return EXIT_FAILURE;
    int exit_status = EXIT_FAILURE;
    struct inputs inputs = { 0 };
    inputs_add_file(&inputs, a.path);
    if (inputs_check(&inputs, NULL) == STATUS_OK &&
        colour_weights(spectra, a.illuminant, a.observer, &weights) == STATUS_OK)
        exit_status = convert(&a, spectra, &weights);
    spectra_close(spectra);
    return exit_status;
}
