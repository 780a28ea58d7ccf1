/* remote.h - a command's connection to the station's daemon.
 *
 * One thread, one connection.  While a reply is waited for, whatever else comes (events,
 * replies to other requests) is kept in order for later.  Failures are logged here, once,
 * unless a function says otherwise: a refusal as "message (reason) - hint". */
#ifndef SKINSPEC_CLI_REMOTE_H
#define SKINSPEC_CLI_REMOTE_H

#include <argp.h>
#include <cjson/cJSON.h>
#include <stdbool.h>
#include <stdint.h>

#include "base/status.h"
#include "station/protocol.h"

struct remote;

/* Connect, hear the station's hello, open a session.  socket NULL: the first of
 * SKINSPEC_SOCKET, $XDG_RUNTIME_DIR/skinspec.sock and /run/skinspec/skinspecd.sock that
 * answers; where the variable is set, it alone.  operator_name may be NULL. */
enum status remote_open(const char *socket, const char *operator_name, struct remote **ret);
void remote_close(struct remote *remote);

const cJSON *remote_session(const struct remote *remote); /* result of session.open */

/* ---- one request, one reply --------------------------------------------------------- */

/* params are given away; NULL: none.  The result is the caller's to delete; NULL where
 * there is none.  The station has 30 s to answer, but for store.verify, which reads the whole
 * store. */
cJSON *remote_ask(struct remote *remote, enum method method, cJSON *params);

/* A page of a list: the items of its member `list`, in order, to take(), whose they are then.
 * The result without them, which tells where the next page begins; NULL as above. */
cJSON *remote_page(struct remote *remote, enum method method, cJSON *params, const char *list,
                   void (*take)(void *context, cJSON *item), void *context);

/* As remote_ask() without a time limit, for what depends on people and instruments, and for those
 * who look at the reason: *ret is the reply, whether result or error.  False where there is
 * none. */
bool remote_try(struct remote *remote, enum method method, cJSON *params, struct answer *ret);

/* A request alone: its reply comes by remote_next(). */
enum status remote_send(struct remote *remote, enum method method, cJSON *params, int64_t *id);

/* Of a reply: why it was refused, REASONS for a result or a reason not known here. */
enum reason remote_reason(const struct answer *answer);
void remote_complain(const struct answer *answer); /* log the refusal */
void remote_done(struct answer *answer);           /* deletes it */

/* ---- whatever comes next ---------------------------------------------------------------- */

enum remote_news {
    REMOTE_LINE,   /* *ret: a notification, or the reply to what was sent alone */
    REMOTE_INPUT,  /* input_fd has something */
    REMOTE_STOP,   /* stop_fd has something */
    REMOTE_SILENT, /* time is up */
    REMOTE_GONE,   /* the connection ended, or the station ends it; logged */
};

/* Descriptors below 0 are not watched; timeout_ms below 0 is for ever. */
struct remote_watch {
    int input_fd, stop_fd, timeout_ms;
};
enum remote_news remote_next(struct remote *remote, const struct remote_watch *watch,
                             struct answer *ret);

/* Events of these topics from here on; since_seq below 0: none from before.  The reply's
 * result, or NULL. */
cJSON *remote_subscribe(struct remote *remote, unsigned topics, int64_t since_seq);

/* ---- the lease ------------------------------------------------------------------------------ */

/* Hold this lease (NULL: none), which lasts for so long, from here on: whenever the functions
 * above have waited for a third of that, it is renewed. */
enum { REMOTE_LEASE_MS = 60000 }; /* what to ask for */
void remote_hold(struct remote *remote, const char *lease, double lasts_ms);
bool remote_holds(const struct remote *remote);

/* Params with the member lease; more may be added. */
cJSON *remote_lease_params(const struct remote *remote);

#endif
