/* clock.h - the machine's clocks as whole numbers, and a time as text. */
#ifndef SKINSPEC_BASE_CLOCK_H
#define SKINSPEC_BASE_CLOCK_H

#include <stdint.h>

int64_t clock_monotonic_ms(void); /* for waits: stands still while the machine is suspended */
int64_t clock_boottime_ms(void);  /* for ages: does not */
int64_t clock_realtime_ms(void);  /* since 1970; for people: it may be set back */

/* RFC 3339, UTC, with milliseconds: "2026-01-31T12:00:00.000Z".  Times before 1970 and after
 * 9999, which it cannot write, become the first and the last that it can. */
enum { CLOCK_TEXT_SIZE = 32 };
void clock_text(int64_t realtime_ms, char text[CLOCK_TEXT_SIZE]);

#endif
