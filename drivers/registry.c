/* registry.c - one line per driver. */
#include "drivers/registry.h"

#include <string.h>

#include "drivers/km_ascii/km_ascii.h"
#include "drivers/ocean_ooi/ocean_ooi.h"
#include "drivers/simulated/simulated.h"
#include "drivers/xrite_rci/xrite_rci.h"

const struct driver *const driver_registry[] = {
    &simulated_driver, /* no instrument */
    &km_ascii_driver,  /* Konica Minolta CM-700d, CM-2600d */
    &ocean_ooi_driver, /* Ocean's spectrometers on a sphere */
    &xrite_rci_driver, /* X-Rite SP60, SP62, SP64 */
    NULL,
};

const struct driver *driver_find(const char *name)
{
    for (size_t i = 0; driver_registry[i] != NULL; i++)
        if (strcmp(driver_registry[i]->name, name) == 0)
            return driver_registry[i];
    return NULL;
}
