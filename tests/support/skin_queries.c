/* skin_queries.c - rows, moved by chance. */
#include "tests/support/skin_queries.h"

#include <math.h>

#include "base/parallel.h"
#include "tests/support/dice.h"

enum status skin_table(size_t side, struct table *ret)
{
    struct recipe recipe = recipe_default(model_find("two-layer"));
    recipe.grid = (struct grid){ { 0.001, 0.5, side, true },
                                 { 0, 1, side, false },
                                 { 0.001, 0.1, side, true } };
    enum status s = table_init(&recipe, grid_rows(&recipe.grid), ret);
    if (s != STATUS_OK)
        return s;
    s = table_compute(ret, 0, ret->n, parallel_cores());
    if (s != STATUS_OK)
        table_done(ret);
    return s;
}

/* A length of low .. high in any direction. */
static void move(struct dice *dice, double low, double high, double at[3])
{
    double way[3], square, length = dice_between(dice, low, high);
    do {
        square = 0.0;
        for (int i = 0; i < 3; i++) {
            way[i] = dice_between(dice, -1.0, 1.0);
            square += way[i] * way[i];
        }
    } while (square > 1.0 || square < 1e-4);
    for (int i = 0; i < 3; i++)
        at[i] += length * way[i] / sqrt(square);
}

/* Three slow waves of chance phase, `rms` in all, and noise. */
static void make_spectrum(const struct table *t, size_t row, double rms, struct dice *dice,
                          struct spectrum *ret)
{
    double phase[3];
    *ret = (struct spectrum){ .first_nm = t->recipe.first_nm,
                              .step_nm = t->recipe.step_nm,
                              .n = t->recipe.bands,
                              .specular = SPECULAR_SCE,
                              .aperture_mm = 8 };
    for (int i = 0; i < 3; i++)
        phase[i] = dice_between(dice, 0.0, 6.28);
    for (size_t band = 0; band < ret->n; band++) {
        double wave = 0.0;
        for (int i = 0; i < 3; i++)
            wave += sin(phase[i] + 0.1 * (i + 1) * (double)band);
        ret->value[band] = (double)table_spectrum(t, row)[band] + rms * wave * sqrt(2.0 / 3.0) +
                           dice_between(dice, -0.002, 0.002);
    }
}

void skin_queries(const struct table *t, bool off, size_t n, struct skin_query *ret)
{
    struct dice dice = { off ? 5u : 3u };
    for (size_t i = 0; i < n; i++) {
        size_t row = dice_below(&dice, t->n);
        struct nearest_query *q = &ret[i].query;
        *q = (struct nearest_query){ .has_colour = true,
                                     .Lab = { t->L[row], t->a[row], t->b[row] },
                                     .rgb = { t->red[row], t->green[row], t->blue[row] },
                                     .spectrum = &ret[i].spectrum };
        move(&dice, off ? 3.0 : 0.5, off ? 10.0 : 1.0, q->Lab);
        move(&dice, 0.0, off ? 0.03 : 0.003, q->rgb);
        make_spectrum(t, row, off ? dice_between(&dice, 0.02, 0.05) : 0.0, &dice, &ret[i].spectrum);
    }
}
