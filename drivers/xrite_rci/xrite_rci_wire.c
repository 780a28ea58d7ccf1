/* xrite_rci_wire.c - answers, the table of status codes, values. */
#include "drivers/xrite_rci/xrite_rci_wire.h"

#include <string.h>

static bool is_digit(char c)
{
    return c >= '0' && c <= '9';
}

/* ---- an answer ---------------------------------------------------------------------- */

static bool read_hex(char c, unsigned *ret)
{
    if (is_digit(c))
        *ret = (unsigned)(c - '0');
    else if (c >= 'A' && c <= 'F')
        *ret = (unsigned)(c - 'A') + 10;
    else
        return false;
    return true;
}

bool rci_read_reply(const char *line, struct rci_reply *ret)
{
    unsigned high, low;
    size_t length = strlen(line);
    if (length < 4)
        return false;
    const char *status = line + length - 4;
    if (strcspn(line, "<>") != length - 4 || status[0] != '<' || status[3] != '>' ||
        !read_hex(status[1], &high) || !read_hex(status[2], &low))
        return false;
    *ret = (struct rci_reply){ .data = line, .n = length - 4, .status = high * 16 + low };
    return true;
}

static bool is_all_digits(const struct rci_reply *reply)
{
    for (size_t i = 0; i < reply->n; i++)
        if (!is_digit(reply->data[i]))
            return false;
    return reply->n > 0;
}

bool rci_is_kind(const struct rci_reply *reply, enum rci_kind kind)
{
    const struct rci_code *code = rci_find_code(reply->status);
    bool has_commas = reply->n > 0 && memchr(reply->data, ',', reply->n) != NULL;
    if (code == NULL || code->reaction != RCI_DONE)
        return code != NULL && reply->n == 0;
    switch (kind) {
    case RCI_STATUS:
        return reply->n == 0;
    case RCI_TEXT:
        return !has_commas;
    case RCI_COUNT:
        return is_all_digits(reply);
    case RCI_SPECTRUM:
        return has_commas;
    }
    return false;
}

/* ---- status ------------------------------------------------------------------------- */

static const struct rci_code codes[] = {
    { 0x00, DRIVER_OK, RCI_DONE, "" },
    { 0x01, DRIVER_OK, RCI_DONE, "" }, /* measured */
    { 0x02, DRIVER_OK, RCI_DONE, "" }, /* calibrated */
    { 0x03, DRIVER_OK, RCI_DONE, "" }, /* a key was pressed */
    { 0x04, DRIVER_GONE, RCI_TELL,
      "the instrument has loaded its default settings: it has to be opened again" },
    { 0x11, DRIVER_PROTOCOL, RCI_RESEND,
      "the instrument did not know a command: is it an SP60, SP62 or SP64?" },
    { 0x12, DRIVER_PROTOCOL, RCI_RESEND,
      "the instrument did not understand a command: is it an SP60, SP62 or SP64?" },
    { 0x13, DRIVER_REFUSED, RCI_RESEND, "there is no such sample or setting in the instrument" },
    { 0x14, DRIVER_BUSY, RCI_WAIT,
      "the instrument is busy: go back to its main screen, then try again" },
    { 0x15, DRIVER_REFUSED, RCI_ABORTED, "it was ended by the instrument's keys: start it again" },
    { 0x16, DRIVER_REFUSED, RCI_EMPTY, "the instrument has no such measurement: measure first" },
    { 0x20, DRIVER_FAULT, RCI_TELL, "the measurement failed: hold still and measure again" },
    { 0x21, DRIVER_TIMEOUT, RCI_EXPIRED, "nobody pressed the instrument in time: try again" },
    { 0x27, DRIVER_IMPLAUSIBLE, RCI_TELL,
      "the instrument took a bad reading, as of something too bright: measure again" },
    { 0x28, DRIVER_REFUSED, RCI_LOST,
      "the instrument needs calibration: take its white tile and its black trap, and calibrate" },
    { 0x29, DRIVER_IMPLAUSIBLE, RCI_LOST,
      "calibration failed: was it the white tile first and then the black trap, both clean? "
      "Calibrate again" },
    { 0x2A, DRIVER_TIMEOUT, RCI_LOST,
      "nobody followed the instrument's display: calibrate again, and place and press what it "
      "asks for" },
    { 0x30, DRIVER_FAULT, RCI_TELL,
      "the instrument reports an internal error: switch it off and on, else have it serviced" },
    { 0x31, DRIVER_FAULT, RCI_TELL, "the lamp failed: have the instrument serviced" },
    { 0x32, DRIVER_FAULT, RCI_TELL, "the filter wheel failed: have the instrument serviced" },
    { 0x33, DRIVER_FAULT, RCI_TELL, "the motor failed: have the instrument serviced" },
    { 0x35, DRIVER_FAULT, RCI_TELL, "the keypad failed: have the instrument serviced" },
    { 0x36, DRIVER_FAULT, RCI_TELL, "the display failed: have the instrument serviced" },
    { 0x37, DRIVER_FAULT, RCI_TELL, "the memory failed: have the instrument serviced" },
    { 0x38, DRIVER_FAULT, RCI_TELL, "the A/D converter failed: have the instrument serviced" },
    { 0x39, DRIVER_FAULT, RCI_TELL, "the processor failed: have the instrument serviced" },
    { 0x3A, DRIVER_BATTERY, RCI_TELL, "the battery failed: replace it" },
    { 0x3B, DRIVER_BATTERY, RCI_TELL, "the battery is too low to measure: charge it" },
    { 0x3C, DRIVER_FAULT, RCI_TELL, "the charger failed: use another, else have it serviced" },
    { 0x3D, DRIVER_REFUSED, RCI_TELL, "the instrument is too hot: let it cool down" },
    { 0x3E, DRIVER_BATTERY, RCI_TELL, "there is no battery in the instrument: put one in" },
    { 0x3F, DRIVER_FAULT, RCI_TELL, "the transmission lamp failed: have it serviced" },
    { 0x40, DRIVER_REFUSED, RCI_TELL,
      "not in this mode: bring the instrument to its main screen, then try again" },
    { 0x41, DRIVER_REFUSED, RCI_TELL, "the instrument's memory refuses: look at its display" },
    { 0x42, DRIVER_REFUSED, RCI_TELL, "the instrument's memory refuses: look at its display" },
    { 0x43, DRIVER_REFUSED, RCI_TELL, "the instrument's memory refuses: look at its display" },
    { 0x44, DRIVER_REFUSED, RCI_TELL, "the instrument's memory refuses: look at its display" },
    { 0x45, DRIVER_REFUSED, RCI_TELL, "the instrument's memory refuses: look at its display" },
    { 0x46, DRIVER_REFUSED, RCI_TELL, "the instrument's memory refuses: look at its display" },
    { 0x47, DRIVER_REFUSED, RCI_TELL, "the instrument's memory refuses: look at its display" },
    { 0x48, DRIVER_BATTERY, RCI_TELL,
      "the battery is too hot or too cold: let it come to room temperature" },
};

const struct rci_code *rci_find_code(unsigned status)
{
    for (size_t i = 0; i < sizeof codes / sizeof *codes; i++)
        if (codes[i].status == status)
            return &codes[i];
    return NULL;
}

/* ---- values ------------------------------------------------------------------------- */

bool rci_read_count(const struct rci_reply *reply, unsigned *ret)
{
    unsigned value = 0;
    if (!is_all_digits(reply))
        return false;
    for (size_t i = 0; i < reply->n; i++) {
        value = value * 10 + (unsigned)(reply->data[i] - '0');
        if (value > RCI_MAX_COUNT)
            return false;
    }
    *ret = value;
    return true;
}

/* `20.1234`, ` 4.5`, `-0.02`: one to three digits, a dot, one to four digits. */
static bool read_percent(const char *at, size_t n, int32_t *ret)
{
    const char *end = at + n;
    while (at < end && *at == ' ')
        at++;
    while (end > at && end[-1] == ' ')
        end--;
    bool minus = at < end && *at == '-';
    at += minus;
    const char *dot = at;
    int32_t value = 0;
    for (; dot < end && is_digit(*dot); dot++)
        value = dot - at < 3 ? value * 10 + (*dot - '0') : value;
    if (dot == at || dot - at > 3 || dot == end || *dot != '.')
        return false;
    const char *decimal = dot + 1;
    for (; decimal < end && decimal - dot <= 4 && is_digit(*decimal); decimal++)
        value = value * 10 + (*decimal - '0');
    if (decimal != end || decimal == dot + 1)
        return false;
    for (; decimal - dot <= 4; decimal++)
        value *= 10;
    *ret = minus ? -value : value;
    return true;
}

enum doubt rci_read_spectrum(const struct rci_reply *reply, int32_t raw[RCI_BANDS])
{
    const char *at = reply->data, *end = at + reply->n;
    size_t commas = 0;
    for (const char *c = at; c < end; c++)
        commas += *c == ',';
    if (commas + 1 != RCI_BANDS)
        return DOUBT_WRONG_COUNT;
    for (size_t i = 0; i < RCI_BANDS; i++) {
        const char *comma = memchr(at, ',', (size_t)(end - at));
        const char *stop = comma != NULL ? comma : end;
        if (!read_percent(at, (size_t)(stop - at), &raw[i]))
            return DOUBT_NO_NUMBER;
        at = stop + (comma != NULL);
    }
    return DOUBT_NONE;
}
