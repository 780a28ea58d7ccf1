/* match_rows.h - a row of spectra answered and printed: what all rows share, and what a thread
 * needs of its own. */
#ifndef SKINSPEC_CLI_MATCH_ROWS_H
#define SKINSPEC_CLI_MATCH_ROWS_H

#include "cli/match_out.h"
#include "cli/match_scene.h"
#include "cli/spectra.h"
#include "match/refined_match.h"

/* What was asked of all rows. */
struct match_wish {
    bool by_given, rgb_float;
    enum match_by by;
    size_t k; /* 0: not asked for */
    struct refine_wish refine;
    enum specular specular;
    double surface; /* NAN: not given */
    enum out_format format;
};

/* Said where neither FILE nor an option says whether it is SCE or SCI. */
extern const char match_rows_tell_specular[];

struct match_rows;

/* For the spectra of a file, and a table that outlives it.  What is wrong for all rows is logged
 * once; *exit_status (EXIT_FAILURE or EXIT_USAGE) says whose matter it is, and NULL is returned. */
struct match_rows *match_rows_open(const struct match_wish *wish, const struct spectra *spectra,
                                   const struct table *table, int *exit_status);
/* By a scene that was prepared for the bands of the file, and outlives it.  NULL, logged: no
 * memory. */
struct match_rows *match_rows_open_scene(const struct match_wish *wish,
                                         const struct spectra *spectra, struct match_scene *scene);
void match_rows_close(struct match_rows *rows); /* takes NULL */

/* Whether each row is fitted, which takes as long as many look-ups. */
bool match_rows_have_fits(const struct match_rows *rows);

/* Columns, or what begins the array; and what ends it after so many objects. */
void match_rows_begin(const struct match_rows *rows, bool header, struct text *into);
void match_rows_end(const struct match_rows *rows, size_t objects, struct text *into);

/* Of one thread. */
struct match_scratch;
struct match_scratch *match_scratch_open(void); /* NULL: no memory */
void match_scratch_close(struct match_scratch *scratch);

/* What became of the rows of a piece. */
struct match_printed {
    struct text text, messages; /* answers; what is to be logged, a NUL behind each */
    size_t rows;
    enum status status; /* STATUS_OK; STATUS_CANCELLED after the first bad row, where that is to be
                         * so; else why no more can be read */
    bool bad;           /* some row is */
};
void match_printed_done(struct match_printed *printed);

/* All rows of a piece; `objects` came before it.  strict: up to the first bad one.  Many threads
 * may call it, each with a scratch of its own. */
void match_rows_print(struct match_rows *rows, struct spectra_piece *piece, size_t objects,
                      bool strict, struct match_scratch *scratch, struct match_printed *ret);

#endif
