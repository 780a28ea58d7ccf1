/* map_picture.c - where things stand in a picture, and its rows. */
#include "cube/map_picture.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/number.h"
#include "base/vectors.h"
#include "cube/colour_scale.h"
#include "cube/tiny_font.h"

/* Pixels; letters grow with the picture. */
enum { MARGIN = 8, WIDTH_LEAST = 240, WIDTH_PER_DOT = 640, BAR = 12, GAP = 4 };

/* Tops of what is below the map. */
static size_t title_top(const struct map_picture *p)
{
    return MARGIN + p->lines * p->zoom + MARGIN;
}

static size_t bar_top(const struct map_picture *p)
{
    return title_top(p) + (TINY_FONT_HEIGHT + GAP) * p->dot;
}

static size_t ends_top(const struct map_picture *p)
{
    return bar_top(p) + (BAR + GAP) * p->dot;
}

static size_t inner_width(const struct map_picture *p)
{
    return p->width - (size_t)(2 * MARGIN);
}

void map_picture_init(struct map_picture *p, size_t samples, size_t lines, double lo, double hi,
                      const char *name, const char *meaning)
{
    char text[NUMBER_TEXT_SIZE];
    *p = (struct map_picture){ .samples = samples, .lines = lines, .lo = lo, .hi = hi };
    p->zoom = (WIDTH_LEAST + samples - 1) / samples;
    p->width = p->zoom * samples + (size_t)(2 * MARGIN);
    p->dot = 1 + p->width / WIDTH_PER_DOT;
    p->height = ends_top(p) + TINY_FONT_HEIGHT * p->dot + (size_t)MARGIN;
    snprintf(p->title, sizeof p->title, "%s: %s", name, meaning);
    if (tiny_font_width(p->title) * p->dot > inner_width(p))
        snprintf(p->title, sizeof p->title, "%s", name);
    snprintf(p->end[0], sizeof p->end[0], "%s", number_format(lo, 3, text));
    snprintf(p->end[1], sizeof p->end[1], "%s", number_format(hi, 3, text));
}

void map_picture_palette(unsigned char (*rgb)[3])
{
    static const unsigned char others[][3] = { { 160, 160, 160 }, { 255, 255, 255 }, { 0, 0, 0 } };
    colour_scale_make(PICTURE_MOST + 1, rgb);
    memcpy(rgb + PICTURE_NOTHING, others, sizeof others);
}

bool map_picture_line(const struct map_picture *p, size_t y, size_t *line)
{
    if (y < MARGIN || y >= MARGIN + p->lines * p->zoom)
        return false;
    *line = (y - MARGIN) / p->zoom;
    return true;
}

/* Without branches: values of neighbours are in any order. */
VECTORS_INLINE int index_of(double value, double lo, double per)
{
    double place = (value - lo) * per;
    place = place > PICTURE_LEAST ? place : PICTURE_LEAST; /* NaN is not */
    place = place < PICTURE_MOST ? place : PICTURE_MOST;
    return (int)(value == value ? place : (double)PICTURE_NOTHING);
}

/* Samples that are worked on side by side. */
enum { GROUP = 16 };

VECTORS_INLINE void index_groups(const float *value, size_t n, double lo, double per,
                                 unsigned char *index)
{
    for (size_t i = 0; i < n; i += GROUP) {
        int each[GROUP]; /* narrowed apart: doubles to bytes at once are too much for gcc */
        VECTORS_LOOP
        for (size_t k = 0; k < GROUP; k++)
            each[k] = index_of((double)value[i + k], lo, per);
        for (size_t k = 0; k < GROUP; k++)
            index[i + k] = (unsigned char)each[k];
    }
}

typedef void index_function(const float *value, size_t n, double lo, double per,
                            unsigned char *index);

static void index_plain(const float *value, size_t n, double lo, double per, unsigned char *index)
{
    index_groups(value, n, lo, per, index);
}

VECTORS_AVX2 static void index_avx2(const float *value, size_t n, double lo, double per,
                                    unsigned char *index)
{
    index_groups(value, n, lo, per, index);
}

VECTORS_AVX512 static void index_avx512(const float *value, size_t n, double lo, double per,
                                        unsigned char *index)
{
    index_groups(value, n, lo, per, index);
}

static void map_row(const struct map_picture *p, const float *value, unsigned char *index)
{
    static index_function *const by[VECTORS_KINDS] = { index_plain, index_avx2, index_avx512 };
    double lo = p->lo, per = (PICTURE_MOST + 1) / (p->hi - p->lo);
    size_t whole = p->zoom == 1 ? p->samples / GROUP * GROUP : 0;
    by[vectors_best()](value, whole, lo, per, index);
    for (size_t i = whole; i < p->samples; i++)
        memset(index + i * p->zoom, index_of((double)value[i], lo, per), p->zoom);
}

/* What of a text stands in the row that is `down` pixels below its top. */
static void print(const struct map_picture *p, const char *text, size_t left, size_t down,
                  unsigned char *index)
{
    for (size_t x = 0; x < tiny_font_width(text) * p->dot && left + x < p->width; x++)
        if (tiny_font_dot(text, x / p->dot, down / p->dot))
            index[left + x] = PICTURE_INK;
}

void map_picture_row(const struct map_picture *p, size_t y, const float *value,
                     unsigned char *index)
{
    size_t letters = TINY_FONT_HEIGHT * p->dot, wide = inner_width(p);
    memset(index, PICTURE_PAPER, p->width);
    if (value != NULL) {
        map_row(p, value, index + MARGIN);
    } else if (y >= title_top(p) && y < title_top(p) + letters) {
        print(p, p->title, MARGIN, y - title_top(p), index);
    } else if (y >= bar_top(p) && y < bar_top(p) + BAR * p->dot) {
        for (size_t x = 0; x < wide; x++)
            index[MARGIN + x] = (unsigned char)(x * (PICTURE_MOST + 1) / wide);
    } else if (y >= ends_top(p) && y < ends_top(p) + letters) {
        print(p, p->end[0], MARGIN, y - ends_top(p), index);
        size_t taken = tiny_font_width(p->end[1]) * p->dot;
        print(p, p->end[1], taken < wide ? MARGIN + wide - taken : MARGIN, y - ends_top(p), index);
    }
}

void map_picture_ends(double lo, double hi, double ret[2])
{
    if (!(lo <= hi)) { /* there is nothing to show */
        lo = 0.0;
        hi = 1.0;
    }
    double least = fmax(1e-6, 1e-3 * fmax(fabs(lo), fabs(hi)));
    if (hi - lo < least) {
        lo -= 0.5 * least;
        hi += 0.5 * least;
    }
    /* A twentieth of the whole is seen, so ends stand on the power of ten below that. */
    double grain = pow(10.0, floor(log10((hi - lo) / 5.0)));
    ret[0] = floor(lo / grain) * grain;
    ret[1] = ceil(hi / grain) * grain;
}
