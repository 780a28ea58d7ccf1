/* colour_row.c - spectrum -> XYZ -> everything else. */
#include "cli/colour_row.h"

#include "base/log.h"
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

enum status colour_weights(const char *path, const struct spectrum *bands,
                           enum illuminant illuminant, enum observer observer,
                           struct xyz_weights *ret)
{
    enum status s =
        xyz_weights_init(illuminant, observer, bands->first_nm, bands->step_nm, bands->n, ret);
    double last_nm = spectrum_nm(bands, bands->n - 1);
    if (s == STATUS_RANGE)
        log_error("%s: bands %g..%g nm are too few for colour; it needs 400..700 nm at least", path,
                  bands->first_nm, last_nm);
    else if (s != STATUS_OK)
        log_error("%s: bands by %g nm from %g; colour needs steps of 10, 5 or 1 nm on whole "
                  "multiples of the step",
                  path, bands->step_nm, bands->first_nm);
    return s;
}
