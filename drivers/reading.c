/* reading.c - counts into spectra, and what no surface gives. */
#include "drivers/reading.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- doubts ------------------------------------------------------------------------- */

static int32_t counts(double reflectance, double raw_unit)
{
    return (int32_t)lround(reflectance / raw_unit);
}

enum doubt doubt_spectrum(size_t n, const int32_t *raw, double raw_unit)
{
    const int32_t limit = counts(DOUBT_RANGE_LIMIT, raw_unit);
    const int32_t jump = counts(DOUBT_JUMP_LIMIT, raw_unit);
    int32_t most = 0;
    for (size_t i = 0; i < n; i++) {
        if (raw[i] < 0 || raw[i] > limit)
            return DOUBT_OUT_OF_RANGE;
        if (i > 0 && abs(raw[i] - raw[i - 1]) > jump)
            return DOUBT_JUMP;
        most = raw[i] > most ? raw[i] : most;
    }
    return most == 0 ? DOUBT_ALL_ZERO : DOUBT_NONE;
}

enum doubt doubt_pair(size_t n, const int32_t *sci, const int32_t *sce, double raw_unit, bool gloss)
{
    const int32_t slack = counts(DOUBT_ORDER_SLACK, raw_unit);
    const int32_t limit = counts(DOUBT_GLOSS_LIMIT, raw_unit);
    if (memcmp(sci, sce, n * sizeof *sci) == 0)
        return DOUBT_SAME;
    for (size_t i = 0; i < n; i++)
        if (sci[i] < sce[i] - slack)
            return DOUBT_ORDER;
    for (size_t i = 0; gloss && n >= 2 && i < n; i++) {
        size_t before = i == 0 ? 1 : i - 1, behind = i + 1 == n ? i - 1 : i + 1;
        int32_t expect = (sci[before] - sce[before] + sci[behind] - sce[behind]) / 2;
        if (abs(sci[i] - sce[i] - expect) > limit)
            return DOUBT_GLOSS;
    }
    return DOUBT_NONE;
}

enum doubt doubt_both(size_t n, const int32_t *sci, const int32_t *sce, double raw_unit, bool gloss)
{
    enum doubt doubt = doubt_spectrum(n, sce, raw_unit);
    if (doubt == DOUBT_NONE)
        doubt = doubt_spectrum(n, sci, raw_unit);
    return doubt == DOUBT_NONE ? doubt_pair(n, sci, sce, raw_unit, gloss) : doubt;
}

static bool bytes_are_to_blame(enum doubt doubt)
{
    return doubt == DOUBT_WRONG_COUNT || doubt == DOUBT_NO_NUMBER || doubt == DOUBT_GLOSS ||
           doubt == DOUBT_SAME;
}

enum driver_result doubt_fail(enum doubt doubt, struct driver_error *error)
{
    static const char *const text[] = {
        [DOUBT_NONE] = "",
        [DOUBT_WRONG_COUNT] = "a spectrum came with another number of bands than the instrument "
                              "has: measure again; if it stays so, check the cable",
        [DOUBT_NO_NUMBER] =
            "a spectrum came with a value that is no number, or with a negative one: is "
            "there skin or a sample under the port? Then measure again; if it "
            "stays so, check the cable",
        [DOUBT_OUT_OF_RANGE] =
            "a band is outside 0 to 200 %: is there skin or a sample under the port? "
            "Calibrate and measure again",
        [DOUBT_ALL_ZERO] = "no light came back at all: is there skin or a sample under the port? "
                           "Calibrate and measure again",
        [DOUBT_JUMP] = "neighbouring bands differ by more than any surface's do: calibrate and "
                       "measure again",
        [DOUBT_ORDER] = "there is less light with the gloss than without it: hold the instrument "
                        "still and measure again",
        [DOUBT_GLOSS] = "the gloss alone jumps from band to band, as when a value came damaged: "
                        "measure again; if it stays so, check the cable",
        [DOUBT_SAME] = "the spectra with and without gloss are one and the same: measure again",
    };
    if (doubt == DOUBT_NONE)
        return DRIVER_OK;
    return driver_fail(error, bytes_are_to_blame(doubt) ? DRIVER_PROTOCOL : DRIVER_IMPLAUSIBLE,
                       NULL, "%s", text[doubt]);
}

/* ---- filling ------------------------------------------------------------------------ */

void reading_init(double raw_unit, unsigned warnings, struct driver_reading *ret)
{
    memset(ret, 0, sizeof *ret);
    ret->raw_unit = raw_unit;
    ret->warnings = warnings;
}

void reading_add(const struct driver_grid *grid, const int32_t *raw, enum specular specular,
                 double aperture_mm, struct driver_reading *ret)
{
    bool sce = specular == SPECULAR_SCE;
    struct spectrum *spectrum = sce ? &ret->sce : &ret->sci;
    memcpy(sce ? ret->raw_sce : ret->raw_sci, raw, grid->n * sizeof *raw);
    *(sce ? &ret->has_sce : &ret->has_sci) = true;
    spectrum->first_nm = grid->first_nm;
    spectrum->step_nm = grid->step_nm;
    spectrum->n = grid->n;
    spectrum->specular = specular;
    spectrum->aperture_mm = aperture_mm;
    for (size_t i = 0; i < grid->n; i++)
        spectrum->value[i] = raw[i] * ret->raw_unit;
}

void reading_plain_text(const char *bytes, size_t n, char *ret, size_t size)
{
    size_t length = 0;
    for (size_t i = 0; i < n && length + 1 < size; i++)
        if (bytes[i] >= ' ' && bytes[i] <= '~' && (length > 0 || bytes[i] != ' '))
            ret[length++] = bytes[i];
    while (length > 0 && ret[length - 1] == ' ')
        length--;
    ret[length] = '\0';
}
