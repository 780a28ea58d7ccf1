/* under_port.h - what lies under an instrument's port, and what it truly reflects.
 *
 *   white   the instrument's own ceramic tile: flat, with the gloss of its glaze
 *   black   a zero box, a light trap, or open air: nothing comes back
 *   skin    rises towards the red, with the dips of blood; as light as it was made
 *   user    a grey tile, somebody's own standard
 *   bright  retroreflecting foil: far more than a perfect white
 *
 * The curves are no model of anything: smooth, plausible, and shared with no code under test.
 * SCI is SCE plus the gloss of the surface, a few percent and a little more in the blue. */
#ifndef SKINSPEC_TESTS_SIM_UNDER_PORT_H
#define SKINSPEC_TESTS_SIM_UNDER_PORT_H

#include <stdbool.h>

enum under_port { UNDER_WHITE, UNDER_BLACK, UNDER_SKIN, UNDER_USER, UNDER_BRIGHT };

/* "white" ... "bright"; false for any other. */
bool under_port_find(const char *name, enum under_port *ret);

/* Reflectance at nm, 0..1 (bright: 2.1), with the gloss (sci) or without.  lightness: L* that the
 * skin has, near enough, 1..80. */
double under_port_truth(enum under_port what, double lightness, double nm, bool sci);

#endif
