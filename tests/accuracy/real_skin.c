/* real_skin.c - the skin fit on measured people that were not looked at when it was chosen,
 * each figure beside its bar; the paper's constants on the same people. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "match/skin_fit.h"
#include "tests/support/measured_skin.h"

static struct measured_skin skin;
/* Missed, and missed where docs/decisions/0011-skin-fit.md says why. */
static int failures, out_of_reach;

static void told(const char *what, double value, double low, double high, int digits)
{
    int good = value >= low && value <= high;
    printf("    %-34s %8.*f   bar %.*f .. %.*f   %s\n", what, digits, value, digits, low, digits,
           high, good ? "met" : "MISSED");
    failures += !good;
}

static void show(const char *what, const struct skin_figures *f)
{
    printf("  %s: rms median %.4f (95 %%: %.4f), dE00 %.2f (%.2f), at a bound %.0f %%, residual "
           "too large %.0f %%\n"
           "    median",
           what, f->rms, f->rms_p95, f->dE00, f->dE00_p95, 100 * f->at_bound, 100 * f->flagged);
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        printf(" %s %.4g", skin_parameter_name(i), f->middle[i]);
    printf("\n    at a bound");
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        if (f->at_bound_of[i] > 0)
            printf(" %s %.0f %%", skin_parameter_name(i), 100 * f->at_bound_of[i]);
    printf("\n");
}

/* ---- repeats that agree ------------------------------------------------------------- */

static const double nominal = 0.95;                  /* share of pairs, were all as stated */
static const double agree_low = 90, agree_high = 98; /* bar, % */

/* Whether chance alone leaves a true 95 % so far off: within two standard deviations, the pairs
 * of one person counted as one, for they share its three repeats. */
static bool by_chance(double agree, size_t pairs)
{
    double people = (double)pairs / MEASURED_REPEATS;
    return fabs(agree - nominal) <= 2.0 * sqrt(nominal * (1.0 - nominal) / people);
}

/* One half has too few people for this bar: what it misses by chance is counted apart. */
static void told_half(size_t parameter, double agree, size_t pairs)
{
    const char *name = skin_parameter_name(parameter);
    double percent = 100 * agree;
    if ((percent < agree_low || percent > agree_high) && by_chance(agree, pairs)) {
        printf("    %-34s %8.1f   bar %.1f .. %.1f   MISSED: %zu pairs of %zu people cannot tell "
               "it from 95 %%\n",
               name, percent, agree_low, agree_high, pairs, pairs / MEASURED_REPEATS);
        out_of_reach++;
    } else
        told(name, percent, agree_low, agree_high, 1);
}

/* Spreads fitted on one half, pairs of the other looked at; then the other way round. */
static enum status judge_pairs(const struct model *model, struct skin_figures of[2])
{
    static const char *const what[2] = { "the even half, spreads fitted on the odd one",
                                         "the odd half, spreads fitted on the even one" };
    struct noise noise = noise_skin();
    for (int half = HALF_EVEN; half <= HALF_ODD; half++) {
        struct fit fit = measured_skin_fit(model, half == HALF_EVEN ? HALF_ODD : HALF_EVEN);
        enum status s = skin_figures_of(&fit, &noise, &skin, (enum half)half, true, &of[half]);
        if (s != STATUS_OK)
            return s;
        printf("  pairs of repeats that agree, %s, %%\n", what[half]);
        for (size_t i = 0; i < SKIN_PARAMETERS; i++)
            if (of[half].pairs[i] > 0)
                told_half(i, of[half].agree[i], of[half].pairs[i]);
    }
    return STATUS_OK;
}

static void judge_both(const struct skin_figures of[2])
{
    printf("  pairs of repeats that agree, both halves held out, %%\n");
    for (size_t i = 0; i < SKIN_PARAMETERS; i++) {
        double even = (double)of[HALF_EVEN].pairs[i], odd = (double)of[HALF_ODD].pairs[i];
        if (even + odd > 0)
            told(skin_parameter_name(i),
                 100 * (even * of[HALF_EVEN].agree[i] + odd * of[HALF_ODD].agree[i]) / (even + odd),
                 agree_low, agree_high, 1);
    }
}

/* ---- a model, and the paper's constants --------------------------------------------- */

static void judge(const struct model *model)
{
    struct skin_figures of[2], *held_out = &of[HALF_ODD];
    printf("Skin fit, %s\n", model->name);
    if (judge_pairs(model, of) != STATUS_OK) {
        printf("  refine() failed\n");
        failures++;
        return;
    }
    show("50 people it was chosen on", &of[HALF_EVEN]);
    show("50 people held out", held_out);
    told("rms, median", held_out->rms, 0, 0.006, 4);
    told("dE00, median", held_out->dE00, 0, 0.55, 2);
    told("at a bound, %", 100 * held_out->at_bound, 0, 10, 0);
    judge_both(of);
}

static void show_paper(const char *model)
{
    struct recipe recipe = recipe_default(model_find(model));
    struct fit fit = fit_three(&recipe);
    struct noise noise = noise_white(SKIN_FIT_MODEL_ERROR);
    struct skin_figures f;
    fit.illuminant = ILLUMINANT_D65;
    fit.observer = OBSERVER_10DEG;
    if (skin_figures_of(&fit, &noise, &skin, HALF_ODD, false, &f) == STATUS_OK)
        show(model, &f);
}

int main(void)
{
    static const char *const models[] = { "two-layer", "transport-8" };
    if (!measured_skin_read(&skin)) {
        printf("measured skin: not here, set SKINSPEC_MEASURED; skipped\n");
        return 0;
    }
    printf("Measured skin, 400..700 nm by 10, surface %.2f taken off\n", MEASURED_SURFACE);
    for (size_t i = 0; i < sizeof models / sizeof *models; i++) {
        const struct model *model = model_find(models[i]);
        if (model != NULL && model->slopes != NULL)
            judge(model);
    }
    printf("The paper's constants: Cm, Bm, Ch free; the same 50 people\n");
    show_paper("half-space");
    show_paper("two-layer");
    printf(
        "%d of the bars missed, and %d that docs/decisions/0011-skin-fit.md tells the reason of\n",
        failures, out_of_reach);
    return failures > 0 ? EXIT_FAILURE : EXIT_SUCCESS;
}
