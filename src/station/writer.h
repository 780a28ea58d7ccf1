/* writer.h - the one thread that writes station.db.
 *
 * It takes what has queued up as one group: one transaction, one sync (group commit).
 * A job is done() on the loop's thread only after that commit, so whoever answers a
 * client there answers for what is on the disk. */
#ifndef SKINSPEC_STATION_WRITER_H
#define SKINSPEC_STATION_WRITER_H

#include <stdbool.h>
#include <stdint.h>

#include "db/store.h"
#include "db/store_check.h"
#include "station/job.h"

enum { WRITER_GROUP_MAX = 256 };

enum write_kind {
    WRITE_RECORD,
    WRITE_CALIBRATION,
    WRITE_SUBJECT,
    WRITE_CHECK_TILE,
    WRITE_CHECK,
    /* Alone, between groups. */
    WRITE_OPEN, /* open the store, or see whether it can be written: `opened` out */
    WRITE_FORGET,
    WRITE_FINISH_ERASING,
    WRITE_PRUNE,
    WRITE_RESTART_WAL,
    WRITE_BEGIN_ANEW, /* after damage; `opened` out, also of one found sound: STATUS_NOT_FOUND */
    WRITE_FENCES,     /* reserve some: `fences` in and out */
};

struct write_job {
    struct job job; /* done() is the caller's; run() is not used */
    enum write_kind kind;
    union {
        struct store_record *record; /* borrowed until done() */
        struct store_calibration calibration;
        struct store_check_tile *tile; /* borrowed, as the next */
        struct store_check *check;
        struct store_subject *subject; /* borrowed; FORGET reads its id alone */
        struct {
            char station_id[STORE_UUID_SIZE];
        } opened;
        struct {
            int64_t n, above; /* above: also out, raised to the highest on record */
            int64_t first;    /* out, with STATUS_OK */
        } fences;
        bool cut; /* RESTART_WAL: to nothing */
    };
    char who[STORE_TEXT_SIZE]; /* for the audit row */
    /* out */
    enum status status;  /* as in db/store.h; STATUS_READ_ONLY while there is no store to write */
    char bad_member[32]; /* with STATUS_NOT_FOUND, STATUS_RANGE */
    bool known;          /* RECORD, CHECK_TILE, CHECK: the uuid was there */
    bool erased;         /* FORGET, FINISH_ERASING */
    bool restarted;      /* RESTART_WAL */
    bool moved;          /* OPEN, BEGIN_ANEW: why it is STATUS_IO; the files lost their names */
    void *context;       /* the caller's */
};

struct writer;

/* Start the thread.  The claim stays the caller's and outlives the writer; the store is
 * opened by the first job that needs it, and stays open. */
enum status writer_open(struct store_claim *claim, struct inbox *inbox, struct writer **ret);

/* All on one thread, the loop's.  What is asked is collected, and the thread gets all of it
 * at once by writer_hand_over(), which the loop calls before it looks for what is next: the
 * requests of one round are one waking and one commit, even where a commit takes no
 * time in which others could queue up. */
void writer_ask(struct writer *writer, struct write_job *job);
void writer_hand_over(struct writer *writer); /* takes NULL */

/* Write what has been asked, close the store, end the thread.  What is asked later is done
 * with STATUS_CANCELLED.  Takes NULL. */
void writer_stop(struct writer *writer);
void writer_close(struct writer *writer); /* after writer_stop() */

/* What is asked to keep the store in order does not count as a job. */
struct writer_counts {
    uint64_t groups, jobs;
    int64_t longest_us; /* of a group, since the last writer_count() */
    int64_t wal_bytes;  /* after the last job of any kind; 0 before the store is open */
};
struct writer_counts writer_count(struct writer *writer);
struct writer_counts writer_look(struct writer *writer); /* longest_us goes on */

#endif
