/* svg.c - four charts of points, fronts and labels. */
#include "trial/svg.h"

#include <math.h>
#include <string.h>

#include "trial/csv.h"
#include "trial/svg_labels.h"

enum {
    WIDTH = 1140,
    HEIGHT = 1010,
    CHART_WIDTH = 480,
    CHART_HEIGHT = 350,
    LEFT = 64,
    TOP = 96,
    ACROSS = 556,
    DOWN = 440,
    POINTS_MAX = TRIAL_METHODS_MAX,
    LABEL_SIZE = 64
};
#define LETTER 5.8 /* mean width of one in labels of 11 px */
#define BOLD_LETTER 6.4
#define LABEL_HEIGHT 12.0

/* ---- what stands for what ----------------------------------------------------------- */

/* Okabe and Ito's colours, which the colour-blind tell apart. */
static const char *colour_of(const struct model *model)
{
    static const char *const colours[][2] = {
        { "half-space", "#E69F00" },   { "two-layer", "#0072B2" },   { "kubelka-munk", "#009E73" },
        { "transport-4", "#CC79A7" },  { "transport-8", "#D55E00" }, { "transport-16", "#A03C00" },
        { "transport-32", "#5C2200" }, { "monte-carlo", "#000000" }, { "paper", "#8C8C8C" },
    };
    for (size_t i = 0; i < sizeof colours / sizeof *colours; i++)
        if (strcmp(colours[i][0], model->name) == 0)
            return colours[i][1];
    return "#000000";
}

enum shape {
    SHAPE_CIRCLE,
    SHAPE_DIAMOND,
    SHAPE_SQUARE,
    SHAPE_OPEN_SQUARE,
    SHAPE_TRIANGLE,
    SHAPE_BATCH
};

static const char *const shape_names[] = { "nearest row",        "closed form", "fit",
                                           "fit with intervals", "skin fit",    "fit, in batch" };

static enum shape shape_of(const struct trial_method *m)
{
    if (m->refine == REFINE_NOT)
        return m->rows > 0 ? SHAPE_CIRCLE : SHAPE_DIAMOND;
    if (m->refine == REFINE_SKIN)
        return SHAPE_TRIANGLE;
    if (m->batch)
        return SHAPE_BATCH;
    return m->interval ? SHAPE_OPEN_SQUARE : SHAPE_SQUARE;
}

static void draw_shape(FILE *f, enum shape shape, double x, double y, const char *colour)
{
    switch (shape) {
    case SHAPE_CIRCLE:
        fprintf(f, "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"4\" fill=\"%s\"/>\n", x, y, colour);
        break;
    case SHAPE_DIAMOND:
        fprintf(f, "<path d=\"M%.1f %.1fl6 6l-6 6l-6 -6z\" fill=\"%s\"/>\n", x, y - 6, colour);
        break;
    case SHAPE_TRIANGLE:
        fprintf(f, "<path d=\"M%.1f %.1fl5.5 9.5h-11z\" fill=\"%s\"/>\n", x, y - 6, colour);
        break;
    case SHAPE_BATCH: /* the triangle upside down */
        fprintf(f, "<path d=\"M%.1f %.1fl5.5 -9.5h-11z\" fill=\"%s\"/>\n", x, y + 6, colour);
        break;
    default:
        fprintf(f,
                "<rect x=\"%.1f\" y=\"%.1f\" width=\"8\" height=\"8\" fill=\"%s\" stroke=\"%s\" "
                "stroke-width=\"1.5\"/>\n",
                x - 4, y - 4, shape == SHAPE_OPEN_SQUARE ? "#fff" : colour, colour);
    }
}

/* ---- a chart ------------------------------------------------------------------------ */

struct point {
    double us, error;
    bool front;
    enum shape shape;
    const struct model *model;
    char label[LABEL_SIZE];
};

struct chart {
    const char *title, *error_axis;
    double left, top; /* of the frame */
    size_t n;
    struct point point[POINTS_MAX];
    double x_lo, x_hi, y_lo, y_hi; /* powers of 10 that the axes span */
};

static double place_x(const struct chart *c, double us)
{
    return c->left + CHART_WIDTH * (log10(us) - c->x_lo) / (c->x_hi - c->x_lo);
}

static double place_y(const struct chart *c, double error)
{
    return c->top + CHART_HEIGHT * (c->y_hi - log10(error)) / (c->y_hi - c->y_lo);
}

static void span(struct chart *c)
{
    c->x_lo = c->y_lo = INFINITY;
    c->x_hi = c->y_hi = -INFINITY;
    for (size_t i = 0; i < c->n; i++) {
        c->x_lo = fmin(c->x_lo, log10(c->point[i].us));
        c->x_hi = fmax(c->x_hi, log10(c->point[i].us));
        c->y_lo = fmin(c->y_lo, log10(c->point[i].error));
        c->y_hi = fmax(c->y_hi, log10(c->point[i].error));
    }
    /* Room around the points, and for labels beside the last. */
    double x = 0.06 * (c->x_hi - c->x_lo) + 0.1, y = 0.08 * (c->y_hi - c->y_lo) + 0.02;
    c->x_lo -= x;
    c->x_hi += x;
    c->y_lo -= y;
    c->y_hi += y;
}

static void number_text(double x, char text[32])
{
    if (x < 1e-3)
        snprintf(text, 32, "%.0e", x);
    else
        snprintf(text, 32, "%.10g", x);
}

/* Lines at 1, 2, 5 of each power of ten; numbers at all of them only where there are few. */
static void draw_axes(FILE *f, const struct chart *c)
{
    static const double steps[3] = { 1.0, 2.0, 5.0 };
    bool all_x = c->x_hi - c->x_lo < 3.0, all_y = c->y_hi - c->y_lo < 2.6;
    char text[32];
    fprintf(f,
            "<text x=\"%.0f\" y=\"%.0f\" font-size=\"14\" font-weight=\"bold\">%s</text>\n"
            "<rect x=\"%.0f\" y=\"%.0f\" width=\"%d\" height=\"%d\" fill=\"none\" "
            "stroke=\"#999\"/>\n",
            c->left, c->top - 10, c->title, c->left, c->top, CHART_WIDTH, CHART_HEIGHT);
    for (int power = -8; power <= 8; power++) {
        for (size_t i = 0; i < 3; i++) {
            double v = steps[i] * pow(10.0, power), at = log10(v);
            number_text(v, text);
            if (at > c->x_lo && at < c->x_hi) {
                double x = place_x(c, v);
                fprintf(f, "<path d=\"M%.1f %.0fv%d\" stroke=\"#%s\"/>\n", x, c->top, CHART_HEIGHT,
                        i == 0 ? "ddd" : "f2f2f2");
                if (i == 0 || all_x)
                    fprintf(f, "<text x=\"%.1f\" y=\"%.0f\" text-anchor=\"middle\">%s</text>\n", x,
                            c->top + CHART_HEIGHT + 16, text);
            }
            if (at > c->y_lo && at < c->y_hi) {
                double y = place_y(c, v);
                fprintf(f, "<path d=\"M%.0f %.1fh%d\" stroke=\"#%s\"/>\n", c->left, y, CHART_WIDTH,
                        i == 0 ? "ddd" : "f2f2f2");
                if (i == 0 || all_y)
                    fprintf(f, "<text x=\"%.0f\" y=\"%.1f\" text-anchor=\"end\">%s</text>\n",
                            c->left - 5, y + 4, text);
            }
        }
    }
    fprintf(f,
            "<text x=\"%.0f\" y=\"%.0f\" text-anchor=\"middle\">us a spectrum, one thread</text>\n",
            c->left + 0.5 * CHART_WIDTH, c->top + CHART_HEIGHT + 33);
    fprintf(
        f,
        "<text transform=\"translate(%.0f %.0f) rotate(-90)\" text-anchor=\"middle\">%s</text>\n",
        c->left - 46, c->top + 0.5 * CHART_HEIGHT, c->error_axis);
}

/* Steps: up to the time of the next, nothing is better than this one. */
static void draw_front(FILE *f, const struct chart *c)
{
    const struct point *last = NULL;
    for (;;) { /* in the order of their times */
        const struct point *next = NULL;
        for (size_t i = 0; i < c->n; i++) {
            const struct point *p = &c->point[i];
            if (p->front && (last == NULL || p->us > last->us) &&
                (next == NULL || p->us < next->us))
                next = p;
        }
        if (next == NULL)
            break;
        if (last == NULL)
            fprintf(f,
                    "<path fill=\"none\" stroke=\"#444\" stroke-dasharray=\"4 3\" d=\"M%.1f %.1f",
                    place_x(c, next->us), place_y(c, next->error));
        else
            fprintf(f, "H%.1fV%.1f", place_x(c, next->us), place_y(c, next->error));
        last = next;
    }
    if (last != NULL)
        fputs("\"/>\n", f);
}

static void draw_labels(FILE *f, const struct chart *c)
{
    struct svg_labels labels = { .inside = { c->left, c->top, c->left + CHART_WIDTH,
                                             c->top + CHART_HEIGHT } };
    for (size_t i = 0; i < c->n; i++) {
        double x = place_x(c, c->point[i].us), y = place_y(c, c->point[i].error);
        svg_labels_take(&labels, (struct svg_box){ x - 5, y - 5, x + 5, y + 5 });
    }
    for (size_t i = 0; i < 2 * c->n; i++) { /* the front's first, then those that find room */
        const struct point *p = &c->point[i % c->n];
        double x, y, width = (p->front ? BOLD_LETTER : LETTER) * (double)strlen(p->label);
        if (p->front != (i < c->n) ||
            !svg_labels_place(&labels, place_x(c, p->us), place_y(c, p->error), width, LABEL_HEIGHT,
                              p->front, &x, &y))
            continue;
        fprintf(f,
                "<text x=\"%.1f\" y=\"%.1f\" font-size=\"11\" stroke=\"#fff\" stroke-width=\"3\" "
                "paint-order=\"stroke\" fill=\"%s\"%s>%s</text>\n",
                x, y, p->front ? "#000" : "#777", p->front ? " font-weight=\"bold\"" : "",
                p->label);
    }
}

static void draw_chart(FILE *f, struct chart *c)
{
    if (c->n == 0)
        return;
    span(c);
    draw_axes(f, c);
    draw_front(f, c);
    for (size_t i = 0; i < c->n; i++)
        draw_shape(f, c->point[i].shape, place_x(c, c->point[i].us), place_y(c, c->point[i].error),
                   colour_of(c->point[i].model));
    draw_labels(f, c);
}

/* ---- which points ------------------------------------------------------------------- */

static const char *rows_text(size_t rows, char text[16])
{
    if (rows >= 950000)
        snprintf(text, 16, "%.0f M", (double)rows / 1e6);
    else
        snprintf(text, 16, "%.0f k", (double)rows / 1e3);
    return text;
}

static void label_of(const struct trial_method *m, bool with_model, char label[LABEL_SIZE])
{
    char rows[16] = "";
    const char *model = with_model ? m->model->name : "", *space = with_model ? " " : "";
    if (m->rows > 0)
        rows_text(m->rows, rows);
    if (m->refine == REFINE_NOT && m->rows > 0)
        snprintf(label, LABEL_SIZE, "%s%s%s, %s", model, space, rows, match_by_name(m->by));
    else if (m->refine == REFINE_NOT)
        snprintf(label, LABEL_SIZE, "%s%sclosed form", model, space);
    else
        snprintf(label, LABEL_SIZE, "%s%s%s%s%s%s%s", model, space,
                 m->refine == REFINE_SKIN ? "skin fit" : "fit", m->rows > 0 ? " from " : "", rows,
                 m->batch ? ", in batch" : "", m->kernel == TRIAL_PLAIN ? ", plain" : "");
}

/* Methods of one model on its own spectra, or all (NULL) on transport-32's. */
static void add_methods(struct chart *c, const struct trial *trial, const struct model *model)
{
    for (size_t i = 0; i < trial->results && c->n < POINTS_MAX; i++) {
        const struct trial_result *r = &trial->result[i];
        const struct trial_errors *e = model == NULL ? &r->transport : &r->own;
        if ((model != NULL && r->method.model != model) || isnan(e->times))
            continue;
        struct point *p = &c->point[c->n++];
        *p = (struct point){ .us = r->us,
                             .error = e->times,
                             .front = e->front,
                             .shape = shape_of(&r->method),
                             .model = r->method.model };
        label_of(&r->method, model == NULL, p->label);
    }
}

static void add_models(struct chart *c, const struct trial *trial)
{
    for (size_t i = 0; i < trial->forwards && c->n < POINTS_MAX; i++) {
        const struct trial_forward *f = &trial->forward[i];
        bool quick = f->kind == TRIAL_FORWARD_QUICK;
        if (isnan(f->rms_R) || (f->kind != TRIAL_FORWARD_MODEL && !quick))
            continue;
        struct point *p = &c->point[c->n++];
        *p = (struct point){ .us = f->us,
                             .error = f->rms_R,
                             .front = f->front,
                             .shape = quick ? SHAPE_SQUARE : SHAPE_CIRCLE,
                             .model = f->model };
        trial_forward_name(f, p->label);
    }
}

/* ---- the picture -------------------------------------------------------------------- */

static void draw_head(FILE *f, const struct trial *trial, const char *machine)
{
    fprintf(f,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %d %d\" width=\"%d\" "
            "height=\"%d\" font-family=\"sans-serif\" font-size=\"12\">\n"
            "<rect width=\"100%%\" height=\"100%%\" fill=\"#fff\"/>\n"
            "<text x=\"20\" y=\"26\" font-size=\"17\" font-weight=\"bold\">Error against run time"
            "</text>\n<text x=\"20\" y=\"45\" fill=\"#555\">%s; %zu skins</text>\n",
            WIDTH, HEIGHT, WIDTH, HEIGHT, machine, trial->skins);
}

static void draw_key(FILE *f)
{
    static const char *const models[] = { "half-space",  "two-layer",   "kubelka-munk",
                                          "transport-4", "transport-8", "paper" };
    double x = 24, y = HEIGHT - 40;
    for (size_t i = 0; i < sizeof models / sizeof *models; i++) {
        fprintf(f, "<rect x=\"%.0f\" y=\"%.0f\" width=\"22\" height=\"6\" fill=\"%s\"/>\n", x,
                y - 7, colour_of(model_find(models[i])));
        fprintf(f, "<text x=\"%.0f\" y=\"%.0f\">%s</text>\n", x + 27, y, models[i]);
        x += 50 + 7 * (double)strlen(models[i]);
    }
    x = 24;
    y += 22;
    for (size_t i = 0; i < sizeof shape_names / sizeof *shape_names; i++) {
        draw_shape(f, (enum shape)i, x + 6, y - 4, "#444");
        fprintf(f, "<text x=\"%.0f\" y=\"%.0f\">%s</text>\n", x + 18, y, shape_names[i]);
        x += 44 + 6.4 * (double)strlen(shape_names[i]);
    }
    fprintf(f,
            "<path d=\"M%.0f %.0fh26\" stroke=\"#444\" stroke-dasharray=\"4 3\"/>"
            "<text x=\"%.0f\" y=\"%.0f\">nothing tried is both quicker and better</text>\n",
            x, y - 4, x + 32, y);
}

void trial_svg(FILE *stream, const struct trial *trial, const char *machine)
{
    static const char times[] = "error: times what noise allows (worst of Cm, Bm, Ch)";
    struct chart charts[] = {
        { .title = "Spectra and fit by the half space", .error_axis = times },
        { .title = "Spectra and fit by two layers", .error_axis = times },
        { .title = "Spectra by transport-32, all methods", .error_axis = times },
        { .title = "The models against transport-32",
          .error_axis = "rms of R; transport-32 itself against 64 streams" },
    };
    add_methods(&charts[0], trial, model_find("half-space"));
    add_methods(&charts[1], trial, model_find("two-layer"));
    add_methods(&charts[2], trial, NULL);
    add_models(&charts[3], trial);
    draw_head(stream, trial, machine);
    for (size_t i = 0; i < sizeof charts / sizeof *charts; i++) {
        charts[i].left = LEFT + (double)(i % 2) * ACROSS;
        charts[i].top = TOP + (i < 2 ? 0.0 : DOWN);
        draw_chart(stream, &charts[i]);
    }
    draw_key(stream);
    fputs("</svg>\n", stream);
}
