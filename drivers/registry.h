/* registry.h - the drivers there are. */
#ifndef SKINSPEC_DRIVERS_REGISTRY_H
#define SKINSPEC_DRIVERS_REGISTRY_H

#include "drivers/driver.h"

/* Ends with NULL. */
extern const struct driver *const driver_registry[];

/* NULL where there is no driver of that name. */
const struct driver *driver_find(const char *name);

#endif
