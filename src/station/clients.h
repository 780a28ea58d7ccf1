/* clients.h - the connections: who is let in, their lines, and what is sent to them.
 *
 * All on the loop's thread, which takes them by rounds: what has been said by up to
 * CLIENTS_AT_ONCE of them, one after the other, before the loop looks elsewhere.  A client is known
 * to others by its number, which never comes again: whoever has an answer later asks whether it is
 * still there.  A client that is dropped in the middle of something is freed afterwards, from the
 * loop. */
#ifndef SKINSPEC_STATION_CLIENTS_H
#define SKINSPEC_STATION_CLIENTS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <systemd/sd-event.h>

#include "base/status.h"
#include "station/connection.h"
#include "station/protocol.h"
#include "station/rights.h"
#include "station/settings.h"

enum {
    CLIENTS_AT_ONCE = 16,      /* in a round */
    CLIENTS_LINES_AT_ONCE = 8, /* of one client before the others have their turn */
    CLIENTS_NAME_SIZE = 64,
    CLIENTS_LEASE_SIZE = 64,
    CLIENTS_OPERATOR_SIZE = 256,
};
/* A client that leaves so much untaken is not read from. */
#define CLIENTS_UNSENT_PAUSE ((size_t)1024 * 1024)

struct clients;

struct client {
    uint64_t number;
    struct clients *of;
    struct connection connection;
    struct peer peer;
    uint32_t watched; /* epoll events */
    sd_event_source *again, *deadline;
    bool leaving;   /* no more is read; goes when all is sent */
    bool said_all;  /* it has closed its half: goes when all is answered and sent */
    bool turn_over; /* what else it has said waits until the others had their turn */
    bool doomed;    /* goes now */

    /* Its session. */
    bool session;
    char name[CLIENTS_NAME_SIZE], operator_name[CLIENTS_OPERATOR_SIZE];
    size_t open_requests;
    unsigned topics; /* that it hears of: 1 << enum event_topic */
    /* Of each instrument, by its place: the last one that expired on it; "". */
    char lost_lease[SETTINGS_MAX_INSTRUMENTS][CLIENTS_LEASE_SIZE];
};

struct clients_settings {
    sd_event *event;
    int listener_fd;
    size_t max, max_per_user, max_per_process;
    struct rights rights;
    const struct protocol *protocol;
    /* The first thing a client is told; false: it is not let in. */
    bool (*greet)(void *context, struct client *client);
    void (*line)(void *context, struct client *client, const char *line, size_t n);
    void (*gone)(void *context, struct client *client); /* last chance; not to be sent to */
    void *context;
};

struct clients_counts {
    size_t now;
    uint64_t accepted, refused, dropped; /* dropped: for not reading */
};

enum status clients_open(const struct clients_settings *settings, struct clients **ret);
void clients_close(struct clients *clients); /* takes NULL; gone() is told of each */
void clients_stop_accepting(struct clients *clients);

struct client *clients_find(struct clients *clients, uint64_t number); /* NULL: it has gone */
struct clients_counts clients_count(const struct clients *clients);

/* Each that is there and stays; the callback may drop. */
typedef void clients_visit(void *context, struct client *client);
void clients_each(struct clients *clients, clients_visit *visit, void *context);

/* For the audit: the operator and the account, "Jo, uid 1000". */
void client_who(const struct client *client, char *text, size_t size);

void client_send(struct client *client, const struct line *line); /* may drop it */
void client_leave(struct client *client);                         /* once all is sent */

/* For line(): this one was dear, the others come before the client's next. */
void client_end_turn(struct client *client);

#endif
