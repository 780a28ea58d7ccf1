/* certificate.c - what can be wrong with a certificate's file, said where it stands. */
#include "cli/certificate.h"

#include <stdlib.h>
#include <strings.h>

#include "base/log.h"
#include "base/number.h"
#include "cli/out.h"
#include "cli/spectra.h"
#include "colour/xyz.h"
#include "station/wire.h"

static bool has_colour(const struct spectra *spectra)
{
    const struct spectrum *bands = spectra_bands(spectra);
    struct xyz_weights *weights = malloc(sizeof *weights);
    if (weights == NULL)
        out_of_memory();
    bool good = xyz_weights_init(ILLUMINANT_D65, OBSERVER_10DEG, bands->first_nm, bands->step_nm,
                                 bands->n, weights) == STATUS_OK;
    free(weights);
    if (!good)
        spectra_bands_error(spectra,
                            "a certificate needs bands by 10, 5 or 1 nm that cover 400..700 nm; "
                            "these are %g..%g by %g",
                            bands->first_nm, spectrum_nm(bands, bands->n - 1), bands->step_nm);
    return good;
}

/* Marks the row bad where it is not for a check. */
static void check_specular(const struct spectra *spectra, struct spectra_row *row)
{
    if (row->spectrum.specular == SPECULAR_SCI)
        spectra_refuse(spectra, row, SPECTRA_AT_SPECULAR,
                       "it includes the mirror reflection (sci); a check is made without: take "
                       "the certificate's sce values");
    else if (row->spectrum.specular != SPECULAR_SCE)
        spectra_refuse(spectra, row, SPECTRA_AT_SPECULAR,
                       "it is not said whether the mirror reflection is in it; add a column "
                       "'specular' that says sce, if it is not");
}

static void check_aperture(const struct spectra *spectra, struct spectra_row *row,
                           double aperture_mm)
{
    double stated_mm;
    for (size_t i = 0; i < spectra_carried(spectra) && row->good; i++) {
        const char *text = spectra_carried_text(spectra, row, i);
        if (strcasecmp(spectra_carried_name(spectra, i), "aperture_mm") != 0 || *text == '\0')
            continue;
        if (number_parse(text, &stated_mm) != STATUS_OK)
            spectra_refuse(spectra, row, SPECTRA_AT_ROW, "aperture_mm: '%.32s' is no number", text);
        else if (stated_mm != aperture_mm)
            spectra_refuse(spectra, row, SPECTRA_AT_ROW,
                           "it holds for a port of %g mm, and the instrument is set to %g mm; "
                           "measurements through another port are not comparable",
                           stated_mm, aperture_mm);
    }
}

/* The one row; false: logged. */
static bool read_row(struct spectra *spectra, double aperture_mm, struct spectra_row *row)
{
    struct spectra_row more = { .number = 0 };
    enum status s = spectra_next(spectra, row);
    if (s == STATUS_NOT_FOUND)
        log_error("%s: it has a header and no spectrum", spectra_path(spectra));
    if (s != STATUS_OK || !row->good)
        return false;
    check_specular(spectra, row);
    if (row->good)
        check_aperture(spectra, row, aperture_mm);
    if (!row->good)
        return false;
    s = spectra_next(spectra, &more);
    if (s == STATUS_OK && more.good)
        spectra_refuse(spectra, &more, SPECTRA_AT_ROW,
                       "a second spectrum; the certificate of a tile is one");
    spectra_row_done(&more);
    return s == STATUS_NOT_FOUND;
}

bool certificate_read(const char *path, double aperture_mm, cJSON *params)
{
    const struct spectra_source source = spectra_source_csv(path);
    struct spectra *spectra;
    struct spectra_row row = { .number = 0 };
    cJSON *spectrum = NULL;
    if (spectra_open(&source, &spectra) != STATUS_OK)
        return false;
    bool good = has_colour(spectra) && read_row(spectra, aperture_mm, &row);
    if (good) {
        if (wire_spectrum(&row.spectrum, &spectrum) != STATUS_OK)
            out_of_memory();
        cJSON_AddItemToObject(params, "spectrum", spectrum);
        cJSON_AddStringToObject(params, "specular", "sce");
        cJSON_AddNumberToObject(params, "aperture_mm", aperture_mm);
    }
    spectra_row_done(&row);
    spectra_close(spectra);
    return good;
}
