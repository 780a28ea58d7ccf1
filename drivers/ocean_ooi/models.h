/* models.h - what differs between the spectrometers that speak this dialect.
 *
 * Sources: the makers' data sheets of the USB2000+ and the USB4000, and two free drivers
 * (python-seabreeze's libseabreeze and pyseabreeze) where these are silent.  Of the HR2000+ and
 * the HR4000 there is no data sheet here: their rows are those of the free drivers alone. */
#ifndef SKINSPEC_DRIVERS_OCEAN_OOI_MODELS_H
#define SKINSPEC_DRIVERS_OCEAN_OOI_MODELS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    OOI_VID = 0x2457,
    OOI_MAX_PIXELS = 3840,
    OOI_MAX_FRAME = 2 * OOI_MAX_PIXELS + 1 /* bytes of a spectrum, the sync byte with it */
};

struct ooi_model {
    const char *option;    /* "usb2000+", in an address */
    const char *name;      /* "USB2000+", in an identity */
    const char *successor; /* same PID, FPGA version 3 and above; NULL: none that can be told */
    size_t pixels;         /* 16-bit words of a spectrum on the wire */
    size_t pixels_shown;   /* as the maker counts them; a status may give either */
    size_t black_first, black_last;   /* optically dark pixels, from 0, both included */
    size_t active_first, active_last; /* pixels that see the spectrum */
    size_t early_bytes;               /* of a spectrum, from endpoint 0x86 at high speed; 0: none */
    uint32_t shortest_us, longest_us; /* integration times that it takes */
    uint32_t fine_step_us, fine_below_us, step_us; /* in steps of these */
    uint16_t pid;
    uint16_t full_scale;    /* largest count */
    uint16_t flipped;       /* bits of each word that come inverted */
    bool tells_temperature; /* a data sheet says so; who does not know 6C would never answer */
};

/* Four of them; the last has name NULL. */
extern const struct ooi_model ooi_models[];

/* NULL where there is none. */
const struct ooi_model *ooi_model_of_pid(uint16_t pid);
const struct ooi_model *ooi_model_of_option(const char *option);

/* us moved into what the model takes and onto its steps. */
uint32_t ooi_model_integration_us(const struct ooi_model *model, double us);

#endif
