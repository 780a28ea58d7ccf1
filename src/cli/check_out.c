/* check_out.c - a check as a few lines, and as one. */
#include "cli/check_out.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "cli/member.h"

void check_out(const cJSON *check)
{
    bool passed = member_true(check, "passed");
    double aperture_mm = member_number(check, "aperture_mm");
    printf("check    %s: dE00 %.2f from its reference, at most %g; rms %.4f\n",
           passed ? "passed" : "FAILED", member_number(check, "dE00"),
           member_number(check, "limit"), member_number(check, "rms"));
    printf("tile     %s, %s %s, %g mm, %" PRId64 " shot%s\n", member_text(check, "tile"),
           member_text(check, "instrument"), member_text(check, "serial"), aperture_mm,
           member_integer(check, "replicates"),
           member_integer(check, "replicates") == 1 ? "" : "s");
    printf("taken    %s\n", member_text(check, "taken_at"));
    if (!passed)
        printf("beware   records of this instrument through %g mm are flagged 'drift' until this "
               "tile passes: clean tile and port, calibrate ('skinspec calibrate --force'), check "
               "again\n",
               aperture_mm);
}

void check_out_tile(const cJSON *tile)
{
    const char *source = member_text(tile, "source"), *name = member_text(tile, "tile");
    double limit = member_number(tile, "limit");
    if (strcmp(source, "limit") == 0)
        printf("tile     %s: a check passes up to dE00 %g from here on\n", name, limit);
    else if (strcmp(source, "measured") == 0)
        printf("tile     %s: its reference is what %s %s has measured through %g mm just now\n",
               name, member_text(tile, "instrument"), member_text(tile, "serial"),
               member_number(tile, "aperture_mm"));
    else
        printf("tile     %s: its reference is the certificate, for every instrument through %g "
               "mm\n",
               name, member_number(tile, "aperture_mm"));
    if (strcmp(source, "limit") != 0)
        printf("limit    a check passes up to dE00 %g\n", limit);
}

void check_out_head(void)
{
    printf("%-6s  %-24s  %-16s  %-16s  %-8s  %-6s  %-6s  %s\n", "SEQ", "TAKEN", "TILE", "SERIAL",
           "APERTURE", "dE00", "LIMIT", "RESULT");
}

void check_out_line(const cJSON *check)
{
    char aperture[32];
    snprintf(aperture, sizeof aperture, "%g mm", member_number(check, "aperture_mm"));
    printf("%-6" PRId64 "  %-24s  %-16s  %-16s  %-8s  %-6.2f  %-6g  %s\n",
           member_integer(check, "seq"), member_text(check, "taken_at"), member_text(check, "tile"),
           member_text(check, "serial"), aperture, member_number(check, "dE00"),
           member_number(check, "limit"), member_true(check, "passed") ? "passed" : "FAILED");
}
