/* png_file.c - libpng, whose errors jump out of it, for all but the pixels: its zlib takes longer
 * for them than the fit. */
#include "cli/png_file.h"

#include <errno.h>
#include <png.h>
#include <setjmp.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "cube/deflate_runs.h"

static void be_silent(png_structp png, png_const_charp text)
{
    (void)png;
    (void)text;
}

/* Out of libpng, with errno as it is. */
static void jump_out(png_structp png, png_const_charp text)
{
    (void)text;
    png_longjmp(png, 1);
}

/* Bytes of the rows, before and after they are made small. */
struct rows {
    struct deflate_runs deflate;
    unsigned char in[DEFLATE_RUNS_IN], out[DEFLATE_RUNS_OUT];
    size_t n; /* in in[] */
    size_t width, height;
    unsigned char *index; /* [width + 1]: a row, and before it that it has no filter */
};

static void give_out(png_structp png, struct rows *r, bool last)
{
    size_t n = deflate_runs_add(&r->deflate, r->in, r->n, last, r->out);
    png_write_chunk(png, (png_const_bytep) "IDAT", r->out, n);
    r->n = 0;
}

static void take_row(png_structp png, struct rows *r, bool last)
{
    for (size_t from = 0; from <= r->width;) {
        size_t room = sizeof r->in - r->n, left = r->width + 1 - from;
        size_t n = left < room ? left : room;
        memcpy(r->in + r->n, r->index + from, n);
        r->n += n;
        from += n;
        if (r->n == sizeof r->in || (last && from > r->width))
            give_out(png, r, last && from > r->width);
    }
}

/* All that is written between setjmp() and the end, in a function without locals that change. */
static enum status write_all(png_structp png, png_infop info, struct rows *r, png_file_row *row,
                             void *context)
{
    if (setjmp(png_jmpbuf(png)) != 0)
        return errno == ENOSPC || errno == EDQUOT || errno == EFBIG ? STATUS_FULL : STATUS_IO;
    png_write_info(png, info);
    for (size_t y = 0; y < r->height; y++) {
        enum status s = row(y, r->index + 1, context);
        if (s != STATUS_OK)
            return s;
        take_row(png, r, y + 1 == r->height);
    }
    png_write_chunk(png, (png_const_bytep) "IEND", NULL, 0);
    return STATUS_OK;
}

static enum status describe(png_structp png, png_infop info, FILE *stream, size_t width,
                            size_t height, const unsigned char (*rgb)[3], size_t colours)
{
    png_color palette[256];
    if (setjmp(png_jmpbuf(png)) != 0)
        return STATUS_RANGE;
    for (size_t i = 0; i < colours; i++)
        palette[i] = (png_color){ rgb[i][0], rgb[i][1], rgb[i][2] };
    png_init_io(png, stream);
    png_set_user_limits(png, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
    png_set_IHDR(png, info, (png_uint_32)width, (png_uint_32)height, 8, PNG_COLOR_TYPE_PALETTE,
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_PLTE(png, info, palette, (int)colours);
    png_set_sRGB(png, info, PNG_sRGB_INTENT_RELATIVE);
    return STATUS_OK;
}

enum status png_file_write(FILE *stream, size_t width, size_t height, const unsigned char (*rgb)[3],
                           size_t colours, png_file_row *row, void *context)
{
    if (width > PNG_UINT_31_MAX || height > PNG_UINT_31_MAX)
        return STATUS_RANGE;
    struct rows *r = malloc(sizeof *r);
    unsigned char *index = malloc(width + 1);
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, jump_out, be_silent);
    png_infop info = png != NULL ? png_create_info_struct(png) : NULL;
    enum status s = r != NULL && index != NULL && info != NULL ? STATUS_OK : STATUS_NO_MEMORY;
    if (s == STATUS_OK)
        s = describe(png, info, stream, width, height, rgb, colours);
    if (s == STATUS_OK) {
        deflate_runs_begin(&r->deflate);
        r->n = 0;
        r->width = width;
        r->height = height;
        r->index = index;
        index[0] = PNG_FILTER_VALUE_NONE;
        s = write_all(png, info, r, row, context);
    }
    png_destroy_write_struct(&png, &info);
    free(index);
    free(r);
    return s;
}
