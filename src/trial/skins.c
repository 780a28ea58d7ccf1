/* skins.c - skins by chance, their spectra by a model, and noise. */
#include "trial/skins.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "base/chance.h"
#include "base/parallel.h"
#include "colour/lab.h"
#include "colour/xyz.h"

/* ---- skins --------------------------------------------------------------------------- */

enum status trial_skins_init(size_t n, uint64_t seed, struct trial_skins *ret)
{
    struct trial_skins skins = { .n = n };
    uint64_t state = seed;
    skins.skin = calloc(n, sizeof *skins.skin);
    skins.noise = calloc(n, sizeof *skins.noise);
    if (skins.skin == NULL || skins.noise == NULL) {
        trial_skins_done(&skins);
        return STATUS_NO_MEMORY;
    }
    for (size_t i = 0; i < n; i++) {
        double Cm = chance_decades(&state, costs_skins[0].lo, costs_skins[0].hi);
        double Bm = chance_even(&state);
        double Ch = chance_decades(&state, costs_skins[2].lo, costs_skins[2].hi);
        skins.skin[i] = tissue_of(Cm, Bm, Ch);
        for (size_t k = 0; k < TRIAL_BANDS; k++)
            skins.noise[i][k] = TRIAL_NOISE * chance_normal(&state);
    }
    *ret = skins;
    return STATUS_OK;
}

void trial_skins_done(struct trial_skins *skins)
{
    free(skins->skin);
    free(skins->noise);
    memset(skins, 0, sizeof *skins);
}

/* ---- spectra ------------------------------------------------------------------------ */

struct making {
    const struct trial_skins *skins;
    struct chromophores chromophores;
    struct trial_spectra *spectra;
};

static enum status make_piece(size_t i, unsigned worker, void *context)
{
    struct making *m = context;
    double scratch[MEDIUM_SCRATCH(TRIAL_BANDS)];
    (void)worker;
    enum status s = model_reflectance(m->spectra->model, &m->skins->skin[i], &m->chromophores,
                                      scratch, m->spectra->clean[i]);
    if (s == STATUS_OK)
        trial_Lab(m->spectra->clean[i], m->spectra->Lab[i]);
    return s;
}

enum status trial_spectra_init(const struct trial_skins *skins, const struct model *model,
                               unsigned threads, struct trial_spectra *ret)
{
    struct trial_spectra spectra = { .model = model, .n = skins->n };
    struct making making = { .skins = skins, .spectra = &spectra };
    enum status s =
        chromophores_init(TRIAL_FIRST_NM, TRIAL_STEP_NM, TRIAL_BANDS, &making.chromophores);
    spectra.clean = calloc(skins->n, sizeof *spectra.clean);
    spectra.Lab = calloc(skins->n, sizeof *spectra.Lab);
    if (s == STATUS_OK && (spectra.clean == NULL || spectra.Lab == NULL))
        s = STATUS_NO_MEMORY;
    if (s == STATUS_OK)
        s = parallel_run(skins->n, threads, make_piece, &making);
    if (s != STATUS_OK) {
        trial_spectra_done(&spectra);
        return s;
    }
    *ret = spectra;
    return STATUS_OK;
}

void trial_spectra_done(struct trial_spectra *spectra)
{
    free(spectra->clean);
    free(spectra->Lab);
    memset(spectra, 0, sizeof *spectra);
}

void trial_measured(const struct trial_skins *skins, const struct trial_spectra *spectra, size_t i,
                    struct spectrum *ret)
{
    *ret = (struct spectrum){ .first_nm = TRIAL_FIRST_NM,
                              .step_nm = TRIAL_STEP_NM,
                              .n = TRIAL_BANDS,
                              .specular = SPECULAR_SCE,
                              .aperture_mm = NAN };
    for (size_t k = 0; k < TRIAL_BANDS; k++)
        ret->value[k] = spectra->clean[i][k] + skins->noise[i][k];
}

/* ---- colour ------------------------------------------------------------------------- */

static struct xyz_weights weights;

static void make_weights(void)
{
    (void)xyz_weights_init(ILLUMINANT_D65, OBSERVER_10DEG, TRIAL_FIRST_NM, TRIAL_STEP_NM,
                           TRIAL_BANDS, &weights); /* these bands give a colour */
}

void trial_Lab(const double R[TRIAL_BANDS], double Lab[3])
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    double XYZ[3];
    (void)pthread_once(&once, make_weights);
    xyz_from_reflectance(&weights, R, XYZ);
    lab_from_xyz(XYZ, weights.white, Lab);
}
