/* map_run.h - the pixels of a cube into a map, on all cores, stoppable and gone on with. */
#ifndef SKINSPEC_CLI_MAP_RUN_H
#define SKINSPEC_CLI_MAP_RUN_H

#include "base/progress.h"
#include "base/status.h"
#include "cli/cube_file.h"
#include "cli/map_file.h"
#include "cli/map_fit.h"

/* None of the files of a map with that prefix may be the cube's own.  STATUS_EXISTS, logged. */
enum status map_run_check_names(const char *prefix, const struct cube_file *cube);

/* Lines file->done and on.  Each thread reads, fits and writes pieces of some thousand pixels by
 * itself, so memory does not grow with the cube.  Where it stops, what is done is noted in the
 * file: STATUS_CANCELLED where progress says so; STATUS_IO, STATUS_FULL, STATUS_NO_MEMORY, logged.
 */
enum status map_run(struct map_file *file, const struct cube_file *cube,
                    const struct band_grid *grid, const struct map_fit *fit, unsigned threads,
                    const struct progress *progress);

#endif
