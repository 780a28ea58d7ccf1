/* model.c - the list of models, and a skin's spectrum by any of them. */
#include "optics/model.h"

#include <string.h>

#include "optics/half_space.h"
#include "optics/kubelka_munk.h"
#include "optics/monte_carlo.h"
#include "optics/paper.h"
#include "optics/transport.h"
#include "optics/two_layer.h"

const struct model model_list[MODEL_COUNT] = {
    {
        .name = "paper",
        .summary = "the paper's RGB computation; reproduces its Table 2, has no spectra",
        .trust = "faithful, not physical: a* falls when haemoglobin rises",
        .rgb = paper_rgb,
    },
    {
        .name = "half-space",
        .summary = "Eq. 9 per wavelength, both layers' absorption summed",
        .trust = "rms 0.08 in R against transport; haemoglobin and melanin trade places",
        .reflectance = half_space_reflectance,
        .slopes = half_space_slopes,
        .quick = MODEL_QUICK_HALF_SPACE,
    },
    {
        .name = "kubelka-munk",
        .summary = "epidermis over dermis, two fluxes of diffuse light, with slopes",
        .trust = "rms 0.027 in R against transport, worst 0.059; mostly too bright",
        .has_thickness = true,
        .reflectance = kubelka_munk_reflectance,
        .slopes = kubelka_munk_slopes,
    },
    {
        .name = "two-layer",
        .summary = "epidermis over dermis, diffusion in closed form (the default)",
        .trust = "rms 0.006 in R against transport; worst 0.02 from 0.06 mm up, 0.03 at 0.02 mm",
        .has_thickness = true,
        .reflectance = two_layer_reflectance,
        .slopes = two_layer_slopes,
        .quick = MODEL_QUICK_TWO_LAYER,
    },
    {
        .name = "monte-carlo",
        .summary = "epidermis over dermis, 10 000 random walks of light a band, with slopes",
        .trust = "no approximation; noise of 0.002 to 0.004 in R, independent from band to band",
        .has_thickness = true,
        .has_noise = true,
        .reflectance = monte_carlo_reflectance,
        .slopes = monte_carlo_slopes,
    },
    {
        .name = "transport-4",
        .summary = "epidermis over dermis, radiative transfer with 4 streams",
        .trust = "rms 0.004 in R against 64 streams, worst 0.0066",
        .has_thickness = true,
        .streams = 4,
        .reflectance = transport_4_reflectance,
        .slopes = transport_4_slopes,
    },
    {
        .name = "transport-8",
        .summary = "epidermis over dermis, radiative transfer with 8 streams",
        .trust = "rms 0.001 in R against 64 streams, worst 0.0015",
        .has_thickness = true,
        .streams = 8,
        .reflectance = transport_8_reflectance,
        .slopes = transport_8_slopes,
    },
    {
        .name = "transport-16",
        .summary = "epidermis over dermis, radiative transfer with 16 streams",
        .trust = "rms 1.4e-4 in R against 64 streams, worst 2.1e-4",
        .has_thickness = true,
        .streams = 16,
        .reflectance = transport_16_reflectance,
        .slopes = transport_16_slopes,
    },
    {
        .name = "transport-32",
        .summary = "epidermis over dermis, radiative transfer with 32 streams",
        .trust = "rms 1.6e-5 in R against 64 streams, worst 2.5e-5",
        .has_thickness = true,
        .streams = 32,
        .reflectance = transport_32_reflectance,
        .slopes = transport_32_slopes,
    },
};

const struct model *model_find(const char *name)
{
    for (size_t i = 0; i < MODEL_COUNT; i++)
        if (strcmp(model_list[i].name, name) == 0)
            return &model_list[i];
    return NULL;
}

enum status model_reflectance(const struct model *model, const struct tissue *t,
                              const struct chromophores *c, double *scratch, double *R)
{
    struct medium m;
    if (model->reflectance == NULL)
        return STATUS_UNSUPPORTED;
    enum status s = tissue_medium(t, c, scratch, &m);
    if (s != STATUS_OK)
        return s;
    return model->reflectance(&m, R);
}

enum status model_slopes(const struct model *model, const struct tissue *t,
                         const struct chromophores *c, double *scratch, double *R, double *J)
{
    struct medium m;
    struct slopes dR = slopes_in(scratch + MEDIUM_SCRATCH(c->n), c->n);
    if (model->slopes == NULL)
        return STATUS_UNSUPPORTED;
    enum status s = tissue_medium(t, c, scratch, &m);
    if (s != STATUS_OK)
        return s;
    s = model->slopes(&m, R, &dR);
    if (s == STATUS_OK)
        tissue_slopes(t, c, &m, &dR, J);
    return s;
}
