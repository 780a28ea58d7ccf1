/* colour_scale.h - numbers as colours, each as far from the next as any other is.
 *
 * From a dark violet over red to a light yellow: lightness L* rises all the way, so that the order
 * is seen in grey as well and by those who do not tell red from green; steps are of equal dE00
 * (colour/delta_e.h), seen as sRGB shows them. */
#ifndef SKINSPEC_CUBE_COLOUR_SCALE_H
#define SKINSPEC_CUBE_COLOUR_SCALE_H

#include <stddef.h>

/* n colours (2 or more), 8-bit sRGB, from the least to the most. */
void colour_scale_make(size_t n, unsigned char (*rgb)[3]);

#endif
