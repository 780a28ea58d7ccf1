/* match_out.c - one answer printed. */
#include "cli/match_out.h"

#include <stdio.h>
#include <string.h>

enum { DIGITS = 9 };

void match_columns_init(struct match_columns *columns, size_t k)
{
    static const char *const fixed[] = { "Cm",  "Bm",       "Ch", "L",     "a",   "b",    "dE00",
                                         "rms", "distance", "by", "table", "row", "flags" };
    static const char *const ranked[] = { "row", "Cm", "Bm", "Ch", "distance" };
    columns->n = 0;
    for (size_t i = 0; i < sizeof fixed / sizeof *fixed; i++)
        columns->name[columns->n++] = fixed[i];
    for (size_t rank = 1; rank < k; rank++) { /* the first is the answer itself */
        for (size_t i = 0; i < 5; i++) {
            char *name = columns->text[rank][i];
            snprintf(name, sizeof columns->text[rank][i], "%s_%u", ranked[i],
                     (unsigned)(rank + 1) % 1000u);
            columns->name[columns->n++] = name;
        }
    }
}

static const char *flags_text(unsigned flags, char text[160])
{
    text[0] = '\0';
    for (size_t i = 0; i < MATCH_FLAG_COUNT; i++) {
        if (!(flags & 1u << i))
            continue;
        if (text[0] != '\0')
            strcat(text, ";");
        strcat(text, match_flag_name(i)); /* eight names of at most 16 bytes */
    }
    return text;
}

void match_out_csv(struct out *out, const struct table *table, const struct match *match,
                   const struct nearest_hit *hits, size_t k)
{
    char flags[160];
    const struct table_row *row = &match->row;
    const double number[] = { row->Cm,     row->Bm,     row->Ch,    row->Lab[0],    row->Lab[1],
                              row->Lab[2], match->dE00, match->rms, match->distance };
    for (size_t i = 0; i < sizeof number / sizeof *number; i++)
        out_number(out, number[i], DIGITS);
    out_text(out, match_by_name(match->by));
    out_text(out, table->name);
    out_number(out, (double)match->row_index + 1.0, 17);
    out_text(out, flags_text(match->flags, flags));
    for (size_t rank = 1; rank < k; rank++) {
        if (rank >= match->found) { /* a table of fewer rows than asked for */
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

static void add_nearest(cJSON *object, const struct table *table, const struct match *match,
                        const struct nearest_hit *hits)
{
    cJSON *nearest = cJSON_AddArrayToObject(object, "nearest");
    for (size_t i = 0; i < match->found; i++) {
        struct table_row near;
        cJSON *one = cJSON_CreateObject();
        table_get(table, hits[i].row, &near);
        out_member(one, "row", (double)hits[i].row + 1.0);
        out_member(one, "Cm", near.Cm);
        out_member(one, "Bm", near.Bm);
        out_member(one, "Ch", near.Ch);
        out_member(one, "distance", hits[i].distance);
        cJSON_AddItemToArray(nearest, one);
    }
}

void match_out_json(cJSON *object, const struct table *table, const struct match *match,
                    const struct nearest_hit *hits, size_t k)
{
    const struct table_row *row = &match->row;
    out_member(object, "Cm", row->Cm);
    out_member(object, "Bm", row->Bm);
    out_member(object, "Ch", row->Ch);
    out_member(object, "L", row->Lab[0]);
    out_member(object, "a", row->Lab[1]);
    out_member(object, "b", row->Lab[2]);
    out_member(object, "dE00", match->dE00);
    out_member(object, "rms", match->rms);
    out_member(object, "distance", match->distance);
    cJSON_AddStringToObject(object, "by", match_by_name(match->by));
    cJSON_AddStringToObject(object, "table", table->name);
    cJSON_AddStringToObject(object, "table_sha256", table->sha256);
    if (k > 0)
        add_nearest(object, table, match, hits);
    cJSON *flags = cJSON_AddArrayToObject(object, "flags");
    for (size_t i = 0; i < MATCH_FLAG_COUNT; i++)
        if (match->flags & 1u << i)
            cJSON_AddItemToArray(flags, cJSON_CreateString(match_flag_name(i)));
}
