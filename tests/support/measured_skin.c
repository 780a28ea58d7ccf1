/* measured_skin.c - measured people read, fitted and summed up. */
#include "tests/support/measured_skin.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "match/skin_fit.h"
#include "tests/support/figures.h"

enum { HALF = MEASURED_PEOPLE / 2 };

/* ---- reading ---------------------------------------------------------------------------- */

static bool read_file(const char *name, struct figures *ret)
{
    const char *folder = getenv("SKINSPEC_MEASURED");
    char path[4096];
    snprintf(path, sizeof path, "%s/%s", folder != NULL ? folder : "../shared/measured", name);
    return figures_read(path, ret);
}

static struct spectrum blank(void)
{
    return (struct spectrum){ .first_nm = 400.0,
                              .step_nm = 10.0,
                              .n = MEASURED_BANDS,
                              .specular = SPECULAR_SCI,
                              .aperture_mm = NAN };
}

static bool take_means(const struct figures *f, struct measured_skin *ret)
{
    bool good = f->rows == MEASURED_PEOPLE;
    for (size_t person = 0; good && person < MEASURED_PEOPLE; person++) {
        struct spectrum *s = &ret->mean[person];
        *s = blank();
        for (size_t i = 0; i < s->n; i++) {
            char column[16];
            snprintf(column, sizeof column, "%.0f", spectrum_nm(s, i));
            size_t at = figures_column(f, column);
            if (at == f->columns)
                return false;
            s->value[i] = figures_at(f, person, at);
        }
        good = spectrum_remove_surface(s, MEASURED_SURFACE, NULL) == STATUS_OK;
    }
    return good;
}

/* Reflectance at nm, straight between the columns on either side. */
static double between(const struct figures *f, size_t row, double nm)
{
    for (size_t c = 2; c + 1 < f->columns; c++) {
        double low = atof(f->name[c]), high = atof(f->name[c + 1]);
        if (nm >= low && nm <= high)
            return figures_at(f, row, c) +
                   (nm - low) / (high - low) * (figures_at(f, row, c + 1) - figures_at(f, row, c));
    }
    return NAN;
}

static bool take_repeats(const struct figures *f, struct measured_skin *ret)
{
    bool good = f->rows == (size_t)MEASURED_PEOPLE * MEASURED_REPEATS;
    for (size_t row = 0; good && row < f->rows; row++) {
        struct spectrum *s = &ret->repeat[row / MEASURED_REPEATS][row % MEASURED_REPEATS];
        *s = blank();
        for (size_t i = 0; i < s->n; i++)
            s->value[i] = between(f, row, spectrum_nm(s, i));
        good = spectrum_remove_surface(s, MEASURED_SURFACE, NULL) == STATUS_OK;
    }
    return good;
}

bool measured_skin_read(struct measured_skin *ret)
{
    struct figures means = { 0 }, repeats = { 0 };
    bool good = read_file("nist_forearm_avg_10nm.csv", &means) &&
                read_file("nist_forearm_repeats_vis.csv", &repeats) && take_means(&means, ret) &&
                take_repeats(&repeats, ret);
    figures_done(&means);
    figures_done(&repeats);
    return good;
}

struct fit measured_skin_fit(const struct model *model, enum half fitted_on)
{
    static const double spread[2][SKIN_PARAMETERS] = {
        [HALF_EVEN] = { 0.0695, 0, 0.1757, 0.0452, 0, 0.0639, 0.2025 },
        [HALF_ODD] = { 0.0635, 0, 0.1432, 0.0467, 0, 0.0648, 0.1471 },
    };
    struct fit fit = fit_skin(model);
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        fit.role[i].spread = spread[fitted_on][i];
    return fit;
}

/* ---- summing up ------------------------------------------------------------------------- */

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Straight between the two nearest of n sorted values. */
static double quantile(double *value, size_t n, double share)
{
    qsort(value, n, sizeof *value, ascending);
    double at = share * (double)(n - 1), below = floor(at);
    size_t i = (size_t)below;
    return i + 1 < n ? value[i] + (at - below) * (value[i + 1] - value[i]) : value[n - 1];
}

static bool at_bound(const struct refined *r, size_t i)
{
    return (r->flags & (unsigned)REFINE_AT_BOUND << i) != 0;
}

/* The repeats of one person, two by two. */
static enum status compare_repeats(const struct refiner *refiner, const struct noise *noise,
                                   const struct spectrum *repeat, struct skin_figures *ret)
{
    static struct refined one[MEASURED_REPEATS], site;
    enum status s =
        refiner_run(refiner, noise, repeat, MEASURED_REPEATS, NULL, 0, REFINE_SECOND, &site, NULL);
    for (size_t k = 0; k < MEASURED_REPEATS && s == STATUS_OK; k++)
        s = refiner_run(refiner, noise, repeat + k, 1, NULL, 0, REFINE_SECOND, &one[k], NULL);
    if (s != STATUS_OK)
        return s;
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        for (size_t k = 0; k < MEASURED_REPEATS; k++)
            for (size_t l = 0; l < k; l++) {
                if ((site.free & 1u << i) == 0 || at_bound(&one[k], i) || at_bound(&one[l], i))
                    continue;
                double apart = fabs(one[k].value[i] - one[l].value[i]);
                /* repeat_se is that of the mean of three. */
                double sd = sqrt(2.0 * MEASURED_REPEATS) * site.repeat_se[i];
                ret->pairs[i]++;
                ret->agree[i] += apart <= 1.96 * sd ? 1.0 : 0.0;
            }
    return STATUS_OK;
}

struct people {
    size_t n;
    double rms[HALF], dE00[HALF], value[SKIN_PARAMETERS][HALF];
};

static void add_person(const struct refined *r, struct people *all, struct skin_figures *ret)
{
    bool any = false;
    all->rms[all->n] = r->rms;
    all->dE00[all->n] = r->dE00;
    for (size_t i = 0; i < SKIN_PARAMETERS; i++) {
        all->value[i][all->n] = r->value[i];
        ret->at_bound_of[i] += at_bound(r, i) ? 1.0 / HALF : 0.0;
        any = any || at_bound(r, i);
    }
    ret->at_bound += any ? 1.0 / HALF : 0.0;
    ret->flagged += (r->flags & REFINE_RESIDUAL_TOO_LARGE) != 0 ? 1.0 / HALF : 0.0;
    all->n++;
}

static void sum_up(struct people *all, struct skin_figures *ret)
{
    ret->rms = quantile(all->rms, all->n, 0.5);
    ret->rms_p95 = quantile(all->rms, all->n, 0.95);
    ret->dE00 = quantile(all->dE00, all->n, 0.5);
    ret->dE00_p95 = quantile(all->dE00, all->n, 0.95);
    for (size_t i = 0; i < SKIN_PARAMETERS; i++) {
        ret->middle[i] = quantile(all->value[i], all->n, 0.5);
        ret->agree[i] = ret->pairs[i] > 0 ? ret->agree[i] / (double)ret->pairs[i] : (double)NAN;
    }
}

enum status skin_figures_of(const struct fit *fit, const struct noise *noise,
                            const struct measured_skin *skin, enum half half, bool repeats,
                            struct skin_figures *ret)
{
    static struct refined answer;
    struct people all = { 0 };
    struct refiner *refiner;
    enum status s = refiner_open(fit, 400.0, 10.0, MEASURED_BANDS, &refiner, NULL);
    if (s != STATUS_OK)
        return s;
    *ret = (struct skin_figures){ 0 };
    for (size_t person = (size_t)half; person < MEASURED_PEOPLE && s == STATUS_OK; person += 2) {
        s = refiner_run(refiner, noise, &skin->mean[person], 1, NULL, 0,
                        REFINE_SECOND | REFINE_COLOUR, &answer, NULL);
        if (s == STATUS_OK)
            add_person(&answer, &all, ret);
        if (s == STATUS_OK && repeats)
            s = compare_repeats(refiner, noise, skin->repeat[person], ret);
    }
    refiner_close(refiner);
    if (s == STATUS_OK)
        sum_up(&all, ret);
    return s;
}
