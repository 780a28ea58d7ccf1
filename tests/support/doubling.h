/* doubling.h - radiative transfer by adding and doubling, as a textbook has it: the plain twin
 * that the transport models are tested and measured against.
 *
 * Each layer starts as 2^-k of itself, so thin that its depth does not matter (the diamond scheme:
 * Wiscombe, J. Quant. Spectrosc. Radiat. Transfer 16, 637, 1976), and is put upon itself k times
 * (van de Hulst); an endless one until nothing gets through.  Plain loops, Gauss elimination. */
#ifndef SKINSPEC_TESTS_SUPPORT_DOUBLING_H
#define SKINSPEC_TESTS_SUPPORT_DOUBLING_H

#include "optics/streams.h"

enum { DOUBLING_MAX = 32 };

/* An epidermis of optical thickness tau over an endless dermis, albedos below 1: what comes back of
 * light along the normal, without the mirror reflection, per incident light.  At most DOUBLING_MAX
 * directions.  thinness: of the thinnest layer over the most grazing cosine, 1/16 or so; the error
 * goes as its square. */
double doubling_two_layers(const struct streams *s, double albedo1, double tau, double albedo2,
                           double thinness);

#endif
