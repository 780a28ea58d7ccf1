/* row_out.h - what the outputs of `convert` and `match` have in common: the
 * columns carried through, the id, and the place of a row that is bad. */
#ifndef SKINSPEC_CLI_ROW_OUT_H
#define SKINSPEC_CLI_ROW_OUT_H

#include "cli/out.h"
#include "cli/spectra.h"

/* CSV header: id (the file's or our row number), carried columns, the command's
 * own, "error".  A carried column whose name is one of ours becomes input_NAME. */
void row_out_header(struct out *out, const struct spectra *spectra, const char *const *names,
                    size_t n);

/* CSV fields before the command's own. */
void row_out_carried(struct out *out, const struct spectra *spectra, const struct spectra_row *row);

/* A whole row that is bad: n empty fields and the error, or {"id","error"}. */
void row_out_bad(struct out *out, const struct spectra *spectra, const struct spectra_row *row,
                 size_t n);

/* A new JSON object with the row's id as it is there, or the row number. */
cJSON *row_out_object(const struct spectra_row *row);

/* The other members of a line of NDJSON, but for its spectrum, behind those of the answer; one
 * whose name is one of ours, of which there are n, becomes input_NAME. */
void row_out_members(cJSON *object, const struct spectra_row *row, const char *const *names,
                     size_t n);

#endif
