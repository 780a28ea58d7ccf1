/* errors.c - every skin answered once, on all cores, and the differences summed in order. */
#include "trial/errors.h"

#include <math.h>
#include <stdlib.h>

#include "base/parallel.h"
#include "colour/delta_e.h"

struct trial_errors trial_errors_none(void)
{
    return (struct trial_errors){ { NAN, NAN, NAN }, NAN, NAN, NAN, false };
}

struct difference {
    double parameter[3], dE00, rms_R;
};

enum { SLICE = 128 }; /* skins between looks at the watch */

struct comparing {
    size_t first; /* skin of piece 0 */
    const struct trial_ready *ready;
    const struct trial_skins *skins;
    const struct trial_spectra *set;
    struct chromophores chromophores;
    struct difference *difference; /* [n] */
};

/* Without spectra only the colour, under the table's light. */
static enum status compare_colour(const struct comparing *c, size_t i, size_t row,
                                  struct difference *d)
{
    struct spectrum clean;
    struct table_row there;
    double Lab[3], rgb[3];
    trial_measured(c->skins, c->set, i, &clean);
    for (size_t k = 0; k < TRIAL_BANDS; k++)
        clean.value[k] = c->set->clean[i][k];
    table_get(c->ready->table, row, &there);
    enum status s = matcher_colour(c->ready->table, &clean, Lab, rgb);
    if (s == STATUS_OK)
        d->dE00 = delta_e_2000(Lab, there.Lab);
    d->rms_R = NAN;
    return s;
}

static enum status answer_spectrum(const struct comparing *c, const struct trial_answer *answer,
                                   double R[TRIAL_BANDS])
{
    double scratch[MEDIUM_SCRATCH(TRIAL_BANDS)];
    if (!answer->has_row)
        return model_reflectance(c->ready->method.model, &answer->skin, &c->chromophores, scratch,
                                 R);
    const float *row = table_spectrum(c->ready->table, answer->row);
    for (size_t k = 0; k < TRIAL_BANDS; k++)
        R[k] = (double)row[k];
    return STATUS_OK;
}

static void compare_spectrum(const struct trial_spectra *set, size_t i, const double R[TRIAL_BANDS],
                             struct difference *d)
{
    double Lab[3], sum = 0.0;
    for (size_t k = 0; k < TRIAL_BANDS; k++)
        sum += (R[k] - set->clean[i][k]) * (R[k] - set->clean[i][k]);
    trial_Lab(R, Lab);
    d->rms_R = sqrt(sum / TRIAL_BANDS);
    d->dE00 = delta_e_2000(set->Lab[i], Lab);
}

static enum status compare_piece(size_t piece, unsigned worker, void *context)
{
    struct comparing *c = context;
    size_t i = c->first + piece;
    struct difference *d = &c->difference[i];
    const struct tissue *truth = &c->skins->skin[i];
    bool fitted = c->ready->refiner != NULL;
    struct trial_answer answer;
    struct spectrum measured;
    double R[TRIAL_BANDS];
    (void)worker;
    trial_measured(c->skins, c->set, i, &measured);
    enum status s = trial_run(c->ready, &measured, &answer);
    if (s != STATUS_OK)
        return s;
    d->parameter[0] = answer.skin.Cm - truth->Cm;
    d->parameter[1] =
        fitted && !c->ready->fit.role[SKIN_BM].free ? NAN : answer.skin.Bm - truth->Bm;
    d->parameter[2] = answer.skin.Ch - truth->Ch;
    if (answer.has_row && table_spectrum(c->ready->table, answer.row) == NULL)
        return compare_colour(c, i, answer.row, d);
    s = answer_spectrum(c, &answer, R);
    if (s == STATUS_OK)
        compare_spectrum(c->set, i, R, d);
    return s;
}

static struct trial_errors sum_up(const struct difference *d, size_t n)
{
    struct trial_errors e = { { 0.0, 0.0, 0.0 }, 0.0, 0.0, NAN, false };
    for (size_t i = 0; i < n; i++) {
        for (size_t k = 0; k < 3; k++)
            e.rmse[k] += d[i].parameter[k] * d[i].parameter[k] / (double)n;
        e.dE00 += d[i].dE00 / (double)n;
        e.rms_R += d[i].rms_R / (double)n;
    }
    for (size_t k = 0; k < 3; k++)
        e.rmse[k] = sqrt(e.rmse[k]);
    return e;
}

enum status trial_errors_of(const struct trial_ready *ready, const struct trial_skins *skins,
                            const struct trial_spectra *set, unsigned threads,
                            const struct trial_watch *watch, struct trial_errors *ret)
{
    struct comparing c = { .ready = ready, .skins = skins, .set = set };
    enum status s = chromophores_init(TRIAL_FIRST_NM, TRIAL_STEP_NM, TRIAL_BANDS, &c.chromophores);
    c.difference = calloc(skins->n, sizeof *c.difference);
    if (s == STATUS_OK && c.difference == NULL)
        s = STATUS_NO_MEMORY;
    for (; s == STATUS_OK && c.first < skins->n; c.first += SLICE) {
        size_t n = skins->n - c.first < SLICE ? skins->n - c.first : SLICE;
        s = parallel_run(n, threads, compare_piece, &c);
        if (s == STATUS_OK)
            s = watch->done(watch->context, (double)n / (double)skins->n);
    }
    if (s == STATUS_OK)
        *ret = sum_up(c.difference, skins->n);
    free(c.difference);
    return s;
}

/* ---- what noise allows -------------------------------------------------------------- */

enum status trial_limit(const struct trial_skins *skins, const struct trial_spectra *set,
                        double ret[3])
{
    static const enum skin_parameter parameter[3] = { SKIN_CM, SKIN_BM, SKIN_CH };
    struct recipe recipe = recipe_default(set->model);
    struct fit fit = fit_three(&recipe);
    struct noise noise = noise_white(TRIAL_NOISE);
    struct refiner *refiner = NULL;
    double sum[3] = { 0.0, 0.0, 0.0 };
    enum status s = refiner_open(&fit, TRIAL_FIRST_NM, TRIAL_STEP_NM, TRIAL_BANDS, &refiner, NULL);
    for (size_t i = 0; i < skins->n && s == STATUS_OK; i++) {
        double start[1][SKIN_PARAMETERS];
        struct spectrum clean;
        struct refined refined;
        trial_measured(skins, set, i, &clean);
        for (size_t k = 0; k < TRIAL_BANDS; k++)
            clean.value[k] = set->clean[i][k];
        for (size_t k = 0; k < SKIN_PARAMETERS; k++)
            start[0][k] = fit.role[k].value;
        start[0][SKIN_CM] = skins->skin[i].Cm;
        start[0][SKIN_BM] = skins->skin[i].Bm;
        start[0][SKIN_CH] = skins->skin[i].Ch;
        s = refiner_run(refiner, &noise, &clean, 1, (const double(*)[SKIN_PARAMETERS])start, 1, 0,
                        &refined, NULL);
        for (size_t k = 0; k < 3 && s == STATUS_OK; k++)
            sum[k] += refined.se[parameter[k]] * refined.se[parameter[k]];
    }
    refiner_close(refiner);
    for (size_t k = 0; k < 3 && s == STATUS_OK; k++)
        ret[k] = sqrt(sum[k] / (double)skins->n);
    return s;
}

double trial_times(const double rmse[3], const double limit[3])
{
    double most = NAN;
    for (size_t k = 0; k < 3; k++)
        most = fmax(most, rmse[k] / limit[k]); /* the one that is a number, where one is none */
    if (isnan(most) || most == 0.0)
        return most;
    double unit = pow(10.0, floor(log10(most)) - 2.0);
    return round(most / unit) * unit;
}
