/* patience.h - how long a test bears with a machine that is slow today, and how often it repeats.
 *
 * TEST_PATIENCE=20 in the environment makes what a busy machine may add 20 times as much: under
 * valgrind all that is computed takes that long, what is waited for does not.  PLUGS=300 repeats
 * the tests in which an instrument is pulled out. */
#ifndef SKINSPEC_TESTS_SUPPORT_PATIENCE_H
#define SKINSPEC_TESTS_SUPPORT_PATIENCE_H

#include <stdlib.h>

/* A whole number >= 1 from the environment; 1 where there is none. */
static inline int patience_number(const char *name)
{
    const char *text = getenv(name);
    long n = text != NULL ? strtol(text, NULL, 10) : 1;
    return n >= 1 && n <= 100000 ? (int)n : 1;
}

static inline int patience_ms(int ms)
{
    return ms * patience_number("TEST_PATIENCE");
}

/* What a busy machine may add. */
#define SLACK_MS patience_ms(400)

#endif
