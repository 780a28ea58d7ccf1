/* clock.c - clock_gettime() in milliseconds. */
#include "base/clock.h"

#include <stdio.h>
#include <time.h>

static int64_t now_ms(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return (int64_t)t.tv_sec * 1000 + t.tv_nsec / 1000000;
}

int64_t clock_monotonic_ms(void)
{
    return now_ms(CLOCK_MONOTONIC);
}

int64_t clock_boottime_ms(void)
{
    return now_ms(CLOCK_BOOTTIME);
}

int64_t clock_realtime_ms(void)
{
    return now_ms(CLOCK_REALTIME);
}

void clock_text(int64_t realtime_ms, char text[CLOCK_TEXT_SIZE])
{
    const int64_t last = INT64_C(253402300799999);
    struct tm utc;
    int64_t ms = realtime_ms < 0 ? 0 : realtime_ms > last ? last : realtime_ms;
    time_t seconds = (time_t)(ms / 1000);
    gmtime_r(&seconds, &utc);
    size_t n = strftime(text, CLOCK_TEXT_SIZE, "%Y-%m-%dT%H:%M:%S", &utc);
    snprintf(text + n, CLOCK_TEXT_SIZE - n, ".%03dZ", (int)(ms % 1000));
}
