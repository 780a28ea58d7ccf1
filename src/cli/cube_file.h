/* cube_file.h - an ENVI cube opened: its header, and parts of its values.
 *
 * Memory is the caller's and of the size of a part; reading is by pread(), so that many threads may
 * read at a time. */
#ifndef SKINSPEC_CLI_CUBE_FILE_H
#define SKINSPEC_CLI_CUBE_FILE_H

#include <stddef.h>
#include <stdint.h>
#include <sys/stat.h>

#include "base/status.h"
#include "cube/band_grid.h"
#include "cube/envi_header.h"

enum { CUBE_PATH_SIZE = 4096, CUBE_HASH_SIZE = 65 };

struct cube_file {
    const char *path; /* of the header */
    char data_path[CUBE_PATH_SIZE];
    char header_hash[CUBE_HASH_SIZE]; /* SHA-256 of its bytes, hexadecimal */
    struct envi_header header;
    struct stat header_stat, data_stat;
    int fd;
};

/* The header at path; the data at data_path or, where that is NULL, in the file of the header's
 * name without .hdr, or with .img, .dat, .raw, .bil, .bip or .bsq in its place.  All errors are
 * logged. */
enum status cube_file_open(const char *path, const char *data_path, struct cube_file *ret);
void cube_file_close(struct cube_file *cube);

/* Lines `line` .. + lines of samples `sample` .. + samples; more than one line only with all of
 * the samples. */
struct cube_part {
    size_t line, lines, sample, samples;
};

/* Bytes of scratch that reading such a part takes. */
size_t cube_file_scratch(const struct cube_file *cube, const struct band_grid *grid,
                         const struct cube_part *part);

/* The used bands of the grid, as they stand in the file: ret[used] rows of the part's pixels, `row`
 * floats apart.  STATUS_IO, logged. */
enum status cube_file_read(const struct cube_file *cube, const struct band_grid *grid,
                           const struct cube_part *part, unsigned char *scratch, size_t row,
                           float *ret);

/* Those lines will be read soon. */
void cube_file_expect(const struct cube_file *cube, const struct band_grid *grid, size_t line,
                      size_t lines);

#endif
