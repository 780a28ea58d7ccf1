/* fuzz_xrite_rci.c - any bytes as what an SP62 sends: to the readers of lines, then to a whole
 * session, in which nothing is sent but the commands of the driver's list. */
#include <string.h>

#include "drivers/reading.h"
#include "drivers/xrite_rci/xrite_rci.h"
#include "drivers/xrite_rci/xrite_rci_wire.h"
#include "tests/fuzz/driver_session.h"

static bool may_send(const char *bytes, size_t n)
{
    static const char *const commands[] = { "",       "CE",     "0005CF", "0107CF", "0108CF",
                                            "0009CF", "0040CF", "0020CF", "014BCF", "024BCF",
                                            "00SN",   "10XD",   "01XD",   "RM",     "0001GM",
                                            "0101GM", "00GM",   "1001GM", "1101GM" };
    for (size_t i = 0; i < sizeof commands / sizeof *commands; i++)
        if (n == strlen(commands[i]) + 2 && memcmp(bytes, commands[i], n - 2) == 0)
            return memcmp(bytes + n - 2, "\r\n", 2) == 0;
    return false;
}

/* ---- the readers -------------------------------------------------------------------- */

static void read_line(char *line)
{
    struct rci_reply reply;
    int32_t raw[RCI_BANDS];
    char text[DRIVER_NAME_SIZE];
    unsigned n = 0;
    line[strcspn(line, "\r")] = '\0';
    if (!rci_read_reply(line, &reply))
        return;
    driver_session_must(reply.n + 4 == strlen(line) && reply.status <= 0xFF, "a reply");
    for (int kind = RCI_STATUS; kind <= RCI_SPECTRUM; kind++)
        (void)rci_is_kind(&reply, (enum rci_kind)kind);
    if (rci_read_count(&reply, &n))
        driver_session_must(n <= RCI_MAX_COUNT, "a count");
    reading_plain_text(reply.data, reply.n, text, sizeof text);
    if (rci_read_spectrum(&reply, raw) != DOUBT_NONE ||
        doubt_spectrum(RCI_BANDS, raw, RCI_RAW_UNIT) != DOUBT_NONE)
        return;
    for (size_t i = 0; i < RCI_BANDS; i++)
        driver_session_must(raw[i] >= 0 && raw[i] <= 2000000, "a band out of range");
}

/* ---- the fuzzer --------------------------------------------------------------------- */

int LLVMFuzzerTestOneInput(const unsigned char *data, size_t size);

int LLVMFuzzerTestOneInput(const unsigned char *data, size_t size)
{
    static const struct driver_session session = { .driver = &xrite_rci_driver,
                                                   .open_timeout_ms = 20000,
                                                   .most_silences = 400,
                                                   .may_send = may_send };
    driver_session_lines(data, size, read_line);
    driver_session_hold(&session, data, size);
    return 0;
}
