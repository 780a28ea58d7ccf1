/* colour_row.c - spectrum -> XYZ -> everything else. */
#include "cli/colour_row.h"

#include <stdio.h>

#include "colour/lab.h"
#include "colour/srgb.h"

void colour_row_of(const struct xyz_weights *weights, const double *value, struct colour_row *ret)
{
    double linear[3];
    xyz_from_reflectance(weights, value, ret->XYZ);
    lab_from_xyz(ret->XYZ, weights->white, ret->Lab);
    lab_to_lch(ret->Lab, ret->LCh);
    srgb_linear_from_xyz(ret->XYZ, weights->white, linear);
    ret->clipped = srgb_code(linear, ret->sRGB);
    ret->ITA = lab_ita_deg(ret->Lab);
}

bool colour_is_adapted(enum illuminant illuminant, enum observer observer)
{
    return illuminant != ILLUMINANT_D65 || observer != OBSERVER_2DEG;
}

void colour_row_json(cJSON *object, const struct colour_row *colour, bool adapted)
{
    cJSON_AddItemToObject(object, "XYZ", out_numbers(colour->XYZ, 3));
    cJSON_AddItemToObject(object, "Lab", out_numbers(colour->Lab, 3));
    cJSON_AddItemToObject(object, "LCh", out_numbers(colour->LCh, 3));
    cJSON_AddItemToObject(object, "sRGB", cJSON_CreateIntArray(colour->sRGB, 3));
    cJSON_AddBoolToObject(object, "clipped", colour->clipped);
    cJSON_AddBoolToObject(object, "adapted", adapted);
    out_member(object, "ITA", colour->ITA);
    cJSON_AddStringToObject(object, "ITA_class", lab_ita_class(colour->ITA));
    cJSON_AddStringToObject(object, "ITA_scheme", LAB_ITA_SCHEME);
}

void colour_row_print(struct plot_style style, const double Lab[3], const int sRGB[3], bool clipped,
                      double ITA)
{
    printf("  colour   L* %.1f  a* %.1f  b* %.1f   sRGB %d %d %d #%02X%02X%02X%s  ", Lab[0], Lab[1],
           Lab[2], sRGB[0], sRGB[1], sRGB[2], (unsigned)sRGB[0], (unsigned)sRGB[1],
           (unsigned)sRGB[2], clipped ? " (clipped)" : "");
    plot_swatch(stdout, style, sRGB);
    printf("\n  ITA      %.1f degrees: %s (%s)\n", ITA, lab_ita_class(ITA), LAB_ITA_SCHEME);
}

enum status colour_weights(const struct spectra *spectra, enum illuminant illuminant,
                           enum observer observer, struct xyz_weights *ret)
{
    const struct spectrum *bands = spectra_bands(spectra);
    enum status s =
        xyz_weights_init(illuminant, observer, bands->first_nm, bands->step_nm, bands->n, ret);
    double last_nm = spectrum_nm(bands, bands->n - 1);
    if (s == STATUS_RANGE)
        spectra_bands_error(spectra,
                            "bands %g..%g nm are too few for colour; it needs 400..700 nm at least",
                            bands->first_nm, last_nm);
    else if (s != STATUS_OK)
        spectra_bands_error(spectra,
                            "bands by %g nm from %g; colour needs steps of 10, 5 or 1 nm on whole "
                            "multiples of the step",
                            bands->step_nm, bands->first_nm);
    return s;
}
