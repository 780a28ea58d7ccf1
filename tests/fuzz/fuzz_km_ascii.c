/* fuzz_km_ascii.c - any bytes as what a CM-700d or CM-2600d sends: to the readers of lines, then to
 * a whole session, in which nothing is sent that writes the instrument's own data. */
#include <string.h>

#include "drivers/km_ascii/km_ascii.h"
#include "drivers/km_ascii/km_ascii_wire.h"
#include "drivers/reading.h"
#include "tests/fuzz/driver_session.h"

static bool may_send(const char *bytes, size_t n)
{
    static const char *const never[] = { "CDS", "UCS", "CIS", "SDD", "SAD", "WMS" };
    for (size_t i = 0; i < sizeof never / sizeof *never; i++)
        if (n >= 3 && memcmp(bytes, never[i], 3) == 0)
            return false;
    return true;
}

/* ---- the readers -------------------------------------------------------------------- */

static void check_spectrum(const struct km_dialect *dialect, size_t n, const int32_t *raw)
{
    if (doubt_spectrum(n, raw, dialect->raw_unit) != DOUBT_NONE)
        return;
    for (size_t i = 0; i < n; i++)
        driver_session_must(raw[i] >= 0 && raw[i] * dialect->raw_unit <= 2.0 + 1e-9,
                            "a band out of range");
}

static void read_line_as(const struct km_dialect *dialect, const struct km_reply *reply)
{
    int32_t raw[KM_MAX_FIELDS];
    struct km_state state;
    struct km_settings settings;
    (void)km_find_code(dialect, reply);
    if (dialect->read_state(reply, &state))
        driver_session_must(state.voltage <= 2, "voltage");
    if (dialect->read_settings(reply, &settings))
        driver_session_must(settings.area <= 2 && settings.averages <= 10, "settings");
    if (reply->fields > 0 && km_read_spectrum(dialect, reply, 0, reply->fields, raw) == DOUBT_NONE)
        check_spectrum(dialect, reply->fields, raw);
}

static void read_line(char *line)
{
    struct km_reply reply;
    struct driver_identity identity;
    if (!km_read_reply(line, &reply))
        return;
    read_line_as(&km_cm700d, &reply);
    read_line_as(&km_cm2600d, &reply);
    if (km_read_identity(&reply, &identity) != NULL)
        driver_session_must(identity.grid[0].n >= 2 && identity.grid[0].n <= KM_MAX_FIELDS,
                            "bands");
}

/* ---- the fuzzer --------------------------------------------------------------------- */

int LLVMFuzzerTestOneInput(const unsigned char *data, size_t size);

int LLVMFuzzerTestOneInput(const unsigned char *data, size_t size)
{
    static const struct driver_session session = { .driver = &km_ascii_driver,
                                                   .open_timeout_ms = 4000,
                                                   .most_silences = 24,
                                                   .may_send = may_send };
    driver_session_lines(data, size, read_line);
    driver_session_hold(&session, data, size);
    return 0;
}
