/* ocean_model.h - what the kinds of spectrometer differ in. */
#ifndef SKINSPEC_TESTS_SIM_OCEAN_MODEL_H
#define SKINSPEC_TESTS_SIM_OCEAN_MODEL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { OCEAN_SLOTS = 19, OCEAN_TEXT = 15, OCEAN_MAX_PIXELS = 3840 };
enum { OCEAN_SLOT_SERIAL = 0, OCEAN_SLOT_LEVEL = 17 };

/* A step of the integration time, below a time. */
struct ocean_step {
    uint32_t below_us, step_us;
};

struct ocean_model {
    size_t pixels;
    size_t black, first, end; /* optically black [0, black), lit [first, end), 0-based */
    unsigned full_scale;
    uint16_t xor_mask;
    uint32_t min_us, max_us;
    struct ocean_step steps[2];
    unsigned kept;  /* exposures that it takes ahead of any request; 0: it idles in cycles */
    bool split;     /* at high speed the first 2048 bytes come on 0x86 */
    unsigned level; /* of saturation, in slot 17; 0: not set */
    const char *slots[OCEAN_SLOTS];
};

extern const struct ocean_model ocean_usb2000, ocean_usb4000, ocean_hr2000, ocean_hr4000;

/* Wavelength of pixel i, by slots 1 to 4. */
double ocean_model_nm(const struct ocean_model *model, size_t i);

/* Slots 6 to 13. */
enum { OCEAN_LINEARITY = 8 };
void ocean_model_linearity(const struct ocean_model *model, double n[OCEAN_LINEARITY]);

/* What the detector shows of `light` counts: the x of x / (n0 + n1 x + ...) = light. */
double ocean_model_bend(const struct ocean_model *model, const double n[OCEAN_LINEARITY],
                        double light);

/* The integration time that the instrument really sets, or 0 where it changes nothing. */
uint32_t ocean_model_integration(const struct ocean_model *model, uint32_t wanted_us);

#endif
