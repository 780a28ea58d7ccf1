/* instrument_out.c - how instruments stand. */
#include "cli/instrument_out.h"

#include <math.h>
#include <stdio.h>

#include "cli/guide.h"
#include "cli/member.h"

/* "8 mm", "97 %"; "-" where it is not known. */
static const char *with_unit(double x, const char *unit, char text[32])
{
    if (isnan(x))
        snprintf(text, 32, "-");
    else
        snprintf(text, 32, "%g %s", x, unit);
    return text;
}

static void print_use(const cJSON *instrument)
{
    char text[GUIDE_TIME_SIZE];
    double queue = member_number(instrument, "queue");
    if (!member_true(instrument, "leased"))
        return;
    printf("%16s  in use", "");
    double left_s = member_number(instrument, "lease_expires_in_ms") / 1000.0;
    if (!isnan(left_s) && left_s >= 60.0)
        printf(" for up to %s", guide_duration(left_s, text));
    else if (!isnan(left_s))
        printf(" for up to %.0f s", left_s);
    if (queue > 0.0)
        printf(", %.0f waiting", queue);
    putchar('\n');
}

static void print_check(const cJSON *check)
{
    if (member_text(check, "tile")[0] == '\0')
        return;
    bool passed = member_true(check, "passed");
    printf("%16s  check of tile %s %s at %s, dE00 %.2f of %g%s\n", "", member_text(check, "tile"),
           passed ? "passed" : "FAILED", member_text(check, "taken_at"),
           member_number(check, "dE00"), member_number(check, "limit"),
           passed ? "" : ": records are flagged 'drift' until one passes");
}

static void print_needs(const cJSON *instrument)
{
    char text[GUIDE_TIME_SIZE];
    const char *error = member_text(instrument, "error");
    const cJSON *step;
    if (*error != '\0')
        printf("%16s  %s\n", "", error);
    if (member_true(instrument, "charging"))
        printf("%16s  the flash is charging\n", "");
    cJSON_ArrayForEach(step, member(instrument, "calibration"))
    {
        double left_s = member_number(step, "expires_in_s");
        if (member_true(step, "due"))
            printf("%16s  %s is due (%s): %s\n", "", member_text(step, "step"), guide_cause(step),
                   member_text(step, "place"));
        else if (!isnan(left_s))
            printf("%16s  %s is good for %s\n", "", member_text(step, "step"),
                   guide_duration(left_s, text));
    }
}

void instrument_out(const cJSON *instruments)
{
    const cJSON *one;
    printf("%-16s  %-15s  %-24s  %-12s  %-8s  %-8s  %s\n", "NAME", "STATE", "MODEL", "SERIAL",
           "GEOMETRY", "APERTURE", "BATTERY");
    if (cJSON_GetArraySize(instruments) == 0)
        puts("none; skinspecd --instrument simulated gives the station one to try");
    cJSON_ArrayForEach(one, instruments)
    {
        char model[128], aperture[32], battery[32];
        const char *maker = member_text(one, "maker");
        snprintf(model, sizeof model, "%.60s%s%.60s", maker, *maker != '\0' ? " " : "",
                 member_text(one, "model"));
        printf("%-16s  %-15s  %-24s  %-12s  %-8s  %-8s  %s\n", member_text(one, "instrument"),
               member_text(one, "state"), model, member_text(one, "serial"),
               member_text(one, "geometry"),
               with_unit(member_number(one, "aperture_mm"), "mm", aperture),
               with_unit(member_number(one, "battery_percent"), "%", battery));
        print_use(one);
        print_needs(one);
        print_check(member(one, "check"));
    }
}
