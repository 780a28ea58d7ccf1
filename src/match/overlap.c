/* overlap.c - bands in common. */
#include "match/overlap.h"

#include <math.h>
#include <stdbool.h>

void overlap_init(const struct table *table, const struct spectrum *s, struct overlap *ret)
{
    const struct recipe *recipe = &table->recipe;
    /* By the same steps from a band of the spectrum's on, its place says those of all others. */
    bool alike = s->step_nm == recipe->step_nm;
    size_t first = alike ? spectrum_band(s, recipe->first_nm) : s->n;
    alike = alike && first < s->n;
    ret->n = 0;
    ret->padded = table->stride;
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
