/* contract.h - what drivers/driver.h asks of every driver, as tests.
 *
 * A driver passes with a program of its own, test_NAME_contract.c here or in
 * drivers/NAME/tests: fixtures that say how to have its instrument, or what stands for it, in each
 * of these situations.  Where a simulator stands for it, tests/drivers/cue.h makes one fall silent
 * at a certain command. */
#ifndef SKINSPEC_TESTS_DRIVERS_CONTRACT_H
#define SKINSPEC_TESTS_DRIVERS_CONTRACT_H

#include "drivers/driver.h"

enum contract_situation {
    CONTRACT_SOUND,        /* quick, whole, uncalibrated; button not pressed; some samples */
    CONTRACT_TAKES_TIME,   /* sound, but every calibration and shot takes half a second or more; a
                              shot   that was cancelled is answered nevertheless, as in life */
    CONTRACT_FALLS_SILENT, /* never answers its second shot, all others well and quickly */
    CONTRACT_SILENT,       /* does not answer even when it is opened */
    CONTRACT_SITUATIONS
};

struct contract_fixture {
    const struct driver *driver;

    /* Set it up and give its address; the same situation means the same instrument,
     * switched off and on.  NULL: cannot be had, its tests are skipped. */
    const char *(*set_up)(enum contract_situation situation);
    void (*tear_down)(void);

    /* The wire to what set_up() made; NULL: the address says it. */
    const struct link_source *(*wire)(void);

    /* What happens to the simulator that stands for it, from any thread: "count shots", after which
     * skin lies there and nobody else presses; "press", "lightness N", "expect shots N"
     * (tests/sim/handheld.h).  NULL: a press makes no shot. */
    bool (*act)(const char *action);

    /* What the driver allows a shot beside the reply timeout, where the instrument says nothing
     * before it is done; 0 where it acknowledges at once or can be asked meanwhile. */
    int shot_ms;

    /* Whether two instruments set up alike measure exactly alike. */
    bool deterministic;
};

/* The whole of main(): the suite with Unity, for each of the fixtures (models of one driver). */
int contract_main(const struct contract_fixture *fixtures, size_t n);

/* For the program's setUp() and tearDown(). */
void contract_set_up(void);
void contract_tear_down(void);

#endif
