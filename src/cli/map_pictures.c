/* map_pictures.c - each band by itself, read once for its quantiles twice, once for its rows. */
#include "cli/map_pictures.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>

#include "base/log.h"
#include "base/parallel.h"
#include "cli/new_file.h"
#include "cli/png_file.h"
#include "cube/map_picture.h"
#include "cube/quantiles.h"

/* Values of a band that are read at a time; a line at least. */
enum { AT_A_TIME = 1 << 16 };

struct work {
    const struct map_file *file;
    const struct map_fit *fit;
    bool pictures;
    struct map_contents *contents;
    unsigned char palette[PICTURE_COLOURS][3];
};

/* A band, some lines at a time. */
struct band_reader {
    const struct map_file *file;
    size_t band, line, lines; /* which are in value[] */
    size_t most;
    float *value;
};

static enum status reader_open(const struct map_file *file, size_t band, struct band_reader *r)
{
    size_t most = AT_A_TIME / file->samples;
    *r = (struct band_reader){ .file = file, .band = band, .most = most > 0 ? most : 1 };
    r->value = malloc(r->most * file->samples * sizeof *r->value);
    return r->value != NULL ? STATUS_OK : STATUS_NO_MEMORY;
}

/* The lines from this one on; at the end none. */
static enum status reader_take(struct band_reader *r, size_t line)
{
    size_t left = r->file->lines - line;
    r->line = line;
    r->lines = left < r->most ? left : r->most;
    return map_file_read(r->file, r->band, r->line, r->lines, r->value);
}

void map_pictures_path(const char *prefix, const struct map_fit *fit, size_t band,
                       char path[MAP_PICTURES_PATH_SIZE])
{
    snprintf(path, MAP_PICTURES_PATH_SIZE, "%s-%s.png", prefix, map_fit_band_name(fit, band));
}

/* ---- what is in it ------------------------------------------------------------------ */

static enum status count_flags(const struct work *w, struct band_reader *r)
{
    struct map_contents *c = w->contents;
    size_t samples = w->file->samples;
    for (size_t line = 0; line < w->file->lines; line += r->lines) {
        enum status s = reader_take(r, line);
        if (s != STATUS_OK)
            return s;
        for (size_t i = 0; i < r->lines * samples; i++) {
            unsigned flags = (unsigned)r->value[i];
            c->fitted += (flags & (unsigned)MAP_MASKED) == 0 ? 1u : 0u;
            for (size_t k = 0; flags >> k != 0; k++)
                c->flagged[k] += flags >> k & 1u;
        }
    }
    c->pixels = (uint64_t)samples * w->file->lines;
    return STATUS_OK;
}

static enum status find_quantiles(struct band_reader *r, struct quantiles *q, struct map_band *ret)
{
    static const double shares[] = { 0.01, 0.5, 0.99 };
    size_t samples = r->file->samples;
    quantiles_begin(q, shares, 3);
    for (int pass = 0; pass < 2; pass++) {
        for (size_t line = 0; line < r->file->lines; line += r->lines) {
            enum status s = reader_take(r, line);
            if (s != STATUS_OK)
                return s;
            if (pass == 0)
                quantiles_first(q, r->value, r->lines * samples);
            else
                quantiles_second(q, r->value, r->lines * samples);
        }
        if (pass == 0)
            quantiles_between(q);
    }
    ret->lo = quantiles_end(q, 0);
    ret->median = quantiles_end(q, 1);
    ret->hi = quantiles_end(q, 2);
    if (isnan(ret->range[0]))
        map_picture_ends(ret->lo, ret->hi, ret->range);
    return STATUS_OK;
}

/* ---- its picture -------------------------------------------------------------------- */

struct painter {
    struct map_picture picture;
    struct band_reader *reader;
};

static enum status paint_row(size_t y, unsigned char *index, void *context)
{
    struct painter *p = context;
    struct band_reader *r = p->reader;
    const float *value = NULL;
    enum status s = STATUS_OK;
    size_t line;
    if (map_picture_line(&p->picture, y, &line)) {
        if (line < r->line || line >= r->line + r->lines)
            s = reader_take(r, line);
        value = r->value + (line - r->line) * r->file->samples;
    }
    if (s == STATUS_OK)
        map_picture_row(&p->picture, y, value, index);
    return s;
}

static enum status paint(const struct work *w, struct band_reader *r)
{
    const double *range = w->contents->band[r->band].range;
    struct painter p = { .reader = r };
    struct new_file file;
    char path[MAP_PICTURES_PATH_SIZE];
    map_pictures_path(w->file->prefix, w->fit, r->band, path);
    map_picture_init(&p.picture, w->file->samples, w->file->lines, range[0], range[1],
                     map_fit_band_name(w->fit, r->band), map_fit_band_meaning(w->fit, r->band));
    r->lines = 0;
    enum status s = new_file_begin(path, w->file->replace || w->file->go_on, &file);
    if (s != STATUS_OK)
        return s;
    s = png_file_write(file.stream, p.picture.width, p.picture.height,
                       (const unsigned char(*)[3])w->palette, PICTURE_COLOURS, paint_row, &p);
    if (s == STATUS_RANGE)
        log_error("%s: %zu by %zu pixels are more than a PNG can have; --no-pictures leaves them "
                  "out",
                  path, p.picture.width, p.picture.height);
    if (s != STATUS_OK && ferror(file.stream))
        log_error("cannot write %s: %s", path, status_text(s));
    enum status kept = new_file_end(&file, s == STATUS_OK);
    return s != STATUS_OK ? s : kept;
}

static enum status make_band(size_t band, unsigned worker, void *context)
{
    struct work *w = context;
    struct band_reader reader;
    (void)worker;
    enum status s = reader_open(w->file, band, &reader);
    if (s != STATUS_OK)
        return s;
    struct quantiles *q = malloc(sizeof *q);
    if (band + 1 == map_fit_bands(w->fit))
        s = count_flags(w, &reader);
    else
        s = q != NULL ? find_quantiles(&reader, q, &w->contents->band[band]) : STATUS_NO_MEMORY;
    if (s == STATUS_OK && w->pictures && band + 1 < map_fit_bands(w->fit))
        s = paint(w, &reader);
    free(q);
    free(reader.value);
    return s;
}

enum status map_pictures_make(const struct map_file *file, const struct map_fit *fit, bool pictures,
                              unsigned threads, struct map_contents *contents)
{
    struct work w = { .file = file, .fit = fit, .pictures = pictures, .contents = contents };
    map_picture_palette(w.palette);
    contents->fitted = 0;
    for (size_t i = 0; i < MAP_FLAG_COUNT; i++)
        contents->flagged[i] = 0;
    enum status s = parallel_run(map_fit_bands(fit), threads, make_band, &w);
    if (s == STATUS_NO_MEMORY)
        log_error("%s", status_text(s));
    return s;
}

enum status map_pictures_look(const char *prefix, const struct map_fit *fit)
{
    char path[MAP_PICTURES_PATH_SIZE];
    struct stat there;
    for (size_t i = 0; i + 1 < map_fit_bands(fit); i++) {
        map_pictures_path(prefix, fit, i, path);
        if (lstat(path, &there) == 0) {
            log_error("%s exists already; --force replaces it, --out NAME makes another", path);
            return STATUS_EXISTS;
        }
    }
    return STATUS_OK;
}
