/* sim.c - the list of simulators. */
#include "tests/sim/sim.h"

#include <string.h>

static const struct sim_kind *const kinds[] = {
    &sim_cm700d, &sim_cm2600d, &sim_sp62, &sim_usb2000, &sim_usb4000, &sim_hr2000, &sim_hr4000,
};

static struct sim_place *added;

void sim_add(struct sim_place *place)
{
    place->next = added;
    added = place;
}

const struct sim_kind *sim_find(const char *name)
{
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
        if (strcmp(kinds[i]->name, name) == 0)
            return kinds[i];
    for (const struct sim_place *place = added; place != NULL; place = place->next)
        if (strcmp(place->kind->name, name) == 0)
            return place->kind;
    return NULL;
}
