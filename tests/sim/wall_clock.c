/* wall_clock.c - the C library knows the calendar. */
#include "tests/sim/wall_clock.h"

#include <time.h>

static const int64_t YEAR_2000_S = 946684800; /* date -u -d 2000-01-01 +%s */

struct wall_clock_time wall_clock_now(const struct wall_clock *clock, int64_t now_us)
{
    struct tm tm;
    time_t t = (time_t)(YEAR_2000_S + clock->set_to_s + (now_us - clock->set_at_us) / 1000000);
    gmtime_r(&t, &tm);
    return (struct wall_clock_time){ tm.tm_year + 1900, tm.tm_mon + 1, tm.tm_mday,
                                     tm.tm_hour,        tm.tm_min,     tm.tm_sec };
}

static int64_t leap_days_before(int64_t year)
{
    year--;
    return year / 4 - year / 100 + year / 400;
}

void wall_clock_set(struct wall_clock *clock, struct wall_clock_time to, int64_t now_us)
{
    static const int before[] = { 0, 31, 59, 90, 120, 151, 181, 212, 243, 273, 304, 334 };
    int64_t leap_now = leap_days_before(to.year + 1) - leap_days_before(to.year);
    int64_t days = (int64_t)(to.year - 2000) * 365 + leap_days_before(to.year) -
                   leap_days_before(2000) + before[to.month - 1] + (to.month > 2 ? leap_now : 0) +
                   to.day - 1;
    clock->set_to_s = ((days * 24 + to.hour) * 60 + to.minute) * 60 + to.second;
    clock->set_at_us = now_us;
    clock->lost = false;
}
