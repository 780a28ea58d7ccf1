/* cube_file.c - which file has the data, whether it has all of it, and parts of it. */
#include "cli/cube_file.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <nettle/sha2.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

#include "base/log.h"

/* A header of ENVI_MAX_BANDS wavelengths, names and more has some 200 kB. */
enum { HEADER_MOST = 4 << 20 };

/* ---- the header --------------------------------------------------------------------- */

static void hash(const void *bytes, size_t n, char ret[CUBE_HASH_SIZE])
{
    struct sha256_ctx sha;
    uint8_t digest[SHA256_DIGEST_SIZE];
    sha256_init(&sha);
    sha256_update(&sha, n, bytes);
    sha256_digest(&sha, sizeof digest, digest);
    for (size_t i = 0; i < sizeof digest; i++)
        snprintf(ret + 2 * i, 3, "%02x", digest[i]);
}

static enum status parse_header(const char *text, size_t n, struct cube_file *cube)
{
    struct envi_fault fault;
    enum status s = envi_header_parse(text, n, &cube->header, &fault);
    if (s != STATUS_OK && fault.line > 0)
        log_error("%s:%zu: %s", cube->path, fault.line, fault.text);
    else if (s != STATUS_OK)
        log_error("%s: %s", cube->path, fault.text);
    hash(text, n, cube->header_hash);
    return s;
}

static enum status read_header(struct cube_file *cube)
{
    FILE *file = fopen(cube->path, "rb");
    char *text = malloc(HEADER_MOST);
    enum status s = STATUS_NO_MEMORY;
    if (file == NULL) {
        log_error("cannot read %s: %s", cube->path, strerror(errno));
        s = STATUS_IO;
    } else if (text != NULL) {
        size_t n = fread(text, 1, HEADER_MOST, file);
        s = STATUS_IO;
        if (ferror(file) || fstat(fileno(file), &cube->header_stat) != 0)
            log_error("cannot read %s: %s", cube->path, strerror(errno));
        else if (n == HEADER_MOST)
            log_error("%s: this is no ENVI header, it has more than %d bytes", cube->path,
                      (int)HEADER_MOST);
        else
            s = parse_header(text, n, cube);
    }
    if (file != NULL)
        fclose(file);
    free(text);
    return s;
}

/* ---- the data ----------------------------------------------------------------------- */

static enum status find_data(struct cube_file *cube)
{
    static const char *const endings[] = { "", ".img", ".dat", ".raw", ".bil", ".bip", ".bsq" };
    size_t n = strlen(cube->path);
    int stem = n > 4 && strcasecmp(cube->path + n - 4, ".hdr") == 0 ? (int)n - 4 : (int)n;
    char name[CUBE_PATH_SIZE];
    struct stat there;
    cube->data_path[0] = '\0';
    for (size_t i = stem == (int)n ? 1 : 0; i < sizeof endings / sizeof *endings; i++) {
        int length = snprintf(name, sizeof name, "%.*s%s", stem, cube->path, endings[i]);
        if (length >= (int)sizeof name || stat(name, &there) != 0 || !S_ISREG(there.st_mode))
            continue;
        if (cube->data_path[0] != '\0') {
            log_error("%s: %s and %s are both there; say which one has the data (--data FILE)",
                      cube->path, cube->data_path, name);
            return STATUS_EXISTS;
        }
        memcpy(cube->data_path, name, (size_t)length + 1);
    }
    if (cube->data_path[0] != '\0')
        return STATUS_OK;
    log_error("%s: there is no %.*s, nor with .img, .dat, .raw, .bil, .bip or .bsq; say where the "
              "data are (--data FILE)",
              cube->path, stem, cube->path);
    return STATUS_NOT_FOUND;
}

static enum status open_data(struct cube_file *cube)
{
    uint64_t wanted = cube->header.offset + envi_data_size(&cube->header);
    cube->fd = open(cube->data_path, O_RDONLY | O_CLOEXEC);
    if (cube->fd < 0 || fstat(cube->fd, &cube->data_stat) != 0) {
        log_error("cannot read %s: %s", cube->data_path, strerror(errno));
        return STATUS_IO;
    }
    if (!S_ISREG(cube->data_stat.st_mode)) {
        log_error("%s is no regular file; a cube is read in pieces, so it must be one",
                  cube->data_path);
        return STATUS_IO;
    }
    uint64_t there = (uint64_t)cube->data_stat.st_size;
    if (there < wanted) {
        log_error("%s is cut short: the header asks for %" PRIu64 " bytes, there are %" PRIu64,
                  cube->data_path, wanted, there);
        return STATUS_DAMAGED;
    }
    if (there > wanted)
        log_warning("%s has %" PRIu64 " bytes more than the header asks for; are samples, lines, "
                    "bands and data type right?",
                    cube->data_path, there - wanted);
    return STATUS_OK;
}

enum status cube_file_open(const char *path, const char *data_path, struct cube_file *ret)
{
    ret->path = path;
    ret->fd = -1;
    enum status s = read_header(ret);
    if (s == STATUS_NO_MEMORY)
        log_error("%s", status_text(s));
    if (s != STATUS_OK)
        return s;
    if (data_path == NULL) {
        s = find_data(ret);
    } else if (snprintf(ret->data_path, sizeof ret->data_path, "%s", data_path) >=
               (int)sizeof ret->data_path) {
        log_error("%s: the name is too long", data_path);
        s = STATUS_RANGE;
    }
    return s == STATUS_OK ? open_data(ret) : s;
}

void cube_file_close(struct cube_file *cube)
{
    if (cube->fd >= 0)
        close(cube->fd);
    cube->fd = -1;
}

/* ---- parts of it -------------------------------------------------------------------- */

static size_t span(const struct band_grid *g)
{
    return g->band[g->used - 1] - g->band[0] + 1;
}

size_t cube_file_scratch(const struct cube_file *cube, const struct band_grid *grid,
                         const struct cube_part *part)
{
    const struct envi_header *h = &cube->header;
    size_t bands = h->interleave == ENVI_BIP   ? h->bands
                   : h->interleave == ENVI_BIL ? span(grid)
                                               : 1;
    size_t lines = h->interleave == ENVI_BIL ? 1 : part->lines;
    return lines * part->samples * bands * envi_value_size(h->type);
}

static enum status read_bytes(const struct cube_file *cube, uint64_t at, size_t n,
                              unsigned char *ret)
{
    while (n > 0) {
        ssize_t got = pread(cube->fd, ret, n, (off_t)at);
        if (got < 0 && errno == EINTR)
            continue;
        if (got <= 0) {
            log_error("cannot read %s at byte %" PRIu64 ": %s", cube->data_path, at,
                      got < 0 ? strerror(errno) : "it ends there now, it was longer before");
            return STATUS_IO;
        }
        at += (uint64_t)got;
        ret += got;
        n -= (size_t)got;
    }
    return STATUS_OK;
}

/* All used bands of a line lie together. */
static enum status read_bil(const struct cube_file *cube, const struct band_grid *g,
                            const struct cube_part *part, unsigned char *scratch, size_t row,
                            float *ret)
{
    const struct envi_header *h = &cube->header;
    size_t size = envi_value_size(h->type), bytes = part->samples * size;
    bool whole = part->samples == h->samples;
    enum status s = STATUS_OK;
    for (size_t line = 0; line < part->lines && s == STATUS_OK; line++) {
        uint64_t at = envi_place(h, part->line + line, part->sample, g->band[0]);
        if (whole)
            s = read_bytes(cube, at, span(g) * bytes, scratch);
        for (size_t i = 0; i < g->used && s == STATUS_OK; i++) {
            size_t band = g->band[i] - g->band[0];
            const unsigned char *from = scratch + band * bytes;
            if (!whole) {
                from = scratch;
                s = read_bytes(cube, at + (uint64_t)band * h->samples * size, bytes, scratch);
            }
            if (s == STATUS_OK)
                envi_values(h, from, part->samples, 1, ret + i * row + line * part->samples);
        }
    }
    return s;
}

/* The bands of a pixel lie together: a few pixels at a time, so that what was fetched for one band
 * is still at hand for the next. */
static enum status read_bip(const struct cube_file *cube, const struct band_grid *g,
                            const struct cube_part *part, unsigned char *scratch, size_t row,
                            float *ret)
{
    enum { AT_A_TIME = 64 };
    const struct envi_header *h = &cube->header;
    size_t size = envi_value_size(h->type), n = part->lines * part->samples;
    enum status s =
        read_bytes(cube, envi_place(h, part->line, part->sample, 0), n * h->bands * size, scratch);
    for (size_t x = 0; x < n && s == STATUS_OK; x += AT_A_TIME)
        for (size_t i = 0; i < g->used; i++)
            envi_values(h, scratch + (x * h->bands + g->band[i]) * size,
                        n - x < AT_A_TIME ? n - x : AT_A_TIME, h->bands, ret + i * row + x);
    return s;
}

/* A band's lines lie together. */
static enum status read_bsq(const struct cube_file *cube, const struct band_grid *g,
                            const struct cube_part *part, unsigned char *scratch, size_t row,
                            float *ret)
{
    const struct envi_header *h = &cube->header;
    size_t n = part->lines * part->samples;
    enum status s = STATUS_OK;
    for (size_t i = 0; i < g->used && s == STATUS_OK; i++) {
        s = read_bytes(cube, envi_place(h, part->line, part->sample, g->band[i]),
                       n * envi_value_size(h->type), scratch);
        if (s == STATUS_OK)
            envi_values(h, scratch, n, 1, ret + i * row);
    }
    return s;
}

enum status cube_file_read(const struct cube_file *cube, const struct band_grid *grid,
                           const struct cube_part *part, unsigned char *scratch, size_t row,
                           float *ret)
{
    switch (cube->header.interleave) {
    case ENVI_BIL:
        return read_bil(cube, grid, part, scratch, row, ret);
    case ENVI_BIP:
        return read_bip(cube, grid, part, scratch, row, ret);
    case ENVI_BSQ:
        break;
    }
    return read_bsq(cube, grid, part, scratch, row, ret);
}

void cube_file_expect(const struct cube_file *cube, const struct band_grid *grid, size_t line,
                      size_t lines)
{
    const struct envi_header *h = &cube->header;
    size_t size = envi_value_size(h->type), pieces = h->interleave == ENVI_BSQ ? grid->used : 1;
    size_t bands = h->interleave == ENVI_BSQ ? 1 : h->bands;
    for (size_t i = 0; i < pieces; i++) {
        size_t band = h->interleave == ENVI_BSQ ? grid->band[i] : 0;
        (void)posix_fadvise(cube->fd, (off_t)envi_place(h, line, 0, band),
                            (off_t)(lines * h->samples * bands * size), POSIX_FADV_WILLNEED);
    }
}
