/* units.h - the few conversions that data enters by; inside, lengths are mm,
 * coefficients mm^-1, wavelengths nm, angles degrees, reflectance 0..1. */
#ifndef SKINSPEC_BASE_UNITS_H
#define SKINSPEC_BASE_UNITS_H

#define UNITS_PI 3.14159265358979323846
#define UNITS_DEG_PER_RAD (180.0 / UNITS_PI)
#define UNITS_MM_PER_CM 10.0 /* a coefficient in cm^-1 divided by this is in mm^-1 */

#endif
