/* seat.c - instruments come to their benches, and leave them. */
#include "station/seat.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/log.h"
#include "drivers/registry.h"
#include "station/asked.h"

enum {
    LEAVING_MS = 300,     /* for the driver to notice by itself that it is gone, and say how */
    LEAVING_LOOK_MS = 20, /* how often it is looked whether its thread has ended */
    NAMED_SERIAL = 40,    /* characters of a serial number in a name */
};

struct seat {
    struct seat *next;
    struct station *station;
    const struct driver *driver;
    char address[DISCOVERY_ADDRESS_SIZE]; /* what fits of a configured one's */
    struct bench *bench;                  /* NULL: not known which it is */
    struct unit *unit;                    /* NULL: its thread has ended */
    uint64_t before;                      /* connections of its bench, before it came */
    bool configured, left;
    bool unset;              /* its thread does not know how the bench was set */
    struct capture *capture; /* NULL: not recorded */
    sd_event_source *timer;  /* of its leaving */
    struct job farewell;     /* behind all that its thread has told */
    struct unit_job look;    /* whether it is still there */
    bool looking;            /* that is under way */
};

/* ---- names -------------------------------------------------------------------------- */

static void name_by_port(const struct seat *seat, char name[BENCH_NAME_SIZE])
{
    const char *port = strrchr(seat->address, '/');
    snprintf(name, BENCH_NAME_SIZE, "%.20s@%.40s", seat->driver->name,
             port != NULL ? port + 1 : seat->address);
}

/* False where the serial number says nothing. */
static bool name_by_serial(const struct seat *seat, const char *serial, char name[BENCH_NAME_SIZE])
{
    size_t n = (size_t)snprintf(name, BENCH_NAME_SIZE, "%.20s-", seat->driver->name);
    size_t first = n;
    for (; *serial != '\0' && n < first + NAMED_SERIAL && n + 1 < BENCH_NAME_SIZE; serial++)
        name[n++] = *serial;
    name[n] = '\0';
    for (size_t i = first; i < n; i++)
        if (!isalnum((unsigned char)name[i]) && strchr("._-", name[i]) == NULL)
            name[i] = '_';
    return n > first;
}

/* ---- coming to a bench -------------------------------------------------------------- */

static struct seat *seat_of(const struct station *station, const struct bench *bench)
{
    struct seat *seat = station->seats;
    while (seat != NULL && (seat->bench != bench || seat->unit != bench->unit))
        seat = seat->next;
    return seat;
}

static void unplugged(struct bench *bench)
{
    struct driver_error error;
    driver_fail(&error, DRIVER_GONE, NULL, "it was unplugged; plug it in again");
    bench_lost(bench, &error);
}

/* The bench has nobody any more. */
static void part(struct seat *seat)
{
    struct bench *bench = seat->bench;
    seat->bench = NULL;
    if (bench == NULL || bench->unit != seat->unit)
        return;
    bench->unit = NULL;
    if (seat->station->stopping)
        return;
    if (bench->provisional)
        bench_forget(bench); /* it never opened: there is nothing to come back to */
    else if (bench->open)
        unplugged(bench);
}

static void sit_down(struct seat *seat, struct bench *bench)
{
    struct seat *former = seat_of(seat->station, bench);
    if (former != NULL)
        part(former);
    seat->bench = bench;
    seat->before = bench->connections;
    bench->unit = seat->unit;
    bench->connections_before = seat->before;
    bench->capture = seat->capture;
}

/* The bench of that name, made where there is none; NULL where another unit sits there, or
 * there is no room for one more. */
static struct bench *bench_named_so(struct seat *seat, const char *name)
{
    struct bench *bench = bench_find(seat->station, name);
    struct seat *former = bench != NULL ? seat_of(seat->station, bench) : NULL;
    if (former != NULL && !former->left && (bench->open || former->configured))
        return NULL;
    if (bench == NULL && bench_make(seat->station, seat->driver, name, &bench) != STATUS_OK)
        return NULL;
    return bench;
}

/* It has told who it is. */
static void find_bench(struct seat *seat, const char *serial)
{
    char name[BENCH_NAME_SIZE];
    struct bench *bench = NULL;
    if (name_by_serial(seat, serial, name)) {
        bench = bench_named_so(seat, name);
        if (bench == NULL)
            log_warning("station: another instrument with the name '%s' is there: serial numbers "
                        "should differ",
                        name);
    }
    if (bench == NULL) {
        name_by_port(seat, name);
        bench = bench_named_so(seat, name);
    }
    if (bench != NULL)
        sit_down(seat, bench);
}

/* It does not open, and why should be seen. */
static void show_trouble(struct seat *seat)
{
    char name[BENCH_NAME_SIZE];
    name_by_port(seat, name);
    struct bench *bench = bench_named_so(seat, name);
    if (bench == NULL)
        return;
    bench->provisional = !bench->known;
    sit_down(seat, bench);
}

/* ---- set as it was ------------------------------------------------------------------ */

/* At its bench's former port it was set so; this thread does not know.  What the former one may
 * still be doing for the bench is not waited for: each thread does its jobs in order, and this is
 * the first of the new one. */
struct restoring {
    struct unit_job unit;
    struct bench *bench;
    const struct unit *by; /* to be compared alone: it may have ended since */
};

static void note_restored(const struct restoring *restoring)
{
    struct bench *bench = restoring->bench;
    struct seat *seat = seat_of(bench->station, bench);
    bench->restoring = false;
    if (seat != NULL)
        seat->unset = restoring->unit.result == DRIVER_GONE;
    switch (restoring->unit.result) {
    case DRIVER_OK:
        bench->setup = bench->was;
        if (restoring->unit.status_known)
            bench->status = restoring->unit.status;
        break;
    case DRIVER_GONE: /* when it is back */
        bench->setup = bench->was;
        break;
    default:
        log_warning("station: instrument '%s' cannot be set as it was: %s", bench->name,
                    restoring->unit.error.text);
    }
    bench_tell_changes(bench);
}

static void restored(struct job *job)
{
    struct restoring *restoring = (struct restoring *)job;
    struct bench *bench = restoring->bench;
    bool is_its_own = bench->unit == restoring->by;
    bool is_nobodys = bench->unit == NULL && bench->restoring;
    if (is_nobodys)
        restoring->unit.result = DRIVER_GONE; /* whatever it was: it has been pulled out since */
    if (is_its_own || is_nobodys)
        note_restored(restoring);
    free(restoring); /* of another unit nothing: the present one was asked itself */
}

static void restore_setup(struct bench *bench, const struct driver_setup *was)
{
    struct restoring *restoring = calloc(1, sizeof *restoring);
    bench->setup = (struct driver_setup){ .grid = 0 };
    bench->restoring = restoring != NULL;
    if (restoring == NULL) {
        log_warning("station: no memory to set instrument '%s' as it was", bench->name);
        return;
    }
    bench->was = *was;
    restoring->bench = bench;
    restoring->by = bench->unit;
    restoring->unit.job.done = restored;
    restoring->unit.command = UNIT_CONFIGURE;
    restoring->unit.setup = *was;
    bench_ask(bench, &restoring->unit);
}

static bool is_as_opened(const struct driver_setup *setup)
{
    return setup->grid == 0 && setup->aperture == 0 && setup->averages <= 1 &&
           setup->delay_ms == 0 && !setup->user_calibration;
}

/* ---- what its thread tells ---------------------------------------------------------- */

static void opened(void *context, const struct driver_identity *identity,
                   const struct driver_status *status, uint64_t connection)
{
    struct seat *seat = context;
    if (seat->left)
        return;
    if (seat->bench != NULL && seat->bench->provisional)
        part(seat); /* now it can say which it is */
    bool is_new = seat->bench == NULL;
    if (is_new)
        find_bench(seat, identity->serial);
    struct bench *bench = seat->bench;
    if (bench == NULL)
        return;
    const struct driver_setup was = bench->restoring ? bench->was : bench->setup;
    if (is_new)
        seat->unset = !is_as_opened(&was);
    if (seat->unset)
        restore_setup(bench, &was);
    bench_opened(bench, identity, status, seat->before + connection);
}

static void lost(void *context, const struct driver_error *error)
{
    struct seat *seat = context;
    if (seat->bench == NULL && !seat->left && error->result != DRIVER_GONE)
        show_trouble(seat);
    if (seat->bench != NULL)
        bench_lost(seat->bench, error);
}

static void pressed(void *context)
{
    const struct seat *seat = context;
    if (seat->bench != NULL)
        bench_pressed(seat->bench);
}

static void status_changed(void *context, const struct driver_status *status)
{
    const struct seat *seat = context;
    if (seat->bench != NULL)
        bench_status_changed(seat->bench, status);
}

/* ---- taking and leaving ------------------------------------------------------------- */

static void free_seat(struct seat *seat)
{
    if (seat->station->recording.seat == seat)
        seat->station->recording.seat = NULL;
    sd_event_source_disable_unref(seat->timer);
    free(seat);
}

static void take_away(struct seat *seat)
{
    struct seat **at = &seat->station->seats;
    while (*at != seat)
        at = &(*at)->next;
    *at = seat->next;
    free_seat(seat);
}

static void say_farewell(struct job *job)
{
    take_away((struct seat *)(void *)((char *)job - offsetof(struct seat, farewell)));
}

static bool end_thread(struct seat *seat, int patience_ms)
{
    struct unit *unit = seat->unit;
    if (unit != NULL && !unit_close(unit, patience_ms))
        return false;
    part(seat);
    seat->unit = NULL;
    return true;
}

static int leave(sd_event_source *source, uint64_t now_us, void *userdata)
{
    struct seat *seat = userdata;
    if (!end_thread(seat, 0)) {
        sd_event_source_set_time(source, now_us + LEAVING_LOOK_MS * UINT64_C(1000));
        return sd_event_source_set_enabled(source, SD_EVENT_ONESHOT);
    }
    seat->farewell.done = say_farewell;
    inbox_put(&seat->station->inbox, &seat->farewell);
    return 0;
}

/* One instrument at a time: two in one capture could not be told apart. */
static struct capture *capture_for(const struct seat *seat)
{
    struct recording *recording = &seat->station->recording;
    if (recording->capture == NULL)
        return NULL;
    if (recording->seat != NULL && !recording->seat->left) {
        log_warning("station: what is at %s is not recorded: %s has the first instrument's bytes "
                    "alone",
                    seat->address, seat->station->settings->record);
        return NULL;
    }
    recording->seat = seat;
    return recording->capture;
}

/* Its timer is made now: there may be no memory when it is pulled out. */
static enum status take_seat(struct station *station, const struct driver *driver,
                             const char *address, struct seat **ret)
{
    struct seat *seat = calloc(1, sizeof *seat);
    if (seat == NULL)
        return STATUS_NO_MEMORY;
    seat->station = station;
    seat->driver = driver;
    snprintf(seat->address, sizeof seat->address, "%s", address != NULL ? address : "");
    if (sd_event_add_time(station->event, &seat->timer, CLOCK_MONOTONIC, UINT64_MAX, 1000, leave,
                          seat) < 0 ||
        sd_event_source_set_enabled(seat->timer, SD_EVENT_OFF) < 0) {
        sd_event_source_disable_unref(seat->timer);
        free(seat);
        return STATUS_NO_MEMORY;
    }
    seat->capture = capture_for(seat);
    const struct driver_options options = { .address = address, .capture = seat->capture };
    const struct unit_events events = {
        .opened = opened, .lost = lost, .button = pressed, .status = status_changed, .context = seat
    };
    seat->next = station->seats;
    station->seats = seat;
    enum status s = unit_open(driver, &options, &station->inbox, &events, &seat->unit);
    if (s != STATUS_OK) {
        log_error("station: cannot start the thread of an instrument of %s", driver->name);
        take_away(seat);
        return s;
    }
    *ret = seat;
    return STATUS_OK;
}

/* ---- discovered --------------------------------------------------------------------- */

/* Whether a configured address, "/dev/serial/by-id/...", is that port. */
static bool is_port(const char *configured, const char *address)
{
    char target[256];
    ssize_t n = readlink(configured, target, sizeof target - 1);
    const char *port = strrchr(address, '/');
    if (strcmp(configured, address) == 0)
        return true;
    if (n < 0 || port == NULL)
        return false;
    target[n] = '\0';
    const char *end = strrchr(target, '/');
    return strcmp(end != NULL ? end : target, end != NULL ? port : port + 1) == 0;
}

static void appeared(void *context, const struct driver *driver, const char *address)
{
    struct station *station = context;
    struct seat *seat;
    for (seat = station->seats; seat != NULL; seat = seat->next)
        if (seat->configured && is_port(seat->address, address))
            return; /* it is tried by itself */
    log_info("station: an instrument of %s was plugged in at %s", driver->name, address);
    (void)take_seat(station, driver, address, &seat); /* logged */
}

static void vanished(void *context, const char *address)
{
    const struct station *station = context;
    uint64_t now_us;
    log_info("station: what was at %s was pulled out", address);
    for (struct seat *seat = station->seats; seat != NULL; seat = seat->next) {
        if (seat->configured || seat->left || strcmp(seat->address, address) != 0)
            continue;
        seat->left = true;
        sd_event_now(station->event, CLOCK_MONOTONIC, &now_us);
        sd_event_source_set_time(seat->timer, now_us + LEAVING_MS * UINT64_C(1000));
        sd_event_source_set_enabled(seat->timer, SD_EVENT_ONESHOT);
    }
}

static void something_came(void *context)
{
    const struct station *station = context;
    for (struct seat *seat = station->seats; seat != NULL; seat = seat->next)
        if (seat->unit != NULL)
            unit_try_now(seat->unit);
}

static void looked(struct job *job)
{
    struct seat *seat = (struct seat *)(void *)((char *)job - offsetof(struct seat, look));
    seat->looking = false; /* where it is gone its thread has told */
    if (seat->look.status_known && seat->bench != NULL && seat->bench->open)
        bench_status_changed(seat->bench, &seat->look.status);
}

/* Nobody knows which device a configured address is: one without a button to watch would be
 * missed only at its next status.  The wires of the others end by themselves. */
static void something_went(void *context)
{
    const struct station *station = context;
    for (struct seat *seat = station->seats; seat != NULL; seat = seat->next) {
        if (!seat->configured || seat->driver->has_no_wire || seat->unit == NULL ||
            seat->bench == NULL || !seat->bench->open || seat->looking)
            continue;
        seat->looking = true;
        seat->look = (struct unit_job){ .job.done = looked, .command = UNIT_STATUS };
        unit_ask(seat->unit, &seat->look);
    }
}

/* Also for configured ones alone: who waits for a port hears that one has come. */
static enum status discover(struct station *station)
{
    const struct discovery_events events = { .appeared = appeared,
                                             .vanished = vanished,
                                             .something_came = something_came,
                                             .something_went = something_went,
                                             .context = station };
    const struct driver *const *drivers = station->settings->discovered;
    enum status s = discovery_open(station->event, drivers, &events, &station->discovery);
    if (s == STATUS_OK || drivers[0] != NULL)
        return s;
    log_warning("station: an instrument that is plugged in again is seen after up to 5 s");
    return STATUS_OK;
}

/* ---- configured --------------------------------------------------------------------- */

/* "simulated", and "simulated-2" for the second of a kind. */
static void name_configured(const struct station *station, const struct driver *driver,
                            char name[BENCH_NAME_SIZE])
{
    size_t same = 0;
    for (size_t i = 0; i < station->benches_n; i++)
        same += station->benches[i]->driver == driver;
    if (same == 0)
        snprintf(name, BENCH_NAME_SIZE, "%s", driver->name);
    else
        snprintf(name, BENCH_NAME_SIZE, "%s-%zu", driver->name, same + 1);
}

/* text: "DRIVER[:ADDRESS]". */
static enum status configure(struct station *station, const char *text)
{
    const char *colon = strchr(text, ':');
    char driver_name[64], name[BENCH_NAME_SIZE];
    struct bench *bench;
    struct seat *seat;
    snprintf(driver_name, sizeof driver_name, "%.*s", (int)strcspn(text, ":"), text);
    const struct driver *driver =
        driver_find(driver_name); /* the settings know that there is one */
    name_configured(station, driver, name);
    enum status s = bench_make(station, driver, name, &bench);
    if (s == STATUS_OK)
        s = take_seat(station, driver, colon != NULL ? colon + 1 : NULL, &seat);
    if (s != STATUS_OK)
        return s;
    seat->configured = true;
    sit_down(seat, bench);
    return STATUS_OK;
}

enum status seats_open(struct station *station)
{
    enum status s = asked_open(station);
    for (size_t i = 0; i < station->settings->instruments_n && s == STATUS_OK; i++)
        s = configure(station, station->settings->instruments[i]);
    return s == STATUS_OK ? discover(station) : s;
}

/* ---- the end ------------------------------------------------------------------------ */

bool seats_stop(struct station *station, int patience_ms)
{
    bool all = true;
    int64_t deadline_ms = clock_boottime_ms() + patience_ms;
    for (struct seat *seat = station->seats; seat != NULL; seat = seat->next)
        (void)end_thread(seat, 0); /* all at once, one patience for all */
    for (struct seat *seat = station->seats; seat != NULL; seat = seat->next) {
        int64_t left_ms = deadline_ms - clock_boottime_ms();
        if (end_thread(seat, patience_ms > 0 && left_ms > 1 ? (int)left_ms : 1))
            continue;
        log_warning("station: an instrument of %s does not answer; left behind",
                    seat->driver->name);
        all = false;
    }
    return all;
}

void seats_close(struct station *station)
{
    discovery_close(station->discovery);
    station->discovery = NULL;
    while (station->seats != NULL) {
        struct seat *seat = station->seats;
        station->seats = seat->next;
        free_seat(seat);
    }
    asked_close(station);
}
