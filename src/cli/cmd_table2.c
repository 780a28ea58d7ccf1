/* cmd_table2.c - the paper's Table 2 beside what its own procedure gives. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/log.h"
#include "cli/command.h"
#include "cli/options.h"
#include "cli/out.h"
#include "optics/paper.h"

enum { GROUPS = 4, CHANNELS = 3, COLUMNS = 5 };

static const double column_Cm[COLUMNS] = { 0.005, 0.03, 0.1, 0.3, 0.4 };

/* As printed; the paper does not name its rows and columns: docs/physics.md. */
static const struct group {
    double Bm, Ch;
    double printed[CHANNELS][COLUMNS];
} groups[GROUPS] = {
    { 1.0,
      0.001,
      { { 0.3016, 0.1542, 0.0951, 0.0605, 0.0537 },
        { 0.2319, 0.1258, 0.0792, 0.0509, 0.0452 },
        { 0.1795, 0.1092, 0.0709, 0.0462, 0.0412 } } },
    { 0.7,
      0.01,
      { { 0.2566, 0.1577, 0.1018, 0.0658, 0.0585 },
        { 0.1937, 0.1250, 0.0821, 0.0536, 0.0477 },
        { 0.1289, 0.0981, 0.0693, 0.0467, 0.0418 } } },
    { 0.3,
      0.05,
      { { 0.1643, 0.1387, 0.1055, 0.0737, 0.0663 },
        { 0.1295, 0.1080, 0.0813, 0.0565, 0.0508 },
        { 0.0785, 0.0717, 0.0598, 0.0449, 0.0409 } } },
    { 0.0,
      0.1,
      { { 0.1276, 0.1197, 0.1035, 0.0803, 0.0737 },
        { 0.1023, 0.0933, 0.0777, 0.0580, 0.0529 },
        { 0.0608, 0.0580, 0.0520, 0.0422, 0.0392 } } },
};

static const char *const channel_names[CHANNELS] = { "R", "G", "B" };

static const struct argp_option options[] = { OPTION_ROWS_JSON, { 0 } };

static error_t parse(int key, char *text, struct argp_state *state)
{
    enum out_format *format = state->input;
    switch (key) {
    case ARGP_KEY_ARG:
        option_unexpected(state, text);
        break;
    default:
        return option_format(key, format) ? 0 : ARGP_ERR_UNKNOWN;
    }
    return 0;
}

typedef double results[GROUPS][CHANNELS][COLUMNS];

static enum status compute(results computed)
{
    for (int g = 0; g < GROUPS; g++) {
        for (int c = 0; c < COLUMNS; c++) {
            struct tissue t = tissue_of(column_Cm[c], groups[g].Bm, groups[g].Ch);
            double rgb[CHANNELS];
            enum status s = paper_rgb(&t, rgb);
            if (s != STATUS_OK)
                return s;
            for (int i = 0; i < CHANNELS; i++)
                computed[g][i][c] = rgb[i];
        }
    }
    return STATUS_OK;
}

static long four_decimals(double x)
{
    return lround(1e4 * x);
}

static void print_plain(results computed)
{
    int same = 0;
    puts("Table 2 of the paper: total diffuse reflectance (Eq. 9), printed / computed here.\n");
    fputs(" Bm   Ch        Cm", stdout);
    for (int c = 0; c < COLUMNS; c++)
        printf("  %-15g", column_Cm[c]);
    putchar('\n');
    for (int g = 0; g < GROUPS; g++) {
        for (int i = 0; i < CHANNELS; i++) {
            printf("%4g %6g    %s   ", groups[g].Bm, groups[g].Ch, channel_names[i]);
            for (int c = 0; c < COLUMNS; c++) {
                double printed = groups[g].printed[i][c], x = computed[g][i][c];
                int equal = four_decimals(printed) == four_decimals(x);
                same += equal;
                printf("  %.4f / %.4f%s", printed, x, equal ? " " : "*");
            }
            putchar('\n');
        }
    }
    printf("\n%d of %d entries are the same at the four printed decimals.\n", same,
           GROUPS * CHANNELS * COLUMNS);
    for (int g = 0; g < GROUPS; g++)
        for (int i = 0; i < CHANNELS; i++)
            for (int c = 0; c < COLUMNS; c++)
                if (four_decimals(groups[g].printed[i][c]) != four_decimals(computed[g][i][c]))
                    printf("* %s at Bm %g, Ch %g, Cm %g: printed %.4f, computed %.4f, difference "
                           "%+.4f: a misprint in the paper.\n",
                           channel_names[i], groups[g].Bm, groups[g].Ch, column_Cm[c],
                           groups[g].printed[i][c], computed[g][i][c],
                           computed[g][i][c] - groups[g].printed[i][c]);
}

static void print_json(struct out *out, results computed)
{
    for (int g = 0; g < GROUPS; g++)
        for (int i = 0; i < CHANNELS; i++)
            for (int c = 0; c < COLUMNS; c++) {
                cJSON *object = cJSON_CreateObject();
                out_member(object, "Bm", groups[g].Bm);
                out_member(object, "Ch", groups[g].Ch);
                cJSON_AddStringToObject(object, "channel", channel_names[i]);
                out_member(object, "Cm", column_Cm[c]);
                out_member(object, "printed", groups[g].printed[i][c]);
                out_member(object, "computed", computed[g][i][c]);
                out_object(out, object);
            }
}

int cmd_table2(int argc, char **argv)
{
    static const struct argp argp = {
        options,
        parse,
        "",
        "The paper's Table 2 recomputed by its own procedure (model `paper`), with the printed "
        "value and the difference.\v"
        "docs/physics.md tells how the procedure was found out.\n",
        NULL,
        NULL,
        NULL
    };
    enum out_format format = OUT_PLAIN;
    results computed;
    struct out out;
    option_parse(&argp, "table2", argc, argv, &format);
    enum status s = compute(computed);
    if (s != STATUS_OK) {
        log_error("%s", status_text(s));
        return EXIT_FAILURE;
    }
    out_begin(&out, format);
    if (format == OUT_PLAIN)
        print_plain(computed);
    else
        print_json(&out, computed);
    return out_end(&out) == STATUS_OK ? EXIT_SUCCESS : EXIT_FAILURE;
}
