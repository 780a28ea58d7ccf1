/* overlap.c - bands in common. */
#include "match/overlap.h"

#include <math.h>
#include <stdbool.h>

/* Where the spectrum has all of the table's bands, though it may not have been measured at all. */
static void lay_block(const double value[TABLE_BLOCK], size_t at, struct overlap *ret)
{
    for (size_t i = 0; i < TABLE_BLOCK; i++)
        ret->weight[at + i] = isnan(value[i]) ? 0.0 : 1.0;
    for (size_t i = 0; i < TABLE_BLOCK; i++)
        ret->value[at + i] = isnan(value[i]) ? 0.0 : value[i];
}

static void lay_all(const double *value, size_t bands, struct overlap *ret)
{
    double last[TABLE_BLOCK], n[TABLE_BLOCK] = { 0.0 };
    size_t at = 0;
    for (; at + TABLE_BLOCK <= bands; at += TABLE_BLOCK)
        lay_block(value + at, at, ret);
    for (size_t i = 0; i < TABLE_BLOCK && at < ret->padded; i++)
        last[i] = at + i < bands ? value[at + i] : NAN;
    if (at < ret->padded)
        lay_block(last, at, ret);
    for (at = 0; at < ret->padded; at += TABLE_BLOCK)
        for (size_t i = 0; i < TABLE_BLOCK; i++)
            n[i] += ret->weight[at + i];
    for (size_t i = 0; i < TABLE_BLOCK; i++)
        ret->n += (size_t)n[i];
}

void overlap_init(const struct table *table, const struct spectrum *s, struct overlap *ret)
{
    const struct recipe *recipe = &table->recipe;
    /* By the same steps from a band of the spectrum's on, its place says those of all others. */
    bool alike = s->step_nm == recipe->step_nm;
    size_t first = alike ? spectrum_band(s, recipe->first_nm) : s->n;
    alike = alike && first < s->n;
    ret->n = 0;
    ret->padded = table->stride;
    if (alike && recipe->bands <= s->n - first) {
        lay_all(s->value + first, recipe->bands, ret);
        return;
    }
    for (size_t i = 0; i < table->stride; i++) {
        size_t j = s->n;
        if (i < recipe->bands && alike)
            j = first + i;
        else if (i < recipe->bands)
            j = spectrum_band(s, recipe->first_nm + (double)i * recipe->step_nm);
        bool both = j < s->n && !isnan(s->value[j]);
        ret->value[i] = both ? s->value[j] : 0.0;
        ret->weight[i] = both ? 1.0 : 0.0;
        ret->n += both ? 1 : 0;
    }
}

static double sum_plain(const struct overlap *o, const float *row, double limit)
{
    return overlap_sum_of_squares(o, row, limit);
}

VECTORS_AVX2 static double sum_avx2(const struct overlap *o, const float *row, double limit)
{
    return overlap_sum_of_squares(o, row, limit);
}

VECTORS_AVX512 static double sum_avx512(const struct overlap *o, const float *row, double limit)
{
    return overlap_sum_of_squares(o, row, limit);
}

overlap_sum *overlap_sum_by(enum vectors kind)
{
    static overlap_sum *const of[VECTORS_KINDS] = { sum_plain, sum_avx2, sum_avx512 };
    return of[kind];
}
