/* nearest.c - one way of looking at a row per kind of distance, and which rows to look at.
 *
 * Every row that could be among the k best is offered to a short sorted list.  Which
 * those are is said, without missing one, by a tree over colours (match/kd_tree.h), for
 * CIEDE2000 with bounds of its own (colour/delta_e_box.h); for spectra by a tree over their
 * principal components (match/components.h).  Where a tree does not apply, all rows are looked
 * at. */
#include "match/nearest.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/parallel.h"
#include "base/vectors.h"
#include "colour/delta_e.h"
#include "colour/delta_e_box.h"
#include "colour/srgb.h"
#include "match/best.h"
#include "match/components.h"
#include "match/kd_tree.h"
#include "match/overlap.h"

/* An index of fewer rows is made sooner than threads are. */
enum { ROWS_FOR_ONE = 20000 };

struct nearest {
    const struct table *table;
    enum match_by by;
    const double *colour[3]; /* Lab or code of row i: colour[0..2][step * i] */
    size_t step;
    double *code;                  /* [n][3] coded sRGB, 0..255, for the rgb kinds */
    double extent;                 /* largest |L*|, |a*| or |b*|, for de2000 */
    struct components *components; /* for spectra */
    overlap_sum *sum;              /* the same */
    struct kd_tree *tree;          /* NULL where values are beyond it */
};

const char *match_by_name(enum match_by by)
{
    static const char *const name[] = { "rgb", "rgb-float", "lab", "de2000", "spectrum" };
    return name[by];
}

/* Coded sRGB on the 0..255 scale: integers for the paper's way, else unrounded. */
static void code_of(enum match_by by, const double rgb[3], double code[3])
{
    int rounded[3];
    srgb_code(rgb, rounded);
    for (int i = 0; i < 3; i++)
        code[i] = by == MATCH_RGB ? (double)rounded[i] : 255.0 * srgb_encode(rgb[i]);
}

static enum status prepare_codes(struct nearest *nearest)
{
    const struct table *t = nearest->table;
    nearest->code = calloc(t->n, 3 * sizeof *nearest->code);
    if (nearest->code == NULL)
        return STATUS_NO_MEMORY;
    for (size_t i = 0; i < t->n; i++)
        code_of(nearest->by, (double[3]){ t->red[i], t->green[i], t->blue[i] },
                nearest->code + 3 * i);
    for (int c = 0; c < 3; c++)
        nearest->colour[c] = nearest->code + c;
    nearest->step = 3;
    return STATUS_OK;
}

static void colour_point(void *context, size_t row, double *point)
{
    const struct nearest *nearest = context;
    for (int i = 0; i < 3; i++)
        point[i] = nearest->colour[i][nearest->step * row];
}

static void spectrum_point(void *context, size_t row, double *point)
{
    const struct nearest *nearest = context;
    components_row_point(nearest->components, table_spectrum(nearest->table, row), point);
}

/* Values that no tree takes are not an error: then all rows are looked at. */
static enum status prepare_tree(struct nearest *nearest)
{
    bool spectra = nearest->by == MATCH_SPECTRUM;
    const struct table *t = nearest->table;
    const struct kd_tree_rows rows = {
        .n = t->n,
        .threads = t->n < ROWS_FOR_ONE ? 1 : parallel_cores(),
        .dims = spectra ? COMPONENTS_DIMS : 3,
        .point = spectra ? spectrum_point : colour_point,
        .rounding = spectra ? COMPONENTS_ROUNDING : 1e-9,
        .context = nearest,
        .field = { t->Cm, t->Bm, t->Ch },
    };
    enum status s = kd_tree_open(&rows, &nearest->tree);
    return s == STATUS_RANGE ? STATUS_OK : s;
}

/* false where a row is beyond what bounds of CIEDE2000 are for. */
static bool prepare_bound(struct nearest *nearest)
{
    const struct table *t = nearest->table;
    for (size_t i = 0; i < t->n; i++) {
        const double Lab[3] = { t->L[i], t->a[i], t->b[i] };
        if (!delta_e_box_takes(Lab))
            return false;
        nearest->extent =
            fmax(nearest->extent, fmax(fabs(Lab[0]), fmax(fabs(Lab[1]), fabs(Lab[2]))));
    }
    return true;
}

static enum status prepare(struct nearest *nearest)
{
    enum status s = STATUS_OK;
    switch (nearest->by) {
    case MATCH_DE2000:
        if (!prepare_bound(nearest))
            return STATUS_OK;
        break;
    case MATCH_RGB:
    case MATCH_RGB_FLOAT:
        s = prepare_codes(nearest);
        break;
    case MATCH_SPECTRUM:
        s = components_open(nearest->table, &nearest->components);
        break;
    case MATCH_LAB:
        break;
    }
    return s == STATUS_OK ? prepare_tree(nearest) : s;
}

enum status nearest_open(const struct table *table, enum match_by by, struct nearest **ret)
{
    if (by == MATCH_SPECTRUM && table->spectrum == NULL)
        return STATUS_UNSUPPORTED;
    struct nearest *nearest = calloc(1, sizeof *nearest);
    if (nearest == NULL)
        return STATUS_NO_MEMORY;
    *nearest = (struct nearest){ .table = table,
                                 .by = by,
                                 .colour = { table->L, table->a, table->b },
                                 .step = 1,
                                 .sum = overlap_sum_by(vectors_best()) };
    enum status s = prepare(nearest);
    if (s != STATUS_OK) {
        nearest_close(nearest);
        return s;
    }
    *ret = nearest;
    return STATUS_OK;
}

void nearest_close(struct nearest *nearest)
{
    if (nearest == NULL)
        return;
    free(nearest->code);
    components_close(nearest->components);
    kd_tree_close(nearest->tree);
    free(nearest);
}

/* ---- looking at one row ----------------------------------------------------------------- */

/* One question on its way to an answer. */
struct search {
    const struct nearest *nearest;
    struct best best;
    double colour[3];                  /* the query's, Lab or code */
    double root_bands;                 /* a rms times this is a distance between all bands */
    struct delta_e_box box;            /* for de2000 only */
    const struct nearest_range *range; /* NULL: all rows */
    struct nearest_work work;
    double point[COMPONENTS_DIMS]; /* and what follows: what the tree is asked */
    struct kd_tree_range limits;
    struct kd_tree_task task;
    struct overlap overlap; /* for spectra only; last, for it is large */
};

static double look_at_colour(void *context, size_t row)
{
    struct search *search = context;
    const struct nearest *nearest = search->nearest;
    search->work.rows++;
    double square = 0.0;
    for (int i = 0; i < 3; i++) {
        double difference = nearest->colour[i][nearest->step * row] - search->colour[i];
        square += difference * difference;
    }
    if (square <= best_limit_square(&search->best))
        best_offer(&search->best, row, sqrt(square));
    return best_limit(&search->best);
}

/* until: a sum above it is given up. */
static double look_at_spectrum_until(struct search *search, size_t row, double limit, double until)
{
    const struct nearest *nearest = search->nearest;
    search->work.rows++;
    double sum = nearest->sum(&search->overlap, table_spectrum(nearest->table, row), until);
    if (sum <= limit)
        best_offer(&search->best, row, sqrt(sum / (double)search->overlap.n));
    return search->root_bands * best_limit(&search->best);
}

static double look_at_spectrum(void *context, size_t row)
{
    struct search *search = context;
    double limit = (double)search->overlap.n * best_limit_square(&search->best);
    return look_at_spectrum_until(search, row, limit, limit);
}

/* Rows that a tree shows are near: when to give up is a guess that costs more than it saves. */
static double look_at_near_spectrum(void *context, size_t row)
{
    struct search *search = context;
    double limit = (double)search->overlap.n * best_limit_square(&search->best);
    return look_at_spectrum_until(search, row, limit, (double)INFINITY);
}

/* kd_tree_fetch, as is the next. */
static void fetch_spectrum(void *context, size_t row)
{
    const struct search *search = context;
    const float *spectrum = table_spectrum(search->nearest->table, row);
    for (size_t i = 0; i < search->overlap.padded; i += 16) /* floats to a line */
        __builtin_prefetch(spectrum + i);
}

static void fetch_colour(void *context, size_t row)
{
    const struct search *search = context;
    const struct nearest *nearest = search->nearest;
    for (int i = 0; i < 3; i++)
        __builtin_prefetch(&nearest->colour[i][nearest->step * row]);
}

static double look_at_de2000(void *context, size_t row)
{
    struct search *search = context;
    const struct table *t = search->nearest->table;
    const double Lab[3] = { t->L[row], t->a[row], t->b[row] };
    search->work.rows++;
    best_offer(&search->best, row, delta_e_2000(search->colour, Lab));
    return best_limit_square(&search->best);
}

/* kd_tree_bound: squares, as look_at_de2000() says. */
static void bound_de2000(void *context, const float *low, const float *high,
                         float bound[KD_TREE_WIDTH])
{
    const struct search *search = context;
    delta_e_box_bound(&search->box, low, high, bound);
}

static kd_tree_look *look_of(enum match_by by)
{
    if (by == MATCH_SPECTRUM)
        return look_at_spectrum;
    return by == MATCH_DE2000 ? look_at_de2000 : look_at_colour;
}

/* ---- which rows to look at -------------------------------------------------------------- */

static bool in_range(const struct search *search, size_t row)
{
    const struct nearest_range *range = search->range;
    const struct table *t = search->nearest->table;
    return range == NULL || (t->Cm[row] >= range->lo[0] && t->Cm[row] <= range->hi[0] &&
                             t->Bm[row] >= range->lo[1] && t->Bm[row] <= range->hi[1] &&
                             t->Ch[row] >= range->lo[2] && t->Ch[row] <= range->hi[2]);
}

/* Told apart outside the loops, which are then as fast as loops over arrays are. */
static void look_at_all(struct search *search)
{
    size_t n = search->nearest->table->n;
    kd_tree_look *look = look_of(search->nearest->by);
    if (search->range != NULL) {
        for (size_t row = 0; row < n; row++)
            if (in_range(search, row))
                look(search, row);
        search->work.judged += n;
    } else if (look == look_at_spectrum)
        for (size_t row = 0; row < n; row++)
            look_at_spectrum(search, row);
    else if (look == look_at_colour)
        for (size_t row = 0; row < n; row++)
            look_at_colour(search, row);
    else
        for (size_t row = 0; row < n; row++)
            look_at_de2000(search, row);
}

/* The task for the tree; false where that does not apply: it knows distances over all of the
 * table's bands only. */
static bool make_task(struct search *search)
{
    const struct nearest *nearest = search->nearest;
    struct kd_tree_task *task = &search->task;
    *task = (struct kd_tree_task){ .query = search->colour,
                                   .look = look_of(nearest->by),
                                   .fetch = fetch_colour,
                                   .context = search };
    if (nearest->tree == NULL)
        return false;
    if (nearest->by == MATCH_SPECTRUM) {
        if (search->overlap.n < nearest->table->recipe.bands)
            return false;
        components_point(nearest->components, search->overlap.value, search->point);
        task->query = search->point;
        task->look = look_at_near_spectrum;
        task->fetch = fetch_spectrum;
    }
    if (nearest->by == MATCH_DE2000) {
        if (!delta_e_box_init(search->colour, nearest->extent, &search->box))
            return false;
        task->bound = bound_de2000;
    }
    if (search->range != NULL) {
        memcpy(search->limits.lo, search->range->lo, sizeof search->limits.lo);
        memcpy(search->limits.hi, search->range->hi, sizeof search->limits.hi);
        task->range = &search->limits;
    }
    return true;
}

/* ---- questions -------------------------------------------------------------------------- */

static bool range_is_one(const struct nearest_range *range)
{
    bool one = true;
    for (int i = 0; i < 3; i++)
        one = one && range->lo[i] <= range->hi[i]; /* as NaN is not */
    return one;
}

static enum status search_init(const struct nearest *nearest, const struct nearest_query *query,
                               size_t k, struct nearest_hit *hits, struct search *ret)
{
    if (k == 0 || (query->range != NULL && !range_is_one(query->range)))
        return STATUS_RANGE;
    ret->nearest = nearest;
    ret->best = (struct best){ hits, k < nearest->table->n ? k : nearest->table->n, 0 };
    ret->range = query->range;
    ret->work = (struct nearest_work){ 0 };
    ret->task.judged = 0;
    if (nearest->by == MATCH_SPECTRUM) {
        overlap_init(nearest->table, query->spectrum, &ret->overlap);
        ret->root_bands = sqrt((double)ret->overlap.n);
        return ret->overlap.n < NEAREST_MIN_BANDS ? STATUS_UNSUPPORTED : STATUS_OK;
    }
    if (!query->has_colour)
        return STATUS_UNSUPPORTED;
    if (nearest->code != NULL)
        code_of(nearest->by, query->rgb, ret->colour);
    else
        memcpy(ret->colour, query->Lab, sizeof ret->colour);
    return STATUS_OK;
}

static enum status answer(const struct search *search, const struct nearest_query *query,
                          size_t *found)
{
    size_t judged = search->work.judged + search->task.judged;
    if (query->work != NULL) {
        query->work->rows += search->work.rows;
        query->work->judged += judged;
    }
    if (search->best.n == 0)
        return STATUS_NOT_FOUND;
    *found = search->best.n;
    return STATUS_OK;
}

enum status nearest_find(const struct nearest *nearest, const struct nearest_query *query, size_t k,
                         struct nearest_hit *hits, size_t *found)
{
    struct search search;
    enum status s = search_init(nearest, query, k, hits, &search);
    if (s != STATUS_OK)
        return s;
    if (!make_task(&search) || !kd_tree_search(nearest->tree, &search.task))
        look_at_all(&search);
    return answer(&search, query, found);
}

/* ---- many of them ------------------------------------------------------------------- */

/* Questions in the order that they have, and the search of each slot that the tree has. */
struct asking {
    const struct nearest *nearest;
    const struct nearest_query *query;
    size_t n, k, next; /* next: the first question that no slot has had */
    struct nearest_hit *hits;
    size_t *found;
    enum status *status;
    size_t asked[KD_TREE_TOGETHER]; /* n: none */
    struct search search[KD_TREE_TOGETHER];
};

static void end_question(struct asking *asking, size_t slot)
{
    size_t number = asking->asked[slot];
    struct search *search = &asking->search[slot];
    if (search->task.refused)
        look_at_all(search);
    asking->status[number] = answer(search, &asking->query[number], &asking->found[number]);
}

/* What is read of a question, on its way before it is its turn.  Inlined for good, as in
 * kd_tree.c. */
VECTORS_INLINE void fetch_question(const struct asking *asking, size_t number)
{
    if (number == asking->n || asking->nearest->by != MATCH_SPECTRUM)
        return;
    const struct spectrum *spectrum = asking->query[number].spectrum;
    __builtin_prefetch(spectrum);
    for (size_t band = 0; band < asking->nearest->table->stride; band += 8) /* doubles to a line */
        __builtin_prefetch(spectrum->value + band);
}

/* kd_tree_next */
static struct kd_tree_task *next_question(void *context, size_t slot)
{
    struct asking *asking = context;
    struct search *search = &asking->search[slot];
    if (asking->asked[slot] < asking->n)
        end_question(asking, slot);
    while (asking->next < asking->n) {
        size_t number = asking->next++;
        asking->asked[slot] = number;
        asking->found[number] = 0;
        fetch_question(asking, asking->next);
        asking->status[number] = search_init(asking->nearest, &asking->query[number], asking->k,
                                             asking->hits + number * asking->k, search);
        if (asking->status[number] != STATUS_OK)
            continue;
        if (make_task(search))
            return &search->task;
        search->task.refused = true;
        end_question(asking, slot);
    }
    asking->asked[slot] = asking->n;
    return NULL;
}

void nearest_find_many(const struct nearest *nearest, size_t n, const struct nearest_query *query,
                       size_t k, struct nearest_hit *hits, size_t *found, enum status *status)
{
    struct asking asking;
    asking.nearest = nearest;
    asking.query = query;
    asking.n = n;
    asking.k = k;
    asking.next = 0;
    asking.hits = hits;
    asking.found = found;
    asking.status = status;
    for (size_t slot = 0; slot < KD_TREE_TOGETHER; slot++)
        asking.asked[slot] = n;
    if (nearest->tree != NULL)
        kd_tree_search_many(nearest->tree, next_question, &asking);
    else
        (void)next_question(&asking, 0); /* looks at all rows for each */
}

enum status nearest_scan(const struct nearest *nearest, const struct nearest_query *query, size_t k,
                         struct nearest_hit *hits, size_t *found)
{
    struct search search;
    enum status s = search_init(nearest, query, k, hits, &search);
    if (s != STATUS_OK)
        return s;
    look_at_all(&search);
    return answer(&search, query, found);
}

size_t nearest_common_bands(const struct table *table, const struct spectrum *spectrum)
{
    struct overlap overlap;
    overlap_init(table, spectrum, &overlap);
    return overlap.n;
}

double nearest_rms(const struct table *table, size_t row, const struct spectrum *spectrum)
{
    struct overlap overlap;
    overlap_init(table, spectrum, &overlap);
    if (overlap.n == 0)
        return NAN;
    double sum = overlap_sum_of_squares(&overlap, table_spectrum(table, row), (double)INFINITY);
    return sqrt(sum / (double)overlap.n);
}
