/* heard.h - what the code under test logs, kept instead of shown. */
#ifndef SKINSPEC_TESTS_SUPPORT_HEARD_H
#define SKINSPEC_TESTS_SUPPORT_HEARD_H

#include <stdbool.h>

/* Begin anew; heard_stop() gives messages back to standard error. */
void heard_start(void);
void heard_stop(void);

int heard_count(void);
const char *heard_last(void); /* "" while there is none */
bool heard_contains(const char *part);

#endif
