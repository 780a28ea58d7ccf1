/* station.h - the daemon's parts and how they meet; for src/station alone.
 *
 *   clients -> serve (one function per method) -> bench, run     instruments
 *                                              -> writer         what is kept
 *                                              -> worker         what is read, or takes long
 *
 * Everything here is on the loop's thread.  A request that cannot be answered at once leaves a
 * ticket behind; its answer goes to the client that is behind the ticket, if it is still
 * there. */
#ifndef SKINSPEC_STATION_STATION_H
#define SKINSPEC_STATION_STATION_H

#include <stdbool.h>
#include <stdint.h>
#include <systemd/sd-event.h>

#include "base/uuid.h"
#include "station/answer.h"
#include "station/clients.h"
#include "station/events.h"
#include "station/job.h"
#include "station/protocol.h"
#include "station/settings.h"
#include "station/tables.h"
#include "station/worker.h"
#include "station/writer.h"

struct bench;
struct seat;
struct discovery;

enum { STATION_OPEN_REQUESTS = 64, STATION_ERROR_SIZE = 512 };

enum store_state { STORE_OK, STORE_OPENING, STORE_FULL, STORE_READ_ONLY, STORE_DAMAGED };
const char *store_state_name(enum store_state state);

struct store_standing {
    enum store_state state;         /* as it is shown; comes from the five below */
    enum status status;             /* what the last write, read or opening has shown */
    bool told;                      /* the writer has said how it stands, since the start */
    bool open;                      /* the writer has it open */
    bool moved;                     /* station.db lost its name while it was open */
    bool in_use;                    /* its damage was met while it was open */
    bool trying;                    /* the writer has been asked whether it can be written */
    char error[STATION_ERROR_SIZE]; /* for a person; "" where it is ok */
    char station_id[UUID_TEXT_SIZE];
    int64_t last_seq;
    bool verified, sound; /* by store.verify, since the start or the new beginning */
};

/* Numbers of leases, so that none comes again in a state folder, also after a restart: a
 * supply of them is reserved at a time, on the writer's thread.  Where the folder cannot be
 * written none is, nor is anything stored: they go on above those on record. */
struct fences {
    int64_t last;     /* the last one given, or not to be given: leases go on above it */
    int64_t reserved; /* up to this one */
    bool known;       /* last is: before, no lease is granted */
    bool asked;       /* the writer has been, for more */
};

struct station_counters {
    uint64_t requests[METHODS], refused, events, records;
};

/* A uuid that is being looked up in the store: what is stored under it meanwhile the one
 * who looks may have missed. */
struct uuid_watch {
    struct uuid_watch *next;
    char uuid[STORE_UUID_SIZE];
    bool stored;
};

struct parked; /* a request that waits for a table, the store's opening, or a run's end */
struct spare_record;
struct housekeeping;

struct station {
    sd_event *event;
    const struct settings *settings;
    struct protocol *protocol;
    char boot[UUID_TEXT_SIZE], machine_boot[UUID_TEXT_SIZE]; /* of the daemon, of the machine */
    int64_t started_ms;
    struct inbox inbox;
    struct events events;
    struct clients *clients;
    struct store_claim *claim;
    struct writer *writer;
    struct worker *reader; /* what clients ask for and comes soon */
    struct worker *chores; /* tables, checks, checkpoints: may take long */
    struct tables *tables;
    struct answer_weights weights;
    struct bench *benches[SETTINGS_MAX_INSTRUMENTS];
    size_t benches_n;
    struct seat *seats;
    struct discovery *discovery;
    struct store_standing store;
    struct fences fences;
    struct uuid_watch *watched;
    struct parked *parked;
    sd_event_source *unpark;
    struct spare_record *spare_records; /* see station_record() */
    struct station_counters counters;
    struct housekeeping *housekeeping;
    int64_t wal_bytes;
    bool wal_limited; /* nothing is stored because of its size */
    bool is_open, stopping;
    /* The store has been opened, or cannot be; hopeless: a foreign file, or a newer
     * program's.  Once. */
    void (*store_opened)(struct station *station, bool hopeless);
};

/* ---- answers ------------------------------------------------------------------------ */

struct ticket {
    uint64_t client;
    struct request_id id;
    enum method method;
};

struct ticket ticket_of(const struct client *client, const struct request *request);

/* Each ticket is answered once.  The result is given away; NULL: no memory. */
void station_answer(struct station *station, const struct ticket *ticket, cJSON *result);
void station_answer_text(struct station *station, const struct ticket *ticket,
                         const char *result); /* JSON already */
void station_answer_line(struct station *station, const struct ticket *ticket, struct line *line);
void station_refuse(struct station *station, const struct ticket *ticket,
                    const struct refusal *refusal);
void station_refuse_for(struct station *station, const struct ticket *ticket, enum reason reason,
                        const char *format, ...) __attribute__((format(printf, 4, 5)));

/* The reason for a status of the store, when reading (or writing) a record. */
struct refusal station_store_refusal(const struct station *station, enum status status,
                                     const char *bad_member);

/* A line of a client: read, checked, and served. */
void station_line(void *station, struct client *client, const char *line, size_t n);

/* An event for all who subscribed to its topic; data is given away.  type is a constant. */
void station_tell(struct station *station, enum event_topic topic, const char *type, cJSON *data);
void station_tell_text(struct station *station, enum event_topic topic, const char *type,
                       const char *data); /* JSON already */

/* ---- the store ---------------------------------------------------------------------- */

/* (station_store.c)  Take the state folder for this process and start the writer.
 * STATUS_EXISTS where another has it; where the folder cannot be written the service is
 * read-only, and that is STATUS_OK. */
enum status station_claim_store(struct station *station);

/* Open the store on the writer's thread; station->store and store_opened() tell the end. */
void station_look_at_store(struct station *station);

/* Where it cannot be written for a cause that may pass: see whether that has passed. */
void station_try_store(struct station *station);

/* See that there are enough of them, and that it becomes known where they go on. */
void station_keep_fences(struct station *station);

/* What WRITE_OPEN or WRITE_BEGIN_ANEW has told, whatever that is. */
void station_take_opened(struct station *station, const struct write_job *write);

/* What a write or a read has shown about the store, told to all where it is new. */
void station_note_write(struct station *station, enum status status);

/* What store.verify has found. */
void station_note_verified(struct station *station, bool sound);

/* The WAL has this size: above the limit nothing is stored until it is below again. */
void station_note_wal(struct station *station, int64_t wal_bytes);

/* False, and the ticket refused, where the store takes nothing. */
bool station_can_write(struct station *station, const struct ticket *ticket);

/* A record with everything absent.  It is too large to be made anew for each request;
 * give it back.  NULL: no memory. */
struct store_record *station_record(struct station *station);
void station_record_back(struct station *station, struct store_record *record);

void station_free_records(struct station *station);

/* From before the question until its answer was looked at. */
void station_watch_uuid(struct station *station, struct uuid_watch *watch);
void station_unwatch_uuid(struct station *station, const struct uuid_watch *watch);

/* After a commit. */
void station_tell_record(struct station *station, const struct store_record *record);

/* ---- tables ------------------------------------------------------------------------- */

/* The table a request names (NULL: the default one).  STATUS_OK; STATUS_CANCELLED: it is being
 * loaded, come again when station_table_changed() says so; STATUS_NOT_FOUND with
 * *refusal. */
enum status station_table(struct station *station, const char *name, struct loaded_table **ret,
                          struct refusal *refusal);

/* Keep a request, which is taken, until something it may wait for has come (a table, the
 * store's opening, the end of a run): station_serve_parked() serves all of them again. */
void station_park(struct station *station, const struct client *client, struct request *request);
void station_serve_parked(struct station *station);
void station_table_changed(void *station, const char *name);

/* ---- life ---------------------------------------------------------------------------------------
 */

/* Everything but the clients, who come with a listener.  Logged.  station->event, settings
 * and store_opened are set before. */
enum status station_open(struct station *station);
enum status station_listen(struct station *station, int listener_fd);

/* No new requests are served and what runs is cancelled; answers still go out. */
void station_stop(struct station *station);

/* After station_stop(): all requests are answered and all answers taken. */
bool station_is_quiet(struct station *station);

/* What was asked of the writer is written and answered; takes a half-opened station. */
void station_close(struct station *station);

#endif
