/* sim.h - the instrument's end of a wire: bytes in, bytes out, by a clock that is passed in.
 *
 * A simulator is written from the makers' and others' descriptions of the protocol
 * alone and includes nothing of drivers/: where both understood a description wrongly they
 * would agree, but never because they share a line.
 *
 * It knows no transport: wire_memory.h connects it to a driver inside one program, mock_tty.h
 * and mock_usb.h to unmodified programs through a tty or usbfs of umockdev. */
#ifndef SKINSPEC_TESTS_SIM_SIM_H
#define SKINSPEC_TESTS_SIM_SIM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

struct sim; /* each kind's own */

/* Not thread-safe: whoever connects it locks. */
struct sim_kind {
    const char *name; /* "cm700d" */

    /* options: "key=value,..." or ""; each kind's header lists them.  All have `serial`, `delays`
     * (a factor on every time it takes, 0: none), `seed`, `lightness` (of what lies
     * under the port at first).  NULL, and why on stderr, for options that cannot be. */
    struct sim *(*make)(const char *options);
    void (*free)(struct sim *sim);

    /* Bytes of the host; the channel is 0 on a line, the endpoint's address on USB.  0, or
     * -errno, how the transfer ends. */
    int (*take)(struct sim *sim, uint8_t channel, const uint8_t *bytes, size_t n, int64_t now_us);

    /* Bytes for the host that are due by now, at most size: > 0; 0: none yet, *due_us is when
     * (INT64_MAX: not before it is asked or acted on); < 0: -errno of the transfer.  On
     * USB each call is one transfer and ends at a short packet. */
    ssize_t (*give)(struct sim *sim, uint8_t channel, uint8_t *bytes, size_t size, int64_t now_us,
                    int64_t *due_us);

    /* What the operator or fate does: "press", "place white|black|skin", "slide 1", "battery
     * 2", "charge", "fault KIND ...", "reset" (power cycled).  False: no such action. */
    bool (*act)(struct sim *sim, const char *action, int64_t now_us);

    /* The true reflectance it will measure of what lies under its port, at nm; with the gloss
     * (SCI) or without (SCE). */
    double (*truth)(const struct sim *sim, double nm, bool sci);

    /* For mock_tty.h and mock_usb.h: what the host sees. */
    uint16_t vid, pid;
    const char *product;
};

/* The members up to truth, of a kind whose functions are named NAME_make() ... NAME_truth(). */
#define SIM_CALLS(kind) \
    .name = #kind, .make = kind##_make, .free = kind##_free, .take = kind##_take, \
    .give = kind##_give, .act = kind##_act, .truth = kind##_truth

extern const struct sim_kind sim_cm700d, sim_cm2600d, sim_sp62, sim_usb2000, sim_usb4000,
    sim_hr2000, sim_hr4000;

/* NULL where there is none of that name.  sim.c has the list of those in this folder. */
const struct sim_kind *sim_find(const char *name);

/* One that a driver brings, drivers/NAME/tests/sim_NAME.c, is found once its file says
 * SIM_IS_FOUND(sim_NAME), without a line elsewhere. */
struct sim_place {
    const struct sim_kind *kind;
    struct sim_place *next;
};
void sim_add(struct sim_place *place); /* before main() */
#define SIM_IS_FOUND(sim) \
    __attribute__((constructor)) static void sim##_is_found(void) \
    { \
        static struct sim_place place = { &(sim), NULL }; \
        sim_add(&place); \
    } \
    struct sim

#endif
