/* conversation.h - a test talks to a simulator, by a clock of its own. */
#ifndef SKINSPEC_TESTS_SUPPORT_CONVERSATION_H
#define SKINSPEC_TESTS_SUPPORT_CONVERSATION_H

#include "tests/sim/sim.h"

enum { CONVERSATION_TEXT = 8192 };

struct conversation {
    const struct sim_kind *kind;
    struct sim *sim;
    int64_t now_us;
    char text[CONVERSATION_TEXT]; /* what came last, its NULs as blanks */
    size_t n;
};

/* Made anew, at 1 s of its clock. */
void conversation_begin(struct conversation *c, const struct sim_kind *kind, const char *options);
void conversation_end(struct conversation *c);

/* Send; then all that comes within seconds, in text, which is returned. */
const char *conversation_ask(struct conversation *c, const char *bytes, double seconds);
const char *conversation_hear(struct conversation *c, double seconds);

/* Fails the test where there is no such action. */
void conversation_act(struct conversation *c, const char *action);

/* Field i (from 0) of the reply as a number, its separators being any of `between`; fails the test
 * where there is none. */
double conversation_number(const struct conversation *c, size_t i, const char *between);
size_t conversation_fields(const struct conversation *c, const char *between);

#endif
