/* store.h - station.db: every reading, kept for good.
 *
 * One thread writes, through a `struct store`; any number read, each with its own
 * `struct store_reader`.  WAL, synchronous=FULL: what store_commit() has returned
 * STATUS_OK for survives a power cut.  Append-only: a correction is a new row that
 * points at the old one.  Measurement, match and audit row are one transaction.
 *
 * Strings are UTF-8 and checked by the caller; "" means absent where a member says
 * so, NAN means not measured.  STATUS_NOT_FOUND, STATUS_EXISTS and STATUS_RANGE about
 * what a caller asked for are answers; every other cause is logged here, once (want of
 * memory not always).
 *
 * The file belongs to the account that made it (0600).  docs/data.md has the SQL,
 * db/audit.h the chain.
 *
 * Within a process that has the store or a reader open nobody else may open and close
 * station.db, its -wal or -shm: closing any descriptor of a file drops all POSIX locks
 * that the process holds on it.  All functions here go through SQLite, which knows. */
#ifndef SKINSPEC_DB_STORE_H
#define SKINSPEC_DB_STORE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/clock.h"
#include "base/spectrum.h"
#include "base/status.h"

enum {
    STORE_UUID_SIZE = 37,
    STORE_TIME_SIZE = CLOCK_TEXT_SIZE,
    STORE_TEXT_SIZE = 256,
    STORE_NOTES_SIZE = 4096,
    STORE_REFINED_SIZE = 32768 /* a residual for each of SPECTRUM_MAX_BANDS is in it */
};
enum { STORE_MAX_REPLICATES = 32 };

/* ---- the claim: one writer ---------------------------------------------------------- */

/* Nobody else writes in this folder while it is held (flock on STATE/lock), whatever is the
 * matter with the store; taken at once, so that a second daemon is told before anything
 * is checked.
 *   STATUS_EXISTS     somebody has it
 *   STATUS_READ_ONLY  no lock can be made there; a reader may still work
 *   STATUS_FULL, STATUS_IO (no such folder), STATUS_NO_MEMORY */
struct store_claim;
enum status store_claim(const char *state_folder, struct store_claim **ret);
void store_claim_release(struct store_claim *claim); /* takes NULL */
const char *store_claim_folder(const struct store_claim *claim);

/* n numbers for leases (fences) that never come again in this folder, whatever becomes of
 * station.db: above all that were reserved in it before, and above `above`, which is the
 * highest on record.  STATE/lock keeps the last of them, synced before *first, the lowest,
 * is set.  STATUS_FULL, STATUS_READ_ONLY, STATUS_IO, and STATUS_RANGE
 * beyond 2^53, logged: none is reserved. */
enum status store_reserve_fences(struct store_claim *claim, int64_t above, int64_t n,
                                 int64_t *first);

/* ---- opening ------------------------------------------------------------------------ */

struct store;

/* The clock, so that tests can set it; NULL means the system's. */
struct store_clock {
    int64_t (*realtime_ms)(void *context); /* since 1970, may step */
    void *context;
};

/* STATE/station.db, made where it is missing, migrated step by step (each one
 * transaction) where it is older.  *ret is set with STATUS_OK only.
 *   STATUS_VERSION   made by a newer program: refused, untouched
 *   STATUS_FORMAT    a foreign file of that name: refused, untouched
 *   STATUS_DAMAGED   corrupt (quick_check), cut short or gone with its -wal left: the
 *                    file, its -wal and -shm were moved aside to
 *                    station.db.damaged-TIME (and -wal, -shm), never deleted, and
 *                    STATE/station.damaged written, which keeps this answer until
 *                    store_begin_anew()
 *   STATUS_READ_ONLY, STATUS_FULL  nothing can be written there
 *   STATUS_IO        failed reads and writes otherwise
 *   STATUS_DB, STATUS_NO_MEMORY
 * clock may be NULL; it is copied.  The claim stays the caller's and outlives the store;
 * one store at a time is opened with it, on any thread. */
enum status store_open_claimed(struct store_claim *claim, const struct store_clock *clock,
                               struct store **ret);

/* Both: with a claim that store_close() gives back.  Statuses of either. */
enum status store_open(const char *state_folder, const struct store_clock *clock,
                       struct store **ret);

/* Takes NULL; drops an open group and checkpoints what it can. */
void store_close(struct store *store);

/* After damage: accept an empty store from here on, with a station id of its own.  Seq
 * goes on above the highest seq that can still be read from the damaged file (1 where
 * none can: a warning says so).  A healthy station.db that was put back by hand
 * is accepted as it is.  STATUS_NOT_FOUND where nothing waits to be accepted; else as
 * above.  The store is closed when it is called. */
enum status store_begin_anew_claimed(struct store_claim *claim);
enum status store_begin_anew(const char *state_folder); /* takes the claim for the time */

const char *store_station_id(const struct store *store); /* random, made with the file */

/* ---- what is kept ------------------------------------------------------------------- */

struct store_instrument {
    char driver[48], maker[48], model[48], serial[48], firmware[48];
};

struct store_calibration {
    char id[STORE_UUID_SIZE]; /* out: UUIDv7 */
    struct store_instrument instrument;
    char step[16];      /* "zero", "white" */
    char tile[48];      /* serial number of the tile, "" */
    double aperture_mm; /* that was set; NAN */
    char operator_name[STORE_TEXT_SIZE];
    char boot_id[STORE_UUID_SIZE]; /* the machine's */
    int64_t boottime_ms;
    char taken_at[STORE_TIME_SIZE]; /* out: RFC 3339 UTC */
};

/* One measurement with everything that belongs to it. */
struct store_record {
    /* out: set by store_add_record() */
    char id[STORE_UUID_SIZE];       /* UUIDv7; never goes back, whatever the clock does */
    int64_t seq;                    /* gap-free from the first */
    char taken_at[STORE_TIME_SIZE]; /* RFC 3339 UTC with milliseconds */

    char uuid[STORE_UUID_SIZE];          /* the client's */
    char parameters_sha256[65];          /* of the request, to tell a retry from a reuse */
    int64_t owner_uid;                   /* account that asked for it; -1: not known */
    char operator_name[STORE_TEXT_SIZE]; /* "" */
    struct store_instrument instrument;  /* all "" for a spectrum that a client sent */
    enum specular specular;
    double aperture_mm; /* NAN */
    size_t replicates;  /* each on the grid of `spectrum`; SCE of all or none, so SCI */
    struct spectrum replicate[STORE_MAX_REPLICATES];     /* SCE as measured; n = 0: none */
    struct spectrum replicate_sci[STORE_MAX_REPLICATES]; /* SCI as measured; n = 0: none */
    const int32_t *raw; /* [raw_n], borrowed: replicates x (sce, sci) x bands, or NULL */
    size_t raw_n;
    double raw_unit;          /* reflectance that a raw 1 stands for; NAN */
    double surface;           /* what was taken off SCI to get `spectrum`; NAN: nothing */
    struct spectrum spectrum; /* the mean that was matched, 1 band or more */
    double XYZ[3], Lab[3];
    int sRGB[3];
    double ITA;
    char ita_scheme[32], illuminant[16], observer[8];
    char calibration_id[STORE_UUID_SIZE]; /* "" */
    int64_t fence;                        /* 0: no lease */
    char subject[STORE_UUID_SIZE], site[STORE_TEXT_SIZE], corrects[STORE_UUID_SIZE]; /* "" */
    char flags[1024];      /* JSON array of tokens */
    char match_json[8192]; /* the match object; "" where there was no match */
    /* The same refined: what stands between the rows (match/refine.h); "": not asked for, or it
     * could not be had. */
    char refined_json[STORE_REFINED_SIZE];
    char table_name[256], table_sha256[65], method[16];
    char boot_id[STORE_UUID_SIZE];
    int64_t boottime_ms;
};

struct store_subject {
    char id[STORE_UUID_SIZE]; /* out: random */
    char label[STORE_TEXT_SIZE], name[STORE_TEXT_SIZE];
    int birth_year; /* 0: not known */
    char notes[STORE_NOTES_SIZE];
    bool forgotten;
};

/* ---- writing: one thread ------------------------------------------------------------ */

/* A group of jobs is one transaction.  Each job is all or nothing on its own
 * (savepoint): one that fails leaves the group and the others as they were, and no gap
 * in seq.  Only a failure that takes the transaction along (a full disk may) loses the
 * group; every later job and the commit then say so, and none of it was kept.  A job
 * outside a group is a group of its own.
 *
 * STATUS_FULL and STATUS_READ_ONLY pass with their cause: the next group may succeed.
 * store_begin() also refuses with STATUS_IO when station.db or its -wal is not the file
 * it was opened as (moved or deleted under the service): close, and open anew.
 * After STATUS_DAMAGED nothing is written any more until the store is opened anew. */
enum status store_begin(struct store *store);

/* The same without savepoints, which cost a record a fifth of its time.  A job that is refused
 * (STATUS_NOT_FOUND, STATUS_EXISTS, STATUS_RANGE) leaves the others as they were here too.  One
 * that fails half way takes the group along, not yet logged: store_must_part() is true, every
 * later job and the commit fail with its status, and all jobs of the group have to be done
 * again in one of store_begin(), where it fails alone. */
enum status store_begin_together(struct store *store);
bool store_must_part(const struct store *store);

enum status store_commit(struct store *store);
void store_rollback(struct store *store);

/* Add a record.  The uuid ("" for none) is looked up first: with the same
 * parameters_sha256 *known is true and the stored id, seq and taken_at are returned;
 * with others STATUS_EXISTS.  STATUS_NOT_FOUND for a subject (forgotten ones too), a
 * calibration or a corrected record that is not there, STATUS_RANGE for spectra that do not
 * fit together: store_bad_member() names the member.  On failure *record is as it was. */
enum status store_add_record(struct store *store, struct store_record *record, bool *known);
enum status store_add_calibration(struct store *store, struct store_calibration *calibration);
/* who: for the audit row. */
enum status store_add_subject(struct store *store, struct store_subject *subject, const char *who);

/* The member that the last STATUS_NOT_FOUND or STATUS_RANGE was about: "subject". */
const char *store_bad_member(const struct store *store);

/* Erase the person for good; measurements stay under the random id.  In one transaction
 * the row goes, its bytes overwritten (secure_delete), and subject_person is written anew,
 * so that no stale copy stays in the file; then the WAL is checkpointed and cut to 0.
 * STATUS_NOT_FOUND.  Commits by itself: call it outside a group.
 *
 * A reader that is in the middle of a statement holds the WAL: then *erased is false,
 * the person is gone for every new reader, and the bytes go with the first
 * store_finish_erasing() after that reader is done, at the latest when the store is closed or
 * opened next.  Not reached: backups, and damaged files that were moved aside. */
enum status store_forget_subject(struct store *store, const char *subject_id, const char *who,
                                 bool *erased);

/* Try again what is left of forgetting; costs nothing where nothing is.  Outside a group.
 * *erased: nothing is left. */
enum status store_finish_erasing(struct store *store, bool *erased);

/* Client uuids older than 30 days are dropped, except that their records stay, and so
 * do the newest 1 000 uuids: a clock that steps must not make a second reading of a
 * retry. */
enum status store_prune(struct store *store);

/* A commit that changes nothing, to see whether one is possible: statuses of a group.
 * Outside a group. */
enum status store_try(struct store *store);

/* station.db or its -wal is no longer the file it was opened as. */
bool store_is_moved(const struct store *store);

/* The highest fence of a stored measurement, 0 without; for store_reserve_fences().  Inside a
 * group as well. */
enum status store_highest_fence(struct store *store, int64_t *ret);

/* ---- checkpoints: any thread, own connection ---------------------------------------- */

struct store_keeper;

/* The store exists.  Not for longer than the file keeps its place: to be closed and opened
 * anew with the store.  STATUS_IO where there is none; else as a reader. */
enum status store_keeper_open(const char *state_folder, struct store_keeper **ret);
void store_keeper_close(struct store_keeper *keeper); /* takes NULL */

/* A PASSIVE checkpoint: neither waits nor makes anyone wait.  *left: pages left in the WAL
 * afterwards, which a reader may hold.  STATUS_FULL, STATUS_READ_ONLY, STATUS_IO: what was
 * committed stays in the WAL, nothing is lost.  STATUS_IO also where the file was moved. */
enum status store_keeper_checkpoint(struct store_keeper *keeper, int *left);

/* Copy what a keeper has left, if it is no work to speak of, and let the next commit begin the
 * WAL anew: under a steady load no PASSIVE checkpoint ever finds it all copied, and it would
 * grow for good.  cut: the file is cut to nothing, as it is anyway when it is large.  Never
 * waits: *restarted is false where a reader holds it.  STATUS_IO also where the file was
 * moved.  On the writer's thread, outside a group. */
enum status store_restart_wal(struct store *store, bool cut, bool *restarted);

/* Size of the WAL of an open store; 0 where it is gone. */
int64_t store_own_wal_bytes(const struct store *store);

/* Size of the WAL, 0 where there is none: for an alarm when a long reader pins it. */
enum status store_wal_bytes(const char *state_folder, int64_t *ret);

/* ---- reading: any thread, own connection -------------------------------------------- */

struct store_reader;

/* Holds no lock and no snapshot between calls.  While STATE/station.damaged stands,
 * the file that was moved aside is opened instead: what can still be read from it is read.
 * A folder that cannot be written is no hindrance as long as the WAL is empty (else
 * STATUS_READ_ONLY).  STATUS_NOT_FOUND where there is no store yet, STATUS_FORMAT,
 * STATUS_VERSION (older ones too: opening the store migrates them), STATUS_DAMAGED, STATUS_IO. */
enum status store_reader_open(const char *state_folder, struct store_reader **ret);
void store_reader_close(struct store_reader *reader); /* takes NULL */

/* From another thread: what the reader is doing ends with STATUS_CANCELLED. */
void store_reader_interrupt(struct store_reader *reader);

/* By id, or by the client's uuid (NULL: not asked) as long as store_prune() left it.
 * raw is NULL in *ret, raw_n its size.  STATUS_NOT_FOUND; after STATUS_DAMAGED *ret may be
 * half filled. */
enum status store_get(struct store_reader *reader, const char *id, const char *uuid,
                      struct store_record *ret);

/* The raw integers of a record, malloc'ed, the caller's; NULL and 0 where it has none.
 * STATUS_NOT_FOUND. */
enum status store_read_raw(struct store_reader *reader, const char *id, int32_t **ret, size_t *n);

/* Which records: all that is asked for holds. */
struct store_query {
    int64_t since_seq;   /* seq is above */
    int64_t until_seq;   /* and not above; 0: the newest at the call */
    const char *subject; /* NULL: all */
    int64_t owner_uid;   /* -1: all */
};

/* Records in order of seq, until the callback returns false.  The callback may take its
 * time: nothing is held while it runs. */
typedef bool store_visit(void *context, const struct store_record *record);
enum status store_list(struct store_reader *reader, const struct store_query *query,
                       store_visit *visit, void *context);

/* As store_station_id(). */
enum status store_read_station_id(struct store_reader *reader, char ret[STORE_UUID_SIZE]);

/* The seq of the newest record, and the highest fence; 0 without. */
enum status store_newest(struct store_reader *reader, int64_t *seq);
enum status store_max_fence(struct store_reader *reader, int64_t *ret);

/* Subjects in the order they were added, those after one ("": from the first), until the
 * callback returns false.  STATUS_NOT_FOUND for an id that is not there. */
typedef bool store_visit_subject(void *context, const struct store_subject *subject);
enum status store_list_subjects(struct store_reader *reader, const char *after_id,
                                store_visit_subject *visit, void *context);

/* Sites that records name, each once. */
typedef bool store_visit_text(void *context, const char *text);
enum status store_list_sites(struct store_reader *reader, store_visit_text *visit, void *context);

/* The last calibration of an instrument for a step; the instrument is known by driver,
 * maker, model and serial, the firmware may have changed.  STATUS_NOT_FOUND. */
enum status store_last_calibration(struct store_reader *reader,
                                   const struct store_instrument *instrument, const char *step,
                                   struct store_calibration *ret);

/* integrity_check, foreign keys, gap-free seq, audit chain from the first row to the last,
 * every row covered by an audit row and as it was (db/audit.h).  Reads everything in one
 * snapshot, which holds the WAL meanwhile.  STATUS_DAMAGED with *ret filled, what[]
 * naming the first thing wrong. */
struct store_verify_report {
    int64_t records, audit_rows, first_seq, last_seq;
    char last_hash[65]; /* of the chain: keep a copy elsewhere to notice a chain made anew */
    char what[STORE_TEXT_SIZE];
};
enum status store_verify(struct store_reader *reader, struct store_verify_report *ret);

#endif
