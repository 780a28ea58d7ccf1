/* overlap.c - bands in common. */
#include "match/overlap.h"

#include <math.h>
#include <stdbool.h>

void overlap_init(const struct table *table, const struct spectrum *s, struct overlap *ret)
{
    const struct recipe *recipe = &table->recipe;
    ret->n = 0;
    ret->padded = table->stride;
    for (size_t i = 0; i < table->stride; i++) {
        size_t j = s->n;
        if (i < recipe->bands)
            j = spectrum_band(s, recipe->first_nm + (double)i * recipe->step_nm);
        bool both = j < s->n && !isnan(s->value[j]);
        ret->value[i] = both ? s->value[j] : 0.0;
        ret->weight[i] = both ? 1.0 : 0.0;
        ret->n += both ? 1 : 0;
    }
}
