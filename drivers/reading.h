/* reading.h - for drivers: a reading out of the counts that an instrument sent, and doubts about
 * counts that no surface gives.
 *
 * A count is raw_unit of reflectance; spectra are n counts from the shortest wavelength on, in
 * steps of about 10 nm.  An instrument without a checksum is doubted by what skin, tiles and
 * everything else between black and a bright white have in common. */
#ifndef SKINSPEC_DRIVERS_READING_H
#define SKINSPEC_DRIVERS_READING_H

#include "drivers/driver.h"

/* ---- doubts ------------------------------------------------------------------------- */

enum doubt {
    DOUBT_NONE,
    DOUBT_WRONG_COUNT, /* not as many values as bands */
    DOUBT_NO_NUMBER,   /* a value that is none */
    DOUBT_OUT_OF_RANGE,
    DOUBT_ALL_ZERO,
    DOUBT_JUMP,  /* between neighbouring bands, larger than any surface's */
    DOUBT_ORDER, /* less with the gloss than without it */
    DOUBT_GLOSS, /* the gloss alone jumps: a value came damaged */
    DOUBT_SAME,  /* SCI and SCE are one and the same */
};

/* More than a white that fluoresces or mirrors ever gives. */
#define DOUBT_RANGE_LIMIT 2.0
/* A band: of 130 measured skins the steepest rises by 0.11.  0.4 leaves room for the edge of a
 * saturated red tile. */
#define DOUBT_JUMP_LIMIT 0.4
/* Reflectance by which SCE may exceed SCI through noise: three times the 0.1 % of repeatability
 * that makers state for such instruments. */
#define DOUBT_ORDER_SLACK 0.003
/* SCI - SCE is what the surface mirrors, about 0.04 at all wavelengths: a band that stands off
 * the mean of its neighbours by more than this came damaged.  Noise of 0.1 % in both spectra
 * gives 0.0017, at an end 0.002: five times that. */
#define DOUBT_GLOSS_LIMIT 0.01

/* One spectrum alone, then two as a pair, then all three.  `gloss`: look at SCI - SCE too, which
 * has to be done where the instrument sends each value only once. */
enum doubt doubt_spectrum(size_t n, const int32_t *raw, double raw_unit);
enum doubt doubt_pair(size_t n, const int32_t *sci, const int32_t *sce, double raw_unit,
                      bool gloss);
enum doubt doubt_both(size_t n, const int32_t *sci, const int32_t *sce, double raw_unit,
                      bool gloss);

/* DRIVER_OK for DOUBT_NONE; DRIVER_PROTOCOL where the bytes are to blame, else
 * DRIVER_IMPLAUSIBLE, with a text that says what to do. */
enum driver_result doubt_fail(enum doubt doubt, struct driver_error *error);

/* ---- filling ------------------------------------------------------------------------ */

/* No spectrum yet, no name of a sample. */
void reading_init(double raw_unit, unsigned warnings, struct driver_reading *ret);

/* specular: SPECULAR_SCE or SPECULAR_SCI. */
void reading_add(const struct driver_grid *grid, const int32_t *raw, enum specular specular,
                 double aperture_mm, struct driver_reading *ret);

/* What is printable ASCII of n bytes, cut to the size, without spaces at either end: a serial
 * number or a sample's name may be anything. */
void reading_plain_text(const char *bytes, size_t n, char *ret, size_t size);

#endif
