/* kd_make.c - rows into the order of a tree, and the boxes around them.
 *
 * The order is found by halving where points spread most, over and over.  Halves are
 * independent pieces of work, so it does not depend on the number of threads. */
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/huge_pages.h"
#include "base/parallel.h"
#include "match/kd_few.h"
#include "match/kd_layout.h"

static size_t groups_of(size_t entries)
{
    return (entries + KD_WIDTH - 1) / KD_WIDTH;
}

static float lower(float x, float y)
{
    return x < y ? x : y;
}

static float higher(float x, float y)
{
    return x > y ? x : y;
}

/* ---- the order of rows -------------------------------------------------------------- */

/* Points are moved as a whole, their row behind them: what is compared then stands in a line. */
union word {
    float x;
    uint32_t row;
};

enum { MAX_WORDS = KD_TREE_MAX_DIMS + 1 };

/* Halves of halves, as pieces of work: one depth at a time, then each of the last to its end. */
enum { SHARED_DEPTH = 6, MAX_PIECES = 1 << SHARED_DEPTH };

struct piece {
    size_t begin, end;
};

struct builder {
    const struct kd_tree_rows *rows;
    union word *point; /* [n][dims + 1] */
    double norm[PARALLEL_MAX_THREADS];
    struct piece piece[MAX_PIECES], half[2 * MAX_PIECES];
};

static union word *at(const struct builder *b, size_t place)
{
    return b->point + place * (b->rows->dims + 1);
}

static void swap(const struct builder *b, size_t i, size_t j)
{
    union word kept[MAX_WORDS];
    size_t size = (b->rows->dims + 1) * sizeof *kept;
    memcpy(kept, at(b, i), size);
    memcpy(at(b, i), at(b, j), size);
    memcpy(at(b, j), kept, size);
}

static size_t widest_dimension(const struct builder *b, size_t begin, size_t end)
{
    size_t dims = b->rows->dims, widest = 0;
    float low[KD_TREE_MAX_DIMS], high[KD_TREE_MAX_DIMS];
    for (size_t dim = 0; dim < dims; dim++)
        low[dim] = high[dim] = at(b, begin)[dim].x;
    for (size_t i = begin + 1; i < end; i++) {
        const union word *p = at(b, i);
        for (size_t dim = 0; dim < dims; dim++) {
            low[dim] = lower(low[dim], p[dim].x);
            high[dim] = higher(high[dim], p[dim].x);
        }
    }
    for (size_t dim = 1; dim < dims; dim++)
        if (high[dim] - low[dim] > high[widest] - low[widest])
            widest = dim;
    return widest;
}

/* Hoare's selection: nothing before `middle` is above, nothing after it below it. */
static void divide(const struct builder *b, size_t begin, size_t end, size_t middle, size_t dim)
{
    while (end - begin > 1) {
        /* Never the last, so that j ends before it and both parts have something. */
        float pivot = at(b, begin + (end - begin - 1) / 2)[dim].x;
        size_t i = begin, j = end - 1;
        for (;;) {
            while (at(b, i)[dim].x < pivot)
                i++;
            while (at(b, j)[dim].x > pivot)
                j--;
            if (i >= j)
                break;
            swap(b, i++, j--);
        }
        /* begin .. j are at most the pivot, the rest at least it. */
        if (middle <= j)
            end = j + 1;
        else
            begin = j + 1;
    }
}

/* Where to halve: at a multiple of the largest group that both halves can be made of; `end` where
 * what there is is one leaf. */
static size_t middle_of(size_t begin, size_t end)
{
    size_t unit = KD_WIDTH;
    if (end - begin <= KD_WIDTH)
        return end;
    while (unit * KD_WIDTH < end - begin)
        unit *= KD_WIDTH;
    return begin + (end - begin + unit - 1) / unit / 2 * unit;
}

static void arrange(const struct builder *b, size_t begin, size_t end)
{
    size_t middle = middle_of(begin, end);
    if (middle == end)
        return;
    divide(b, begin, end, middle, widest_dimension(b, begin, end));
    arrange(b, begin, middle);
    arrange(b, middle, end);
}

static enum status halve_piece(size_t number, unsigned worker, void *context)
{
    struct builder *b = context;
    struct piece p = b->piece[number];
    size_t middle = middle_of(p.begin, p.end);
    (void)worker;
    if (middle < p.end)
        divide(b, p.begin, p.end, middle, widest_dimension(b, p.begin, p.end));
    b->half[2 * number] = (struct piece){ p.begin, middle };
    b->half[2 * number + 1] = (struct piece){ middle, p.end };
    return STATUS_OK;
}

static enum status arrange_piece(size_t number, unsigned worker, void *context)
{
    struct builder *b = context;
    (void)worker;
    if (b->piece[number].begin < b->piece[number].end)
        arrange(b, b->piece[number].begin, b->piece[number].end);
    return STATUS_OK;
}

static enum status arrange_all(struct builder *b)
{
    enum status s = STATUS_OK;
    size_t pieces = 1;
    b->piece[0] = (struct piece){ 0, b->rows->n };
    for (; pieces < MAX_PIECES && s == STATUS_OK; pieces *= 2) {
        s = parallel_run(pieces, b->rows->threads, halve_piece, b);
        memcpy(b->piece, b->half, 2 * pieces * sizeof *b->piece);
    }
    return s == STATUS_OK ? parallel_run(pieces, b->rows->threads, arrange_piece, b) : s;
}

enum { POINTS_PER_PIECE = 4096 };

/* Points as floats, and the largest norm; STATUS_RANGE where one is out of range. */
static enum status take_piece(size_t number, unsigned worker, void *context)
{
    struct builder *b = context;
    const struct kd_tree_rows *rows = b->rows;
    size_t begin = number * POINTS_PER_PIECE, end = begin + POINTS_PER_PIECE;
    for (size_t i = begin; i < end && i < rows->n; i++) {
        double p[KD_TREE_MAX_DIMS], square = 0.0;
        rows->point(rows->context, i, p);
        for (size_t dim = 0; dim < rows->dims; dim++)
            square += p[dim] * p[dim];
        if (!(sqrt(square) <= KD_LARGEST_NORM)) /* as NaN is not */
            return STATUS_RANGE;
        b->norm[worker] = fmax(b->norm[worker], sqrt(square));
        for (size_t dim = 0; dim < rows->dims; dim++)
            at(b, i)[dim].x = (float)p[dim];
        at(b, i)[rows->dims].row = (uint32_t)i;
    }
    return STATUS_OK;
}

static enum status take_points(struct builder *b)
{
    size_t pieces = (b->rows->n + POINTS_PER_PIECE - 1) / POINTS_PER_PIECE;
    return parallel_run(pieces, b->rows->threads, take_piece, b);
}

/* ---- boxes -------------------------------------------------------------------------- */

struct placing {
    struct kd_tree *tree;
    const struct builder *b;
};

static void place_point(struct kd_tree *tree, size_t place, const float *point)
{
    size_t dims = kd_dims(tree, 0);
    float *to = tree->corner[0] + kd_place(dims, 0, place);
    for (size_t dim = 0; dim < dims; dim++)
        to[dim * KD_WIDTH] = point[dim];
}

/* The points of a group of boxes, in a frame of their own. */
static void frame_points(struct kd_tree *tree, const struct builder *b, size_t group)
{
    size_t begin = group * KD_FRAMED, left = tree->entries[0] - begin,
           count = left < KD_FRAMED ? left : KD_FRAMED;
    struct kd_frame *frame = &tree->frame[group];
    kd_frame_make(tree->dims, count, &at(b, begin)->x, tree->dims + 1, frame);
    for (size_t i = begin; i < begin + count; i++) {
        float point[KD_TREE_MAX_DIMS] = { 0.0f }, framed[KD_FRAME_DIMS];
        memcpy(point, at(b, i), tree->dims * sizeof *point);
        kd_frame_point(tree->vectors, frame, point, framed);
        place_point(tree, i, framed);
    }
}

static enum status place_piece(size_t number, unsigned worker, void *context)
{
    struct placing *placing = context;
    struct kd_tree *tree = placing->tree;
    const struct builder *b = placing->b;
    size_t begin = number * POINTS_PER_PIECE, end = begin + POINTS_PER_PIECE;
    (void)worker;
    for (size_t i = begin; i < end && i < tree->entries[0]; i++) {
        if (!tree->framed)
            place_point(tree, i, &at(b, i)->x);
        else if (i % KD_FRAMED == 0)
            frame_points(tree, b, i / KD_FRAMED);
        tree->row[i] = at(b, i)[tree->dims].row;
    }
    return STATUS_OK;
}

static enum status place_points(struct kd_tree *tree, const struct builder *b)
{
    struct placing placing = { tree, b };
    size_t pieces = (b->rows->n + POINTS_PER_PIECE - 1) / POINTS_PER_PIECE;
    return parallel_run(pieces, b->rows->threads, place_piece, &placing);
}

/* Each entry of `level` becomes the box around its share of the level below, which is told in the
 * same dimensions. */
static void place_boxes(struct kd_tree *tree, unsigned level)
{
    size_t dims = kd_dims(tree, level), high_below = kd_high(dims, level - 1);
    for (size_t i = 0; i < tree->entries[level - 1]; i++) {
        const float *from = tree->corner[level - 1] + kd_place(dims, level - 1, i);
        float *low = tree->corner[level] + kd_place(dims, level, i / KD_WIDTH);
        float *high = low + kd_high(dims, level);
        for (size_t dim = 0; dim < dims * KD_WIDTH; dim += KD_WIDTH) {
            low[dim] = i % KD_WIDTH == 0 ? from[dim] : lower(low[dim], from[dim]);
            float most = from[high_below + dim];
            high[dim] = i % KD_WIDTH == 0 ? most : higher(high[dim], most);
        }
    }
}

/* The boxes around framed points, from the points themselves. */
static void place_boxes_of_frames(struct kd_tree *tree, const struct builder *b)
{
    for (size_t i = 0; i < tree->entries[0]; i++) {
        float *low = tree->corner[2] + kd_place(tree->dims, 2, i / KD_FRAMED);
        float *high = low + kd_high(tree->dims, 2);
        for (size_t dim = 0; dim < tree->dims; dim++) {
            float x = at(b, i)[dim].x, *l = low + dim * KD_WIDTH, *h = high + dim * KD_WIDTH;
            *l = i % KD_FRAMED == 0 ? x : lower(*l, x);
            *h = i % KD_FRAMED == 0 ? x : higher(*h, x);
        }
    }
}

/* ---- fields ------------------------------------------------------------------------- */

float kd_float_below(double x)
{
    float f = (float)x;
    return (double)f > x ? nextafterf(f, -INFINITY) : f;
}

float kd_float_above(double x)
{
    return -kd_float_below(-x);
}

/* One field's least and most of an entry; of a point its own. */
static void field_ends(const struct kd_tree *tree, unsigned level, size_t entry, size_t field,
                       float *low, float *high)
{
    if (level == 0) {
        *low = kd_float_below(tree->field[field][tree->row[entry]]);
        *high = kd_float_above(tree->field[field][tree->row[entry]]);
        return;
    }
    const float *ends = tree->ends[level] + kd_place(KD_TREE_FIELDS, level, entry);
    *low = ends[field * KD_WIDTH];
    *high = ends[field * KD_WIDTH + kd_high(KD_TREE_FIELDS, level)];
}

/* Of each entry of `level`, from its share of the level below.  A value that is not a number is
 * in no range, so it widens none. */
static void place_ends(struct kd_tree *tree, unsigned level)
{
    size_t last = tree->entries[level - 1];
    for (size_t i = 0; i < tree->entries[level]; i++)
        for (size_t field = 0; field < KD_TREE_FIELDS; field++) {
            float *ends = tree->ends[level] + kd_place(KD_TREE_FIELDS, level, i) + field * KD_WIDTH;
            float least = (float)INFINITY, most = -(float)INFINITY;
            size_t end = (i + 1) * KD_WIDTH;
            for (size_t below = i * KD_WIDTH; below < (end < last ? end : last); below++) {
                float low, high;
                field_ends(tree, level - 1, below, field, &low, &high);
                least = low < least ? low : least;
                most = high > most ? high : most;
            }
            ends[0] = least;
            ends[kd_high(KD_TREE_FIELDS, level)] = most;
        }
}

/* ---- all of it ---------------------------------------------------------------------- */

/* That corners of a level take, or the ends of its fields. */
static size_t floats_of(const struct kd_tree *tree, bool corners, unsigned level)
{
    size_t dims = corners ? kd_dims(tree, level) : KD_TREE_FIELDS;
    return kd_place(dims, level, groups_of(tree->entries[level]) * KD_WIDTH);
}

/* Arrays of all levels from `first` up, one behind the other; returns what they take. */
static size_t lay_out(const struct kd_tree *tree, bool corners, unsigned first, float *place,
                      float **array)
{
    size_t floats = 0;
    for (unsigned level = first; level < tree->levels; level++) {
        if (place != NULL)
            array[level] = place + floats;
        floats += floats_of(tree, corners, level);
    }
    return floats;
}

/* All arrays in one block, so that all lie on large pages where they are large together. */
static bool lay_out_all(struct kd_tree *tree, size_t frames)
{
    size_t of_frames = frames * (sizeof *tree->frame / sizeof(float));
    size_t of_corners = lay_out(tree, true, 0, NULL, tree->corner);
    size_t of_ends = tree->field[0] != NULL ? lay_out(tree, false, 1, NULL, tree->ends) : 0;
    size_t of_rows = groups_of(tree->entries[0]) * KD_WIDTH;
    size_t floats = of_frames + of_corners + of_rows + of_ends;
    float *place = huge_pages_alloc(floats, sizeof *place);
    if (place == NULL)
        return false;
    memset(place, 0, floats * sizeof *place); /* for what is past the end */
    tree->block = place;
    tree->large = floats * sizeof *place > KD_NEAR_BYTES;
    if (frames > 0)
        tree->frame = tree->block;
    lay_out(tree, true, 0, place + of_frames, tree->corner);
    void *rows = place + of_frames + of_corners;
    tree->row = rows;
    if (of_ends > 0)
        lay_out(tree, false, 1, place + of_frames + of_corners + of_rows, tree->ends);
    return true;
}

/* Levels up to one group. */
static enum status lay_out_levels(struct kd_tree *tree, const struct kd_tree_rows *rows)
{
    size_t entries = rows->n;
    do {
        tree->entries[tree->levels++] = entries;
        entries = groups_of(entries);
    } while (entries > 1);
    memcpy(tree->field, rows->field, sizeof tree->field);
    tree->framed = tree->dims > KD_TREE_BOUND_DIMS && tree->levels > 1;
    return lay_out_all(tree, tree->framed ? groups_of(tree->entries[1]) : 0) ? STATUS_OK
                                                                             : STATUS_NO_MEMORY;
}

static enum status fill(struct kd_tree *tree, struct builder *b)
{
    b->point = huge_pages_alloc(b->rows->n, (b->rows->dims + 1) * sizeof *b->point);
    if (b->point == NULL)
        return STATUS_NO_MEMORY;
    enum status s = take_points(b);
    if (s == STATUS_OK)
        s = arrange_all(b);
    if (s != STATUS_OK)
        return s;
    for (size_t i = 0; i < PARALLEL_MAX_THREADS; i++)
        tree->norm = fmax(tree->norm, b->norm[i]);
    s = place_points(tree, b);
    if (s != STATUS_OK)
        return s;
    for (unsigned level = 1; level < tree->levels; level++) {
        if (level == 2 && tree->framed)
            place_boxes_of_frames(tree, b);
        else
            place_boxes(tree, level);
        if (tree->ends[1] != NULL)
            place_ends(tree, level);
    }
    return STATUS_OK;
}

enum status kd_tree_open(const struct kd_tree_rows *rows, struct kd_tree **ret)
{
    if (rows->n > UINT32_MAX)
        return STATUS_RANGE;
    struct kd_tree *tree = calloc(1, sizeof *tree);
    struct builder *b = calloc(1, sizeof *b);
    const size_t few[] = { KD_FEW_COLOURS, KD_FEW_SPECTRA };
    enum status s = tree != NULL && b != NULL ? STATUS_OK : STATUS_NO_MEMORY;
    if (s == STATUS_OK) {
        tree->dims = rows->dims;
        tree->rounding = rows->rounding;
        tree->vectors = vectors_best();
        tree->judge = kd_judge_of(tree->vectors);
        tree->few = rows->n <= few[rows->dims > 3];
        b->rows = rows;
        s = lay_out_levels(tree, rows);
    }
    if (s == STATUS_OK)
        s = fill(tree, b);
    if (b != NULL)
        free(b->point);
    free(b);
    if (s == STATUS_OK)
        *ret = tree;
    else
        kd_tree_close(tree);
    return s;
}

void kd_tree_close(struct kd_tree *tree)
{
    if (tree == NULL)
        return;
    free(tree->block);
    free(tree);
}
