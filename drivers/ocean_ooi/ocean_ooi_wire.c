/* ocean_ooi_wire.c - see the table in the header. */
#include "drivers/ocean_ooi/ocean_ooi_wire.h"

#include <string.h>

#include "base/number.h"

enum { SYNC = 0x69, TEMPERATURE_READ = 0x08, FLAME_REGISTER = 0xfe, HIGH_SPEED = 0x80 };
enum { STATUS_BYTES = 16, SHORT_REPLY = 3 };

#define CELSIUS_OF_COUNT 0.003906

static uint16_t u16_at(const uint8_t *bytes)
{
    return (uint16_t)(bytes[0] | bytes[1] << 8);
}

/* ---- requests ----------------------------------------------------------------------- */

size_t ooi_ask_initialise(uint8_t *bytes)
{
    bytes[0] = 0x01;
    return 1;
}

size_t ooi_ask_integration(uint8_t *bytes, uint32_t us)
{
    bytes[0] = 0x02;
    for (unsigned i = 0; i < 4; i++)
        bytes[1 + i] = (uint8_t)(us >> (8 * i));
    return 5;
}

size_t ooi_ask_lamp(uint8_t *bytes, bool on)
{
    bytes[0] = 0x03;
    bytes[1] = on ? 1 : 0;
    bytes[2] = 0;
    return 3;
}

size_t ooi_ask_slot(uint8_t *bytes, uint8_t slot)
{
    bytes[0] = 0x05;
    bytes[1] = slot;
    return 2;
}

size_t ooi_ask_spectrum(uint8_t *bytes)
{
    bytes[0] = 0x09;
    return 1;
}

size_t ooi_ask_register(uint8_t *bytes, uint8_t reg)
{
    bytes[0] = 0x6b;
    bytes[1] = reg;
    return 2;
}

size_t ooi_ask_temperature(uint8_t *bytes)
{
    bytes[0] = 0x6c;
    return 1;
}

size_t ooi_ask_status(uint8_t *bytes)
{
    bytes[0] = 0xfe;
    return 1;
}

/* ---- replies ------------------------------------------------------------------------ */

static bool is_slot(const uint8_t *bytes, size_t n, uint8_t slot)
{
    return n == OOI_SLOT_REPLY && bytes[0] == 0x05 && bytes[1] == slot;
}

bool ooi_read_slot(const uint8_t *bytes, size_t n, uint8_t slot, char text[OOI_SLOT_TEXT])
{
    size_t first = 2, end = 2;
    if (!is_slot(bytes, n, slot))
        return false;
    while (end < n && bytes[end] != '\0')
        end++;
    while (first < end && bytes[first] == ' ')
        first++;
    while (end > first && bytes[end - 1] == ' ')
        end--;
    for (size_t i = first; i < end; i++)
        text[i - first] = bytes[i] >= 0x20 && bytes[i] < 0x7f ? (char)bytes[i] : '?';
    text[end - first] = '\0';
    return true;
}

bool ooi_read_number(const char *text, double *ret)
{
    return number_parse(text, ret) == STATUS_OK;
}

bool ooi_read_level(const uint8_t *bytes, size_t n, uint16_t *ret)
{
    if (!is_slot(bytes, n, OOI_SLOT_AUTO_NULL))
        return false;
    *ret = u16_at(bytes + 6);
    return true;
}

bool ooi_read_register(const uint8_t *bytes, size_t n, uint8_t reg, uint16_t *ret)
{
    if (n != SHORT_REPLY || (bytes[0] != reg && bytes[0] != FLAME_REGISTER))
        return false;
    *ret = u16_at(bytes + 1);
    return true;
}

bool ooi_read_temperature(const uint8_t *bytes, size_t n, double *celsius)
{
    if (n != SHORT_REPLY || bytes[0] != TEMPERATURE_READ)
        return false;
    *celsius = (int16_t)u16_at(bytes + 1) * CELSIUS_OF_COUNT;
    return true;
}

bool ooi_read_status(const uint8_t *bytes, size_t n, struct ooi_status *ret)
{
    if (n != STATUS_BYTES || (bytes[14] != 0 && bytes[14] != HIGH_SPEED))
        return false;
    ret->pixels = u16_at(bytes);
    ret->integration_us = u16_at(bytes + 2) | (uint32_t)u16_at(bytes + 4) << 16;
    ret->lamp = bytes[6] != 0;
    ret->trigger = bytes[7];
    ret->high_speed = bytes[14] == HIGH_SPEED;
    return true;
}

/* ---- the spectrum ------------------------------------------------------------------- */

size_t ooi_frame_bytes(const struct ooi_model *model)
{
    return 2 * model->pixels + 1;
}

enum ooi_frame ooi_read_frame(const struct ooi_model *model, const uint8_t *bytes, size_t n,
                              uint16_t *counts)
{
    if (n != ooi_frame_bytes(model))
        return OOI_FRAME_COUNT;
    if (bytes[n - 1] != SYNC)
        return OOI_FRAME_SYNC;
    for (size_t p = 0; p < model->pixels; p++)
        if ((u16_at(bytes + 2 * p) ^ model->flipped) > model->full_scale)
            return OOI_FRAME_RANGE;
    for (size_t p = 0; p < model->pixels; p++)
        counts[p] = u16_at(bytes + 2 * p) ^ model->flipped;
    return OOI_FRAME_OK;
}
