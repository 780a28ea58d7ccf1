/* kd_few.h - up to how many points a tree is not worth its boxes: all are judged, sixteen at once.
 *
 * Written by `make calibrate-search` (tests/bench/few.c); docs/decisions/0013. */
#ifndef SKINSPEC_MATCH_KD_FEW_H
#define SKINSPEC_MATCH_KD_FEW_H

/* Of three dimensions, and of more. */
#define KD_FEW_COLOURS 32u
#define KD_FEW_SPECTRA 32u

#endif
