/* drivers.c - what a driver adds to the instrument's own time for one reading.
 *
 *   drivers TIMES   one object a line: {"name":..,"added_us":[..],"instrument_us":[..]}, and for an
 *                   instrument with a button another: each reading ends a wait for it, as the
 *                   station's do
 *
 * Each driver measures a simulator of the same program that takes no time of its own (delays=0).
 * What it takes all the same is taken from the time of measure(): the time inside its functions,
 * and the time from a question that it had nothing for yet until that was due, where
 * the driver waited for it.  All else counts as the driver's: its waits, its pauses, and the wire
 * in memory, which is there instead of the kernel's tty or usbfs. */
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "drivers/km_ascii/km_ascii.h"
#include "drivers/ocean_ooi/ocean_ooi.h"
#include "drivers/xrite_rci/xrite_rci.h"
#include "tests/sim/wire_memory.h"
#include "tests/support/ocean_bench.h"

enum { TIMES_MAX = 100000 };
/* A wait is cancelled after 3 ms; so long a thread may starve beside other work. */
enum { PATIENCE_MS = 30000 };

static int64_t now_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

/* ---- a simulator whose time is taken ------------------------------------------------- */

static const struct sim_kind *timed;
static int64_t instrument_ns;
static int64_t nothing_ns; /* when it had nothing to give; 0: it had */
static int64_t due_ns;     /* when it would have */

/* The driver is back, to hear or to speak. */
static int64_t wait_is_over(void)
{
    int64_t now = now_ns(), until = now < due_ns ? now : due_ns;
    if (nothing_ns != 0 && until > nothing_ns)
        instrument_ns += until - nothing_ns;
    nothing_ns = 0;
    return now;
}

static int timed_take(struct sim *sim, uint8_t channel, const uint8_t *bytes, size_t n,
                      int64_t now_us)
{
    int64_t begun = wait_is_over();
    int ended = timed->take(sim, channel, bytes, n, now_us);
    instrument_ns += now_ns() - begun;
    return ended;
}

static ssize_t timed_give(struct sim *sim, uint8_t channel, uint8_t *bytes, size_t size,
                          int64_t now_us, int64_t *due_us)
{
    int64_t begun = wait_is_over();
    ssize_t came = timed->give(sim, channel, bytes, size, now_us, due_us);
    int64_t now = now_ns();
    instrument_ns += now - begun;
    if (came == 0 && *due_us != INT64_MAX) { /* silence is the driver's to end */
        nothing_ns = now;
        due_ns = *due_us * 1000;
    }
    return came;
}

/* ---- readings ------------------------------------------------------------------------ */

struct subject {
    const char *name;
    const struct driver *driver;
    const struct sim_kind *sim;
    const char *options;
};

static const struct subject subjects[] = {
    { "CM-700d (km_ascii)", &km_ascii_driver, &sim_cm700d, "delays=0" },
    { "CM-2600d (km_ascii)", &km_ascii_driver, &sim_cm2600d, "delays=0" },
    { "SP62 (xrite_rci)", &xrite_rci_driver, &sim_sp62, "delays=0,operator_ms=50" },
    { "USB2000+ (ocean_ooi)", &ocean_ooi_driver, &sim_usb2000, "delays=0" },
    { "USB4000 (ocean_ooi)", &ocean_ooi_driver, &sim_usb4000, "delays=0" },
};

static void must(const char *what, enum driver_result r, const struct driver_error *error)
{
    if (r == DRIVER_OK)
        return;
    fprintf(stderr, "drivers: %s: %s: %s\n", what, driver_result_name(r), error->text);
    exit(1);
}

static void place(struct wire_memory *wire, const char *action)
{
    if (!wire_memory_act(wire, action)) {
        fprintf(stderr, "drivers: no simulator knows '%s'\n", action);
        exit(1);
    }
}

static void print_list(const char *name, const int64_t *ns, size_t n)
{
    printf("\"%s\":[", name);
    for (size_t i = 0; i < n; i++)
        printf("%s%.1f", i > 0 ? "," : "", (double)ns[i] / 1e3);
    printf("]");
}

struct waiting {
    const struct driver *driver;
    struct instrument *instrument;
};

static void *cancel_soon(void *argument)
{
    const struct waiting *waiting = argument;
    nanosleep(&(struct timespec){ .tv_nsec = 3000000 }, NULL);
    waiting->driver->cancel(waiting->instrument);
    return NULL;
}

static void wait_in_vain(const struct driver *driver, struct instrument *instrument)
{
    struct waiting waiting = { driver, instrument };
    struct driver_error error;
    bool pressed = false;
    pthread_t thread;
    if (pthread_create(&thread, NULL, cancel_soon, &waiting) != 0) {
        perror("drivers: a thread");
        exit(1);
    }
    enum driver_result r = driver->wait_button(instrument, PATIENCE_MS, &pressed, &error);
    pthread_join(thread, NULL);
    if (r != DRIVER_CANCELLED) {
        fprintf(stderr, "drivers: %s: a wait ended with %s%s\n", driver->name,
                driver_result_name(r), pressed ? ", a press" : "");
        exit(1);
    }
}

static void measure_often(const struct subject *subject, struct instrument *instrument, size_t n,
                          bool waits)
{
    static int64_t added[TIMES_MAX], own[TIMES_MAX];
    static struct driver_reading reading;
    struct driver_error error;
    for (size_t i = 0; i < n; i++) {
        if (waits)
            wait_in_vain(subject->driver, instrument);
        instrument_ns = nothing_ns = 0;
        int64_t begun = now_ns();
        enum driver_result r = subject->driver->measure(instrument, &reading, &error);
        int64_t took = now_ns() - begun;
        must(subject->name, r, &error);
        own[i] = instrument_ns;
        added[i] = took - own[i];
    }
    printf("{\"name\":\"%s%s\",", subject->name, waits ? ", after a wait" : "");
    print_list("added_us", added, n);
    printf(",");
    print_list("instrument_us", own, n);
    printf("}\n");
}

static void run(const struct subject *subject, size_t n)
{
    struct sim_kind kind = *subject->sim;
    const struct driver *driver = subject->driver;
    bool usb = driver == &ocean_ooi_driver;
    struct ocean_bench usb_wire = { .memory = NULL };
    struct driver_identity identity;
    struct driver_error error;
    struct instrument *instrument;

    timed = subject->sim;
    kind.take = timed_take;
    kind.give = timed_give;
    ocean_bench_make(&usb_wire, &kind, subject->options);
    struct wire_memory *wire = usb_wire.memory;
    struct driver_options options = {
        .address = usb ? ocean_bench_address() : "",
        .wire = usb ? &usb_wire.source : wire_memory_source(wire),
    };
    must(subject->name, driver->open(&options, &instrument, &identity, &error), &error);
    place(wire, "place black");
    must("zero", driver->calibrate(instrument, DRIVER_CALIBRATION_ZERO, &error), &error);
    place(wire, "place white");
    must("white", driver->calibrate(instrument, DRIVER_CALIBRATION_WHITE, &error), &error);
    place(wire, "place skin");
    measure_often(subject, instrument, n, false);
    if (identity.has_button)
        measure_often(subject, instrument, n, true);
    driver->close(instrument);
    ocean_bench_free(&usb_wire);
    ocean_bench_clean();
}

int main(int argc, char **argv)
{
    char *end = NULL;
    long n = argc == 2 ? strtol(argv[1], &end, 10) : 0;
    if (argc != 2 || end == argv[1] || *end != '\0' || n < 1 || n > TIMES_MAX) {
        fprintf(stderr, "usage: drivers TIMES (1 to %d)\n", TIMES_MAX);
        return 2;
    }
    for (size_t i = 0; i < sizeof subjects / sizeof *subjects; i++)
        run(&subjects[i], (size_t)n);
    return 0;
}
