#include "tests/sim/ocean_detector.h"

#include <math.h>
#include <string.h>

/* All in counts of 65536; a well holds about as many electrons, so that the shot noise
 * is the root of the count (250:1 at full scale, as in the data sheet). */
static const double base = 1500, dark_per_us = 2e-5, fixed_pattern = 12, read_noise = 18;

/* ---- dice ---------------------------------------------------------------------------- */

static uint64_t mix(uint64_t z) /* splitmix64 */
{
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
    return z ^ (z >> 31);
}

static double unit(uint64_t bits) /* (0, 1) */
{
    return ((double)(bits >> 11) + 0.5) / 9007199254740992.0;
}

static double gauss(uint64_t *state)
{
    double u = unit(mix(*state += 0x9e3779b97f4a7c15U));
    double v = unit(mix(*state += 0x9e3779b97f4a7c15U));
    return sqrt(-2 * log(u)) * cos(2 * 3.14159265358979323846 * v);
}

/* ---- light --------------------------------------------------------------------------- */

static bool lit(const struct ocean_detector *d)
{
    return !d->lamp_broken && (d->lamp_line || d->options.always_lit);
}

static double drifted(const struct ocean_detector *d, int64_t at_us)
{
    double minutes = at_us > d->lit_since_us ? (double)(at_us - d->lit_since_us) / 60e6 : 0;
    return 1 + d->options.drift / 100 * fmin(minutes, 10);
}

/* The exposure that runs has been lit up to then as it is now. */
static void expose(struct ocean_detector *d, int64_t until_us)
{
    struct ocean_exposure *e = &d->now;
    int64_t length_us = e->end_us - e->start_us, from_us = e->lit_until_us;
    if (until_us > e->end_us)
        until_us = e->end_us;
    if (length_us > 0 && until_us <= from_us)
        return;
    double share = length_us > 0 ? (double)(until_us - from_us) / (double)length_us : 1;
    e->lit_until_us = until_us;
    if (!lit(d))
        return;
    double factor = share * e->integration_us * drifted(d, from_us + (until_us - from_us) / 2);
    for (size_t i = 0; i < d->model->pixels; i++)
        e->light[i] += factor * d->pixel_light[i];
}

void ocean_detector_look(struct ocean_detector *d)
{
    const struct ocean_model *m = d->model;
    for (size_t i = 0; i < m->pixels; i++) {
        bool reaches = i >= m->black && i < m->end;
        double half_covered = i < m->first ? 0.5 : 1;
        d->pixel_light[i] = reaches ? half_covered * ocean_scene_light(&d->scene, d->nm[i]) : 0;
    }
}

double ocean_detector_light(const struct ocean_detector *d, size_t i, uint32_t integration_us)
{
    return lit(d) ? d->pixel_light[i] * integration_us * d->model->full_scale / 65535 : 0;
}

unsigned ocean_detector_count(struct ocean_detector *d, const struct ocean_exposure *exposure,
                              size_t i)
{
    double full = d->model->full_scale, scale = full / 65535;
    double pattern = fixed_pattern * (2 * unit(mix(d->options.seed * 4096 + i)) - 1);
    double dark = base + pattern + dark_per_us * exposure->integration_us;
    double light = ocean_model_bend(d->model, d->linearity, exposure->light[i] * scale) / scale;
    double noise = d->options.noise * sqrt(read_noise * read_noise + light) * gauss(&d->random);
    double level = d->options.level > 0 ? d->options.level : full;
    double counts = (dark + light + noise) * level / 65535;
    return (unsigned)fmin(fmax(round(counts), 0), level);
}

/* ---- time ---------------------------------------------------------------------------- */

static int64_t length_us(const struct ocean_detector *d)
{
    return (int64_t)(d->options.delays * d->integration_us);
}

static void begin(struct ocean_detector *d, int64_t at_us)
{
    d->running = true;
    memset(&d->now, 0, sizeof d->now);
    d->now.integration_us = d->integration_us;
    d->now.start_us = d->now.lit_until_us = at_us;
    d->now.end_us = at_us + length_us(d);
    d->taken += d->model->kept > 0;
}

static void begin_if_due(struct ocean_detector *d, int64_t at_us)
{
    const size_t kept = d->model->kept;
    if (d->running || d->held || !d->powered || d->trigger != 0)
        return;
    if (d->asked > 0 && d->n_kept == 0) {
        begin(d, at_us);
    } else if (kept > 0 && d->ahead && d->n_kept < kept) {
        begin(d, at_us);
        d->unasked++;
    } else if (kept == 0 && length_us(d) > 0) {
        begin(d, at_us);
    }
}

/* The exposure has ended: true where it answers a request. */
static bool end(struct ocean_detector *d, int64_t now_us, struct ocean_exposure *ret)
{
    expose(d, d->now.end_us);
    d->running = false;
    if (d->asked > 0 && !d->held && d->n_kept == 0) {
        d->taken += d->model->kept == 0; /* an idle cycle is none */
        *ret = d->now;
        return true;
    }
    int64_t next_us = d->now.end_us;
    if (d->model->kept > 0) {
        d->kept[d->n_kept++] = d->now;
    } else { /* whole idle cycles at once */
        int64_t cycle_us = d->now.end_us - d->now.start_us;
        next_us += (now_us - next_us) / cycle_us * cycle_us;
    }
    begin_if_due(d, next_us);
    return false;
}

bool ocean_detector_pass(struct ocean_detector *d, int64_t now_us, struct ocean_exposure *ret,
                         int64_t *at_us)
{
    if (d->lit_since_us == INT64_MAX && lit(d))
        d->lit_since_us = now_us;
    bool answered = false;
    begin_if_due(d, now_us);
    while (!answered && d->running && d->now.end_us <= now_us) {
        *at_us = d->now.end_us;
        answered = end(d, now_us, ret);
    }
    if (!answered && d->asked > 0 && !d->held && d->n_kept > 0) {
        *ret = d->kept[0];
        *at_us = now_us;
        memmove(d->kept, d->kept + 1, --d->n_kept * sizeof *d->kept);
        answered = true;
    }
    if (answered) {
        d->held = true;
        d->asked--;
    } else if (d->running) {
        expose(d, now_us);
    }
    return answered;
}

void ocean_detector_fetched(struct ocean_detector *d)
{
    d->held = false;
    d->ahead = true;
}

void ocean_detector_stop(struct ocean_detector *d)
{
    d->running = d->ahead = false;
    d->asked = 0;
    d->n_kept = 0;
    d->trigger = 0;
}

void ocean_detector_reset(struct ocean_detector *d)
{
    ocean_detector_stop(d);
    d->held = d->lamp_line = false;
    d->powered = true;
    d->lit_since_us = INT64_MAX;
    d->integration_us = 100000;
    d->taken = d->unasked = 0;
}

void ocean_detector_init(struct ocean_detector *d, const struct ocean_model *model,
                         const struct ocean_detector_options *options,
                         const struct ocean_scene *scene)
{
    memset(d, 0, sizeof *d);
    d->model = model;
    d->options = *options;
    d->scene = *scene;
    d->random = mix(options->seed);
    ocean_model_linearity(model, d->linearity);
    for (size_t i = 0; i < model->pixels; i++)
        d->nm[i] = ocean_model_nm(model, i);
    ocean_detector_reset(d);
    ocean_detector_look(d);
}
