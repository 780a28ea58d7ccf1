/* model.h - every model of skin behind one interface: coefficients in,
 * reflectance out.
 *
 * Convention of all spectral models: diffuse reflectance per incident light, so
 * the light lost to the mirror reflection at entry is gone (a factor 1-Rs) and
 * the mirror reflection itself is not in it: what SCE measures. */
#ifndef SKINSPEC_OPTICS_MODEL_H
#define SKINSPEC_OPTICS_MODEL_H

#include <stdbool.h>
#include <stddef.h>

#include "base/status.h"
#include "optics/slopes.h"
#include "optics/tissue.h"
#include "optics/tissue_slopes.h"

/* Which formulas of optics/quick.h a model has. */
enum model_quick {
    MODEL_QUICK_NONE,
    MODEL_QUICK_HALF_SPACE,
    MODEL_QUICK_TWO_LAYER,
    MODEL_QUICK_EPIDERMIS
};

struct model {
    const char *name;    /* as on the command line and in table files */
    const char *summary; /* one line for --help */
    const char *trust;   /* how far to believe it */
    bool has_thickness;  /* whether epidermis_mm changes the answer */
    bool has_noise;      /* R and its derivatives carry chance of their own: not to be fitted by */
    enum model_quick quick;
    int streams; /* of a transport model, optics/transport_lanes.h; else 0 */

    /* Just one of these two is there; NULL means the model cannot. */
    enum status (*reflectance)(const struct medium *m, double *R); /* R[m->n] */
    enum status (*rgb)(const struct tissue *t, double rgb[3]);     /* no spectrum */
    /* R as reflectance() gives it, to the last bit, and its derivatives: optics/slopes.h.
     * NULL for a model without. */
    enum status (*slopes)(const struct medium *m, double *R, const struct slopes *dR);
};

enum { MODEL_COUNT = 9 };
extern const struct model model_list[MODEL_COUNT];

/* NULL where there is no model of that name. */
const struct model *model_find(const char *name);

/* Spectrum of a skin on the chromophores' bands, R[c->n]; scratch holds
 * MEDIUM_SCRATCH(c->n) doubles.  STATUS_UNSUPPORTED for a model without
 * spectra, STATUS_RANGE as the model says; R is then untouched. */
enum status model_reflectance(const struct model *model, const struct tissue *t,
                              const struct chromophores *c, double *scratch, double *R);

/* Doubles of scratch for model_slopes() on n bands. */
#define MODEL_SLOPES_SCRATCH(n) (MEDIUM_SCRATCH(n) + SLOPES_SCRATCH(n))

/* The same R to the last bit, and J[TISSUE_PARAMETERS * c->n] as optics/tissue_slopes.h has it.
 * scratch holds MODEL_SLOPES_SCRATCH(c->n) doubles.  STATUS_UNSUPPORTED for a model without
 * slopes, STATUS_RANGE as the model says; R and J are then untouched. */
enum status model_slopes(const struct model *model, const struct tissue *t,
                         const struct chromophores *c, double *scratch, double *R, double *J);

#endif
