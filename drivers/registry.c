/* registry.c - one line per driver. */
#include "drivers/registry.h"

#include <string.h>

/* DRIVER(NAME): the driver NAME_driver of drivers/NAME/. */
#define EACH_DRIVER \
    DRIVER(simulated) /* no instrument */ \
    DRIVER(km_ascii)  /* Konica Minolta CM-700d, CM-2600d */ \
    DRIVER(ocean_ooi) /* Ocean's spectrometers on a sphere */ \
    DRIVER(xrite_rci) /* X-Rite SP60, SP62, SP64 */ \
    /* the end */

#define DRIVER(name) extern const struct driver name##_driver;
EACH_DRIVER
#undef DRIVER

#define DRIVER(name) &name##_driver,
const struct driver *const driver_registry[] = { EACH_DRIVER NULL };
#undef DRIVER

const struct driver *driver_find(const char *name)
{
    for (size_t i = 0; driver_registry[i] != NULL; i++)
        if (strcmp(driver_registry[i]->name, name) == 0)
            return driver_registry[i];
    return NULL;
}
