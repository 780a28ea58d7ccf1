/* toy_wire.c - answers taken apart. */
#include "drivers/toy/toy_wire.h"

#include <string.h>

bool toy_read_identity(const char *line, char serial[DRIVER_NAME_SIZE])
{
    static const char model[] = "TOY1,";
    size_t n = strlen(line), before = strlen(model);
    if (strncmp(line, model, before) != 0 || n == before || n - before >= DRIVER_NAME_SIZE ||
        strspn(line + before, "0123456789") != n - before)
        return false;
    memcpy(serial, line + before, n - before + 1);
    return true;
}

bool toy_read_calibrated(const char *line, bool ret[DRIVER_CALIBRATIONS])
{
    if (strlen(line) != strlen("CAL,0,0") || strncmp(line, "CAL,", 4) != 0 || line[5] != ',' ||
        strspn(line + 4, "01") != 1 || strspn(line + 6, "01") != 1)
        return false;
    ret[DRIVER_CALIBRATION_ZERO] = line[4] == '1';
    ret[DRIVER_CALIBRATION_WHITE] = line[6] == '1';
    return true;
}

bool toy_read_done(const char *line)
{
    return strcmp(line, "OK") == 0;
}

const struct toy_code *toy_find_error(const char *line)
{
    static const struct toy_code codes[] = {
        { "ERR 1", DRIVER_REFUSED,
          "a calibration is missing: zero on the black trap, then white on the white tile" },
        { "ERR 2", DRIVER_IMPLAUSIBLE,
          "something else lies under the port: put the instrument on what is asked for, and "
          "calibrate again" },
        { "ERR 3", DRIVER_PROTOCOL, "the instrument did not understand: check the cable" },
    };
    for (size_t i = 0; i < sizeof codes / sizeof *codes; i++)
        if (strcmp(line, codes[i].line) == 0)
            return &codes[i];
    return NULL;
}

/* Up to five digits and what ends them; NULL where there is no number. */
static const char *read_number(const char *at, int32_t *ret)
{
    size_t digits = strspn(at, "0123456789");
    if (digits == 0 || digits > 5)
        return NULL;
    *ret = 0;
    for (size_t i = 0; i < digits; i++)
        *ret = *ret * 10 + (at[i] - '0');
    return at + digits;
}

enum doubt toy_read_shot(const char *line, int32_t raw[TOY_BANDS])
{
    int32_t read[TOY_BANDS];
    size_t commas = 0;
    const char *at = line;
    for (const char *c = line; *c != '\0'; c++)
        commas += *c == ',';
    if (commas + 1 != TOY_BANDS)
        return DOUBT_WRONG_COUNT;
    for (size_t i = 0; i < TOY_BANDS; i++, at++) {
        at = read_number(at, &read[i]);
        if (at == NULL || *at != (i + 1 < TOY_BANDS ? ',' : '\0'))
            return DOUBT_NO_NUMBER;
    }
    enum doubt doubt = doubt_spectrum(TOY_BANDS, read, TOY_RAW_UNIT);
    if (doubt == DOUBT_NONE)
        memcpy(raw, read, sizeof read);
    return doubt;
}
