/* spectrum.c - naming of bands and of specular modes; the surface term. */
#include "base/spectrum.h"

#include <math.h>
#include <string.h>
#include <strings.h>

/* Values and surface come from decimals: 0.011 - 0.016 is a rounding below -0.005
 * and still meant to be at the edge. */
#define ROUNDING 1e-12

const char *specular_name(enum specular specular)
{
    switch (specular) {
    case SPECULAR_SCE:
        return "sce";
    case SPECULAR_SCI:
        return "sci";
    case SPECULAR_UNKNOWN:
        break;
    }
    return "unknown";
}

enum status specular_parse(const char *text, enum specular *ret)
{
    if (strcasecmp(text, "sce") == 0)
        *ret = SPECULAR_SCE;
    else if (strcasecmp(text, "sci") == 0)
        *ret = SPECULAR_SCI;
    else
        return STATUS_FORMAT;
    return STATUS_OK;
}

double spectrum_nm(const struct spectrum *s, size_t i)
{
    return s->first_nm + (double)i * s->step_nm;
}

size_t spectrum_band(const struct spectrum *s, double nm)
{
    double place = nearbyint((nm - s->first_nm) / s->step_nm);
    if (!(place >= 0.0) || place >= (double)s->n)
        return s->n;
    size_t i = (size_t)place;
    return fabs(spectrum_nm(s, i) - nm) <= 1e-6 ? i : s->n;
}

enum status spectrum_remove_surface(struct spectrum *s, double surface, size_t *band_ret)
{
    if (s->specular != SPECULAR_SCI)
        return STATUS_UNSUPPORTED;
    if (!(surface >= 0.0 && surface <= SPECTRUM_SURFACE_MAX))
        return STATUS_RANGE;
    for (size_t i = 0; i < s->n; i++) {
        if (s->value[i] - surface < -(SPECTRUM_SURFACE_SLACK + ROUNDING)) {
            if (band_ret != NULL)
                *band_ret = i;
            return STATUS_RANGE;
        }
    }
    for (size_t i = 0; i < s->n; i++) {
        s->value[i] -= surface;
        if (s->value[i] < 0.0) {
            s->value[i] = 0.0;
            s->flag[i] |= SPECTRUM_BAND_ZEROED;
        }
    }
    s->specular = SPECULAR_SCE;
    return STATUS_OK;
}
