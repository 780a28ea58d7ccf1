/* ocean_ooi.h - Ocean Optics' spectrometers with the OOI protocol, a lamp and a sphere.
 *
 *   USB2000+, Flame-S   2457:101e      HR2000+   2457:1016
 *   USB4000, Flame-T    2457:1022      HR4000    2457:1012
 *
 * The spectrometer looks at the sample port of an integrating sphere under 8 degrees; the gloss
 * trap is open, so that all it gives is SCE; there is no SCI.  The lamp may hang at the
 * spectrometer's lamp line, which is switched on at open() and left on by close(), so that
 * the lamp is warm at the next; or be on by itself.
 *
 * The address (address.h) names the link, the white tile's file and the port's diameter:
 *
 *   ocean_ooi:usb,tile=FILE,port_mm=8[,greys=FILE][,model=NAME]
 *
 * Without a tile it is not opened: there is no reflectance without a certified one.  reference.h
 * has what the steps do and refuse, radiometry.h and bands.h the way from counts to 31 bands,
 * substitution.h the error of a sphere with a single beam (several percent for dark skin against a
 * white tile) and its correction from grey tiles.  A bench tool, then; a handheld with
 * a second beam has no such error.  The identity's firmware says whether it is corrected, and by
 * which file: "FPGA 3.0.0, greys 0123456789abcdef", the first 16 digits of its SHA-256.
 *
 * Readings: 400..700 nm by 10; no raw integers (a reading is a ratio of 2 000 pixels and more);
 * setup.averages spectra; R from -0.01 to 0 becomes 0 and is flagged.  A reading is refused where
 * R is outside -0.01..2, where it is dark altogether (mean below 0.002: the lamp), and where
 * neighbouring bands differ by more than 0.35: the steepest tiles (red, orange) rise by 0.25
 * in 10 nm, skin by 0.1.
 *
 * The OOI dialect names no writing command but 06, which is never sent.  Not seen on hardware.
 * HR2000+ and HR4000 are by the free drivers' descriptions alone. */
#ifndef SKINSPEC_DRIVERS_OCEAN_OOI_OCEAN_OOI_H
#define SKINSPEC_DRIVERS_OCEAN_OOI_OCEAN_OOI_H

#include "drivers/driver.h"

extern const struct driver ocean_ooi_driver;

#endif
