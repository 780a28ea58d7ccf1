/* match_out.h - the match object: as JSON, as CSV columns, and for a person. */
#ifndef SKINSPEC_CLI_MATCH_OUT_H
#define SKINSPEC_CLI_MATCH_OUT_H

#include "cli/out.h"
#include "cli/row_out.h"
#include "match/match.h"
#include "match/refined_match.h"

/* CSV columns of an answer with the k nearest. */
enum { MATCH_OUT_MAX_K = 100 };
struct match_columns {
    const char *name[48 + 5 * MATCH_OUT_MAX_K];
    size_t n;
    char text[MATCH_OUT_MAX_K][5][16];
    char refined[SKIN_PARAMETERS][3][24];
};
void match_columns_init(struct match_columns *columns, enum refine_kind kind, size_t k);

/* The CSV fields of those columns, without the carried ones and the error. */
void match_out_csv(struct out *out, const struct table *table, const struct match *match,
                   const struct nearest_hit *hits, size_t k);

/* The same of a refined one: each parameter with _se, _lo and _hi, how well it fits, and the row it
 * began with. */
void match_out_refined_csv(struct out *out, const struct table *table,
                           const struct refined_match *match, const struct nearest_hit *hits,
                           size_t k);

/* Members of the match object as the protocol has them; `nearest` only where k > 0. */
void match_out_json(cJSON *object, const struct table *table, const struct match *match,
                    const struct nearest_hit *hits, size_t k);

void match_out_refined_json(cJSON *object, const struct table *table,
                            const struct refined_match *match, const struct nearest_hit *hits,
                            size_t k);

/* Names of those members, whether an answer has them or not. */
extern const char *const match_out_members[];
extern const size_t match_out_members_n;

/* The line "skin  Cm ... blood ..." on standard output. */
void match_out_skin(const struct table_row *row);

#endif
