/* envi_header.h - the text that says how the values of a hyperspectral cube lie in its file.
 * [ENVI] NV5 Geospatial, ENVI header files,
 * https://www.nv5geospatialsoftware.com/docs/enviheaderfiles.html
 *
 *   field                     taken                                     where it is missing
 *   samples, lines, bands     1 ..; bands to ENVI_MAX_BANDS             refused
 *   header offset             bytes before the first value              0
 *   data type                 4 (float32), 12 (uint16)                  refused
 *   interleave                bil, bip, bsq                             refused
 *   byte order                0 (least significant first), 1            refused
 *   wavelength                one a band, increasing                    refused
 *   wavelength units          nanometers, micrometers (nm, um)          told by size
 *   reflectance scale factor  what stands for R = 1, above 0            NAN
 *   data ignore value         what stands for nothing measured          has_ignore false
 *   bbl                       0: a bad band                             all are good
 * Names are read without regard to case and to how many spaces there are; lines that begin with ';'
 * are comments; a value in braces may go over several lines.  What would change the values
 * (gain, offset, compression, frame offsets) is refused; any other field is passed over. */
#ifndef SKINSPEC_CUBE_ENVI_HEADER_H
#define SKINSPEC_CUBE_ENVI_HEADER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/status.h"

enum { ENVI_MAX_BANDS = 4096 };

enum envi_type { ENVI_FLOAT32 = 4, ENVI_UINT16 = 12 };
enum envi_interleave { ENVI_BIL, ENVI_BIP, ENVI_BSQ };

struct envi_header {
    size_t samples, lines, bands;
    uint64_t offset; /* bytes */
    enum envi_type type;
    enum envi_interleave interleave;
    bool big_endian;
    double nm[ENVI_MAX_BANDS]; /* increasing */
    bool bad[ENVI_MAX_BANDS];
    double scale; /* NAN: not said */
    bool has_ignore;
    double ignore;
};

/* What is wrong, in a sentence for people without full stop, and in which line (0: none). */
struct envi_fault {
    size_t line;
    char text[240];
};

/* The n bytes of a header.  STATUS_FORMAT: no header, or not one that can be followed;
 * STATUS_UNSUPPORTED: one that says what is not taken here.  *fault is then filled. */
enum status envi_header_parse(const char *text, size_t n, struct envi_header *ret,
                              struct envi_fault *fault);

/* "bil" "bip" "bsq"; bytes of one value. */
const char *envi_interleave_name(enum envi_interleave interleave);
size_t envi_value_size(enum envi_type type);

/* Bytes of all values; UINT64_MAX where that is no number of bytes that a file can have. */
uint64_t envi_data_size(const struct envi_header *h);

/* Where the value of a line, a sample and a band begins, in bytes from the file's start.  For a
 * header whose envi_data_size() is one. */
uint64_t envi_place(const struct envi_header *h, size_t line, size_t sample, size_t band);

/* n values of the file as floats, every stride-th of those from bytes on, which need no
 * alignment. */
void envi_values(const struct envi_header *h, const void *bytes, size_t n, size_t stride,
                 float *ret);

#endif
