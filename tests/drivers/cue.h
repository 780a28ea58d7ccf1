/* cue.h - a wire on which something happens when the driver has said a certain thing: faults at
 * the reply to a named command, wherever in the conversation it comes. */
#ifndef SKINSPEC_TESTS_DRIVERS_CUE_H
#define SKINSPEC_TESTS_DRIVERS_CUE_H

#include "tests/sim/wire_memory.h"

enum { CUES_MAX = 8 };
#define CUE_ALWAYS 0xffffu

struct cued_wire {
    struct link_source source; /* first; goes into driver_options.wire */
    struct wire_memory *wire;
    struct cue {
        const char *command; /* what the host's bytes begin with */
        unsigned on;         /* 1: the next time; 0: over; CUE_ALWAYS */
        char action[96];     /* act() of the simulator, before it hears the command */
    } cue[CUES_MAX];
    char said[64];      /* the last command */
    unsigned sends;     /* all of them */
    const char *never;  /* commands, between commas, that may not be sent; NULL */
    unsigned forbidden; /* how many of them were */
};

void cued_wire_init(struct cued_wire *cued, struct wire_memory *wire);
void cue(struct cued_wire *cued, const char *command, unsigned on, const char *action);

#endif
