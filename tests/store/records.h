/* records.h - records, calibrations and subjects for tests: plausible, no two alike. */
#ifndef SKINSPEC_TESTS_STORE_RECORDS_H
#define SKINSPEC_TESTS_STORE_RECORDS_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "db/store.h"
#include "tests/support/dice.h"

/* A number that does not end within 53 bits, so that rounding would show. */
static inline void records_spectrum(struct dice *dice, size_t n, enum specular specular,
                                    struct spectrum *ret)
{
    ret->first_nm = 400.0;
    ret->step_nm = n > 1 ? 300.0 / (double)(n - 1) : 10.0;
    ret->n = n;
    ret->specular = specular;
    ret->aperture_mm = 8.0;
    for (size_t i = 0; i < n; i++)
        ret->value[i] = dice_between(dice, 0.05, 0.7);
    memset(ret->flag, 0, n);
}

static inline void records_uuid(struct dice *dice, char text[STORE_UUID_SIZE])
{
    unsigned long long hi = dice_bits(dice), lo = dice_bits(dice);
    snprintf(text, STORE_UUID_SIZE, "%08llx-%04llx-4%03llx-8%03llx-%012llx", hi >> 32,
             hi >> 16 & 0xffff, hi & 0xfff, lo >> 52, lo & 0xffffffffffff);
}

static inline struct store_instrument records_instrument(void)
{
    return (struct store_instrument){ "simulated", "skinspec", "d/8", "S-0001", "1.0" };
}

/* Three replicates of 31 bands, SCE and SCI, with a match: what a reading is.  The
 * caller's to free; NULL without memory. */
static inline struct store_record *records_make(struct dice *dice)
{
    struct store_record *r = calloc(1, sizeof *r);
    if (r == NULL)
        return NULL;
    records_uuid(dice, r->uuid);
    snprintf(r->parameters_sha256, sizeof r->parameters_sha256, "%064llx",
             (unsigned long long)dice_bits(dice));
    r->owner_uid = 1000;
    strcpy(r->operator_name, "Zoë");
    r->instrument = records_instrument();
    r->specular = SPECULAR_SCE;
    r->aperture_mm = 8.0;
    r->surface = r->raw_unit = (double)NAN;
    r->replicates = 3;
    for (size_t i = 0; i < r->replicates; i++) {
        records_spectrum(dice, 31, SPECULAR_SCE, &r->replicate[i]);
        records_spectrum(dice, 31, SPECULAR_SCI, &r->replicate_sci[i]);
    }
    records_spectrum(dice, 31, SPECULAR_SCE, &r->spectrum);
    for (int i = 0; i < 3; i++) {
        r->XYZ[i] = dice_between(dice, 10.0, 60.0);
        r->Lab[i] = dice_between(dice, 5.0, 70.0);
        r->sRGB[i] = (int)dice_below(dice, 256);
    }
    r->ITA = dice_between(dice, -60.0, 70.0);
    strcpy(r->ita_scheme, "chardon-1991");
    strcpy(r->illuminant, "D65");
    strcpy(r->observer, "10");
    strcpy(r->site, "inner forearm");
    strcpy(r->flags, "[\"a_falling\"]");
    snprintf(r->match_json, sizeof r->match_json,
             "{\"Cm\":%.17g,\"Bm\":%.17g,\"Ch\":%.17g,\"dE00\":%.17g}",
             dice_between(dice, 0.0, 0.5), dice_between(dice, 0.0, 1.0),
             dice_between(dice, 0.0, 0.1), dice_between(dice, 0.0, 3.0));
    strcpy(r->table_name, "two-layer");
    memset(r->table_sha256, 'a', 64);
    strcpy(r->method, "lab");
    strcpy(r->boot_id, "f325439a-0fb6-4e34-92f6-680202b1ed90");
    r->boottime_ms = (int64_t)dice_below(dice, 1000000);
    r->fence = 7;
    return r;
}

#endif
