/* test_kd_tree.c - no row that matters is missing, whatever the points; most that do not
 * are.  Judged by distances in long double over all rows. */
#include "match/kd_tree.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "match/kd_layout.h"
#include "tests/support/dice.h"
#include "unity.h"

enum { MOST_ROWS = 5000 };

/* Points by their row. */
static struct {
    size_t n, dims;
    double point[MOST_ROWS][KD_TREE_MAX_DIMS];
} cloud;

static void cloud_point(void *context, size_t row, double *point)
{
    (void)context;
    memcpy(point, cloud.point[row], cloud.dims * sizeof *point);
}

static double true_distance(const double *query, size_t row)
{
    long double sum = 0.0L;
    for (size_t dim = 0; dim < cloud.dims; dim++) {
        long double d = (long double)query[dim] - (long double)cloud.point[row][dim];
        sum += d * d;
    }
    return (double)sqrtl(sum);
}

void setUp(void)
{
}

void tearDown(void)
{
}

static struct kd_tree *open_tree(const char *what)
{
    struct kd_tree_rows rows = {
        .n = cloud.n, .dims = cloud.dims, .threads = 2, .point = cloud_point, .rounding = 1e-9
    };
    struct kd_tree *tree;
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, kd_tree_open(&rows, &tree), what);
    return tree;
}

/* ---- clouds ----------------------------------------------------------------------------- */

/* Points that a partition or a rounding could stumble over. */
static const struct cloud_case {
    const char *what;
    size_t n, dims;
    double scale, offset; /* times chance in -1 .. 1, plus */
    size_t values;        /* only so many different values a coordinate; 0: any */
} cloud_cases[] = {
    { "one point", 1, 3, 1.0, 0.0, 0 },
    { "two", 2, 3, 1.0, 0.0, 0 },
    { "a leaf less one", 15, 3, 1.0, 0.0, 0 },
    { "a leaf", 16, 8, 1.0, 0.0, 0 },
    { "a leaf and one", 17, 8, 1.0, 0.0, 0 },
    { "two leaves, as many as are judged without boxes", 32, 3, 1.0, 0.0, 0 },
    { "two leaves and one point", 33, 3, 1.0, 0.0, 0 },
    { "two leaves of spectra", 32, 12, 1.0, 0.0, 0 },
    { "sixteen leaves", 256, 3, 1.0, 0.0, 0 },
    { "sixteen leaves and one point", 257, 3, 1.0, 0.0, 0 },
    { "three levels and one point", 4097, 3, 1.0, 0.0, 0 },
    { "many", 5000, 8, 1.0, 0.0, 0 },
    { "one dimension", 3000, 1, 1.0, 0.0, 0 },
    { "sixteen dimensions", 1000, 16, 1.0, 0.0, 0 },
    { "all the same", 700, 3, 0.0, 5.0, 0 },
    { "few different", 3000, 3, 1.0, 0.0, 4 },
    { "two values", 999, 8, 1.0, 0.0, 2 },
    { "differing below a float's last bit", 2000, 3, 1e-6, 1000.0, 0 },
    { "differing in a double's last bits", 2000, 3, 1e-12, 1000.0, 0 },
    { "as far out as allowed", 2000, 3, 5e14, 0.0, 0 },
    { "far out and close together", 2000, 3, 1.0, 5e14, 0 },
    { "squares of a float's last bits", 2000, 3, 1e-22, 0.0, 0 },
    { "squares below a float", 2000, 3, 1e-25, 0.0, 0 },
    { "below a float altogether", 2000, 3, 1e-60, 0.0, 0 },
    { "squares below a double", 2000, 3, 1e-200, 0.0, 0 },
};

static void make_cloud(const struct cloud_case *c, struct dice *dice)
{
    cloud.n = c->n;
    cloud.dims = c->dims;
    for (size_t i = 0; i < c->n; i++)
        for (size_t dim = 0; dim < c->dims; dim++) {
            double x = dice_between(dice, -1.0, 1.0);
            if (c->values > 0)
                x = (double)dice_below(dice, c->values) / (double)c->values;
            cloud.point[i][dim] = c->offset + c->scale * x;
        }
}

/* By turns: a point, between two, near one, and anywhere at all. */
static void make_query(size_t number, struct dice *dice, double *query)
{
    const double *x = cloud.point[dice_below(dice, cloud.n)];
    const double *y = cloud.point[dice_below(dice, cloud.n)];
    for (size_t dim = 0; dim < cloud.dims; dim++) {
        double beyond = dice_between(dice, -2.0, 3.0);
        const double turns[] = { x[dim], (x[dim] + y[dim]) / 2.0,
                                 x[dim] * (1.0 + dice_between(dice, -1e-7, 1e-7)),
                                 x[dim] + beyond * (y[dim] - x[dim]) };
        query[dim] = fmin(fmax(turns[number % 4], -5e14), 5e14 * (1.0 + 1e-7));
    }
}

/* ---- looking ---------------------------------------------------------------------------- */

struct viewer {
    const double *query;
    double radius; /* fixed; below 0: that of the nearest so far */
    double nearest;
    size_t shown;
    unsigned char times[MOST_ROWS];
};

static double look(void *context, size_t row)
{
    struct viewer *v = context;
    v->shown++;
    v->times[row]++;
    v->nearest = fmin(v->nearest, true_distance(v->query, row));
    return v->radius >= 0.0 ? v->radius : v->nearest;
}

static void search(const struct kd_tree *tree, const double *query, double radius,
                   struct viewer *ret, const char *what)
{
    memset(ret, 0, sizeof *ret);
    ret->query = query;
    ret->radius = radius;
    ret->nearest = (double)INFINITY;
    TEST_ASSERT_TRUE_MESSAGE(
        kd_tree_search(tree,
                       &(struct kd_tree_task){ .query = query, .look = look, .context = ret }),
        what);
}

/* Every row within the radius once; none at all twice. */
static void assert_all_within(const struct viewer *v, double radius, const char *what)
{
    for (size_t row = 0; row < cloud.n; row++) {
        if (true_distance(v->query, row) <= radius)
            TEST_ASSERT_EQUAL_INT_MESSAGE(1, v->times[row], what);
        TEST_ASSERT_MESSAGE(v->times[row] <= 1, what);
    }
}

static void test_nothing_is_missing(void)
{
    struct dice dice = { 41 };
    for (size_t i = 0; i < sizeof cloud_cases / sizeof *cloud_cases; i++) {
        const struct cloud_case *c = &cloud_cases[i];
        make_cloud(c, &dice);
        struct kd_tree *tree = open_tree(c->what);
        for (size_t number = 0; number < 60; number++) {
            static struct viewer v;
            double query[KD_TREE_MAX_DIMS];
            make_query(number, &dice, query);
            search(tree, query, -1.0, &v, c->what); /* the nearest, and all as near */
            assert_all_within(&v, v.nearest, c->what);
            double radius = true_distance(query, dice_below(&dice, c->n));
            search(tree, query, radius, &v, c->what); /* a row on the rim */
            assert_all_within(&v, radius, c->what);
            search(tree, query, (double)INFINITY, &v, c->what);
            TEST_ASSERT_EQUAL_size_t_MESSAGE(c->n, v.shown, c->what);
        }
        kd_tree_close(tree);
    }
}

/* ---- a measure of the caller's own -------------------------------------------------------- */

/* The largest difference in any dimension: less than the distance, so not the tree's own. */
static double largest_difference(const double *query, size_t row)
{
    double most = 0.0;
    for (size_t dim = 0; dim < cloud.dims; dim++)
        most = fmax(most, fabs(query[dim] - cloud.point[row][dim]));
    return most;
}

static void bound_largest(void *context, const float *low, const float *high,
                          float bound[KD_TREE_WIDTH])
{
    const struct viewer *v = context;
    for (size_t i = 0; i < KD_TREE_WIDTH; i++) {
        double most = 0.0;
        for (size_t dim = 0; dim < cloud.dims; dim++) {
            double from = (double)low[dim * KD_TREE_WIDTH + i];
            double to = (double)high[dim * KD_TREE_WIDTH + i];
            from -= 0x1p-24 * fabs(from);
            to += 0x1p-24 * fabs(to);
            most = fmax(most, fmax(from - v->query[dim], v->query[dim] - to));
        }
        bound[i] = nextafterf((float)most, 0.0f);
    }
}

static double look_largest(void *context, size_t row)
{
    struct viewer *v = context;
    v->shown++;
    v->times[row]++;
    v->nearest = fmin(v->nearest, largest_difference(v->query, row));
    return v->nearest;
}

static void test_own_measure(void)
{
    static const struct cloud_case cases[] = { { "in a cube", 5000, 3, 1.0, 0.0, 0 },
                                               { "far out", 3000, 8, 1.0, 1000.0, 0 } };
    struct dice dice = { 44 };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        make_cloud(&cases[i], &dice);
        struct kd_tree *tree = open_tree(cases[i].what);
        size_t shown = 0;
        for (size_t number = 0; number < 100; number++) {
            static struct viewer v;
            double query[KD_TREE_MAX_DIMS];
            make_query(number, &dice, query);
            memset(&v, 0, sizeof v);
            v.query = query;
            v.nearest = (double)INFINITY;
            struct kd_tree_task task = { .look = look_largest,
                                         .bound = bound_largest,
                                         .context = &v };
            TEST_ASSERT_TRUE(kd_tree_search(tree, &task));
            for (size_t row = 0; row < cloud.n; row++)
                if (largest_difference(query, row) <= v.nearest)
                    TEST_ASSERT_EQUAL_INT_MESSAGE(1, v.times[row], cases[i].what);
            shown += v.shown;
            TEST_ASSERT_TRUE(task.judged < 2 * cloud.n);
        }
        TEST_ASSERT_TRUE(shown < 100 * cloud.n / 8);
        kd_tree_close(tree);
    }
}

/* ---- many together ------------------------------------------------------------------ */

enum { MANY = 3 * KD_TREE_TOGETHER + 1 };

/* A search that writes down what it is shown. */
struct diary {
    double query[KD_TREE_MAX_DIMS], nearest;
    size_t row[MOST_ROWS], n;
    struct kd_tree_task task;
};

struct diaries {
    struct diary *diary;
    size_t n, given, asked_after_end[KD_TREE_TOGETHER];
    struct kd_tree_task *in[KD_TREE_TOGETHER]; /* of a slot: its search on the way */
};

static double look_and_write(void *context, size_t row)
{
    struct diary *d = context;
    d->row[d->n++] = row;
    d->nearest = fmin(d->nearest, true_distance(d->query, row));
    return d->nearest;
}

static void begin_diary(struct diary *d, const double *query)
{
    memcpy(d->query, query, sizeof d->query);
    d->nearest = (double)INFINITY;
    d->n = 0;
    d->task = (struct kd_tree_task){ .query = d->query, .look = look_and_write, .context = d };
}

static struct kd_tree_task *next_diary(void *context, size_t slot)
{
    struct diaries *all = context;
    TEST_ASSERT_TRUE(slot < KD_TREE_TOGETHER);
    if (all->in[slot] != NULL) /* done: by itself it shows no more */
        TEST_ASSERT_TRUE(all->in[slot]->judged > 0 || all->in[slot]->refused);
    if (all->given == all->n) {
        TEST_ASSERT_EQUAL_size_t(0, all->asked_after_end[slot]++);
        return NULL;
    }
    return all->in[slot] = &all->diary[all->given++].task;
}

/* Whatever their number, each shows the same rows in the same order as by itself; in turns, as in
 * a large tree, or not. */
static void test_many_together(void)
{
    static const size_t numbers[] = {
        0, 0, 1, 1, KD_TREE_TOGETHER, 4, KD_TREE_TOGETHER + 1, 9, MANY
    };
    static struct diary one, many[MANY];
    struct dice dice = { 45 };
    for (size_t i = 0; i < sizeof cloud_cases / sizeof *cloud_cases; i++) {
        const struct cloud_case *c = &cloud_cases[i];
        make_cloud(c, &dice);
        struct kd_tree *tree = open_tree(c->what);
        for (size_t j = 0; j < sizeof numbers / sizeof *numbers; j++) {
            struct diaries all = { .diary = many, .n = numbers[j] };
            for (size_t number = 0; number < all.n; number++) {
                double query[KD_TREE_MAX_DIMS] = { 0.0 };
                make_query(number, &dice, query);
                if (number % 5 == 3)
                    query[0] = NAN; /* refused among others */
                begin_diary(&many[number], query);
            }
            tree->large = j % 2 == 0;
            kd_tree_search_many(tree, next_diary, &all);
            TEST_ASSERT_EQUAL_size_t_MESSAGE(all.n, all.given, c->what);
            for (size_t number = 0; number < all.n; number++) {
                begin_diary(&one, many[number].query);
                TEST_ASSERT_EQUAL_MESSAGE(number % 5 != 3, kd_tree_search(tree, &one.task),
                                          c->what);
                TEST_ASSERT_EQUAL_MESSAGE(number % 5 == 3, many[number].task.refused, c->what);
                TEST_ASSERT_EQUAL_size_t_MESSAGE(one.n, many[number].n, c->what);
                if (one.n > 0)
                    TEST_ASSERT_EQUAL_MEMORY_MESSAGE(one.row, many[number].row,
                                                     one.n * sizeof *one.row, c->what);
                TEST_ASSERT_EQUAL_size_t_MESSAGE(one.task.judged, many[number].task.judged,
                                                 c->what);
            }
        }
        kd_tree_close(tree);
    }
}

/* Or it would be no use: of 5 000 points in a cube the nearest is found among 100. */
static void test_most_are_passed_over(void)
{
    static const struct cloud_case cube = { "cube", 5000, 3, 1.0, 0.0, 0 };
    struct dice dice = { 43 };
    size_t shown = 0;
    make_cloud(&cube, &dice);
    struct kd_tree *tree = open_tree(cube.what);
    for (size_t number = 0; number < 200; number++) {
        static struct viewer v;
        double query[3];
        make_query(2, &dice, query);
        search(tree, query, -1.0, &v, cube.what);
        TEST_ASSERT_TRUE(v.shown < 100);
        shown += v.shown;
    }
    TEST_ASSERT_TRUE(shown < 200u * 10u);
    kd_tree_close(tree);
}

/* ---- refusals ----------------------------------------------------------------------------- */

static const struct refused_case {
    const char *what;
    double coordinate;
} refused_cases[] = {
    { "not a number", NAN },
    { "infinite", INFINITY },
    { "minus infinite", -INFINITY },
    { "too far", 1.1e15 },
    { "so far that squares overflow", -1e300 },
};

static void test_refusals(void)
{
    static const struct cloud_case some = { "some", 40, 3, 1.0, 0.0, 0 };
    struct kd_tree_rows rows = {
        .n = 40, .dims = 3, .threads = 1, .point = cloud_point, .rounding = 1e-9
    };
    struct dice dice = { 47 };
    make_cloud(&some, &dice);
    struct kd_tree *tree = open_tree("some"), *untouched = tree;
    for (size_t i = 0; i < sizeof refused_cases / sizeof *refused_cases; i++) {
        const struct refused_case *c = &refused_cases[i];
        struct viewer v = { .radius = 1.0 };
        double query[3] = { 0.1, c->coordinate, 0.2 };
        struct kd_tree_task task = { .query = query, .look = look, .context = &v };
        TEST_ASSERT_FALSE_MESSAGE(kd_tree_search(tree, &task), c->what);
        TEST_ASSERT_EQUAL_size_t_MESSAGE(0, v.shown, c->what);
        double kept = cloud.point[37][2];
        cloud.point[37][2] = c->coordinate;
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_RANGE, kd_tree_open(&rows, &tree), c->what);
        TEST_ASSERT_EQUAL_PTR_MESSAGE(untouched, tree, c->what);
        cloud.point[37][2] = kept;
    }
    rows.n = (size_t)UINT32_MAX + 1;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, kd_tree_open(&rows, &tree));
    kd_tree_close(untouched);
    kd_tree_close(NULL);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_nothing_is_missing);
    RUN_TEST(test_own_measure);
    RUN_TEST(test_many_together);
    RUN_TEST(test_most_are_passed_over);
    RUN_TEST(test_refusals);
    return UNITY_END();
}
