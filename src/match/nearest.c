/* nearest.c - one scan per kind of distance over a table's arrays.
 *
 * A scan offers every row that could be among the k best to a short sorted list.
 * Two shortcuts are taken, both exact: a spectrum's sum of squares only grows, so
 * a row is dropped as soon as it exceeds the k-th best; and CIEDE2000 is at least
 * its lightness term, which grows with distance in L*, so rows are visited
 * outwards from the query's L* until that term alone is too large. */
#include "match/nearest.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "colour/delta_e.h"
#include "colour/srgb.h"

struct nearest {
    const struct table *table;
    enum match_by by;
    double *code; /* [n][3] coded sRGB, 0..255, for the rgb kinds */
    size_t *by_L; /* [n] rows in the order of L*, for de2000 */
};

const char *match_by_name(enum match_by by)
{
    static const char *const name[] = { "rgb", "rgb-float", "lab", "de2000", "spectrum" };
    return name[by];
}

/* The list of the k best so far, in the caller's hits[].  Sorted by distance,
 * then by row. */
struct best {
    struct nearest_hit *hits;
    size_t k, n;
};

/* Nothing above this can enter the list. */
static double best_limit(const struct best *best)
{
    return best->n < best->k ? INFINITY : best->hits[best->n - 1].distance;
}

/* The same for the squares that scans work with, wider by more than root and product
 * round.  The list itself holds roots: squares that differ in their last bits may
 * have the same one, and then the lower row comes first. */
static double best_limit_square(const struct best *best)
{
    double distance = best_limit(best);
    return distance * distance * (1.0 + 1e-15);
}

static bool comes_before(double distance, size_t row, const struct nearest_hit *hit)
{
    return distance < hit->distance || (distance == hit->distance && row < hit->row);
}

static void best_offer(struct best *best, size_t row, double distance)
{
    if (best->n == best->k && !comes_before(distance, row, &best->hits[best->n - 1]))
        return;
    size_t place = best->n < best->k ? best->n++ : best->n - 1;
    for (; place > 0 && comes_before(distance, row, &best->hits[place - 1]); place--)
        best->hits[place] = best->hits[place - 1];
    best->hits[place] = (struct nearest_hit){ row, distance };
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
    for (size_t i = 0; i < t->n; i++) {
        double code[3];
        code_of(nearest->by, (double[3]){ t->red[i], t->green[i], t->blue[i] }, code);
        for (int c = 0; c < 3; c++)
            nearest->code[3 * i + (size_t)c] = code[c];
    }
    return STATUS_OK;
}

struct keyed_row {
    double key;
    size_t row;
};

static int compare_keyed(const void *left, const void *right)
{
    const struct keyed_row *x = left, *y = right;
    if (x->key != y->key)
        return x->key < y->key ? -1 : 1;
    return (x->row > y->row) - (x->row < y->row);
}

static enum status prepare_lightness(struct nearest *nearest)
{
    const struct table *t = nearest->table;
    struct keyed_row *keyed = calloc(t->n, sizeof *keyed);
    nearest->by_L = calloc(t->n, sizeof *nearest->by_L);
    if (keyed == NULL || nearest->by_L == NULL) {
        free(keyed);
        return STATUS_NO_MEMORY;
    }
    for (size_t i = 0; i < t->n; i++)
        keyed[i] = (struct keyed_row){ t->L[i], i };
    qsort(keyed, t->n, sizeof *keyed, compare_keyed);
    for (size_t i = 0; i < t->n; i++)
        nearest->by_L[i] = keyed[i].row;
    free(keyed);
    return STATUS_OK;
}

enum status nearest_open(const struct table *table, enum match_by by, struct nearest **ret)
{
    enum status s = STATUS_OK;
    if (by == MATCH_SPECTRUM && table->spectrum == NULL)
        return STATUS_UNSUPPORTED;
    struct nearest *nearest = calloc(1, sizeof *nearest);
    if (nearest == NULL)
        return STATUS_NO_MEMORY;
    nearest->table = table;
    nearest->by = by;
    if (by == MATCH_RGB || by == MATCH_RGB_FLOAT)
        s = prepare_codes(nearest);
    else if (by == MATCH_DE2000)
        s = prepare_lightness(nearest);
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
    free(nearest->by_L);
    free(nearest);
}

static void scan_rgb(const struct nearest *nearest, const struct nearest_query *query,
                     struct best *best)
{
    double code[3];
    code_of(nearest->by, query->rgb, code);
    for (size_t i = 0; i < nearest->table->n; i++) {
        const double *row = nearest->code + 3 * i;
        double dr = row[0] - code[0], dg = row[1] - code[1], db = row[2] - code[2];
        double square = dr * dr + dg * dg + db * db;
        if (square <= best_limit_square(best))
            best_offer(best, i, sqrt(square));
    }
}

static void scan_lab(const struct nearest *nearest, const struct nearest_query *query,
                     struct best *best)
{
    const struct table *t = nearest->table;
    for (size_t i = 0; i < t->n; i++) {
        double dL = t->L[i] - query->Lab[0], da = t->a[i] - query->Lab[1],
               db = t->b[i] - query->Lab[2];
        double square = dL * dL + da * da + db * db;
        if (square <= best_limit_square(best))
            best_offer(best, i, sqrt(square));
    }
}

/* First place in the order of L* whose row is not darker than L. */
static size_t lower_bound(const struct nearest *nearest, double L)
{
    size_t low = 0, high = nearest->table->n;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (nearest->table->L[nearest->by_L[middle]] < L)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

static void offer_de2000(const struct table *t, size_t row, const double Lab[3], struct best *best)
{
    best_offer(best, row, delta_e_2000(Lab, (double[3]){ t->L[row], t->a[row], t->b[row] }));
}

/* Whether the lightness term grows from the query to every row: the range that
 * delta_e_2000_lightness() promises it for. */
static bool can_bound(const struct nearest *nearest, double L)
{
    const struct table *t = nearest->table;
    double darkest = t->L[nearest->by_L[0]], lightest = t->L[nearest->by_L[t->n - 1]];
    return fmin(L, darkest) >= DELTA_E_LIGHTNESS_MIN && fmax(L, lightest) <= DELTA_E_LIGHTNESS_MAX;
}

static void scan_de2000(const struct nearest *nearest, const struct nearest_query *query,
                        struct best *best)
{
    const struct table *t = nearest->table;
    /* The bound and the distance round differently: leave the bound some slack. */
    const double slack = 1.0 - 1e-12, L = query->Lab[0];
    bool bounded = can_bound(nearest, L), up = true, down = true;
    size_t above = lower_bound(nearest, L), below = above;
    while (up || down) {
        up = up && above < t->n;
        if (up) {
            size_t row = nearest->by_L[above++];
            up = !bounded || slack * delta_e_2000_lightness(L, t->L[row]) <= best_limit(best);
            if (up)
                offer_de2000(t, row, query->Lab, best);
        }
        down = down && below > 0;
        if (down) {
            size_t row = nearest->by_L[--below];
            down = !bounded || slack * delta_e_2000_lightness(L, t->L[row]) <= best_limit(best);
            if (down)
                offer_de2000(t, row, query->Lab, best);
        }
    }
}

/* The query laid on the table's bands: weight 1 where both have the band, else 0.
 * Padded like the table's rows, so that blocks need no remainder. */
struct overlap {
    size_t n, padded;
    double value[SPECTRUM_MAX_BANDS], weight[SPECTRUM_MAX_BANDS];
};

static void overlap_init(const struct table *table, const struct spectrum *s, struct overlap *ret)
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

/* Sum of squares, given up as soon as it exceeds limit (then only > limit). */
static double sum_of_squares(const float *row, const struct overlap *o, double limit)
{
    double sum = 0.0;
    for (size_t i = 0; i + TABLE_BLOCK <= o->padded && sum <= limit; i += TABLE_BLOCK) {
        double part[TABLE_BLOCK];
        for (size_t j = 0; j < TABLE_BLOCK; j++) {
            double difference = (double)row[i + j] - o->value[i + j];
            part[j] = o->weight[i + j] * difference * difference;
        }
        sum += ((part[0] + part[1]) + (part[2] + part[3])) +
               ((part[4] + part[5]) + (part[6] + part[7]));
    }
    return sum;
}

static void scan_spectrum(const struct nearest *nearest, const struct overlap *overlap,
                          struct best *best)
{
    const struct table *t = nearest->table;
    const double bands = (double)overlap->n;
    for (size_t i = 0; i < t->n; i++) {
        double limit = bands * best_limit_square(best);
        double sum = sum_of_squares(table_spectrum(t, i), overlap, limit);
        if (sum <= limit)
            best_offer(best, i, sqrt(sum / bands));
    }
}

enum status nearest_find(const struct nearest *nearest, const struct nearest_query *query, size_t k,
                         struct nearest_hit *hits, size_t *found)
{
    struct best best = { hits, k < nearest->table->n ? k : nearest->table->n, 0 };
    struct overlap overlap;
    if (k == 0)
        return STATUS_RANGE;
    if (nearest->by != MATCH_SPECTRUM && !query->has_colour)
        return STATUS_UNSUPPORTED;
    switch (nearest->by) {
    case MATCH_RGB:
    case MATCH_RGB_FLOAT:
        scan_rgb(nearest, query, &best);
        break;
    case MATCH_LAB:
        scan_lab(nearest, query, &best);
        break;
    case MATCH_DE2000:
        scan_de2000(nearest, query, &best);
        break;
    case MATCH_SPECTRUM:
        overlap_init(nearest->table, query->spectrum, &overlap);
        if (overlap.n < NEAREST_MIN_BANDS)
            return STATUS_UNSUPPORTED;
        scan_spectrum(nearest, &overlap, &best);
        break;
    }
    *found = best.n;
    return STATUS_OK;
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
    return sqrt(sum_of_squares(table_spectrum(table, row), &overlap, INFINITY) / (double)overlap.n);
}
