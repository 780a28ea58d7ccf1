/* protocol.h - lines of the socket <-> requests, replies, notifications.
 *
 * Pure: no socket, no thread, no database.  What there is to ask and how is in
 * protocol.schema.json, which is part of the program; docs/protocol.md is made from it.
 *
 *   line -> protocol_read() -> struct request -> (the station) -> protocol_reply() -> line
 *                           \-> struct refusal ----------------> protocol_refuse() -> line */
#ifndef SKINSPEC_STATION_PROTOCOL_H
#define SKINSPEC_STATION_PROTOCOL_H

#include <cjson/cJSON.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/status.h"
#include "station/events.h"
#include "station/schema.h"

enum { PROTOCOL_MAJOR = 1, PROTOCOL_MINOR = 0 };
enum {
    PROTOCOL_MAX_REQUEST = 64 * 1024, /* without the line feed */
    PROTOCOL_MAX_LINE = 1024 * 1024,  /* from the station, line feed included */
    PROTOCOL_MAX_ID = 64,             /* bytes of a string */
};
#define PROTOCOL_MAX_INTEGER INT64_C(9007199254740991) /* 2^53 - 1 */

/* clang-format off */
#define PROTOCOL_METHODS(X) \
    X(SESSION_OPEN, "session.open") \
    X(SESSION_CLOSE, "session.close") \
    X(INSTRUMENT_LIST, "instrument.list") \
    X(INSTRUMENT_ACQUIRE, "instrument.acquire") \
    X(INSTRUMENT_WITHDRAW, "instrument.withdraw") \
    X(INSTRUMENT_RENEW, "instrument.renew") \
    X(INSTRUMENT_RELEASE, "instrument.release") \
    X(INSTRUMENT_CONFIGURE, "instrument.configure") \
    X(INSTRUMENT_CALIBRATE, "instrument.calibrate") \
    X(MEASURE_START, "measure.start") \
    X(MEASURE_NEXT, "measure.next") \
    X(MEASURE_CANCEL, "measure.cancel") \
    X(CHECK_TAKE, "check.take") \
    X(CHECK_SET, "check.set") \
    X(CHECK_LIST, "check.list") \
    X(MATCH_SPECTRUM, "match.spectrum") \
    X(RECORD_GET, "record.get") \
    X(RECORD_LIST, "record.list") \
    X(RECORD_EXPORT, "record.export") \
    X(RECORD_RECOMPUTE, "record.recompute") \
    X(SUBJECT_ADD, "subject.add") \
    X(SUBJECT_LIST, "subject.list") \
    X(SUBJECT_FORGET, "subject.forget") \
    X(SITE_LIST, "site.list") \
    X(TABLE_LIST, "table.list") \
    X(TABLE_INFO, "table.info") \
    X(STATUS_GET, "status.get") \
    X(METRICS_GET, "metrics.get") \
    X(RPC_DESCRIBE, "rpc.describe") \
    X(EVENTS_SUBSCRIBE, "events.subscribe") \
    X(STORE_VERIFY, "store.verify") \
    X(STORE_BEGIN_ANEW, "store.begin_anew")

#define PROTOCOL_REASONS(X) \
    X(JSON_INVALID, "json_invalid") \
    X(UTF8_INVALID, "utf8_invalid") \
    X(NUL_REFUSED, "nul_refused") \
    X(DUPLICATE_MEMBER, "duplicate_member") \
    X(TOO_DEEP, "too_deep") \
    X(TOO_MANY_MEMBERS, "too_many_members") \
    X(NUMBER_RANGE, "number_range") \
    X(LINE_TOO_LONG, "line_too_long") \
    X(BATCH_REFUSED, "batch_refused") \
    X(REQUEST_INVALID, "request_invalid") \
    X(ID_MISSING, "id_missing") \
    X(ID_INVALID, "id_invalid") \
    X(METHOD_UNKNOWN, "method_unknown") \
    X(PARAMS_INVALID, "params_invalid") \
    X(SESSION_NEEDED, "session_needed") \
    X(SESSION_EXISTS, "session_exists") \
    X(PROTOCOL_VERSION, "protocol_version") \
    X(RIGHT_NEEDED, "right_needed") \
    X(INSTRUMENT_UNKNOWN, "instrument_unknown") \
    X(INSTRUMENT_BUSY, "instrument_busy") \
    X(QUEUE_FULL, "queue_full") \
    X(INSTRUMENT_GONE, "instrument_gone") \
    X(INSTRUMENT_TIMEOUT, "instrument_timeout") \
    X(INSTRUMENT_REFUSED, "instrument_refused") \
    X(INSTRUMENT_PROTOCOL, "instrument_protocol") \
    X(INSTRUMENT_BATTERY, "instrument_battery") \
    X(INSTRUMENT_FAULT, "instrument_fault") \
    X(INSTRUMENT_UNSUPPORTED, "instrument_unsupported") \
    X(INSTRUMENT_NO_PERMISSION, "instrument_no_permission") \
    X(LEASE_EXISTS, "lease_exists") \
    X(LEASE_WITHDRAWN, "lease_withdrawn") \
    X(LEASE_NOT_AWAITED, "lease_not_awaited") \
    X(LEASE_UNKNOWN, "lease_unknown") \
    X(LEASE_EXPIRED, "lease_expired") \
    X(CALIBRATION_DUE, "calibration_due") \
    X(CALIBRATION_ORDER, "calibration_order") \
    X(CALIBRATION_IMPLAUSIBLE, "calibration_implausible") \
    X(MEASUREMENT_RUNNING, "measurement_running") \
    X(MEASUREMENT_UNKNOWN, "measurement_unknown") \
    X(MEASUREMENT_NOT_WAITING, "measurement_not_waiting") \
    X(MEASUREMENT_CANCELLED, "measurement_cancelled") \
    X(MEASUREMENT_FAILED, "measurement_failed") \
    X(CHECK_UNFIT, "check_unfit") \
    X(REFERENCE_MISSING, "reference_missing") \
    X(UUID_REUSED, "uuid_reused") \
    X(SURFACE_NEEDED, "surface_needed") \
    X(SPECTRUM_UNSUITABLE, "spectrum_unsuitable") \
    X(TABLE_UNKNOWN, "table_unknown") \
    X(TABLE_LOADING, "table_loading") \
    X(TABLE_MISSING, "table_missing") \
    X(TABLE_UNSUITABLE, "table_unsuitable") \
    X(RECORD_UNKNOWN, "record_unknown") \
    X(RECORD_WITHOUT_MATCH, "record_without_match") \
    X(SUBJECT_UNKNOWN, "subject_unknown") \
    X(STORE_READ_ONLY, "store_read_only") \
    X(STORE_FULL, "store_full") \
    X(STORE_FAILED, "store_failed") \
    X(STORE_NOT_DAMAGED, "store_not_damaged") \
    X(TOO_MANY_CLIENTS, "too_many_clients") \
    X(TOO_MANY_FOR_USER, "too_many_for_user") \
    X(TOO_MANY_FOR_PROCESS, "too_many_for_process") \
    X(TOO_MANY_REQUESTS, "too_many_requests") \
    X(REPLY_TOO_LARGE, "reply_too_large") \
    X(SHUTTING_DOWN, "shutting_down") \
    X(NO_MEMORY, "no_memory") \
    X(INTERNAL, "internal")

#define PROTOCOL_NOTIFICATIONS(X) \
    X(HELLO, "hello") \
    X(EVENT, "event") \
    X(EVENTS_LOST, "events.lost")

#define PROTOCOL_METHOD(name, text) METHOD_##name,
#define PROTOCOL_REASON(name, text) REASON_##name,
#define PROTOCOL_NOTIFICATION(name, text) NOTIFICATION_##name,
enum method { PROTOCOL_METHODS(PROTOCOL_METHOD) METHODS };
enum reason { PROTOCOL_REASONS(PROTOCOL_REASON) REASONS };
enum notification { PROTOCOL_NOTIFICATIONS(PROTOCOL_NOTIFICATION) NOTIFICATIONS };
/* clang-format on */

/* Each may what the one before may. */
enum right { RIGHT_KIOSK, RIGHT_CLINIC, RIGHT_ADMIN, RIGHTS };

/* Never NULL. */
const char *method_name(enum method method);
const char *reason_name(enum reason reason);
const char *right_name(enum right right);

/* ---- the description, compiled ------------------------------------------------------ */

/* Made once, then only read, by any thread. */
struct protocol;

/* STATUS_FORMAT, with the cause logged, where the description and this page differ (a
 * mistake in the program); STATUS_NO_MEMORY. */
enum status protocol_open(struct protocol **ret);
enum status protocol_open_text(const char *text, struct protocol **ret); /* for tests: another */
void protocol_close(struct protocol *protocol);                          /* takes NULL */

/* The description on one line, for rpc.describe. */
const char *protocol_describe(const struct protocol *protocol);

/* Whether a result, the params of a notification, or the data of an event is as described
 * and holds nothing else: for tests.  A type that the topic does not have is an error. */
bool protocol_check_result(const struct protocol *protocol, enum method method, const cJSON *result,
                           struct schema_error *error);
bool protocol_check_notification(const struct protocol *protocol, enum notification notification,
                                 const cJSON *params, struct schema_error *error);
bool protocol_check_event(const struct protocol *protocol, enum event_topic topic, const char *type,
                          const cJSON *data, struct schema_error *error);

/* ---- requests ----------------------------------------------------------------------- */

enum request_id_kind { REQUEST_ID_NONE, REQUEST_ID_INTEGER, REQUEST_ID_STRING };

/* As the client gave it; NONE is null, for lines whose id cannot be read. */
struct request_id {
    enum request_id_kind kind;
    int64_t integer;
    char text[PROTOCOL_MAX_ID + 1];
};

struct request {
    struct request_id id;
    enum method method;
    enum right right; /* the least that may */
    bool needs_session;
    const cJSON *params; /* checked; an object, empty where absent */
    cJSON *tree;         /* what owns params */
};

/* Why not. */
struct refusal {
    enum reason reason;
    char detail[SCHEMA_WHAT_SIZE]; /* what in particular; "" where the reason says it all */
    char path[SCHEMA_PATH_SIZE];   /* the member to blame; "" */
    char device_code[16];          /* the instrument's own code; "" */
};

/* Set the reason and what in particular (NULL: nothing); path and code become "". */
void refusal_set(struct refusal *refusal, enum reason reason, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* A line without its line feed.  On true *ret is to be given to request_done(); on false
 * ret->id is what could be read of the id, and *refusal says why. */
bool protocol_read(const struct protocol *protocol, const char *line, size_t n, struct request *ret,
                   struct refusal *refusal);
void request_done(struct request *request);

/* ---- what the station sends --------------------------------------------------------- */

/* text is to be freed by free(); n bytes without a line feed, a NUL follows. */
struct line {
    char *text;
    size_t n;
};

/* The reply to a request.  result is given away, NULL counts as no memory, and so does one that was
 * made while json/memory.h noted that memory was short, which begins anew with this.  STATUS_RANGE
 * where it is too long, STATUS_FORMAT where it holds null or a number that is not finite;
 * STATUS_NO_MEMORY. */
enum status protocol_result(const struct request_id *id, cJSON *result, struct line *ret);

/* The same; what cannot be replied becomes the error it is.  STATUS_NO_MEMORY. */
enum status protocol_reply(const struct protocol *protocol, const struct request_id *id,
                           cJSON *result, struct line *ret);

/* The same of a result that is JSON already, of one line and without null. */
enum status protocol_reply_text(const struct protocol *protocol, const struct request_id *id,
                                const char *result, struct line *ret);
enum status protocol_refuse(const struct protocol *protocol, const struct request_id *id,
                            const struct refusal *refusal, struct line *ret);

/* params are given away.  STATUS_RANGE for one that is too long, STATUS_FORMAT for null, a
 * number that is not finite or text that is not UTF-8; STATUS_NO_MEMORY.  The data of an
 * event is taken as it is. */
enum status protocol_notify(enum notification notification, cJSON *params, struct line *ret);
enum status protocol_event(const struct event *event, struct line *ret);

struct hello {
    const char *server;     /* "skinspecd 0.1.0" */
    const char *station_id; /* "" without a store */
    const char *boot;
};
enum status protocol_hello(const struct hello *hello, struct line *ret);

/* ---- for clients -------------------------------------------------------------------- */

/* A request as a line; params is given away, NULL: none.  STATUS_RANGE, STATUS_FORMAT and
 * STATUS_NO_MEMORY as above. */
enum status protocol_ask(int64_t id, enum method method, cJSON *params, struct line *ret);

/* What a station's line is: a reply with result or error (the members of tree), or a
 * notification with method and params. */
struct answer {
    cJSON *tree;                 /* owns the rest; cJSON_Delete() */
    struct request_id id;        /* NONE: a notification, or an error about a line without */
    const cJSON *result, *error; /* one of them for a reply, else both NULL */
    const char *method;          /* of a notification, else NULL */
    const cJSON *params;
};

/* A line without its line feed.  STATUS_FORMAT for one that is none of these;
 * STATUS_NO_MEMORY counts as that. */
enum status protocol_read_answer(const char *line, size_t n, struct answer *ret);

#endif
