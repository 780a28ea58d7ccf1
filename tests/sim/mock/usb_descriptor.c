#include "tests/sim/mock/usb_descriptor.h"

#include <errno.h>
#include <string.h>

enum { DEVICE = 1, CONFIGURATION = 2, STRING = 3 }; /* chapter 9 of the USB specification */
enum { DEVICE_BYTES = 18 };
enum { MAKER_TEXT = 1, PRODUCT_TEXT = 2, SERIAL_TEXT = 3 };

static const uint8_t endpoints[] = { 0x01, 0x82, 0x86, 0x81 };
enum { ENDPOINTS = sizeof endpoints };

size_t usb_descriptor_packet(const struct mock_usb_place *place, uint8_t endpoint)
{
    if (memchr(endpoints, endpoint, ENDPOINTS) == NULL)
        return 0;
    return endpoint == 0x81 || place->full_speed ? 64 : 512;
}

static size_t device(const struct sim_kind *kind, const struct mock_usb_place *place, uint8_t *b)
{
    const uint8_t bytes[DEVICE_BYTES] = {
        DEVICE_BYTES,
        DEVICE,
        0x00, /* USB 2.0 */
        0x02,
        0xff, /* of the vendor's class */
        0,
        0,
        64,
        (uint8_t)kind->vid,
        (uint8_t)(kind->vid >> 8),
        (uint8_t)kind->pid,
        (uint8_t)(kind->pid >> 8),
        0x02,
        0x00,
        MAKER_TEXT,
        PRODUCT_TEXT,
        place->serial != NULL ? SERIAL_TEXT : 0,
        1,
    };
    memcpy(b, bytes, sizeof bytes);
    return sizeof bytes;
}

static size_t configuration(const struct mock_usb_place *place, uint8_t *b)
{
    const uint8_t head[] = {
        9,
        CONFIGURATION,
        9 + 9 + 7 * ENDPOINTS,
        0,
        1,
        1,
        0,
        0x80,
        250, /* 500 mA of the bus */
        9,
        4,
        0,
        0,
        ENDPOINTS,
        0xff,
        0,
        0,
        0,
    };
    memcpy(b, head, sizeof head);
    size_t n = sizeof head;
    for (size_t i = 0; i < ENDPOINTS; i++) {
        size_t packet = usb_descriptor_packet(place, endpoints[i]);
        const uint8_t bulk[7] = { 7, 5, endpoints[i], 2, (uint8_t)packet, (uint8_t)(packet >> 8) };
        memcpy(b + n, bulk, sizeof bulk);
        n += sizeof bulk;
    }
    return n;
}

size_t usb_descriptor_all(const struct sim_kind *kind, const struct mock_usb_place *place,
                          uint8_t bytes[USB_DESCRIPTOR_MOST])
{
    size_t n = device(kind, place, bytes);
    return n + configuration(place, bytes + n);
}

/* As UTF-16, each byte as the character of its number. */
static size_t text(const char *string, uint8_t *b)
{
    size_t n = 2;
    for (size_t i = 0; string[i] != '\0' && n + 2 < USB_DESCRIPTOR_MOST; i++, n += 2) {
        b[n] = (uint8_t)string[i];
        b[n + 1] = 0;
    }
    b[0] = (uint8_t)n;
    b[1] = STRING;
    return n;
}

static size_t string(const struct sim_kind *kind, const struct mock_usb_place *place, uint8_t index,
                     uint8_t *b)
{
    static const uint8_t languages[] = { 4, STRING, 0x09, 0x04 }; /* English */
    switch (index) {
    case 0:
        memcpy(b, languages, sizeof languages);
        return sizeof languages;
    case MAKER_TEXT:
        return text("Simulated Optics", b);
    case PRODUCT_TEXT:
        return text(kind->product, b);
    case SERIAL_TEXT:
        return place->serial != NULL ? text(place->serial, b) : 0;
    default:
        return 0;
    }
}

int usb_descriptor_control(const struct sim_kind *kind, const struct mock_usb_place *place,
                           const uint8_t setup[8], uint8_t *data, size_t n)
{
    enum { GET_STATUS = 0, GET_DESCRIPTOR = 6 };
    uint8_t bytes[USB_DESCRIPTOR_MOST] = { 0 };
    size_t length = 0;
    bool of_device = setup[0] == 0x80;
    if (of_device && setup[1] == GET_DESCRIPTOR && setup[3] == DEVICE)
        length = device(kind, place, bytes);
    else if (of_device && setup[1] == GET_DESCRIPTOR && setup[3] == CONFIGURATION)
        length = configuration(place, bytes);
    else if (of_device && setup[1] == GET_DESCRIPTOR && setup[3] == STRING)
        length = string(kind, place, setup[2], bytes);
    else if ((setup[0] & 0xe0) == 0x80 && setup[1] == GET_STATUS)
        length = 2;
    if (length == 0)
        return -EPIPE;
    if (length > n)
        length = n;
    memcpy(data, bytes, length);
    return (int)length;
}
