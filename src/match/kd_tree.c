/* kd_tree.c - the search through nested boxes, nearest first.
 *
 * Rounding.  Points and queries are kept as floats: each moves by at most 2^-24 of its
 * norm, and the contract adds 1e-9 of it, so distances between floats exceed true
 * ones by less than slack = 2^-23 (|query| + largest |point|).  Sums of at most 16
 * squares of floats err by less than 18 x 2^-24 < 2e-6 of themselves, and by
 * nothing worth FLT_MIN where squares underflow.  threshold() allows for all of it; keys
 * (kd_judge.h) are at most the squares they stand for.
 * Frames (kd_frame.h) round once more, the norms being those from a centre, which is no farther
 * than the points are: by less than 2^-23 (|query| + 3 largest |point|), so that the slack is 2^-21
 * instead; and by 2^-19 of the squares, for which threshold() has room.
 * A box's bound needs nothing of its own: it is made by the same operations as the
 * distance of a point in it, from smaller differences, and rounding is monotonic.
 *
 * Fields.  A box keeps what its rows' fields lie between, as floats rounded outwards; a row's
 * own are looked up in their columns, which are not rounded. */
#include "match/kd_tree.h"

#include <float.h>
#include <math.h>

#include "match/kd_layout.h"

struct visit {
    const struct kd_tree *tree;
    struct kd_tree_task *task;
    float query[KD_TREE_MAX_DIMS]; /* 0 past the dimensions that there are */
    float framed[KD_FRAME_DIMS];   /* in the frame of the group that is being visited */
    double slack;
    int32_t limit;                                /* keys above it are of rows that do not matter */
    float lo[KD_TREE_FIELDS], hi[KD_TREE_FIELDS]; /* of the range, rounded outwards */
};

/* See the top; 1e-6 is for the caller's own rounding of its distances. */
static float threshold(const struct visit *v, double distance)
{
    if (v->task->bound != NULL)
        return kd_float_above(distance);
    double reach = distance * (1.0 + 1e-6) + v->slack;
    return (float)(reach * reach * (1.0 + 1e-5) + (double)FLT_MIN);
}

/* ---- one group ---------------------------------------------------------------------- */

/* Bounds of the caller's as keys.  What is not above 0, or not a number, is near. */
static int32_t judge_by_bound(const struct visit *v, const float *low, const float *high,
                              int32_t key[KD_WIDTH])
{
    float bound[KD_WIDTH];
    v->task->bound(v->task->context, low, high, bound);
    for (int32_t i = 0; i < KD_WIDTH; i++)
        key[i] = (kd_key_limit(bound[i] > 0.0f ? bound[i] : 0.0f) & ~KD_KEY_NUMBER) | i;
    return v->tree->judge->least(key);
}

/* No keys for the boxes of a group that hold nothing of the range. */
static void leave_out(const struct visit *v, unsigned level, size_t group, int32_t key[KD_WIDTH])
{
    const float *low = v->tree->ends[level] + kd_place(KD_TREE_FIELDS, level, group * KD_WIDTH);
    const float *high = low + kd_high(KD_TREE_FIELDS, level);
    for (size_t field = 0; field < KD_TREE_FIELDS; field++)
        for (size_t i = 0; i < KD_WIDTH; i++)
            if (low[field * KD_WIDTH + i] > v->hi[field] ||
                high[field * KD_WIDTH + i] < v->lo[field])
                key[i] = KD_KEY_NONE;
}

/* Keys of a group, and the least of them. */
static int32_t judge(struct visit *v, unsigned level, size_t group, int32_t key[KD_WIDTH])
{
    const struct kd_tree *tree = v->tree;
    size_t dims = kd_dims(tree, level);
    const float *low = tree->corner[level] + kd_place(dims, level, group * KD_WIDTH);
    const float *high = low + kd_high(dims, level);
    const float *query = tree->frame != NULL && level <= 1 ? v->framed : v->query;
    size_t left = tree->entries[level] - group * KD_WIDTH,
           count = left < KD_WIDTH ? left : KD_WIDTH;
    int32_t least = v->task->bound != NULL ? judge_by_bound(v, low, high, key)
                                           : tree->judge->group(dims, low, high, query, key);
    bool in_range = v->task->range == NULL || level == 0;
    v->task->judged += count;
    if (count == KD_WIDTH && in_range)
        return least;
    for (size_t i = count; i < KD_WIDTH; i++)
        key[i] = KD_KEY_NONE;
    if (!in_range)
        leave_out(v, level, group, key);
    return tree->judge->least(key);
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

/* ---- all of them -------------------------------------------------------------------- */

static void look_at(struct visit *v, size_t entry)
{
    size_t row = v->tree->row[entry];
    if (row_in_range(v, row))
        v->limit = kd_key_limit(threshold(v, v->task->look(v->task->context, row)));
}

/* On its way from memory while something nearer is looked at. */
static void fetch(const struct kd_tree *tree, unsigned level, size_t group)
{
    size_t dims = kd_dims(tree, level), lines = level == 0 ? dims : 2 * dims;
    const float *line = tree->corner[level] + kd_place(dims, level, group * KD_WIDTH);
    if (level == 1 && tree->frame != NULL)
        for (size_t i = 0; i <= KD_FRAME_DIRECTIONS; i++)
            __builtin_prefetch(tree->frame[group].centre + i * KD_TREE_MAX_DIMS);
    for (size_t i = 0; i < lines; i++)
        __builtin_prefetch(line + i * KD_WIDTH);
}

static void enter_frame(struct visit *v, size_t group)
{
    if (v->tree->frame != NULL)
        kd_frame_point(v->tree->vectors, &v->tree->frame[group], v->query, v->framed);
}

/* What of a group matters, nearest first. */
static void visit_group(struct visit *v, unsigned level, size_t group)
{
    const struct kd_tree *tree = v->tree;
    int32_t key[KD_WIDTH], next;
    if (level == 0)
        __builtin_prefetch(tree->row + group * KD_WIDTH);
    if (level == 1)
        enter_frame(v, group);
    next = judge(v, level, group, key);
    while (next <= v->limit) {
        size_t entry = group * KD_WIDTH + (size_t)(next & KD_KEY_NUMBER);
        key[next & KD_KEY_NUMBER] = KD_KEY_NONE;
        next = tree->judge->least(key);
        if (level == 0) {
            if (next <= v->limit && v->task->fetch != NULL)
                v->task->fetch(v->task->context,
                               tree->row[group * KD_WIDTH + (size_t)(next & KD_KEY_NUMBER)]);
            look_at(v, entry);
            continue;
        }
        if (next <= v->limit)
            fetch(tree, level - 1, group * KD_WIDTH + (size_t)(next & KD_KEY_NUMBER));
        visit_group(v, level - 1, entry);
    }
}

/* false where the query is beyond what a tree takes. */
static bool take_query(struct visit *v)
{
    double square = 0.0;
    for (size_t dim = 0; dim < v->tree->dims; dim++)
        square += v->task->query[dim] * v->task->query[dim];
    if (!(sqrt(square) <= KD_LARGEST_NORM))
        return false;
    for (size_t dim = 0; dim < v->tree->dims; dim++)
        v->query[dim] = (float)v->task->query[dim];
    v->slack = (v->tree->frame != NULL ? 0x1p-21 : 0x1p-23) * (sqrt(square) + v->tree->norm);
    return true;
}

bool kd_tree_search(const struct kd_tree *tree, struct kd_tree_task *task)
{
    struct visit v = { .tree = tree, .task = task, .limit = kd_key_limit((float)INFINITY) };
    if (task->bound == NULL ? !take_query(&v) : tree->frame != NULL)
        return false;
    for (size_t field = 0; task->range != NULL && field < KD_TREE_FIELDS; field++) {
        v.lo[field] = kd_float_below(task->range->lo[field]);
        v.hi[field] = kd_float_above(task->range->hi[field]);
    }
    if (!tree->few)
        visit_group(&v, tree->levels - 1, 0);
    else
        for (size_t first = 0; first < tree->entries[0]; first += KD_WIDTH) {
            if (first % KD_FRAMED == 0)
                enter_frame(&v, first / KD_FRAMED);
            visit_group(&v, 0, first / KD_WIDTH);
        }
    return true;
}
