/* reading.h - a request that the worker answers from the store.
 *
 * run() makes the whole line on the worker's thread, so that the loop only sends it. */
#ifndef SKINSPEC_STATION_READING_H
#define SKINSPEC_STATION_READING_H

#include "station/station.h"
#include "station/ticket.h"

struct reading {
    struct job job;
    struct station *station;
    struct ticket ticket;
    /* On the worker's thread: the result, or NULL with *refusal. */
    cJSON *(*read)(struct reading *reading, struct worker *worker, struct refusal *refusal);
    void (*free)(struct reading *reading); /* what `own` holds; NULL: nothing */
    void *own;

    char id[STORE_UUID_SIZE];
    bool kiosk; /* sees only what `uid` made */
    int64_t uid;
    bool damaged; /* the store was known to be, when it was asked: no news then */

    enum status made; /* of line */
    struct line line;
};

/* For a client's request, with own_size bytes of zeroes as `own` (0: NULL).  NULL where
 * there is no memory, and the ticket is refused then. */
struct reading *reading_make(struct station *station, const struct client *client,
                             const struct request *request, size_t own_size);

/* The same for a ticket, with everybody's records in sight. */
struct reading *reading_of_ticket(struct station *station, const struct ticket *ticket,
                                  size_t own_size);

void reading_ask(struct reading *reading, struct worker *worker);

/* done() of each, for one that has more to do on the loop's thread first. */
void reading_done(struct job *job);

/* For one whose run() and done() were replaced, to look at the record first: now as
 * usual; or not at all. */
void reading_ask_again(struct reading *reading, struct worker *worker);
void reading_free(struct reading *reading);

/* For read(): the store's reader, or NULL with *refusal. */
struct store_reader *reading_store(struct worker *worker, struct refusal *refusal);

/* The refusal for what the store said; it is opened anew next time where that may help. */
void reading_failed(struct worker *worker, enum status status, struct refusal *refusal);

/* The record of reading->id that the client may see, to be freed by free(); NULL with
 * *refusal. */
struct store_record *reading_record(struct reading *reading, struct worker *worker,
                                    struct refusal *refusal);

#endif
