/* match_out.c - one answer printed. */
#include "cli/match_out.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "station/wire.h"

enum { DIGITS = 9, FLAGS_SIZE = 1024 };

/* ---- columns ------------------------------------------------------------------------ */

static void add(struct match_columns *columns, const char *const *names, size_t n)
{
    for (size_t i = 0; i < n; i++)
        columns->name[columns->n++] = names[i];
}

/* The parameters that are told of: all of them of the skin fit. */
static size_t parameters(enum refine_kind kind)
{
    return kind == REFINE_THREE ? SKIN_CH + 1 : SKIN_PARAMETERS;
}

static void add_refined(struct match_columns *columns, enum refine_kind kind)
{
    static const char *const ends[] = { "se", "lo", "hi" };
    for (size_t i = 0; i < parameters(kind); i++)
        columns->name[columns->n++] = skin_parameter_name(i);
    for (size_t i = 0; i < parameters(kind); i++) {
        for (size_t j = 0; j < 3; j++) {
            char *name = columns->refined[i][j];
            snprintf(name, sizeof columns->refined[i][j], "%s_%s", skin_parameter_name(i), ends[j]);
            columns->name[columns->n++] = name;
        }
    }
}

static void add_ranked(struct match_columns *columns, size_t k)
{
    static const char *const ranked[] = { "row", "Cm", "Bm", "Ch", "distance" };
    for (size_t rank = 1; rank < k; rank++) { /* the first is the answer itself */
        for (size_t i = 0; i < 5; i++) {
            char *name = columns->text[rank][i];
            snprintf(name, sizeof columns->text[rank][i], "%s_%u", ranked[i],
                     (unsigned)(rank + 1) % 1000u);
            columns->name[columns->n++] = name;
        }
    }
}

void match_columns_init(struct match_columns *columns, enum refine_kind kind, size_t k)
{
    static const char *const nearest[] = { "Cm",  "Bm",       "Ch", "L",     "a",   "b",    "dE00",
                                           "rms", "distance", "by", "table", "row", "flags" };
    static const char *const fitted[] = { "L",        "a",          "b",          "dE00",
                                          "rms",      "chi_square", "degrees",    "p",
                                          "noise",    "placement",  "by",         "table",
                                          "row",      "nearest_Cm", "nearest_Bm", "nearest_Ch",
                                          "distance", "flags" };
    columns->n = 0;
    if (kind == REFINE_NOT) {
        add(columns, nearest, sizeof nearest / sizeof *nearest);
    } else {
        add_refined(columns, kind);
        add(columns, fitted, sizeof fitted / sizeof *fitted);
    }
    add_ranked(columns, k);
}

/* ---- fields ------------------------------------------------------------------------- */

/* Tokens into text, a semicolon between. */
static void add_flags(char *text, size_t size, unsigned flags, const char *(*name)(size_t i),
                      size_t n)
{
    for (size_t i = 0; i < n; i++) {
        size_t used = strlen(text);
        if (flags & 1u << i)
            snprintf(text + used, size - used, "%s%s", used > 0 ? ";" : "", name(i));
    }
}

/* The rows after the first: row, parameters, distance. */
static void out_ranked(struct out *out, const struct table *table, const struct nearest_hit *hits,
                       size_t found, size_t k)
{
    for (size_t rank = 1; rank < k; rank++) {
        if (rank >= found) { /* a table of fewer rows than asked for */
            for (int i = 0; i < 5; i++)
                out_text(out, "");
            continue;
        }
        struct table_row near;
        table_get(table, hits[rank].row, &near);
        out_number(out, (double)hits[rank].row + 1.0, 17);
        out_number(out, near.Cm, DIGITS);
        out_number(out, near.Bm, DIGITS);
        out_number(out, near.Ch, DIGITS);
        out_number(out, hits[rank].distance, DIGITS);
    }
}

static void out_numbers_of(struct out *out, const double *x, size_t n)
{
    for (size_t i = 0; i < n; i++)
        out_number(out, x[i], DIGITS);
}

void match_out_csv(struct out *out, const struct table *table, const struct match *match,
                   const struct nearest_hit *hits, size_t k)
{
    char flags[FLAGS_SIZE] = "";
    const struct table_row *row = &match->row;
    const double number[] = { row->Cm,     row->Bm,     row->Ch,    row->Lab[0],    row->Lab[1],
                              row->Lab[2], match->dE00, match->rms, match->distance };
    add_flags(flags, sizeof flags, match->flags, match_flag_name, MATCH_FLAG_COUNT);
    out_numbers_of(out, number, sizeof number / sizeof *number);
    out_text(out, match_by_name(match->by));
    out_text(out, table->name);
    out_number(out, (double)match->row_index + 1.0, 17);
    out_text(out, flags);
    out_ranked(out, table, hits, match->found, k);
}

void match_out_refined_csv(struct out *out, const struct table *table,
                           const struct refined_match *match, const struct nearest_hit *hits,
                           size_t k)
{
    char flags[FLAGS_SIZE] = "";
    const struct refined *r = &match->refined;
    const struct match *nearest = &match->nearest;
    size_t n = parameters(match->wish.kind);
    const double fit[] = { match->Lab[0],
                           match->Lab[1],
                           match->Lab[2],
                           r->dE00,
                           r->rms,
                           r->chi_square,
                           (double)r->degrees,
                           r->degrees > 0 ? r->chi_square_p : (double)NAN,
                           r->noise.white,
                           r->noise.placement };
    const double row[] = { nearest->row.Cm, nearest->row.Bm, nearest->row.Ch, nearest->distance };
    out_numbers_of(out, r->value, n);
    for (size_t i = 0; i < n; i++) { /* nothing to say of one that was held */
        bool free = (r->free & 1u << i) != 0;
        out_number(out, free ? r->se[i] : (double)NAN, DIGITS);
        out_number(out, free ? r->lo[i] : (double)NAN, DIGITS);
        out_number(out, free ? r->hi[i] : (double)NAN, DIGITS);
    }
    out_numbers_of(out, fit, sizeof fit / sizeof *fit);
    out_text(out, match_by_name(nearest->by));
    out_text(out, table->name);
    out_number(out, (double)nearest->row_index + 1.0, 17);
    out_numbers_of(out, row, sizeof row / sizeof *row);
    add_flags(flags, sizeof flags, r->flags, refine_flag_name, REFINE_FLAG_COUNT);
    add_flags(flags, sizeof flags, nearest->flags & (MATCH_NO_COLOUR | MATCH_BANDS_ZEROED),
              match_flag_name, MATCH_FLAG_COUNT);
    out_text(out, flags);
    out_ranked(out, table, hits, nearest->found, k);
}

/* ---- objects ------------------------------------------------------------------------ */

const char *const match_out_members[] = {
    "Cm",         "Bm",      "Ch",   "SO2",   "epidermis_mm", "scattering",   "L",
    "a",          "b",       "dE00", "rms",   "distance",     "by",           "table",
    "refine",     "model",   "se",   "fixed", "repeat_se",    "table_sha256", "interval",
    "chi_square", "degrees", "p",    "noise", "residual",     "second",       "nearest",
    "words",      "flags",   "id",   "error", "spectrum"
};
const size_t match_out_members_n = sizeof match_out_members / sizeof *match_out_members;

/* Its numbers are finite: only memory can be wanting. */
static void move_members(enum status s, cJSON *made, cJSON *object)
{
    if (s != STATUS_OK)
        out_of_memory();
    while (made->child != NULL) {
        cJSON *member = cJSON_DetachItemViaPointer(made, made->child);
        cJSON_AddItemToObject(object, member->string, member);
    }
    cJSON_Delete(made);
}

void match_out_json(cJSON *object, const struct table *table, const struct match *match,
                    const struct nearest_hit *hits, size_t k)
{
    cJSON *made = NULL;
    enum status s = wire_match(table, match, hits, k, &made);
    move_members(s, made, object);
}

void match_out_refined_json(cJSON *object, const struct table *table,
                            const struct refined_match *match, const struct nearest_hit *hits,
                            size_t k)
{
    cJSON *made = NULL;
    enum status s = wire_refined_match(table, match, hits, k, &made);
    move_members(s, made, object);
}

void match_out_skin(const struct table_row *row)
{
    printf("  skin     Cm %.4f  Bm %.2f  Ch %.4f   melanin %.2f %%, blood %.2f %%\n", row->Cm,
           row->Bm, row->Ch, 100.0 * row->Cm, 100.0 * row->Ch);
}
