/* models.c - data. */
#include "drivers/ocean_ooi/models.h"

#include <math.h>
#include <string.h>

/* Black pixels are those that data sheet and libraries both call black.  The pixels before the
 * active ones are in transition and are not used. */
const struct ooi_model ooi_models[] = {
    { .option = "usb2000+",
      .name = "USB2000+",
      .successor = "Flame-S",
      .pid = 0x101e,
      .pixels = 2048,
      .pixels_shown = 2048,
      .full_scale = 65535,
      .black_first = 6,
      .black_last = 17,
      .active_first = 20,
      .active_last = 2047,
      .shortest_us = 1000,
      .longest_us = 65535000,
      .fine_step_us = 10,
      .fine_below_us = 655000,
      .step_us = 1000,
      .tells_temperature = true },
    { .option = "usb4000",
      .name = "USB4000",
      .pid = 0x1022,
      .pixels = 3840,
      .pixels_shown = 3648,
      .full_scale = 65535,
      .black_first = 5,
      .black_last = 15,
      .active_first = 21,
      .active_last = 3668,
      .early_bytes = 2048,
      .shortest_us = 10,
      .longest_us = 65535000,
      .fine_step_us = 1,
      .fine_below_us = 3800,
      .step_us = 10,
      .tells_temperature = true },
    { .option = "hr2000+",
      .name = "HR2000+",
      .pid = 0x1016,
      .pixels = 2048,
      .pixels_shown = 2048,
      .full_scale = 16383,
      .flipped = 0x2000,
      .black_first = 6,
      .black_last = 17,
      .active_first = 24,
      .active_last = 2047,
      .shortest_us = 1000,
      .longest_us = 65535000,
      .fine_step_us = 1000,
      .fine_below_us = 0,
      .step_us = 1000 },
    { .option = "hr4000",
      .name = "HR4000",
      .pid = 0x1012,
      .pixels = 3840,
      .pixels_shown = 3648,
      .full_scale = 16383,
      .flipped = 0x2000,
      .black_first = 5,
      .black_last = 12,
      .active_first = 21,
      .active_last = 3668,
      .early_bytes = 2048,
      .shortest_us = 1000,
      .longest_us = 65535000,
      .fine_step_us = 1000,
      .fine_below_us = 0,
      .step_us = 1000 },
    { .name = NULL },
};

const struct ooi_model *ooi_model_of_pid(uint16_t pid)
{
    for (const struct ooi_model *m = ooi_models; m->name != NULL; m++)
        if (m->pid == pid)
            return m;
    return NULL;
}

const struct ooi_model *ooi_model_of_option(const char *option)
{
    for (const struct ooi_model *m = ooi_models; m->name != NULL; m++)
        if (strcmp(m->option, option) == 0)
            return m;
    return NULL;
}

uint32_t ooi_model_integration_us(const struct ooi_model *model, double us)
{
    double within = fmin(fmax(us, model->shortest_us), model->longest_us);
    double step = within < model->fine_below_us ? model->fine_step_us : model->step_us;
    return (uint32_t)(round(within / step) * step);
}
