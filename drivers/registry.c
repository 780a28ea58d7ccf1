/* registry.c - one line per driver. */
#include "drivers/registry.h"

#include <string.h>

#include "drivers/km_ascii/km_ascii.h"
#include "drivers/ocean_ooi/ocean_ooi.h"
#include "drivers/simulated/simulated.h"
#include "drivers/xrite_rci/xrite_rci.h"

const struct driver *const driver_registry[] = {
    &simulated_driver, &km_ascii_driver, &ocean_ooi_driver, &xrite_rci_driver, NULL,
};

const struct driver *driver_find(const char *name)
{
    for (size_t i = 0; driver_registry[i] != NULL; i++)
        if (strcmp(driver_registry[i]->name, name) == 0)
            return driver_registry[i];
    return NULL;
}
