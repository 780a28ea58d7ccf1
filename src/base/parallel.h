/* parallel.h - one loop over independent pieces of work, on several cores.
 *
 * Pieces are numbered; which thread does which is not fixed, so a piece must
 * depend on nothing but its number.  Then the outcome is the same for any
 * number of threads. */
#ifndef SKINSPEC_BASE_PARALLEL_H
#define SKINSPEC_BASE_PARALLEL_H

#include <stddef.h>

#include "base/status.h"

/* worker: 0 .. threads-1, for scratch memory of its own; 0 is the calling thread. */
typedef enum status parallel_piece(size_t piece, unsigned worker, void *context);

/* Cores this process may run on, at least 1, at most PARALLEL_MAX_THREADS. */
enum { PARALLEL_MAX_THREADS = 256 };
unsigned parallel_cores(void);

/* Run all pieces on at most `threads` threads (the calling one among them) and
 * wait.  After a failure no further piece is begun.  Returns the status of the
 * failed piece with the lowest number, else STATUS_OK.  Where threads cannot be
 * started the work is done by those that could. */
enum status parallel_run(size_t pieces, unsigned threads, parallel_piece *run, void *context);

#endif
