/* map_picture.h - a map of numbers as a picture: the map, below it a name, a bar of the colours,
 * and what its ends stand for.
 *
 * Row by row, each pixel an index into a palette: from PICTURE_LEAST, at the bar's left end, to
 * PICTURE_MOST at its right; what lies beyond the ends has their colours, and PICTURE_NOTHING
 * (grey) is what is no number.  A map of few samples is enlarged by whole pixels. */
#ifndef SKINSPEC_CUBE_MAP_PICTURE_H
#define SKINSPEC_CUBE_MAP_PICTURE_H

#include <stdbool.h>
#include <stddef.h>

enum {
    PICTURE_LEAST = 0,
    PICTURE_MOST = 249,
    PICTURE_NOTHING,
    PICTURE_PAPER,
    PICTURE_INK,
    PICTURE_COLOURS
};

struct map_picture {
    size_t samples, lines; /* of the map */
    double lo, hi;         /* lo < hi: values of the bar's ends */
    /* Made by map_picture_init(): */
    size_t zoom;               /* pixels a sample and a line */
    size_t width, height, dot; /* of the picture; of a dot of its letters */
    char title[80], end[2][24];
};

/* name[0] with as much of what it stands for as there is room: "Cm", "melanin ...". */
void map_picture_init(struct map_picture *p, size_t samples, size_t lines, double lo, double hi,
                      const char *name, const char *meaning);

/* 8-bit sRGB of each index. */
void map_picture_palette(unsigned char (*rgb)[3]);

/* Which line of the map row y shows; false where it shows none. */
bool map_picture_line(const struct map_picture *p, size_t y, size_t *line);

/* Row y into index[width]; value[samples]: that line, or NULL. */
void map_picture_row(const struct map_picture *p, size_t y, const float *value,
                     unsigned char *index);

/* Ends for a bar that shows values from lo to hi: apart, and of few digits. */
void map_picture_ends(double lo, double hi, double ret[2]);

#endif
