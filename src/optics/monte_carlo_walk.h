/* monte_carlo_walk.h - one photon through layers; what optics/monte_carlo.h adds up. */
#ifndef SKINSPEC_OPTICS_MONTE_CARLO_WALK_H
#define SKINSPEC_OPTICS_MONTE_CARLO_WALK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "optics/monte_carlo.h"

/* Layers as a walk sees them: depth counts mean free paths, so a path is of mean 1 anywhere. */
struct monte_carlo_stack {
    size_t n;
    double eta, entering;  /* 1 - Rs */
    double losing_no_more; /* diffusion's 2A, for what the last scattering leaves */
    double albedo[MONTE_CARLO_MAX_LAYERS], g[MONTE_CARLO_MAX_LAYERS];
    double absorbed[MONTE_CARLO_MAX_LAYERS]; /* 1 - albedo, as a quotient */
    double end[MONTE_CARLO_MAX_LAYERS];      /* depth of each layer's lower side */
};

/* What one photon sent out, and for every layer that times the scatterings in it, and times the
 * mean free paths gone in it, up to where it left. */
struct monte_carlo_score {
    double R, T, left;
    double scattered[MONTE_CARLO_MAX_LAYERS], gone[MONTE_CARLO_MAX_LAYERS];
};

/* The photon of that number; key: of seed and band.  Without counting, scattered and gone stay
 * 0; the walk is the same. */
void monte_carlo_walk(const struct monte_carlo_stack *stack, uint64_t key, uint64_t photon,
                      bool counting, struct monte_carlo_score *ret);

/* SplitMix64's mixing of 64 bits. */
uint64_t monte_carlo_mix(uint64_t z);

#endif
