/* svg_labels.h - where labels of points in a chart go without lying on one another. */
#ifndef SKINSPEC_TRIAL_SVG_LABELS_H
#define SKINSPEC_TRIAL_SVG_LABELS_H

#include <stdbool.h>
#include <stddef.h>

struct svg_box {
    double left, top, right, bottom;
};

enum { SVG_BOXES_MAX = 256 };
struct svg_labels {
    struct svg_box inside; /* of the chart */
    size_t n;
    struct svg_box taken[SVG_BOXES_MAX];
};

/* Nothing may lie there. */
void svg_labels_take(struct svg_labels *labels, struct svg_box box);

/* The left end of the baseline of a text so wide, for the point x, y: the nearest of some places
 * around it where it covers least of what is taken; that is taken then.  False, with nothing
 * taken, where it would cover something and need not be there. */
bool svg_labels_place(struct svg_labels *labels, double x, double y, double width, double height,
                      bool must, double *text_x, double *text_y);

#endif
