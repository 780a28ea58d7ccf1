/* kd_tree.c - the search through nested boxes, nearest first.
 *
 * Rounding.  Points and queries are kept as floats: each moves by at most 2^-24 of its
 * norm, and the contract adds its share of it, so distances between floats exceed true
 * ones by less than slack = (2^-23 + rounding) (|query| + largest |point|).  Sums of at most 16
 * squares of floats err by less than 18 x 2^-24 < 2e-6 of themselves, and by
 * nothing worth FLT_MIN where squares underflow.  threshold() allows for all of it; keys
 * (kd_judge.h) are at most the squares they stand for.
 * Frames (kd_frame.h) round once more, the norms being those from a centre, which is no farther
 * than the points are: by less than 2^-23 (|query| + 3 largest |point|), so that the slack has
 * 2^-21 instead; and by 2^-19 of the squares, for which threshold() has room. A box's bound needs
 * nothing of its own: it is made by the same operations as the distance of a point in it, from
 * smaller differences, and rounding is monotonic.
 *
 * Fields.  A box keeps what its rows' fields lie between, as floats rounded outwards; a row's
 * own are looked up in their columns, which are not rounded. */
#include "match/kd_tree.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "match/kd_layout.h"

/* A group whose entries are gone through, nearest first. */
struct visit {
    _Alignas(64) int32_t key[KD_WIDTH];
    size_t group;
    int32_t next; /* of these: the nearest that has not been gone into */
};

/* A search on its way. */
struct walk {
    const struct kd_tree *tree;
    struct kd_tree_task *task;
    double slack;
    int32_t limit;  /* keys above it are of rows that do not matter */
    unsigned level; /* of the group at hand */
    bool at_row;    /* the next step is a look at a row, not a group to be judged */
    size_t row;
    float query[KD_TREE_MAX_DIMS];                /* 0 past the dimensions that there are */
    float framed[KD_FRAME_DIMS];                  /* in the frame of the last group of level 1 */
    float lo[KD_TREE_FIELDS], hi[KD_TREE_FIELDS]; /* of the range, rounded outwards */
    struct visit at[KD_MAX_LEVELS];               /* from the level at hand to the top */
};

/* See the top; 1e-6 is for the caller's own rounding of its distances. */
static float threshold(const struct walk *w, double distance)
{
    if (w->task->bound != NULL)
        return kd_float_above(distance);
    double reach = distance * (1.0 + 1e-6) + w->slack;
    return (float)(reach * reach * (1.0 + 1e-5) + (double)FLT_MIN);
}

/* ---- one group ---------------------------------------------------------------------- */

/* Bounds of the caller's as keys.  What is not above 0, or not a number, is near. */
static int32_t judge_by_bound(const struct walk *w, const float *low, const float *high,
                              int32_t key[KD_WIDTH])
{
    float bound[KD_WIDTH];
    w->task->bound(w->task->context, low, high, bound);
    for (int32_t i = 0; i < KD_WIDTH; i++)
        key[i] = (kd_key_limit(bound[i] > 0.0f ? bound[i] : 0.0f) & ~KD_KEY_NUMBER) | i;
    return w->tree->judge->least(key, KD_KEY_BEFORE);
}

/* No keys for the boxes of a group that hold nothing of the range. */
static void leave_out(const struct walk *w, unsigned level, size_t group, int32_t key[KD_WIDTH])
{
    const float *low = w->tree->ends[level] + kd_place(KD_TREE_FIELDS, level, group * KD_WIDTH);
    const float *high = low + kd_high(KD_TREE_FIELDS, level);
    for (size_t field = 0; field < KD_TREE_FIELDS; field++)
        for (size_t i = 0; i < KD_WIDTH; i++)
            if (low[field * KD_WIDTH + i] > w->hi[field] ||
                high[field * KD_WIDTH + i] < w->lo[field])
                key[i] = KD_KEY_NONE;
}

/* Keys of a group, and the least of them. */
static int32_t judge(struct walk *w, unsigned level, size_t group, int32_t key[KD_WIDTH])
{
    const struct kd_tree *tree = w->tree;
    size_t dims = kd_dims(tree, level);
    const float *low = tree->corner[level] + kd_place(dims, level, group * KD_WIDTH);
    const float *high = low + kd_high(dims, level);
    const float *query = tree->framed && level <= 1 ? w->framed : w->query;
    size_t left = tree->entries[level] - group * KD_WIDTH,
           count = left < KD_WIDTH ? left : KD_WIDTH;
    int32_t least = w->task->bound != NULL ? judge_by_bound(w, low, high, key)
                                           : tree->judge->group(dims, low, high, query, key);
    bool in_range = w->task->range == NULL || level == 0;
    w->task->judged += count;
    if (count == KD_WIDTH && in_range)
        return least;
    for (size_t i = count; i < KD_WIDTH; i++)
        key[i] = KD_KEY_NONE;
    if (!in_range)
        leave_out(w, level, group, key);
    return tree->judge->least(key, KD_KEY_BEFORE);
}

static bool row_in_range(const struct walk *w, size_t row)
{
    const struct kd_tree_range *range = w->task->range;
    for (size_t field = 0; range != NULL && field < KD_TREE_FIELDS; field++) {
        double value = w->tree->field[field][row];
        if (!(value >= range->lo[field] && value <= range->hi[field])) /* as NaN is not */
            return false;
    }
    return true;
}

/* ---- memory that is read soon ------------------------------------------------------- */

/* Inlined for good: gcc takes a function that only fetches for one without effect, and leaves its
 * calls out. */
VECTORS_INLINE void fetch_group(const struct kd_tree *tree, unsigned level, size_t group)
{
    size_t dims = kd_dims(tree, level), lines = level == 0 ? dims : 2 * dims;
    const float *line = tree->corner[level] + kd_place(dims, level, group * KD_WIDTH);
    if (level == 0)
        __builtin_prefetch(tree->row + group * KD_WIDTH);
    if (level == 1 && tree->framed)
        for (size_t i = 0; i <= KD_FRAME_DIRECTIONS; i++)
            __builtin_prefetch(tree->frame[group].centre + i * KD_TREE_MAX_DIMS);
    for (size_t i = 0; i < lines; i++)
        __builtin_prefetch(line + i * KD_WIDTH);
}

VECTORS_INLINE void fetch_entry(const struct walk *w, int32_t key)
{
    const struct kd_tree *tree = w->tree;
    size_t entry = w->at[w->level].group * KD_WIDTH + (size_t)(key & KD_KEY_NUMBER);
    if (w->level > 0)
        fetch_group(tree, w->level - 1, entry);
    else if (w->task->fetch != NULL)
        w->task->fetch(w->task->context, tree->row[entry]);
}

/* ---- all of them -------------------------------------------------------------------- */

static void look_at_row(struct walk *w)
{
    if (row_in_range(w, w->row))
        w->limit = kd_key_limit(threshold(w, w->task->look(w->task->context, w->row)));
}

static void judge_group(struct walk *w)
{
    const struct kd_tree *tree = w->tree;
    struct visit *v = &w->at[w->level];
    if (tree->framed && w->level == 1)
        kd_frame_point(tree->vectors, &tree->frame[v->group], w->query, w->framed);
    v->next = judge(w, w->level, v->group, v->key);
}

/* Up to where something is left that matters; false where nothing is. */
static bool go_up(struct walk *w)
{
    while (w->at[w->level].next > w->limit)
        if (++w->level == w->tree->levels)
            return false;
    return true;
}

/* Into the nearest that is left.  What that takes to read is fetched where other searches have
 * their turns meanwhile; where this is the only one, what comes after it. */
VECTORS_INLINE void go_in(struct walk *w, bool alone)
{
    struct visit *v = &w->at[w->level];
    int32_t key = v->next;
    size_t entry = v->group * KD_WIDTH + (size_t)(key & KD_KEY_NUMBER);
    v->next = w->tree->judge->least(v->key, key);
    if (!alone)
        fetch_entry(w, key);
    else if (w->tree->large && v->next <= w->limit)
        fetch_entry(w, v->next);
    w->at_row = w->level == 0;
    if (w->at_row) {
        w->row = w->tree->row[entry];
        return;
    }
    w->at[--w->level].group = entry;
    if (alone && w->tree->large && w->level == 0)
        __builtin_prefetch(w->tree->row + entry * KD_WIDTH);
}

/* One group judged or one row looked at, and on to the next; false where that was the last. */
VECTORS_INLINE bool step(struct walk *w, bool alone)
{
    if (w->at_row)
        look_at_row(w);
    else
        judge_group(w);
    if (!go_up(w))
        return false;
    go_in(w, alone);
    return true;
}

/* ---- from the beginning ------------------------------------------------------------- */

/* false where the query is beyond what a tree takes. */
static bool take_query(struct walk *w)
{
    double square = 0.0;
    for (size_t dim = 0; dim < w->tree->dims; dim++)
        square += w->task->query[dim] * w->task->query[dim];
    if (!(sqrt(square) <= KD_LARGEST_NORM))
        return false;
    memset(w->query, 0, sizeof w->query);
    for (size_t dim = 0; dim < w->tree->dims; dim++)
        w->query[dim] = (float)w->task->query[dim];
    w->slack = ((w->tree->framed ? 0x1p-21 : 0x1p-23) + w->tree->rounding) *
               (sqrt(square) + w->tree->norm);
    return true;
}

/* So few that all are judged: each group of points by itself, as a tree of one. */
static void look_at_few(struct walk *w)
{
    const struct kd_tree *tree = w->tree;
    for (size_t first = 0; first < tree->entries[0]; first += KD_WIDTH) {
        struct visit *v = &w->at[0];
        if (first % KD_FRAMED == 0 && tree->framed)
            kd_frame_point(tree->vectors, &tree->frame[first / KD_FRAMED], w->query, w->framed);
        v->group = first / KD_WIDTH;
        v->next = judge(w, 0, v->group, v->key);
        while (v->next <= w->limit) {
            go_in(w, true);
            look_at_row(w);
        }
    }
}

/* At the top; false where the search is at its end. */
static bool begin(struct walk *w, const struct kd_tree *tree, struct kd_tree_task *task)
{
    w->tree = tree;
    w->task = task;
    w->limit = kd_key_limit((float)INFINITY);
    w->level = tree->few ? 0 : tree->levels - 1;
    w->at_row = false;
    w->at[w->level].group = 0;
    task->refused = task->bound == NULL ? !take_query(w) : tree->framed;
    if (task->refused)
        return false;
    for (size_t field = 0; task->range != NULL && field < KD_TREE_FIELDS; field++) {
        w->lo[field] = kd_float_below(task->range->lo[field]);
        w->hi[field] = kd_float_above(task->range->hi[field]);
    }
    if (tree->few)
        look_at_few(w);
    return !tree->few;
}

bool kd_tree_search(const struct kd_tree *tree, struct kd_tree_task *task)
{
    struct walk w;
    bool more = begin(&w, tree, task);
    while (more)
        more = step(&w, true);
    return !task->refused;
}

/* The slot's next search that is not over as soon as it begins; false where there is none. */
static bool begin_next(struct walk *w, const struct kd_tree *tree, size_t slot, kd_tree_next *next,
                       void *context)
{
    for (struct kd_tree_task *task; (task = next(context, slot)) != NULL;)
        if (begin(w, tree, task))
            return true;
    return false;
}

void kd_tree_search_many(const struct kd_tree *tree, kd_tree_next *next, void *context)
{
    struct walk walk[KD_TREE_TOGETHER];
    size_t slot[KD_TREE_TOGETHER], n = 0;
    if (!tree->large) { /* nothing to wait for */
        for (struct kd_tree_task *task; (task = next(context, 0)) != NULL;)
            (void)kd_tree_search(tree, task);
        return;
    }
    for (size_t i = 0; i < KD_TREE_TOGETHER; i++)
        if (begin_next(&walk[i], tree, i, next, context))
            slot[n++] = i;
    while (n > 0)
        for (size_t i = 0; i < n; i++) {
            struct walk *w = &walk[slot[i]];
            if (!step(w, false) && !begin_next(w, tree, slot[i], next, context))
                slot[i--] = slot[--n];
        }
}
