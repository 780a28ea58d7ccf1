/* skin.h - what lies under the simulated port: a computed skin, or a file's rows.
 *
 * The file is CSV as docs/examples/skin.csv: lines that begin with # and empty
 * ones are passed over; a header whose numeric columns are wavelengths in nm,
 * rising; one reflectance spectrum (0..1) a row.  Other columns are ignored, but
 * `specular`, where there is one, must say sce.  No quotes.  Bands between the
 * file's are interpolated, those beyond its ends take the end's value. */
#ifndef SKINSPEC_DRIVERS_SIMULATED_SKIN_H
#define SKINSPEC_DRIVERS_SIMULATED_SKIN_H

#include "drivers/driver.h"
#include "drivers/simulated/options.h"

struct skin;

/* Fails with DRIVER_UNSUPPORTED and a text that names file and line. */
enum driver_result skin_open(const struct options *options, struct skin **ret,
                             struct driver_error *error);
void skin_close(struct skin *skin); /* takes NULL */

/* Reflectance R[grid->n] of the spot that a shot meets, counted from 0, without the
 * mirror reflection, through a large port. */
void skin_reflectance(const struct skin *skin, size_t shot, const struct driver_grid *grid,
                      double *R);

/* Share that comes back through a port: 1 at 8 mm; at 3 mm falling to 0.9 at 700 nm,
 * because red light wanders furthest before it leaves the skin. */
double skin_port_share(double aperture_mm, double nm);

/* Mirror reflection of a surface that has `at_550` at 550 nm: rises a little towards
 * the blue, as refractive indices do (Cauchy). */
double skin_surface(double at_550, double nm);

#endif
