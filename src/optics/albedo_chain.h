/* albedo_chain.h - from albedos and optical depths to the coefficients of two layers: the chain
 * rule of optics/transport.c and optics/transport_lanes.c. */
#ifndef SKINSPEC_OPTICS_ALBEDO_CHAIN_H
#define SKINSPEC_OPTICS_ALBEDO_CHAIN_H

#include "optics/slopes.h"
#include "optics/tissue.h"

/* R is a function of a1, tau1 and a2.  by_a1 and by_a2 are its derivatives at the same tau1 (not
 * looked at: by_a2 where the dermis absorbs nothing); border is light times adjoint light between
 * the layers, each summed over all directions.  m and dR have one band. */
void albedo_chain(const struct medium *m, double by_a1, double by_a2, double border,
                  const struct slopes *dR);

#endif
