/* match_stream.h - all rows of an input answered on all cores, in their order, in bounded memory.
 */
#ifndef SKINSPEC_CLI_MATCH_STREAM_H
#define SKINSPEC_CLI_MATCH_STREAM_H

#include "cli/answers.h"
#include "cli/match_rows.h"

struct match_stream_options {
    unsigned threads;
    bool strict;     /* stop at the first bad row */
    bool header;     /* begin with a line of column names */
    const char *out; /* a file; NULL: standard output */
    enum answers_mode mode;
};

/* The exit status.  Ctrl-C, SIGTERM and SIGHUP stop it between rows: what is done is written, how
 * to go on is said, and the signal then takes its usual course. */
int match_stream(struct match_rows *rows, struct spectra *spectra, enum out_format format,
                 const struct match_stream_options *options);

#endif
