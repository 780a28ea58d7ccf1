/* wall_clock.h - a simulated instrument's own clock: date and time, no time zone. */
#ifndef SKINSPEC_TESTS_SIM_WALL_CLOCK_H
#define SKINSPEC_TESTS_SIM_WALL_CLOCK_H

#include <stdbool.h>
#include <stdint.h>

struct wall_clock_time {
    int year, month, day, hour, minute, second;
};

/* All 0: 1 January 2000 when now_us was 0. */
struct wall_clock {
    int64_t set_to_s, set_at_us; /* seconds since 2000 */
    bool lost;                   /* until it is set */
};

struct wall_clock_time wall_clock_now(const struct wall_clock *clock, int64_t now_us);
void wall_clock_set(struct wall_clock *clock, struct wall_clock_time to, int64_t now_us);

#endif
