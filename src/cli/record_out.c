/* record_out.c - one record as a page or as a line. */
#include "cli/record_out.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "cli/colour_row.h"
#include "cli/match_out.h"
#include "cli/member.h"
#include "cli/plot.h"
#include "cli/refined_out.h"
#include "station/wire.h"

/* ---- flags -------------------------------------------------------------------------- */

/* Tokens that records and matches carry, in words. */
static const struct {
    const char *name, *text;
} known_flags[] = {
    { "sci_below_sce", "less light with the mirror reflection than without; check the port" },
    { "spread", "the shots differ more than skin does; lift the probe between them" },
    { "outlier", "a shot was left out: it lies far from the others" },
    { "redness_falls", "the skin blanched under the probe; lift it and press more lightly" },
    { "single", "only one shot: nothing is known of its spread" },
    { "calibration_old", "a calibration was due when this was measured" },
    { "drift", "the last check of the instrument against its tile failed ('skinspec check')" },
    { "not_refined", "the match could not be refined; the station's log says why" },
    { "lease_expired", "the instrument was no longer held when the last shot came" },
    { "battery_low", "the instrument's battery is low; charge it" },
    { "lamp_weak", "the instrument's lamp flashed weakly" },
    { "temperature", "the instrument was colder or warmer than it should be" },
    { "over_range", "brighter than the instrument can measure" },
    { "conditions_differ", "the instrument was not set as for its calibration or its target" },
    { "Cm_at_limit", "Cm is at an end of the table: the truth may lie beyond" },
    { "Bm_at_limit", "Bm is at an end of the table: the truth may lie beyond" },
    { "Ch_at_limit", "Ch is at an end of the table: the truth may lie beyond" },
    { "Bm_undetermined", "without melanin there is nothing to blend" },
    { "tie", "another row of the table is just as near" },
    { "poor_fit", "no skin of the table explains this spectrum" },
    { "no_colour", "these bands give no colour, so there is no dE00" },
    { "bands_zeroed", "the stated surface was more than the reading in some band" },
};

static const char *flag_text(const char *name)
{
    for (size_t i = 0; i < sizeof known_flags / sizeof *known_flags; i++)
        if (strcmp(known_flags[i].name, name) == 0)
            return known_flags[i].text;
    return "";
}

static void print_flags(const cJSON *flags)
{
    const cJSON *one;
    cJSON_ArrayForEach(one, flags)
    {
        const char *name = cJSON_GetStringValue(one);
        const char *text = name != NULL ? flag_text(name) : "";
        if (name != NULL)
            printf("  beware   %s%s%s\n", name, *text != '\0' ? ": " : "", text);
    }
}

const char *record_out_flags(const cJSON *flags, char text[RECORD_FLAGS_SIZE])
{
    const cJSON *one;
    size_t used = 0;
    text[0] = '\0';
    cJSON_ArrayForEach(one, flags)
    {
        const char *name = cJSON_GetStringValue(one);
        if (name == NULL || used + strlen(name) + 2 > RECORD_FLAGS_SIZE)
            continue;
        used += (size_t)snprintf(text + used, RECORD_FLAGS_SIZE - used, "%s%s", used > 0 ? " " : "",
                                 name);
    }
    return text;
}

/* ---- a page ------------------------------------------------------------------------- */

static void print_origin(const struct store_record *r)
{
    printf("\nrecord %" PRId64 "  %s\n", r->seq, r->id);
    printf("  taken    %s", r->taken_at);
    if (*r->operator_name != '\0')
        printf(" by %s", r->operator_name);
    if (*r->instrument.model != '\0')
        printf(", %s%s%s", r->instrument.model, *r->instrument.serial != '\0' ? " " : "",
               r->instrument.serial);
    if (!isnan(r->aperture_mm))
        printf(", %g mm", r->aperture_mm);
    printf(", %s", specular_name(r->specular));
    if (!isnan(r->surface))
        printf(" (sci less %g)", r->surface);
    if (r->replicates > 0)
        printf(", %zu shot%s", r->replicates, r->replicates == 1 ? "" : "s");
    putchar('\n');
    if (*r->site != '\0')
        printf("  site     %s\n", r->site);
    if (*r->subject != '\0')
        printf("  subject  %s\n", r->subject);
    if (*r->corrects != '\0')
        printf("  corrects %s\n", r->corrects);
    putchar('\n');
}

void record_out_match(const cJSON *match)
{
    struct wire_match m;
    if (wire_read_match(match, &m) != STATUS_OK) {
        puts("  match    none");
        return;
    }
    if (m.is_refined) {
        refined_out_page(match, &m);
        return;
    }
    match_out_skin(&m.match.row);
    printf("  distance %.4g by %s", m.match.distance, match_by_name(m.match.by));
    if (!isnan(m.match.dE00))
        printf(", dE00 %.2f", m.match.dE00);
    if (!isnan(m.match.rms))
        printf(", rms %.4f", m.match.rms);
    printf("; table %s\n", m.table);
}

/* A record has room for all replicates: too much for the stack. */
static struct store_record *read_record(const cJSON *record)
{
    struct store_record *r = calloc(1, sizeof *r);
    if (r == NULL)
        out_of_memory();
    if (wire_read_record(record, r) == STATUS_OK)
        return r;
    log_error("the station sent a record that this program cannot read");
    free(r);
    return NULL;
}

enum status record_out(const cJSON *record)
{
    struct plot_style style = plot_style_of(stdout);
    struct store_record *r = read_record(record);
    const cJSON *match = member(record, "match");
    if (r == NULL)
        return STATUS_FORMAT;
    print_origin(r);
    plot_spectrum(stdout, style, &r->spectrum);
    if (!isnan(r->ITA))
        colour_row_print(style, r->Lab, r->sRGB, false, r->ITA);
    record_out_match(match);
    print_flags(member(record, "flags"));
    if (member(match, "refine") == NULL) /* else it was told with the skin */
        print_flags(member(match, "flags"));
    free(r);
    return STATUS_OK;
}

/* ---- a line ------------------------------------------------------------------------- */

/* UTF-8, padded or cut to so many characters, and two blanks. */
static void print_cell(const char *text, int width)
{
    for (; *text != '\0' && width > 0; width--) {
        do
            putchar(*text++);
        while (((unsigned char)*text & 0xC0) == 0x80);
    }
    printf("%*s", width + 2, "");
}

void record_out_head(void)
{
    puts("   seq  taken (UTC)          instrument    site               L*     a*     b*     ITA"
         "      Cm    Bm      Ch  flags");
}

/* Blank where it was not measured. */
static void print_number(int width, int digits, double x)
{
    if (isnan(x))
        printf("%*s", width, "");
    else
        printf("%*.*f", width, digits, x);
}

void record_out_line(const cJSON *record)
{
    char flags[RECORD_FLAGS_SIZE], more[RECORD_FLAGS_SIZE];
    const cJSON *match = member(record, "match"), *Lab = member(record, "Lab");
    const char *serial = member_text(record, "serial");
    printf("%6" PRId64 "  %-19.19s  ", member_integer(record, "seq"),
           member_text(record, "taken_at"));
    print_cell(*serial != '\0' ? serial : member_text(record, "instrument"), 12);
    print_cell(member_text(record, "site"), 14);
    for (int i = 0; i < 3; i++) {
        const cJSON *one = cJSON_GetArrayItem(Lab, i);
        print_number(i == 0 ? 5 : 7, 1, cJSON_IsNumber(one) ? one->valuedouble : NAN);
    }
    print_number(8, 1, member_number(record, "ITA"));
    print_number(8, 4, member_number(match, "Cm"));
    print_number(6, 2, member_number(match, "Bm"));
    print_number(8, 4, member_number(match, "Ch"));
    record_out_flags(member(record, "flags"), flags);
    record_out_flags(member(match, "flags"), more);
    printf("  %s%s%s\n", flags, *flags != '\0' && *more != '\0' ? " " : "", more);
}
