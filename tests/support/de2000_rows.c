/* de2000_rows.c - see de2000_rows.h. */
#include "tests/support/de2000_rows.h"

#include <math.h>
#include <stdlib.h>

#include "base/parallel.h"
#include "colour/delta_e.h"
#include "colour/delta_e_many.h"
#include "tests/support/dice.h"

enum { K = 5, PIECE = 4096, NEAR = 256 };

/* ---- the table and what is asked of it ---------------------------------------------- */

enum status de2000_table(size_t rows, struct table *t)
{
    struct recipe recipe = recipe_default(model_find("two-layer"));
    size_t side = (size_t)lround(cbrt((double)rows));
    recipe.grid = (struct grid){ { 0.001, 0.5, side, true },
                                 { 0, 1, (rows + side * side / 2) / (side * side), false },
                                 { 0.001, 0.1, side, true } };
    enum status s = table_init(&recipe, grid_rows(&recipe.grid), t);
    return s == STATUS_OK ? table_compute(t, 0, t->n, parallel_cores()) : s;
}

void de2000_query(const struct table *t, enum de2000_sort sort, size_t number,
                  struct nearest_query *ret)
{
    struct dice dice = { 1000003u * (number + 1) + (sort == DE2000_OFF) };
    size_t row = dice_below(&dice, t->n);
    double step[3], length;
    do {
        for (int i = 0; i < 3; i++)
            step[i] = dice_between(&dice, -1.0, 1.0);
        length = sqrt(step[0] * step[0] + step[1] * step[1] + step[2] * step[2]);
    } while (length > 1.0 || length < 0.1);
    double by =
        (sort == DE2000_OFF ? dice_between(&dice, 3.0, 10.0) : dice_between(&dice, 0.5, 1.0));
    by /= length;
    *ret = (struct nearest_query){ .has_colour = true,
                                   .Lab = { t->L[row] + by * step[0], t->a[row] + by * step[1],
                                            t->b[row] + by * step[2] } };
}

/* A third of each parameter's range, on its scale; of every third query. */
static void make_range(size_t number, struct nearest_range *ret)
{
    struct dice dice = { 7919u * number };
    double Cm = dice_between(&dice, -3.0, -1.2), Bm = dice_between(&dice, 0.0, 0.7);
    double Ch = dice_between(&dice, -3.0, -1.7);
    *ret = (struct nearest_range){ { pow(10.0, Cm), Bm, pow(10.0, Ch) },
                                   { pow(10.0, Cm + 0.9), Bm + 0.33, pow(10.0, Ch + 0.7) } };
}

/* ---- every row ---------------------------------------------------------------------- */

struct judged {
    double distance;
    size_t row;
};

static int compare_judged(const void *left, const void *right)
{
    const struct judged *x = left, *y = right;
    if (x->distance != y->distance)
        return x->distance < y->distance ? -1 : 1;
    return (x->row > y->row) - (x->row < y->row);
}

static bool inside(const struct table *t, const struct nearest_range *range, size_t row)
{
    const double value[3] = { t->Cm[row], t->Bm[row], t->Ch[row] };
    for (int i = 0; range != NULL && i < 3; i++)
        if (value[i] < range->lo[i] || value[i] > range->hi[i])
            return false;
    return true;
}

static double distance_to(const struct table *t, const double Lab[3], size_t row)
{
    return delta_e_2000(Lab, (double[3]){ t->L[row], t->a[row], t->b[row] });
}

/* What no square of the k nearest is above: any k rows of the range are as far or farther than the
 * nearest k.  Taken from an answer, right or wrong; INFINITY where it is no k such rows. */
static double limit_from(const struct table *t, const struct nearest_query *query, size_t k,
                         const struct nearest_hit *hits, size_t found)
{
    double reach = 0.0;
    for (size_t i = 0; i < k; i++) {
        if (found < k || hits[i].row >= t->n || !inside(t, query->range, hits[i].row))
            return (double)INFINITY;
        for (size_t j = 0; j < i; j++)
            if (hits[j].row == hits[i].row)
                return (double)INFINITY;
        reach = fmax(reach, distance_to(t, query->Lab, hits[i].row));
    }
    reach = reach * (1.0 + 1e-9) + 1e-11; /* more than the vectorised formula errs by */
    return reach * reach;
}

/* The k nearest by every row's distance, sorted; their number.  Squares above the limit are
 * passed by; `near` is cut down to k when it is full. */
static size_t judge_all(const struct table *t, const struct nearest_query *query, size_t k,
                        double limit, struct judged near[NEAR])
{
    double square[PIECE];
    size_t count = 0;
    for (size_t first = 0; first < t->n; first += PIECE) {
        size_t n = t->n - first < PIECE ? t->n - first : PIECE;
        delta_e_2000_squares(query->Lab, n, t->L + first, t->a + first, t->b + first, square);
        for (size_t i = 0; i < n; i++) {
            if (square[i] > limit || !inside(t, query->range, first + i))
                continue;
            near[count++] = (struct judged){ distance_to(t, query->Lab, first + i), first + i };
            if (count == NEAR) {
                qsort(near, count, sizeof *near, compare_judged);
                count = k;
            }
        }
    }
    qsort(near, count, sizeof *near, compare_judged);
    return count < k ? count : k;
}

bool de2000_agrees(const struct nearest *nearest, const struct table *t, size_t number,
                   size_t *limited)
{
    struct judged near[NEAR];
    struct nearest_hit hits[K];
    struct nearest_query query;
    struct nearest_range range;
    size_t found = 0;
    de2000_query(t, (enum de2000_sort)(number % DE2000_SORTS), number, &query);
    make_range(number, &range);
    if (number % 6 >= 4) /* two in six, one of each sort */
        query.range = &range;
    size_t k = number % 4 < 2 ? 1 : K;
    enum status s = nearest_find(nearest, &query, k, hits, &found);
    size_t expect = judge_all(t, &query, k, limit_from(t, &query, k, hits, found), near);
    bool good = s == (expect > 0 ? STATUS_OK : STATUS_NOT_FOUND) && found == expect;
    for (size_t i = 0; good && i < expect; i++)
        good = hits[i].row == near[i].row && hits[i].distance == near[i].distance;
    *limited += query.range != NULL ? 1 : 0;
    return good;
}
