/* forward.c - the ladder of models, rung by rung. */
#include "trial/forward.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/parallel.h"
#include "colour/delta_e.h"
#include "optics/model.h"
#include "optics/monte_carlo.h"
#include "optics/transport.h"

/* A walk of 10 000 photons takes 0.2 s, 64 streams 0.01: fewer skins tell enough. */
enum { SKINS = 200, SKINS_SLOW = 60, SKINS_WALKS = 12, MANY_PHOTONS = 5000 };

/* ---- which -------------------------------------------------------------------------- */

const char *trial_forward_name(const struct trial_forward *f, char text[TRIAL_FORWARD_NAME_SIZE])
{
    static const char *const vectors[QUICK_VECTORS] = { "SSE2", "AVX2", "AVX-512" };
    const char *slopes = f->kind == TRIAL_FORWARD_SLOPES         ? ", all slopes"
                         : f->kind == TRIAL_FORWARD_QUICK_SLOPES ? ", 3 slopes"
                                                                 : "";
    bool quick = f->kind == TRIAL_FORWARD_QUICK || f->kind == TRIAL_FORWARD_QUICK_SLOPES;
    if (f->photons > 0)
        snprintf(text, TRIAL_FORWARD_NAME_SIZE, "%s, %llu photons", f->model->name,
                 (unsigned long long)f->photons);
    else if (f->streams > 0)
        snprintf(text, TRIAL_FORWARD_NAME_SIZE, "transport, %d streams", f->streams);
    else
        snprintf(text, TRIAL_FORWARD_NAME_SIZE, "%s%s%s%s", f->model->name, quick ? ", " : "",
                 quick ? vectors[f->vectors] : "", slopes);
    return text;
}

static void add(struct trial_forward *list, size_t *n, struct trial_forward f)
{
    f.us = f.us_p95 = f.rms_R = f.worst_R = f.dE00 = NAN;
    list[(*n)++] = f;
}

/* Of N streams: by the widest vectors alone. */
static void add_side_by_side(const struct model *m, struct trial_forward *list, size_t *n)
{
    struct trial_forward f = { .model = m, .kind = TRIAL_FORWARD_QUICK };
    for (int v = QUICK_PLAIN; v < QUICK_VECTORS; v++)
        if (quick_has((enum quick_vectors)v))
            f.vectors = (enum quick_vectors)v;
    add(list, n, f);
    f.kind = TRIAL_FORWARD_QUICK_SLOPES;
    add(list, n, f);
}

size_t trial_forward_list(bool quick, struct trial_forward ret[TRIAL_FORWARD_MAX])
{
    size_t n = 0;
    const struct model *walks = model_find("monte-carlo");
    for (size_t i = 0; i < MODEL_COUNT; i++) {
        const struct model *m = &model_list[i];
        if (m == walks)
            continue;
        add(ret, &n, (struct trial_forward){ .model = m, .kind = TRIAL_FORWARD_MODEL });
        if (m->streams > 0)
            add_side_by_side(m, ret, &n);
        if (m->quick == MODEL_QUICK_NONE)
            continue;
        for (int v = QUICK_PLAIN; v < QUICK_VECTORS; v++) {
            struct trial_forward f = { .model = m, .vectors = (enum quick_vectors)v };
            if (!quick_has(f.vectors))
                continue;
            f.kind = TRIAL_FORWARD_QUICK;
            add(ret, &n, f);
            f.kind = TRIAL_FORWARD_QUICK_SLOPES;
            add(ret, &n, f);
        }
        add(ret, &n, (struct trial_forward){ .model = m, .kind = TRIAL_FORWARD_SLOPES });
    }
    for (uint64_t photons = 100; photons <= (quick ? 1000u : 10000u); photons *= 10)
        add(ret, &n,
            (struct trial_forward){
                .model = walks, .kind = TRIAL_FORWARD_MODEL, .photons = photons });
    add(ret, &n,
        (struct trial_forward){
            .model = model_find("transport-32"), .kind = TRIAL_FORWARD_MODEL, .streams = 64 });
    return n;
}

/* ---- one ---------------------------------------------------------------------------- */

enum status trial_forward_ready_init(const struct trial_forward *forward,
                                     const struct trial_skins *skins,
                                     struct trial_forward_ready *ret)
{
    bool reference = strcmp(forward->model->name, "transport-32") == 0;
    size_t most = forward->photons > 0                ? SKINS_WALKS
                  : reference || forward->streams > 0 ? SKINS_SLOW
                                                      : SKINS;
    *ret = (struct trial_forward_ready){ .forward = *forward, .skins = skins };
    ret->items = skins->n < most ? skins->n : most;
    if (forward->model->streams > 0)
        quick_init(forward->model, &ret->chromophores, skins->skin[0].eta, &ret->quick);
    return chromophores_init(TRIAL_FIRST_NM, TRIAL_STEP_NM, TRIAL_BANDS, &ret->chromophores);
}

static enum status run_medium(const struct trial_forward_ready *ready, const struct tissue *t,
                              size_t item, double *R)
{
    double scratch[MEDIUM_SCRATCH(TRIAL_BANDS)];
    struct medium medium;
    const struct monte_carlo_run run = { .photons = ready->forward.photons,
                                         .seed = item + 1,
                                         .threads = 1 };
    enum status s = tissue_medium(t, &ready->chromophores, scratch, &medium);
    if (s != STATUS_OK)
        return s;
    return ready->forward.photons > 0 ? monte_carlo_skin(&medium, &run, R, NULL, NULL, NULL)
                                      : transport_reflectance(ready->forward.streams, &medium, R);
}

enum status trial_forward_run(const struct trial_forward_ready *ready, size_t item, double *R)
{
    double scratch[QUICK_SCRATCH(TRIAL_BANDS)];
    double J[TISSUE_PARAMETERS * QUICK_STRIDE(TRIAL_BANDS)];
    const struct trial_forward *f = &ready->forward;
    const struct tissue *t = &ready->skins->skin[item];
    const struct chromophores *c = &ready->chromophores;
    unsigned three = QUICK_WANT(TISSUE_CM) | QUICK_WANT(TISSUE_BM) | QUICK_WANT(TISSUE_CH);
    if (f->photons > 0 || f->streams > 0)
        return run_medium(ready, t, item, R);
    if (f->model->streams > 0 && f->kind != TRIAL_FORWARD_MODEL)
        return quick_skin(&ready->quick, t, f->kind == TRIAL_FORWARD_QUICK ? 0 : three, scratch, R,
                          J);
    switch (f->kind) {
    case TRIAL_FORWARD_QUICK:
        return quick_slopes_by(f->vectors, f->model, t, c, 0, scratch, R, NULL);
    case TRIAL_FORWARD_QUICK_SLOPES:
        return quick_slopes_by(f->vectors, f->model, t, c, three, scratch, R, J);
    case TRIAL_FORWARD_SLOPES:
        return model_slopes(f->model, t, c, scratch, R, J);
    default:
        return f->model->rgb != NULL ? f->model->rgb(t, R)
                                     : model_reflectance(f->model, t, c, scratch, R);
    }
}

enum status trial_forward_work(const void *ready, size_t item)
{
    double R[QUICK_STRIDE(TRIAL_BANDS)];
    return trial_forward_run(ready, item, R);
}

/* ---- errors ------------------------------------------------------------------------- */

struct comparing {
    const struct trial_forward_ready *ready;
    const struct trial_spectra *truth;
    bool reference;          /* against 64 streams */
    double (*difference)[3]; /* [items] sum of squares, largest, dE00 */
};

static enum status compare_piece(size_t i, unsigned worker, void *context)
{
    const struct comparing *c = context;
    double R[QUICK_STRIDE(TRIAL_BANDS)], finer[TRIAL_BANDS], Lab[2][3];
    const double *truth = c->truth->clean[i];
    enum status s = trial_forward_run(c->ready, i, R);
    (void)worker;
    if (s == STATUS_OK && c->reference) {
        struct trial_forward_ready most = *c->ready;
        most.forward.streams = TRANSPORT_STREAMS_MAX;
        s = trial_forward_run(&most, i, finer);
        truth = finer;
    }
    if (s != STATUS_OK)
        return s;
    double *d = c->difference[i];
    for (size_t k = 0; k < TRIAL_BANDS; k++) {
        d[0] += (R[k] - truth[k]) * (R[k] - truth[k]);
        d[1] = fmax(d[1], fabs(R[k] - truth[k]));
    }
    trial_Lab(R, Lab[0]);
    trial_Lab(truth, Lab[1]);
    d[2] = delta_e_2000(Lab[0], Lab[1]);
    return STATUS_OK;
}

enum status trial_forward_errors(const struct trial_forward_ready *ready,
                                 const struct trial_spectra *truth, unsigned threads,
                                 struct trial_forward *f)
{
    size_t n = ready->items;
    double sum = 0.0, worst = 0.0, dE00 = 0.0;
    struct comparing c = { .ready = ready, .truth = truth };
    if (f->model->reflectance == NULL || f->streams > 0)
        return STATUS_OK; /* no spectra; nothing finer */
    c.reference = f->model == truth->model;
    c.difference = calloc(n, sizeof *c.difference);
    if (c.difference == NULL)
        return STATUS_NO_MEMORY;
    enum status s = parallel_run(n, threads, compare_piece, &c);
    for (size_t i = 0; i < n; i++) {
        sum += c.difference[i][0];
        worst = fmax(worst, c.difference[i][1]);
        dE00 += c.difference[i][2] / (double)n;
    }
    free(c.difference);
    if (s != STATUS_OK)
        return s;
    f->rms_R = sqrt(sum / (double)(n * TRIAL_BANDS));
    f->worst_R = worst;
    f->dE00 = dE00;
    f->compared = n;
    return STATUS_OK;
}
