/* worker.h - a thread for what takes longer than the loop can wait: reads, exports,
 * checks, tables, checkpoints, long matches.
 *
 * It has a connection of its own to the store, opened when a job first asks for it. */
#ifndef SKINSPEC_STATION_WORKER_H
#define SKINSPEC_STATION_WORKER_H

#include "db/store.h"
#include "station/answer.h"
#include "station/job.h"

struct worker;

/* in_background: it gives way to the other threads where cores are short. */
enum status worker_open(const char *state_folder, bool in_background, struct inbox *inbox,
                        struct worker **ret);
void worker_ask(struct worker *worker, struct job *job);
struct job_queue *worker_queue(struct worker *worker);

/* What is being read ends with STATUS_CANCELLED, and so does what waits and what is asked
 * later (run() gets no reader then); the thread ends.  Takes NULL. */
void worker_stop(struct worker *worker);
void worker_close(struct worker *worker); /* after worker_stop() */

/* ---- for run(), on the worker's thread ---------------------------------------------- */

/* STATUS_NOT_FOUND while there is no store yet; logged by the store. */
enum status worker_reader(struct worker *worker, struct store_reader **ret);

/* The store has been replaced, or reading it failed: the next job opens it anew. */
void worker_forget_reader(struct worker *worker);

struct answer_weights *worker_weights(struct worker *worker);
const char *worker_state_folder(const struct worker *worker);

#endif
