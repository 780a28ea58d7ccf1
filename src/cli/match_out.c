/* match_out.c - one answer printed. */
#include "cli/match_out.h"

#include <stdio.h>
#include <string.h>

#include "station/wire.h"

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

void match_out_json(cJSON *object, const struct table *table, const struct match *match,
                    const struct nearest_hit *hits, size_t k)
{
    cJSON *made;
    if (wire_match(table, match, hits, k, &made) != STATUS_OK)
        out_of_memory(); /* its numbers are finite: only memory can be wanting */
    while (made->child != NULL) {
        cJSON *member = cJSON_DetachItemViaPointer(made, made->child);
        cJSON_AddItemToObject(object, member->string, member);
    }
    cJSON_Delete(made);
}

void match_out_skin(const struct table_row *row)
{
    printf("  skin     Cm %.4f  Bm %.2f  Ch %.4f   melanin %.2f %%, blood %.2f %%\n", row->Cm,
           row->Bm, row->Ch, 100.0 * row->Cm, 100.0 * row->Ch);
}
