/* spectrum.h - one reflectance spectrum on an even wavelength grid.
 *
 *   value[i]   reflectance factor at first_nm + i step_nm, 0..1 (percent only
 *              on screens); NAN where the band was not measured
 *   flag[i]    0, or why the band deserves less trust (SPECTRUM_BAND_*)
 *   specular   whether the mirror reflection is in it; SCI and SCE are never
 *              mixed in one array
 *   aperture   of the measuring port; NAN when not known.  Skin reflectance
 *              changes by up to 10 % with it: never compare across apertures */
#ifndef SKINSPEC_BASE_SPECTRUM_H
#define SKINSPEC_BASE_SPECTRUM_H

#include <stdbool.h>
#include <stddef.h>

#include "base/status.h"

enum { SPECTRUM_MAX_BANDS = 1024 };

enum specular { SPECULAR_UNKNOWN, SPECULAR_SCE, SPECULAR_SCI };

enum spectrum_band_flag {
    SPECTRUM_BAND_ZEROED = 1 << 0 /* slightly negative after the surface was removed; set to 0 */
};

struct spectrum {
    double first_nm, step_nm;
    size_t n;
    enum specular specular;
    double aperture_mm;
    double value[SPECTRUM_MAX_BANDS];
    unsigned char flag[SPECTRUM_MAX_BANDS];
};

/* "sce", "sci" or "unknown". */
const char *specular_name(enum specular specular);

/* "sce" and "sci" in either case; anything else is STATUS_FORMAT. */
enum status specular_parse(const char *text, enum specular *ret);

/* Wavelength of band i, nm. */
double spectrum_nm(const struct spectrum *s, size_t i);

/* Index of the band at nm (within 1e-6 nm) or s->n where there is none. */
size_t spectrum_band(const struct spectrum *s, double nm);

/* SCI -> SCE: subtract a stated surface term, 0..0.1 (about 0.04 for a skin
 * surface in air at SCI geometry).  A band that becomes negative by at most
 * SPECTRUM_SURFACE_SLACK is set to 0 and flagged; by more, STATUS_RANGE with
 * the spectrum untouched and *band_ret (may be NULL) the first such band.
 * STATUS_UNSUPPORTED when the spectrum is not SCI. */
#define SPECTRUM_SURFACE_SLACK 0.005
#define SPECTRUM_SURFACE_MAX 0.1
enum status spectrum_remove_surface(struct spectrum *s, double surface, size_t *band_ret);

#endif
