/* map_pictures.c - each band by itself, gone over twice for its quantiles, once for its rows. */
#include "cli/map_pictures.h"

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/log.h"
#include "base/parallel.h"
#include "cli/new_file.h"
#include "cli/png_file.h"
#include "cube/map_picture.h"
#include "cube/quantiles.h"

/* Values of a band that are read at a time; a line at least.  And those that all threads together
 * keep: a band for which there is room is read once, not three times. */
enum { AT_A_TIME = 1 << 16, KEPT_BYTES = 16 << 20 };

/* What a thread works with, band after band. */
struct worker {
    float *value;
    struct quantiles *quantiles;
};

struct work {
    const struct map_file *file;
    const struct map_fit *fit;
    bool pictures;
    struct map_contents *contents;
    pthread_mutex_t lock; /* for these: */
    bool has_palette;
    unsigned char palette[PICTURE_COLOURS][3];
    size_t lines, room; /* of a worker: read at a time; that its memory holds, a band's at most */
    struct worker worker[PARALLEL_MAX_THREADS];
};

/* A band, some lines at a time. */
struct band_reader {
    const struct work *work;
    const struct map_file *file;
    size_t band, first, held; /* lines first .. + held are in memory[] */
    float *memory;
    size_t line, lines; /* those taken last, and their values */
    const float *value;
};

/* How much of a band so many threads keep. */
static void settle_room(struct work *w, unsigned threads)
{
    size_t samples = w->file->samples, lines = w->file->lines;
    size_t bands = threads < w->file->bands ? threads : w->file->bands;
    w->lines = AT_A_TIME / samples > 0 ? AT_A_TIME / samples : 1;
    if (w->lines > lines)
        w->lines = lines;
    w->room = KEPT_BYTES / bands / sizeof(float) / samples >= lines ? lines : w->lines;
}

static enum status worker_open(const struct work *w, struct worker *ret)
{
    ret->value = malloc(w->room * w->file->samples * sizeof *ret->value);
    ret->quantiles = malloc(sizeof *ret->quantiles);
    return ret->value != NULL && ret->quantiles != NULL ? STATUS_OK : STATUS_NO_MEMORY;
}

static void worker_close(struct worker *w)
{
    free(w->value);
    free(w->quantiles);
}

/* Some lines from this one on, those in memory or as many as are read at a time; at the end none.
 */
static enum status reader_take(struct band_reader *r, size_t line)
{
    size_t samples = r->file->samples, left = r->file->lines - line;
    enum status s = STATUS_OK;
    if (line < r->first || line >= r->first + r->held) {
        bool all = r->work->room == r->file->lines; /* then lines are read in their order */
        size_t lines = left < r->work->lines ? left : r->work->lines;
        r->first = all ? 0 : line;
        r->held = all ? line + lines : lines;
        s = map_file_read(r->file, r->band, line, lines, r->memory + (line - r->first) * samples);
    }
    r->line = line;
    r->lines = r->first + r->held - line;
    r->value = r->memory + (line - r->first) * samples;
    return s;
}

void map_pictures_path(const char *prefix, const struct map_fit *fit, size_t band,
                       char path[MAP_PICTURES_PATH_SIZE])
{
    snprintf(path, MAP_PICTURES_PATH_SIZE, "%s-%s.png", prefix, map_fit_band_name(fit, band));
}

/* ---- what is in it ------------------------------------------------------------------ */

static void count_one(struct map_contents *c, unsigned flags)
{
    c->fitted -= (flags & (unsigned)MAP_MASKED) != 0 ? 1u : 0u;
    for (size_t k = 0; flags >> k != 0; k++)
        c->flagged[k] += flags >> k & 1u;
}

/* Most pixels have none: sixteen at a time are looked at together. */
static void count_some(struct map_contents *c, const float *value, size_t n)
{
    enum { GROUP = 16 };
    size_t i = 0;
    for (; i + GROUP <= n; i += GROUP) {
        uint32_t bits[GROUP], any = 0;
        memcpy(bits, value + i, sizeof bits);
        for (size_t k = 0; k < GROUP; k++)
            any |= bits[k];
        for (size_t k = 0; k < GROUP && any != 0; k++)
            count_one(c, (unsigned)value[i + k]);
    }
    for (; i < n; i++)
        count_one(c, (unsigned)value[i]);
}

static enum status count_flags(const struct work *w, struct band_reader *r)
{
    struct map_contents *c = w->contents;
    enum status s = STATUS_OK;
    c->pixels = c->fitted = (uint64_t)w->file->samples * w->file->lines;
    for (size_t line = 0; line < w->file->lines && s == STATUS_OK; line += r->lines) {
        s = reader_take(r, line);
        if (s == STATUS_OK)
            count_some(c, r->value, r->lines * w->file->samples);
    }
    return s;
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

/* By the first that comes; others wait. */
static void make_palette(struct work *w)
{
    pthread_mutex_lock(&w->lock);
    if (!w->has_palette)
        map_picture_palette(w->palette);
    w->has_palette = true;
    pthread_mutex_unlock(&w->lock);
}

static enum status paint(struct work *w, struct band_reader *r)
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

static enum status make_band(struct work *w, size_t band, struct worker *own)
{
    enum status s = own->value == NULL ? worker_open(w, own) : STATUS_OK;
    struct band_reader reader = { .work = w, .file = w->file, .band = band, .memory = own->value };
    if (s == STATUS_OK && band + 1 == map_fit_bands(w->fit))
        return count_flags(w, &reader);
    if (s == STATUS_OK)
        s = find_quantiles(&reader, own->quantiles, &w->contents->band[band]);
    if (s == STATUS_OK && w->pictures) {
        make_palette(w);
        s = paint(w, &reader);
    }
    return s;
}

/* The palette, while others look at what is in their bands; then band after band. */
static enum status do_piece(size_t piece, unsigned worker, void *context)
{
    struct work *w = context;
    if (!w->pictures)
        return make_band(w, piece, &w->worker[worker]);
    if (piece > 0)
        return make_band(w, piece - 1, &w->worker[worker]);
    make_palette(w);
    return STATUS_OK;
}

enum status map_pictures_make(const struct map_file *file, const struct map_fit *fit, bool pictures,
                              unsigned threads, struct map_contents *contents)
{
    struct work w = { .file = file, .fit = fit, .pictures = pictures, .contents = contents };
    settle_room(&w, threads);
    pthread_mutex_init(&w.lock, NULL);
    for (size_t i = 0; i < MAP_FLAG_COUNT; i++)
        contents->flagged[i] = 0;
    size_t pieces = map_fit_bands(fit) + (pictures ? 1 : 0);
    enum status s = parallel_run(pieces, threads, do_piece, &w);
    pthread_mutex_destroy(&w.lock);
    for (size_t i = 0; i < PARALLEL_MAX_THREADS; i++)
        worker_close(&w.worker[i]);
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
