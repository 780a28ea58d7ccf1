/* station.h - the daemon's parts and how they meet; for src/station alone.
 *
 *   clients -> dispatch -> serve (one function per method) -> bench, run   instruments
 *                                                          -> writer       what is kept
 *                                                          -> worker       what is read, or long
 *   ticket    answers find their clients;  tell  events find those who hear of them
 *   parking   requests that wait;  station_store, station_table  what all share
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
#include "station/fences.h"
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

struct station_counters {
    uint64_t requests[METHODS], refused, events, records;
};

struct uuid_watch;

/* What is written down of one instrument; see asked.h. */
struct recording {
    struct capture *capture; /* NULL: nothing */
    const struct seat *seat; /* whose; NULL: of the next that comes */
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
    struct recording recording;
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

/* ---- life --------------------------------------------------------------------------- */

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
