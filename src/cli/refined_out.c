/* refined_out.c - values with their intervals, and sentences. */
#include "cli/refined_out.h"

#include <math.h>
#include <stdio.h>

#include "cli/member.h"
#include "cli/record_out.h"

static const struct {
    const char *name, *unit;
    int digits;
} shown[SKIN_PARAMETERS] = {
    [SKIN_CM] = { "Cm", "", 4 },
    [SKIN_BM] = { "Bm", "", 2 },
    [SKIN_CH] = { "Ch", "", 4 },
    [SKIN_SO2] = { "SO2", "", 2 },
    [SKIN_EPIDERMIS_MM] = { "epidermis", " mm", 3 },
    [SKIN_SCATTERING_A] = { "scattering a", " /mm", 2 },
    [SKIN_SCATTERING_B] = { "b", "", 2 },
};

static void print_parameter(const struct refined *r, size_t i)
{
    int digits = shown[i].digits;
    printf("%s %.*f", shown[i].name, digits, r->value[i]);
    if (r->free & 1u << i)
        printf(" (%.*f .. %.*f)", digits, r->lo[i], digits, r->hi[i]);
    printf("%s", shown[i].unit);
}

/* Those from first to last that are told of; a blank line's worth of nothing where none is. */
static void print_parameters(const struct refined *r, size_t first, size_t last)
{
    const char *between = "";
    for (size_t i = first; i <= last; i++) {
        if (isnan(r->value[i]))
            continue;
        printf("%s", between);
        print_parameter(r, i);
        between = "  ";
    }
}

void refined_out_skin(const struct refined_match *match)
{
    print_parameters(&match->refined, SKIN_CM, SKIN_CH);
}

static void print_fit(const struct refined_match *match)
{
    const struct refined *r = &match->refined;
    printf("  fit      %s: rms %.4f", refine_kind_name(match->wish.kind), r->rms);
    if (!isnan(r->dE00))
        printf(", dE00 %.2f", r->dE00);
    printf(", chi-square %.1f of %zu degrees", r->chi_square, r->degrees);
    if (r->degrees > 0)
        printf(", p %.2g", r->chi_square_p);
    printf("\n  noise    %.4g a band, ", r->noise.white);
    if (match->wish.kind == REFINE_SKIN && match->source != NOISE_STATED)
        printf("the skin differs between placements (%s)\n", noise_source_name(match->source));
    else
        printf("%.4g placement (%s)\n", r->noise.placement, noise_source_name(match->source));
}

static void print_nearest(const struct wire_match *m)
{
    const struct table_row *row = &m->match.row;
    printf("  nearest  Cm %.4f  Bm %.2f  Ch %.4f: row %zu, distance %.4g by %s; table %s\n",
           row->Cm, row->Bm, row->Ch, m->match.row_index + 1, m->match.distance,
           match_by_name(m->match.by), m->table);
}

static void print_second(const struct refined *r)
{
    if (!r->has_second)
        return;
    printf("  second   Cm %.4f  Bm %.2f  Ch %.4f: chi-square %.1f\n", r->second[SKIN_CM],
           r->second[SKIN_BM], r->second[SKIN_CH], r->second_chi_square);
}

void refined_out_page(const cJSON *match, const struct wire_match *m)
{
    const struct refined_match *refined = &m->refined;
    const cJSON *words;
    char flags[RECORD_FLAGS_SIZE];
    fputs("  skin     ", stdout);
    refined_out_skin(refined);
    if (!isnan(refined->refined.value[SKIN_SO2])) {
        fputs("\n           ", stdout);
        print_parameters(&refined->refined, SKIN_SO2, SKIN_SCATTERING_B);
    }
    putchar('\n');
    print_fit(refined);
    print_nearest(m);
    print_second(&refined->refined);
    cJSON_ArrayForEach(words, member(match, "words"))
    {
        if (cJSON_IsString(words))
            printf("  beware   %s\n", words->valuestring);
    }
    if (*record_out_flags(member(match, "flags"), flags) != '\0')
        printf("  flags    %s\n", flags);
}

void refined_out_line(const cJSON *match, const struct refined_match *refined)
{
    const cJSON *words;
    refined_out_skin(refined);
    cJSON_ArrayForEach(words, member(match, "words"))
    {
        if (cJSON_IsString(words))
            printf("; %s", words->valuestring);
    }
    putchar('\n');
}
