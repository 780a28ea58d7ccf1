/* png_file.h - a picture of indexed colours, written row by row as PNG. */
#ifndef SKINSPEC_CLI_PNG_FILE_H
#define SKINSPEC_CLI_PNG_FILE_H

#include <stddef.h>
#include <stdio.h>

#include "base/status.h"

/* Gives row y: index[width].  Another status than STATUS_OK ends the picture. */
typedef enum status png_file_row(size_t y, unsigned char *index, void *context);

/* sRGB colours rgb[colours], at most 256.  STATUS_RANGE: larger than a PNG can be;
 * STATUS_NO_MEMORY; STATUS_IO: the stream has an error; or what a row gave. */
enum status png_file_write(FILE *stream, size_t width, size_t height, const unsigned char (*rgb)[3],
                           size_t colours, png_file_row *row, void *context);

#endif
