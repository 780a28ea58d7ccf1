/* markdown.h - a run as a page: what to conclude, tables, how it was measured. */
#ifndef SKINSPEC_TRIAL_MARKDOWN_H
#define SKINSPEC_TRIAL_MARKDOWN_H

#include <stdio.h>

#include "trial/trial.h"

/* picture: path of the SVG made in the same run, shown by its last part; NULL: none.  What to
 * conclude is computed from the figures of the run.  The caller looks at ferror(). */
void trial_markdown(FILE *stream, const struct trial *trial, const char *machine,
                    const char *picture);

#endif
