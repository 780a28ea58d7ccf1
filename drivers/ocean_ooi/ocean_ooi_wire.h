/* ocean_ooi_wire.h - the OOI dialect: bytes <-> values.
 *
 * Requests go to endpoint 0x01, replies come from 0x81, spectra from 0x82 (and 0x86).  Numbers
 * are little-endian.  As far as two independent sources agree:
 *
 *   request            reply              what
 *   01                 -                  initialise; trigger 0
 *   02 u32             -                  integration time in us; out of range: ignored in silence
 *   03 u16             -                  lamp line on (1) or off
 *   05 slot            05 slot 15 bytes   EEPROM: text up to the first NUL, the rest is garbage
 *   09                 a spectrum         words, pixel 0 first, then 69
 *   6B reg             reg u16            FPGA register; a Flame-S answers FE for reg
 *   6C                 08 s16             temperature of the board in 0.003906 degrees C
 *   FE                 16 bytes           status, see below
 *
 * 06 writes the EEPROM: nothing here can make it.  USB secures each transfer with a CRC, so
 * nothing is asked twice; what a reply must be is checked all the same. */
#ifndef SKINSPEC_DRIVERS_OCEAN_OOI_OCEAN_OOI_WIRE_H
#define SKINSPEC_DRIVERS_OCEAN_OOI_OCEAN_OOI_WIRE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "drivers/ocean_ooi/models.h"

enum ooi_endpoint { OOI_OUT = 0x01, OOI_REPLY = 0x81, OOI_LATE = 0x82, OOI_EARLY = 0x86 };

/* ---- requests: into bytes[OOI_MAX_REQUEST]; how many they are ----------------------- */

enum { OOI_MAX_REQUEST = 5 };

size_t ooi_ask_initialise(uint8_t *bytes);
size_t ooi_ask_integration(uint8_t *bytes, uint32_t us);
size_t ooi_ask_lamp(uint8_t *bytes, bool on);
size_t ooi_ask_slot(uint8_t *bytes, uint8_t slot);
size_t ooi_ask_spectrum(uint8_t *bytes);
size_t ooi_ask_register(uint8_t *bytes, uint8_t reg);
size_t ooi_ask_temperature(uint8_t *bytes);
size_t ooi_ask_status(uint8_t *bytes);

/* ---- replies: false, and nothing touched, for what is no such reply ----------------- */

enum ooi_slot {
    OOI_SLOT_SERIAL = 0,
    OOI_SLOT_WAVELENGTH = 1,   /* to 4: of p^0 .. p^3 */
    OOI_SLOT_NONLINEARITY = 6, /* to 13: of x^0 .. x^7 */
    OOI_SLOT_ORDER = 14,       /* of that polynomial */
    OOI_SLOT_AUTO_NULL = 17,   /* no text: the saturation level in bytes 6 and 7 */
};
enum { OOI_REPLY_BYTES = 64, OOI_SLOT_REPLY = 17, OOI_SLOT_TEXT = 16, OOI_FPGA_VERSION = 4 };

/* The text of a slot, at most 15 characters and a NUL: printable ASCII, anything else a '?';
 * spaces at its ends are left out. */
bool ooi_read_slot(const uint8_t *bytes, size_t n, uint8_t slot, char text[OOI_SLOT_TEXT]);

/* A slot's text as a number, in the C locale whatever the program's. */
bool ooi_read_number(const char *text, double *ret);

/* Saturation level of slot 17; 0: the full scale. */
bool ooi_read_level(const uint8_t *bytes, size_t n, uint16_t *ret);

bool ooi_read_register(const uint8_t *bytes, size_t n, uint8_t reg, uint16_t *ret);
bool ooi_read_temperature(const uint8_t *bytes, size_t n, double *celsius);

struct ooi_status {
    size_t pixels;
    uint32_t integration_us;
    bool lamp; /* its line is on */
    uint8_t trigger;
    bool high_speed; /* of the USB connection */
};
bool ooi_read_status(const uint8_t *bytes, size_t n, struct ooi_status *ret);

/* ---- the spectrum ------------------------------------------------------------------- */

/* Size of the receive on each endpoint: whole packets, so that the sync byte's short packet ends
 * the last one and nothing overflows. */
enum { OOI_PACKET = 512 };

/* Bytes of a spectrum, the sync byte with it. */
size_t ooi_frame_bytes(const struct ooi_model *model);

enum ooi_frame {
    OOI_FRAME_OK,
    OOI_FRAME_COUNT, /* not so many bytes */
    OOI_FRAME_SYNC,  /* the last is not 0x69: out of step */
    OOI_FRAME_RANGE, /* a count above the model's full scale */
};

/* counts[model->pixels] of a whole spectrum; untouched unless OOI_FRAME_OK. */
enum ooi_frame ooi_read_frame(const struct ooi_model *model, const uint8_t *bytes, size_t n,
                              uint16_t *counts);

#endif
