/* main.c - exact nearest rows held against brute force: QUERIES questions near a table's surface
 * and as many off it, at 10 thousand, 100 thousand and a million rows.
 *
 *     search [QUERIES [SIDE ...]]
 *
 * Without arguments 10 000 of each sort and tables of 22, 47 and 100 values an axis.  Ends with
 * status 1 where a row is wrong. */
#include <stdio.h>
#include <stdlib.h>

#include "match/nearest.h"
#include "tests/support/brute.h"
#include "tests/support/skin_queries.h"

enum { K = 3 };

static void check_no_memory(bool there)
{
    if (there)
        return;
    fprintf(stderr, "search: no memory for a table of this size\n");
    exit(2);
}

static size_t search(const struct table *table, enum match_by by, struct skin_query *query,
                     size_t queries)
{
    size_t wrong = 0;
    struct nearest *nearest;
    struct brute *brute = brute_open(table, by);
    check_no_memory(brute != NULL && nearest_open(table, by, &nearest) == STATUS_OK);
    for (int off = 0; off < 2; off++) {
        skin_queries(table, off == 1, queries, query);
        struct brute_verdict v = brute_judge(brute, nearest, query, queries, K);
        printf("%8zu rows  by %-9s %-5s k = %d  %zu queries: %zu wrong, %zu the same but for "
               "rounding  (brute force %.1f s)\n",
               table->n, match_by_name(by), off == 1 ? "off" : "near", K, queries, v.wrong,
               v.rounding, v.seconds);
        fflush(stdout);
        wrong += v.wrong;
    }
    nearest_close(nearest);
    brute_close(brute);
    return wrong;
}

int main(int argc, char **argv)
{
    static const size_t sides[] = { 22, 47, 100 };
    static const enum match_by ways[] = { MATCH_LAB, MATCH_SPECTRUM, MATCH_RGB };
    size_t queries = argc > 1 ? strtoul(argv[1], NULL, 10) : 10000, wrong = 0;
    size_t tables = argc > 2 ? (size_t)argc - 2 : sizeof sides / sizeof *sides;
    if (queries == 0) {
        fprintf(stderr, "usage: search [QUERIES [SIDE ...]]\n");
        return 2;
    }
    struct skin_query *query = calloc(queries, sizeof *query);
    check_no_memory(query != NULL);
    for (size_t i = 0; i < tables; i++) {
        struct table table;
        check_no_memory(skin_table(argc > 2 ? strtoul(argv[2 + i], NULL, 10) : sides[i], &table) ==
                        STATUS_OK);
        for (size_t way = 0; way < sizeof ways / sizeof *ways; way++)
            wrong += search(&table, ways[way], query, queries);
        table_done(&table);
    }
    free(query);
    printf("%zu wrong\n", wrong);
    return wrong == 0 ? 0 : 1;
}
