/* chance.h - numbers as if by chance, the same for the same seed: for skins and noise that are
 * made up. */
#ifndef SKINSPEC_BASE_CHANCE_H
#define SKINSPEC_BASE_CHANCE_H

#include <stdint.h>

/* Evenly between 0 and 1, neither of them; *state is the seed and goes on by itself.  splitmix64
 * (Steele, Lea and Flood, 2014; public-domain code by S. Vigna). */
double chance_even(uint64_t *state);

/* Evenly in the logarithm between least and most, both above 0. */
double chance_decades(uint64_t *state, double least, double most);

/* Normal, mean 0, variance 1: Box and Muller's, one of the two. */
double chance_normal(uint64_t *state);

#endif
