/* certificate.h - the spectrum of a check tile as its certificate has it, from a file. */
#ifndef SKINSPEC_CLI_CERTIFICATE_H
#define SKINSPEC_CLI_CERTIFICATE_H

#include <cjson/cJSON.h>
#include <stdbool.h>

/* A spectrum file (cli/spectra.h) with one row, whose column `specular` says sce, and whose
 * bands, by 10, 5 or 1 nm, cover 400..700 nm.  A column `aperture_mm`, where there is one, must
 * say the port that is set.  spectrum, specular and aperture_mm are added to the params of
 * check.set.  False: logged as file:line:column, params as they were. */
bool certificate_read(const char *path, double aperture_mm, cJSON *params);

#endif
