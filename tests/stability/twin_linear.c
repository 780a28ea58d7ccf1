/* twin_linear.c - linear equations in wide numbers. */
#include "tests/stability/twins.h"

void twin_eliminate(wide *m, size_t n, size_t columns)
{
    for (size_t i = 0; i < n; i++) {
        wide *own = m + i * columns, inverse = w_div(w_int(1), own[i]);
        for (size_t j = i; j < columns; j++)
            own[j] = w_mul(own[j], inverse);
        for (size_t k = 0; k < n; k++) {
            wide *row = m + k * columns, factor = w_neg(w_copy(row[i]));
            if (k == i || w_is_zero(factor))
                continue;
            for (size_t j = i; j < columns; j++) {
                size_t mark = wide_mark();
                w_add_to(row[j], w_mul(factor, own[j]));
                wide_release(mark);
            }
        }
    }
}
