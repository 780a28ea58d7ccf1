#include "tests/sim/ocean_model.h"

#include <math.h>
#include <stdlib.h>

/* The polynomials bend the scale by 5 % between dark and half of it, as those of real
 * instruments do; on 14 bits the same curve has 4^k times the coefficients. */
#define LINEARITY_16 \
    "9.380000e-01", "3.600000e-06", "-9.00000e-11", "1.000000e-15", "-5.00000e-21", \
        "1.000000e-26", "-1.00000e-32", "1.000000e-38", "7"
#define LINEARITY_14 \
    "9.380000e-01", "1.440000e-05", "-1.44000e-09", "6.400000e-14", "-1.28000e-18", \
        "1.024000e-23", "-4.09600e-29", "1.638400e-34", "7"

/* USB2000+ data sheet: 10 us below 655 ms, 1 ms above; USB4000: 1 us below 3.8 ms, else 10 us. */
#define STEPS_2000 \
    { \
        { 655000, 10 }, \
        { \
            UINT32_MAX, 1000 \
        } \
    }
#define STEPS_4000 \
    { \
        { 3800, 1 }, \
        { \
            UINT32_MAX, 10 \
        } \
    }

const struct ocean_model ocean_usb2000 = {
    .pixels = 2048,
    .black = 18,
    .first = 20,
    .end = 2048,
    .full_scale = 65535,
    .min_us = 1000,
    .max_us = 65535000,
    .steps = STEPS_2000,
    .kept = 2,
    .level = 60000,
    .slots = { "SIM00042", "346.710000", "0.371200", "-1.45000e-05", "-1.90000e-09", "0.0",
               LINEARITY_16, "03 025 050 UVVI", "DET2B-200-850", "", "9600" },
};

const struct ocean_model ocean_usb4000 = {
    .pixels = 3840,
    .black = 18,
    .first = 21,
    .end = 3669,
    .full_scale = 65535,
    .min_us = 10,
    .max_us = 65535000,
    .steps = STEPS_4000,
    .split = true,
    .level = 60000,
    .slots = { "SIM00042", "345.300000", "0.218600", "-5.60000e-06", "-3.50000e-10", "0.0",
               LINEARITY_16, "03 025 025 UVVI", "DET4-200-850", "", "9600" },
};

const struct ocean_model ocean_hr2000 = {
    .pixels = 2048,
    .black = 18,
    .first = 20,
    .end = 2048,
    .full_scale = 16383,
    .xor_mask = 0x2000,
    .min_us = 1000,
    .max_us = 65535000,
    .steps = STEPS_2000,
    .kept = 2,
    .slots = { "SIM00042", "352.400000", "0.362700", "-1.38000e-05", "-1.80000e-09", "0.0",
               LINEARITY_14, "HC-1 5 UVVI", "DET2B-VIS", "", "9600" },
};

const struct ocean_model ocean_hr4000 = {
    .pixels = 3840,
    .black = 18,
    .first = 21,
    .end = 3669,
    .full_scale = 16383,
    .xor_mask = 0x2000,
    .min_us = 10,
    .max_us = 65535000,
    .steps = STEPS_4000,
    .split = true,
    .slots = { "SIM00042", "348.900000", "0.215400", "-5.30000e-06", "-3.30000e-10", "0.0",
               LINEARITY_14, "HC-1 5 UVVI", "DET4-VIS", "", "9600" },
};

double ocean_model_nm(const struct ocean_model *model, size_t i)
{
    double nm = 0;
    for (size_t k = 4; k > 0; k--)
        nm = nm * (double)i + strtod(model->slots[k], NULL);
    return nm;
}

void ocean_model_linearity(const struct ocean_model *model, double n[OCEAN_LINEARITY])
{
    for (size_t k = 0; k < OCEAN_LINEARITY; k++)
        n[k] = strtod(model->slots[6 + k], NULL);
}

double ocean_model_bend(const struct ocean_model *model, const double n[OCEAN_LINEARITY],
                        double light)
{
    /* x = light * n(x).  Beyond the scale, where the polynomial says nothing, as at its end. */
    double x = light;
    for (size_t round = 0; round < 100; round++) {
        double at = fmin(fmax(x, 0), model->full_scale), polynomial = 0;
        for (size_t k = OCEAN_LINEARITY; k > 0; k--)
            polynomial = polynomial * at + n[k - 1];
        double next = light * polynomial;
        if (fabs(next - x) < 1e-9)
            return next;
        x = next;
    }
    return x;
}

uint32_t ocean_model_integration(const struct ocean_model *model, uint32_t wanted_us)
{
    if (wanted_us < model->min_us || wanted_us > model->max_us)
        return 0;
    const struct ocean_step *step = model->steps;
    while (wanted_us >= step->below_us)
        step++;
    return wanted_us - wanted_us % step->step_us;
}
