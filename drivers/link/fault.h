/* fault.h - what can go wrong on a wire, at a stated byte; for tests.
 *
 * A fault_source opens what another source gives and spoils it once, or from then on, where
 * that makes sense; a link opened after that is whole: the driver comes back. */
#ifndef SKINSPEC_DRIVERS_LINK_FAULT_H
#define SKINSPEC_DRIVERS_LINK_FAULT_H

#include "drivers/link/link.h"

enum fault_kind {
    FAULT_NONE,
    FAULT_DROP,      /* count bytes are lost */
    FAULT_FLIP,      /* the byte is XORed with mask */
    FAULT_SPLIT,     /* a receive ends before the byte */
    FAULT_DELAY,     /* the byte and what follows come delay_ms later, once */
    FAULT_DRIBBLE,   /* from the byte on all come one by one, delay_ms apart */
    FAULT_GARBAGE,   /* count bytes of noise come before it: 0xf1, 0xf2 ... */
    FAULT_DUPLICATE, /* the reply comes once more when all of it has come */
    FAULT_TRUNCATE,  /* the rest of the reply is lost; with byte 0: silence */
    FAULT_CLOSE,     /* DRIVER_GONE, whatever is done, once the bytes before it have come */
};

/* Where: before byte `byte`, from 0, of reply number `reply`, from 1; of all that comes where
 * reply is 0.  A reply is what comes after one send and before the next. */
struct fault {
    enum fault_kind kind;
    unsigned reply;
    size_t byte;
    size_t count;
    uint8_t mask;
    int delay_ms;
};

struct fault_source {
    struct link_source source; /* for driver_options.wire */
    const struct link_source *wire;
    struct fault fault;
    unsigned replies; /* so far, links opened later included */
    size_t bytes;     /* of this reply, or of all where fault.reply is 0 */
    bool happened;
};

/* wire outlives the source, which outlives its links. */
void fault_source_init(struct fault_source *source, const struct link_source *wire,
                       struct fault fault);

#endif
