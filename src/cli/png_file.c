/* png_file.c - libpng, whose errors jump out of it. */
#include "cli/png_file.h"

#include <errno.h>
#include <png.h>
#include <setjmp.h>
#include <stdint.h>
#include <stdlib.h>

/* Maps of measured skin are noisy: looking for more than runs of one colour finds little.  And to
 * make them a fifth smaller takes as long as a quarter of the fits of a million pixels: large ones
 * are stored as they are. */
enum { STRATEGY = 3 /* zlib's Z_RLE */, LEVEL = 6, STORED = 0, LARGE = 1 << 18 /* pixels */ };

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

/* All that is written between setjmp() and the end, in a function without locals that change. */
static enum status write_all(png_structp png, png_infop info, unsigned char *index, size_t height,
                             png_file_row *row, void *context)
{
    if (setjmp(png_jmpbuf(png)) != 0)
        return errno == ENOSPC || errno == EDQUOT || errno == EFBIG ? STATUS_FULL : STATUS_IO;
    png_write_info(png, info);
    for (size_t y = 0; y < height; y++) {
        enum status s = row(y, index, context);
        if (s != STATUS_OK)
            return s;
        png_write_row(png, index);
    }
    png_write_end(png, info);
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
    png_set_compression_strategy(png, STRATEGY);
    png_set_compression_level(png, width * height >= LARGE ? STORED : LEVEL);
    png_set_check_for_invalid_index(png, 0); /* rows give none: a look at every pixel */
    png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_NONE);
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
    unsigned char *index = malloc(width);
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, jump_out, be_silent);
    png_infop info = png != NULL ? png_create_info_struct(png) : NULL;
    enum status s = index != NULL && info != NULL ? STATUS_OK : STATUS_NO_MEMORY;
    if (s == STATUS_OK)
        s = describe(png, info, stream, width, height, rgb, colours);
    if (s == STATUS_OK)
        s = write_all(png, info, index, height, row, context);
    png_destroy_write_struct(&png, &info);
    free(index);
    return s;
}
