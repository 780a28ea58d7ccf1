/* check_fit.c - what was found, and what to do about it. */
#include "station/check_fit.h"

/* What to do, in the order in which it is told: what explains the others comes first. */
static const struct {
    unsigned warning, flag; /* one of them */
    const char *token, *text;
} unfit[] = {
    { DRIVER_WARNING_LAMP_WEAK, 0, "lamp_weak",
      "the instrument's lamp flashed weakly; charge the battery or connect its supply, let it rest "
      "a minute; if it stays so, the lamp wants service" },
    { DRIVER_WARNING_TEMPERATURE, 0, "temperature",
      "the instrument is colder or warmer than it should be; leave it in the room for half an "
      "hour, and calibrate" },
    { DRIVER_WARNING_CALIBRATION_OLD, 0, "calibration_old",
      "the instrument asks for a calibration; calibrate" },
    { DRIVER_WARNING_CONDITIONS_DIFFER, 0, "conditions_differ",
      "the instrument is not set as for its calibration; set it up again, and calibrate" },
    { DRIVER_WARNING_OVER_RANGE, 0, "over_range",
      "brighter than the instrument can measure; calibrate, or take a darker tile" },
    { 0, QUALITY_SCI_BELOW_SCE, "sci_below_sce",
      "less light with the mirror reflection than without; place the port flat on the tile" },
    { 0, QUALITY_OUTLIER, "outlier",
      "a shot lies far from the others; clean the tile and keep the port flat on it" },
    { 0, QUALITY_SPREAD, "spread",
      "the shots differ more than those of a tile do; clean the tile and keep the port flat on "
      "it" },
};

bool check_fit(const struct measuring *m, const struct quality_set *set, struct refusal *refusal)
{
    for (size_t i = 0; i < sizeof unfit / sizeof *unfit; i++) {
        bool found =
            (m->warnings & unfit[i].warning) != 0 || ((m->flags | set->flags) & unfit[i].flag) != 0;
        if (!found)
            continue;
        refusal_set(refusal, REASON_CHECK_UNFIT, "%s: %s; then check again", unfit[i].token,
                    unfit[i].text);
        return false;
    }
    return true;
}
