/* kd_tree.c - a k-d partition packed into boxes of 16 boxes of ... 16 points.
 *
 * Rows are put in an order in which every 16 neighbours are close together, every 16
 * such leaves, and so on; so a tree is just arrays, and where a box's content stands
 * follows from its number.  The 16 entries of a group are stored dimension by
 * dimension, which lets a compiler judge them all at once.
 *
 * Rounding.  Points and queries are kept as floats: each moves by at most 2^-24 of its
 * norm, and the contract adds 1e-9 of it, so distances between floats exceed true
 * ones by less than slack = 2^-23 (|query| + largest |point|).  Sums of at most 16
 * squares of floats err by less than 18 x 2^-24 < 2e-6 of themselves, and by
 * nothing worth FLT_MIN where squares underflow.  threshold() allows for all of it.
 * A box's bound needs nothing of its own: it is made by the same operations as the
 * distance of a point in it, from smaller differences, and rounding is monotonic.
 *
 * Fields.  A box keeps what its rows' fields lie between, as floats rounded outwards; a row's
 * own are looked up in their columns, which are not rounded. */
#include "match/kd_tree.h"

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { WIDTH = KD_TREE_WIDTH, MAX_LEVELS = 8 }; /* 16^8 = 2^32 rows */

/* Squares of this still fit a float. */
static const double largest_norm = 1e15;

/* Squared distances from the query to the entries of a group, whose corners are [dims][WIDTH]: to
 * a point itself, to a box's nearest side, 0 inside. */
typedef void judge_group(size_t dims, const float *low, const float *high, const float *query,
                         float square[WIDTH]);

/* Level 0 are the points, level l + 1 the boxes around groups of level l; the top
 * level has one group.  low and high: [group][dims][WIDTH], zero past the end. */
struct kd_tree {
    size_t dims;
    unsigned levels;
    size_t entries[MAX_LEVELS]; /* points or boxes of a level */
    float *low[MAX_LEVELS], *high[MAX_LEVELS];
    /* [group][KD_TREE_FIELDS][WIDTH] of boxes; NULL at level 0 and without fields. */
    float *field_low[MAX_LEVELS], *field_high[MAX_LEVELS];
    const double *field[KD_TREE_FIELDS];
    uint32_t *row; /* [entries[0]] */
    double norm;   /* of the farthest point */
    judge_group *judge;
};

static size_t groups_of(size_t entries)
{
    return (entries + WIDTH - 1) / WIDTH;
}

/* As fminf() and fmaxf(), which calls and their care for NaN make slow. */
static float lower(float x, float y)
{
    return x < y ? x : y;
}

static float higher(float x, float y)
{
    return x > y ? x : y;
}

/* ---- judging sixteen at once ------------------------------------------------------------- */

static inline __attribute__((always_inline)) void
judge_any(size_t dims, const float *low, const float *high, const float *query, float square[WIDTH])
{
    float sum[WIDTH] = { 0.0f };
    for (size_t dim = 0; dim < dims; dim++) {
        float outside[WIDTH]; /* two loops: in one, a compiler jumps over what is not outside */
        for (size_t i = 0; i < WIDTH; i++)
            outside[i] = higher(higher(low[i] - query[dim], query[dim] - high[i]), 0.0f);
        for (size_t i = 0; i < WIDTH; i++)
            sum[i] += outside[i] * outside[i];
        low += WIDTH;
        high += WIDTH;
    }
    memcpy(square, sum, sizeof sum);
}

static void judge_plain(size_t dims, const float *low, const float *high, const float *query,
                        float square[WIDTH])
{
    judge_any(dims, low, high, query, square);
}

/* The same operations, eight to an instruction where the processor has them, four everywhere else:
 * the same bits. */
#if defined __x86_64__
__attribute__((target("avx2"))) static void judge_wide(size_t dims, const float *low,
                                                       const float *high, const float *query,
                                                       float square[WIDTH])
{
    judge_any(dims, low, high, query, square);
}

static judge_group *best_judge(void)
{
    return __builtin_cpu_supports("avx2") ? judge_wide : judge_plain;
}
#else
static judge_group *best_judge(void)
{
    return judge_plain;
}
#endif

/* ---- making one ------------------------------------------------------------------------- */

/* The points in the order of rows, and the order that becomes the tree's. */
struct builder {
    size_t dims;
    const float *point; /* [n][dims] */
    uint32_t *row;
};

static float key(const struct builder *b, size_t place, size_t dim)
{
    return b->point[b->row[place] * b->dims + dim];
}

static size_t widest_dimension(const struct builder *b, size_t begin, size_t end)
{
    size_t widest = 0;
    float most = -1.0f;
    for (size_t dim = 0; dim < b->dims; dim++) {
        float low = key(b, begin, dim), high = low;
        for (size_t i = begin + 1; i < end; i++) {
            low = lower(low, key(b, i, dim));
            high = higher(high, key(b, i, dim));
        }
        if (high - low > most) {
            most = high - low;
            widest = dim;
        }
    }
    return widest;
}

/* Hoare's selection: nothing before `middle` is above, nothing after it below it. */
static void divide(struct builder *b, size_t begin, size_t end, size_t middle, size_t dim)
{
    while (end - begin > 1) {
        /* Never the last, so that j ends before it and both parts have something. */
        float pivot = key(b, begin + (end - begin - 1) / 2, dim);
        size_t i = begin, j = end - 1;
        for (;;) {
            while (key(b, i, dim) < pivot)
                i++;
            while (key(b, j, dim) > pivot)
                j--;
            if (i >= j)
                break;
            uint32_t row = b->row[i];
            b->row[i++] = b->row[j];
            b->row[j--] = row;
        }
        /* begin .. j are at most the pivot, the rest at least it. */
        if (middle <= j)
            end = j + 1;
        else
            begin = j + 1;
    }
}

/* Halve where points spread most, at a multiple of the largest group that both halves
 * can be made of, until what is left is one leaf. */
static void arrange(struct builder *b, size_t begin, size_t end)
{
    size_t unit = WIDTH;
    if (end - begin <= WIDTH)
        return;
    while (unit * WIDTH < end - begin)
        unit *= WIDTH;
    size_t units = (end - begin + unit - 1) / unit;
    size_t middle = begin + units / 2 * unit;
    divide(b, begin, end, middle, widest_dimension(b, begin, end));
    arrange(b, begin, middle);
    arrange(b, middle, end);
}

/* Entry `entry` of a level, at its dimension 0; the next dimension is WIDTH further. */
static float *place_of(const struct kd_tree *tree, float *level, size_t entry)
{
    return level + entry / WIDTH * tree->dims * WIDTH + entry % WIDTH;
}

static void place_points(struct kd_tree *tree, const float *point)
{
    for (size_t i = 0; i < tree->entries[0]; i++) {
        float *to = place_of(tree, tree->low[0], i);
        for (size_t dim = 0; dim < tree->dims; dim++)
            to[dim * WIDTH] = point[tree->row[i] * tree->dims + dim];
    }
}

/* Each entry of `level` becomes the box around a group of the level below. */
static void place_boxes(struct kd_tree *tree, unsigned level)
{
    for (size_t i = 0; i < tree->entries[level - 1]; i++) {
        const float *low = place_of(tree, tree->low[level - 1], i);
        const float *high = place_of(tree, tree->high[level - 1], i);
        float *box_low = place_of(tree, tree->low[level], i / WIDTH);
        float *box_high = place_of(tree, tree->high[level], i / WIDTH);
        for (size_t at = 0; at < tree->dims * WIDTH; at += WIDTH) {
            box_low[at] = i % WIDTH == 0 ? low[at] : lower(box_low[at], low[at]);
            box_high[at] = i % WIDTH == 0 ? high[at] : higher(box_high[at], high[at]);
        }
    }
}

/* Levels down to one group, in one block: points once, boxes with two corners. */
static enum status lay_out(struct kd_tree *tree, size_t n)
{
    size_t floats = 0, entries = n;
    do {
        tree->entries[tree->levels] = entries;
        floats += groups_of(entries) * (tree->levels == 0 ? 1 : 2);
        tree->levels++;
        entries = groups_of(entries);
    } while (entries > 1);
    tree->row = calloc(n, sizeof *tree->row);
    tree->low[0] = calloc(floats, tree->dims * WIDTH * sizeof **tree->low);
    if (tree->row == NULL || tree->low[0] == NULL)
        return STATUS_NO_MEMORY;
    tree->high[0] = tree->low[0];
    for (unsigned level = 1; level < tree->levels; level++) {
        size_t below = groups_of(tree->entries[level - 1]) * tree->dims * WIDTH;
        tree->low[level] = tree->high[level - 1] + below;
        tree->high[level] = tree->low[level] + groups_of(tree->entries[level]) * tree->dims * WIDTH;
    }
    return STATUS_OK;
}

/* ---- fields ----------------------------------------------------------------------------- */

static float float_below(double x)
{
    float f = (float)x;
    return (double)f > x ? nextafterf(f, -INFINITY) : f;
}

static float float_above(double x)
{
    return -float_below(-x);
}

static enum status lay_out_fields(struct kd_tree *tree, const struct kd_tree_rows *rows)
{
    size_t floats = 0;
    memcpy(tree->field, rows->field, sizeof tree->field);
    if (rows->field[0] == NULL || tree->levels == 1)
        return STATUS_OK;
    for (unsigned level = 1; level < tree->levels; level++)
        floats += 2 * groups_of(tree->entries[level]);
    float *place = calloc(floats, sizeof *place * KD_TREE_FIELDS * WIDTH);
    if (place == NULL)
        return STATUS_NO_MEMORY;
    for (unsigned level = 1; level < tree->levels; level++) {
        size_t size = groups_of(tree->entries[level]) * KD_TREE_FIELDS * WIDTH;
        tree->field_low[level] = place;
        tree->field_high[level] = place + size;
        place += 2 * size;
    }
    return STATUS_OK;
}

/* One field's least and most of an entry; of a point its own. */
static void field_ends(const struct kd_tree *tree, unsigned level, size_t entry, size_t field,
                       float *low, float *high)
{
    size_t place = (entry / WIDTH * KD_TREE_FIELDS + field) * WIDTH + entry % WIDTH;
    if (level > 0) {
        *low = tree->field_low[level][place];
        *high = tree->field_high[level][place];
    } else {
        *low = float_below(tree->field[field][tree->row[entry]]);
        *high = float_above(tree->field[field][tree->row[entry]]);
    }
}

/* Of each entry of `level`, from the group below it.  A value that is not a number is in no
 * range, so it widens none. */
static void place_fields(struct kd_tree *tree, unsigned level)
{
    for (size_t i = 0; i < tree->entries[level]; i++)
        for (size_t field = 0; field < KD_TREE_FIELDS; field++) {
            size_t place = (i / WIDTH * KD_TREE_FIELDS + field) * WIDTH + i % WIDTH;
            float least = (float)INFINITY, most = -(float)INFINITY;
            size_t end = (i + 1) * WIDTH, last = tree->entries[level - 1];
            for (size_t below = i * WIDTH; below < (end < last ? end : last); below++) {
                float low, high;
                field_ends(tree, level - 1, below, field, &low, &high);
                least = low < least ? low : least;
                most = high > most ? high : most;
            }
            tree->field_low[level][place] = least;
            tree->field_high[level][place] = most;
        }
}

/* ---- all of it -------------------------------------------------------------------------- */

/* All points as floats, and the largest norm; false where one is out of range. */
static bool take_points(struct kd_tree *tree, const struct kd_tree_rows *rows, float *ret)
{
    for (size_t i = 0; i < tree->entries[0]; i++) {
        double p[KD_TREE_MAX_DIMS], square = 0.0;
        rows->point(rows->context, i, p);
        for (size_t dim = 0; dim < tree->dims; dim++)
            square += p[dim] * p[dim];
        if (!(sqrt(square) <= largest_norm)) /* as NaN is not */
            return false;
        tree->norm = fmax(tree->norm, sqrt(square));
        for (size_t dim = 0; dim < tree->dims; dim++)
            ret[i * tree->dims + dim] = (float)p[dim];
    }
    return true;
}

enum status kd_tree_open(const struct kd_tree_rows *rows, struct kd_tree **ret)
{
    enum status s;
    size_t n = rows->n, dims = rows->dims;
    float *points = NULL;
    if (n > UINT32_MAX)
        return STATUS_RANGE;
    struct kd_tree *tree = calloc(1, sizeof *tree);
    if (tree == NULL)
        return STATUS_NO_MEMORY;
    tree->dims = dims;
    tree->judge = best_judge();
    s = lay_out(tree, n);
    if (s == STATUS_OK)
        s = lay_out_fields(tree, rows);
    if (s != STATUS_OK)
        goto fail;
    s = STATUS_NO_MEMORY;
    points = calloc(n, dims * sizeof *points);
    if (points == NULL)
        goto fail;
    s = STATUS_RANGE;
    if (!take_points(tree, rows, points))
        goto fail;
    for (size_t i = 0; i < n; i++)
        tree->row[i] = (uint32_t)i;
    arrange(&(struct builder){ dims, points, tree->row }, 0, n);
    place_points(tree, points);
    for (unsigned level = 1; level < tree->levels; level++)
        place_boxes(tree, level);
    for (unsigned level = 1; level < tree->levels && tree->field_low[1] != NULL; level++)
        place_fields(tree, level);
    free(points);
    *ret = tree;
    return STATUS_OK;
fail:
    free(points);
    kd_tree_close(tree);
    return s;
}

void kd_tree_close(struct kd_tree *tree)
{
    if (tree == NULL)
        return;
    free(tree->row);
    free(tree->low[0]);       /* the block of all levels */
    free(tree->field_low[1]); /* the same */
    free(tree);
}

/* ---- searching -------------------------------------------------------------------------- */

struct visit {
    const struct kd_tree *tree;
    struct kd_tree_task *task;
    float query[KD_TREE_MAX_DIMS];
    double slack;
    float threshold; /* squares above it, or bounds, are of rows that do not matter */
    float lo[KD_TREE_FIELDS], hi[KD_TREE_FIELDS]; /* of the range, rounded outwards */
};

/* See the top; 1e-6 is for the caller's own rounding of its distances. */
static float threshold(const struct visit *v, double distance)
{
    if (v->task->bound != NULL)
        return float_above(distance);
    double reach = distance * (1.0 + 1e-6) + v->slack;
    return (float)(reach * reach * (1.0 + 1e-5) + (double)FLT_MIN);
}

/* NaN for the boxes of a group that hold nothing of the range. */
static void leave_out(const struct visit *v, unsigned level, size_t group, float square[WIDTH])
{
    const float *low = v->tree->field_low[level] + group * KD_TREE_FIELDS * WIDTH;
    const float *high = v->tree->field_high[level] + group * KD_TREE_FIELDS * WIDTH;
    for (size_t field = 0; field < KD_TREE_FIELDS; field++)
        for (size_t i = 0; i < WIDTH; i++)
            if (low[field * WIDTH + i] > v->hi[field] || high[field * WIDTH + i] < v->lo[field])
                square[i] = NAN;
}

static void judge(const struct visit *v, unsigned level, size_t group, float square[WIDTH])
{
    size_t first = group * v->tree->dims * WIDTH;
    const float *low = v->tree->low[level] + first, *high = v->tree->high[level] + first;
    if (v->task->bound != NULL)
        v->task->bound(v->task->context, low, high, square);
    else
        v->tree->judge(v->tree->dims, low, high, v->query, square);
    if (v->task->range != NULL && level > 0)
        leave_out(v, level, group, square);
}

static bool row_in_range(const struct visit *v, size_t row)
{
    const struct kd_tree_range *range = v->task->range;
    for (size_t field = 0; range != NULL && field < KD_TREE_FIELDS; field++) {
        double value = v->tree->field[field][row];
        if (!(value >= range->lo[field] && value <= range->hi[field])) /* as NaN is not */
            return false;
    }
    return true;
}

/* The entries of a group that matter, nearest first; their number. */
static size_t sort_entries(const struct visit *v, size_t count, const float square[WIDTH],
                           size_t order[WIDTH])
{
    size_t n = 0;
    for (size_t i = 0; i < count; i++) {
        if (!(square[i] <= v->threshold)) /* as NaN is not */
            continue;
        size_t place = n++;
        for (; place > 0 && square[i] < square[order[place - 1]]; place--)
            order[place] = order[place - 1];
        order[place] = i;
    }
    return n;
}

static void visit_group(struct visit *v, unsigned level, size_t group)
{
    float square[WIDTH];
    size_t order[WIDTH], first = group * WIDTH, left = v->tree->entries[level] - first;
    size_t count = left < WIDTH ? left : WIDTH;
    judge(v, level, group, square);
    v->task->judged += count;
    size_t n = sort_entries(v, count, square, order);
    for (size_t i = 0; i < n && square[order[i]] <= v->threshold; i++) {
        size_t entry = first + order[i];
        if (level > 0)
            visit_group(v, level - 1, entry);
        else if (row_in_range(v, v->tree->row[entry]))
            v->threshold = threshold(v, v->task->look(v->task->context, v->tree->row[entry]));
    }
}

/* false where the query is beyond what a tree takes. */
static bool take_query(struct visit *v)
{
    double square = 0.0;
    for (size_t dim = 0; dim < v->tree->dims; dim++)
        square += v->task->query[dim] * v->task->query[dim];
    if (!(sqrt(square) <= largest_norm))
        return false;
    for (size_t dim = 0; dim < v->tree->dims; dim++)
        v->query[dim] = (float)v->task->query[dim];
    v->slack = 0x1p-23 * (sqrt(square) + v->tree->norm);
    return true;
}

bool kd_tree_search(const struct kd_tree *tree, struct kd_tree_task *task)
{
    struct visit v = { .tree = tree, .task = task, .threshold = (float)INFINITY };
    if (task->bound == NULL && !take_query(&v))
        return false;
    for (size_t field = 0; task->range != NULL && field < KD_TREE_FIELDS; field++) {
        v.lo[field] = float_below(task->range->lo[field]);
        v.hi[field] = float_above(task->range->hi[field]);
    }
    visit_group(&v, tree->levels - 1, 0);
    return true;
}
