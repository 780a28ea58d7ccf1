/* recipe.c - one row of a table at a time: parameters -> spectrum -> colour. */
#include "match/recipe.h"

#include <stdlib.h>

#include "colour/lab.h"
#include "colour/srgb.h"
#include "colour/xyz.h"

struct recipe recipe_default(const struct model *model)
{
    struct tissue t = tissue_of(0.0, 0.0, 0.0);
    struct recipe recipe = {
        .model = model,
        .grid = grid_default(),
        .gamma = t.gamma,
        .epidermis_mm = t.epidermis_mm,
        .eta = t.eta,
        .illuminant = ILLUMINANT_D65,
        .observer = OBSERVER_2DEG,
        .rgb_reading = RGB_READING_LINEAR,
    };
    if (model->reflectance != NULL) {
        recipe.first_nm = 400.0;
        recipe.step_nm = 10.0;
        recipe.bands = 31;
        recipe.observer = OBSERVER_10DEG;
    }
    return recipe;
}

enum status recipe_check(const struct recipe *recipe)
{
    bool spectral = recipe->model->reflectance != NULL;
    if (spectral != (recipe->bands > 0))
        return STATUS_UNSUPPORTED;
    if (!spectral && (recipe->illuminant != ILLUMINANT_D65 || recipe->observer != OBSERVER_2DEG))
        return STATUS_UNSUPPORTED;
    enum status s = grid_check(&recipe->grid);
    if (s != STATUS_OK)
        return s;
    /* Opening a row maker tries the rest: bands, thickness, gamma, eta. */
    struct row_maker *maker;
    struct table_row row;
    s = row_maker_open(recipe, &maker);
    if (s != STATUS_OK)
        return s;
    s = row_maker_make(maker, 0, &row, NULL);
    row_maker_close(maker);
    return s;
}

struct row_maker {
    struct recipe recipe;
    struct chromophores chromophores;
    struct xyz_weights weights;
    double scratch[MEDIUM_SCRATCH(SPECTRUM_MAX_BANDS)];
    double R[SPECTRUM_MAX_BANDS];
};

enum status row_maker_open(const struct recipe *recipe, struct row_maker **ret)
{
    enum status s = STATUS_OK;
    struct row_maker *maker = calloc(1, sizeof *maker);
    if (maker == NULL)
        return STATUS_NO_MEMORY;
    maker->recipe = *recipe;
    if (recipe->bands > 0)
        s = chromophores_init(recipe->first_nm, recipe->step_nm, recipe->bands,
                              &maker->chromophores);
    if (s == STATUS_OK && recipe->bands > 0)
        s = xyz_weights_init(recipe->illuminant, recipe->observer, recipe->first_nm,
                             recipe->step_nm, recipe->bands, &maker->weights);
    if (s != STATUS_OK) {
        row_maker_close(maker);
        return s;
    }
    *ret = maker;
    return STATUS_OK;
}

void row_maker_close(struct row_maker *maker)
{
    free(maker);
}

/* Spectrum -> colour under the recipe's illuminant and observer. */
static enum status spectral_row(struct row_maker *maker, const struct tissue *t,
                                struct table_row *row, float *spectrum)
{
    double XYZ[3];
    const struct xyz_weights *w = &maker->weights;
    enum status s =
        model_reflectance(maker->recipe.model, t, &maker->chromophores, maker->scratch, maker->R);
    if (s != STATUS_OK)
        return s;
    xyz_from_reflectance(w, maker->R, XYZ);
    lab_from_xyz(XYZ, w->white, row->Lab);
    srgb_linear_from_xyz(XYZ, w->white, row->rgb);
    if (spectrum != NULL)
        for (size_t i = 0; i < maker->recipe.bands; i++)
            spectrum[i] = (float)maker->R[i];
    return STATUS_OK;
}

/* RGB of the paper -> Lab through sRGB's matrix. */
static enum status rgb_row(const struct recipe *recipe, const struct tissue *t,
                           struct table_row *row)
{
    double XYZ[3], white[3];
    enum status s = recipe->model->rgb(t, row->rgb);
    if (s != STATUS_OK)
        return s;
    if (recipe->rgb_reading == RGB_READING_CODED)
        for (int i = 0; i < 3; i++)
            row->rgb[i] = srgb_decode(row->rgb[i]);
    srgb_linear_to_xyz(row->rgb, XYZ, white);
    lab_from_xyz(XYZ, white, row->Lab);
    return STATUS_OK;
}

enum status row_maker_make(struct row_maker *maker, size_t row, struct table_row *ret,
                           float *spectrum)
{
    const struct recipe *recipe = &maker->recipe;
    struct table_row made;
    grid_row(&recipe->grid, row, &made.Cm, &made.Bm, &made.Ch);
    struct tissue t = tissue_of(made.Cm, made.Bm, made.Ch);
    t.gamma = recipe->gamma;
    t.epidermis_mm = recipe->epidermis_mm;
    t.eta = recipe->eta;
    enum status s =
        recipe->bands > 0 ? spectral_row(maker, &t, &made, spectrum) : rgb_row(recipe, &t, &made);
    if (s == STATUS_OK)
        *ret = made;
    return s;
}
