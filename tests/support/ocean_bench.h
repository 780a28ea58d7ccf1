/* ocean_bench.h - what the tests of the Ocean driver share: the simulated spectrometer behind a
 * wire that can be spoiled, and files of its tiles. */
#ifndef SKINSPEC_TESTS_SUPPORT_OCEAN_BENCH_H
#define SKINSPEC_TESTS_SUPPORT_OCEAN_BENCH_H

#include "drivers/link/link.h"
#include "tests/sim/wire_memory.h"

struct ocean_bench {
    struct link_source source; /* for driver_options.wire */
    struct wire_memory *memory;
    uint16_t pid; /* what the link tells; 0: nothing */

    bool hands; /* an operator puts what each step needs at the port: black, white, skin */

    /* What is spoiled, all 0 at first. */
    unsigned silent_measure; /* in that call of measure, from 1, no spectrum comes */
    uint8_t channel;         /* of a transfer to the host: */
    unsigned transfer;       /* this one, from 1 */
    bool every;              /* and all after it */
    size_t byte;             /* the byte there */
    uint8_t mask;            /* is XORed */

    unsigned measures, transfers; /* so far */
    bool spoiled;
};

/* One with this simulator, and address_of it.  Frees what it was before. */
void ocean_bench_make(struct ocean_bench *bench, const struct sim_kind *kind, const char *options);
void ocean_bench_free(struct ocean_bench *bench);

/* Count transfers anew. */
void ocean_bench_spoil(struct ocean_bench *bench, uint8_t channel, unsigned transfer, size_t byte,
                       uint8_t mask);

/* "usb,tile=FILE,port_mm=8", and the file of the simulator's white tile behind it. */
const char *ocean_bench_address(void);
/* A file in the same folder, made for the test. */
const char *ocean_bench_path(const char *name);
void ocean_bench_clean(void); /* files and folder */

#endif
