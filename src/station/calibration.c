/* calibration.c - the reasons, tried one after the other. */
#include "station/calibration.h"

#include <string.h>

static const struct {
    const char *name, *text;
} dues[] = {
    [CALIBRATION_GOOD] = { "good", "calibrated" },
    [CALIBRATION_NEVER] = { "never", "not calibrated yet" },
    [CALIBRATION_INSTRUMENT] = { "instrument", "the instrument asks to be calibrated" },
    [CALIBRATION_BOOT] = { "boot", "calibrated before this machine was started" },
    [CALIBRATION_RECONNECTED] = { "reconnected", "calibrated before the instrument was connected" },
    [CALIBRATION_APERTURE] = { "aperture", "calibrated with another aperture" },
    [CALIBRATION_EXPIRED] = { "expired", "the calibration is too old" },
    [CALIBRATION_EARLIER_STEP] = { "earlier_step", "the step before it is due" },
};

enum { DUES = sizeof dues / sizeof *dues };

const char *calibration_due_name(enum calibration_due due)
{
    return (unsigned)due < DUES ? dues[due].name : "unknown";
}

const char *calibration_due_text(enum calibration_due due)
{
    return (unsigned)due < DUES ? dues[due].text : "unknown";
}

static bool this_boot(const struct calibration_made *made, const struct calibration_now *now)
{
    return strcmp(made->boot_id, now->boot_id) == 0;
}

static bool too_old(const struct calibration_made *made, const struct calibration_now *now,
                    size_t step)
{
    int64_t limit_ms = now->max_age_ms[step];
    return limit_ms > 0 && now->boottime_ms - made->boottime_ms >= limit_ms;
}

static enum calibration_due judge_step(const struct calibration_made *made,
                                       const struct calibration_now *now, size_t step)
{
    if (!made->made)
        return CALIBRATION_NEVER;
    if (now->instrument_asks[step])
        return CALIBRATION_INSTRUMENT;
    if (!this_boot(made, now))
        return CALIBRATION_BOOT;
    if (made->connection != now->connection)
        return CALIBRATION_RECONNECTED;
    if (made->aperture_mm != now->aperture_mm)
        return CALIBRATION_APERTURE;
    return too_old(made, now, step) ? CALIBRATION_EXPIRED : CALIBRATION_GOOD;
}

struct calibration_state calibration_judge(const struct calibration_made made[CALIBRATION_STEPS],
                                           const struct calibration_now *now)
{
    struct calibration_state state = { .good = true };
    for (size_t step = 0; step < CALIBRATION_STEPS; step++) {
        bool known = made[step].made && this_boot(&made[step], now);
        state.due[step] = judge_step(&made[step], now, step);
        if (state.due[step] == CALIBRATION_GOOD && !state.good)
            state.due[step] = CALIBRATION_EARLIER_STEP;
        state.good = state.good && state.due[step] == CALIBRATION_GOOD;
        state.age_ms[step] = known ? now->boottime_ms - made[step].boottime_ms : -1;
        state.expires_in_ms[step] = -1;
        if (state.due[step] == CALIBRATION_GOOD && now->max_age_ms[step] > 0)
            state.expires_in_ms[step] = now->max_age_ms[step] - state.age_ms[step];
    }
    return state;
}
