/* svg_labels.c - places tried one after the other. */
#include "trial/svg_labels.h"

#include <math.h>

void svg_labels_take(struct svg_labels *labels, struct svg_box box)
{
    if (labels->n < SVG_BOXES_MAX)
        labels->taken[labels->n++] = box;
}

static double overlap(const struct svg_box *a, const struct svg_box *b)
{
    double width = fmin(a->right, b->right) - fmax(a->left, b->left);
    double height = fmin(a->bottom, b->bottom) - fmax(a->top, b->top);
    return width > 0.0 && height > 0.0 ? width * height : 0.0;
}

static double outside(const struct svg_box *box, const struct svg_box *inside)
{
    double area = (box->right - box->left) * (box->bottom - box->top);
    return area - overlap(box, inside);
}

bool svg_labels_place(struct svg_labels *labels, double x, double y, double width, double height,
                      bool must, double *text_x, double *text_y)
{
    /* Side of the point (right, left, middle), and how far up or down, heights. */
    static const double places[][2] = { { 1, -0.3 }, { -1, -0.3 }, { 0, -1.2 },  { 0, 1.2 },
                                        { 1, -1.2 }, { 1, 0.9 },   { -1, -1.2 }, { -1, 0.9 },
                                        { 1, -2.3 }, { -1, 2.0 },  { 1, 2.0 },   { -1, -2.3 },
                                        { 0, -2.4 }, { 0, 2.4 },   { 1, -3.5 },  { -1, 3.2 },
                                        { 0, -3.6 }, { 0, 3.6 },   { 0, -5.0 },  { 0, 5.0 } };
    enum { NEAR = 8 }; /* one that need not be there would belong to nothing farther off */
    struct svg_box best = { 0 };
    double least = INFINITY;
    size_t n = must ? sizeof places / sizeof *places : NEAR;
    for (size_t i = 0; i < n; i++) {
        double left = places[i][0] > 0.0   ? x + 8.0
                      : places[i][0] < 0.0 ? x - 8.0 - width
                                           : x - 0.5 * width;
        double middle = y + places[i][1] * height;
        struct svg_box box = { left, middle - 0.5 * height, left + width, middle + 0.5 * height };
        double bad = 100.0 * outside(&box, &labels->inside) + 0.01 * (double)i;
        for (size_t k = 0; k < labels->n; k++)
            bad += overlap(&box, &labels->taken[k]);
        if (bad < least) {
            least = bad;
            best = box;
        }
    }
    if (!must && least > 1.0)
        return false;
    svg_labels_take(labels, best);
    *text_x = best.left;
    *text_y = best.bottom - 0.22 * height;
    return true;
}
