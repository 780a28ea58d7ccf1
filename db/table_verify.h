/* table_verify.h - rebuild a table from its own meta rows and compare.
 *
 * The same build on the same machine gives the same bits; any other gives the
 * same numbers to TABLE_VERIFY_TOLERANCE (spectra, which are float32, to one unit
 * in their last place).  The difference is reported either way. */
#ifndef SKINSPEC_DB_TABLE_VERIFY_H
#define SKINSPEC_DB_TABLE_VERIFY_H

#include <stdbool.h>
#include <stddef.h>

#include "base/progress.h"
#include "base/status.h"
#include "match/table.h"

#define TABLE_VERIFY_TOLERANCE 1e-10
#define TABLE_VERIFY_SPECTRUM_ULPS 1.0

struct table_verify_report {
    size_t rows, identical_rows;
    double worst;          /* largest |stored - computed| of parameters and colour */
    double worst_spectrum; /* the same of the spectra, in float32 units in the last place */
    size_t worst_id;       /* row whose difference is the most of what is tolerated, or 0 */
    bool content_hash_matches;
};

/* Reads the file (with all checks and statuses of db/table_file.h, *ret untouched)
 * and recomputes every row.  STATUS_OK: the rows agree within the tolerance;
 * STATUS_DAMAGED: they do not, or the content hash does not match, which is
 * logged; *ret is set in both cases.  STATUS_CANCELLED, STATUS_NO_MEMORY. */
enum status table_verify(const char *path, unsigned threads, const struct progress *progress,
                         struct table_verify_report *ret);

#endif
