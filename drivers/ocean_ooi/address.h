/* address.h - where the spectrometer is, and what stands at the other end of its fibre.
 *
 *   ocean_ooi:usb,tile=/etc/skinspec/ws-1.csv,port_mm=8
 *   ocean_ooi:usb:2457:101e,tile=...,port_mm=8,greys=/etc/skinspec/greys.csv
 *   ocean_ooi:usb:001:005,tile=...,port_mm=8
 *   ocean_ooi:replay:FILE,tile=...,port_mm=8,model=usb4000
 *
 * The part before the first comma is the link's address, see drivers/link/link.h.  Then, in
 * any order, each once; a path cannot hold a comma:
 *
 *   tile=FILE     must be given; certified SCE reflectance of the white tile, tile_file.h
 *   port_mm=N     must be given; diameter of the sphere's sample port, 1 .. 100 mm.  The
 *                 spectrometer cannot know it, and spectra of skin depend on it
 *   greys=FILE    grey tiles as measured and as certified: corrects the substitution error
 *                 of the single-beam sphere, substitution.h.  Without it there is no correction
 *   model=NAME    usb2000+, usb4000, hr2000+ or hr4000: where the link cannot tell, as a replay
 *                 cannot.  Without it the number of pixels decides between the first two */
#ifndef SKINSPEC_DRIVERS_OCEAN_OOI_ADDRESS_H
#define SKINSPEC_DRIVERS_OCEAN_OOI_ADDRESS_H

#include "drivers/driver.h"
#include "drivers/ocean_ooi/models.h"

enum { OOI_PATH_SIZE = 1024 };

struct ooi_address {
    char link[OOI_PATH_SIZE];
    char tile[OOI_PATH_SIZE], greys[OOI_PATH_SIZE]; /* greys "": none */
    double port_mm;
    const struct ooi_model *model; /* NULL: not said */
};

/* With or without "ocean_ooi:" before it.  DRIVER_UNSUPPORTED, and a text that says what is missing
 * or wrong; *ret is untouched then. */
enum driver_result ooi_address_parse(const char *text, struct ooi_address *ret,
                                     struct driver_error *error);

#endif
