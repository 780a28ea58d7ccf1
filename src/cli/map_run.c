/* map_run.c - pieces in their order, each to the thread that is free; what is done is what lies
 * before all pieces in hand. */
#include "cli/map_run.h"

#include <pthread.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "base/log.h"
#include "base/parallel.h"
#include "cli/inputs.h"

/* Of a piece: what a core's own cache holds of it, and yet long rows to work along. */
enum { PIECE_PIXELS = 2048, PIECE_BYTES = 8 << 20 };
/* Of those, judged and fitted at a time: what the smallest cache holds. */
enum { FIT_PIXELS = 128 };

/* How often what is done is noted; and what the system is told to read ahead. */
#define NOTE_S 5.0
enum { AHEAD_BYTES = 32 << 20 };

struct worker {
    struct map_scratch *scratch;
    unsigned char *bytes;
    float *used, *map;
    size_t piece; /* in hand, or that failed; of all where there is none */
};

struct run {
    struct map_file *file;
    const struct cube_file *cube;
    const struct band_grid *grid;
    const struct map_fit *fit;
    const struct progress *progress;
    /* Pieces of a line, or lines of a piece: one of them is 1. */
    size_t pieces_a_line, lines_a_piece, piece_samples;
    size_t line, pieces;   /* the first of this run; those from there to the end */
    pthread_mutex_t lock;  /* for these: */
    size_t next, expected; /* piece; line that nobody was told to read yet */
    size_t noted;          /* lines, by the first thread alone */
    double noted_at;
    struct worker worker[PARALLEL_MAX_THREADS];
};

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* ---- names -------------------------------------------------------------------------- */

enum status map_run_check_names(const char *prefix, const struct cube_file *cube)
{
    static const char *const endings[] = { ".img", ".hdr", ".img.part", ".img.resume" };
    struct inputs inputs = { 0 };
    enum status s = STATUS_OK;
    inputs_add(&inputs, "the cube", &cube->header_stat);
    inputs_add(&inputs, "the cube", &cube->data_stat);
    for (size_t i = 0; i < sizeof endings / sizeof *endings && s == STATUS_OK; i++) {
        char path[MAP_FILE_PATH_SIZE];
        if (snprintf(path, sizeof path, "%s%s", prefix, endings[i]) < (int)sizeof path)
            s = inputs_check(&inputs, path);
    }
    return s;
}

/* ---- pieces ------------------------------------------------------------------------- */

static void cut(struct run *r)
{
    const struct envi_header *h = &r->cube->header;
    size_t most = PIECE_BYTES / (h->bands * envi_value_size(h->type));
    if (most > PIECE_PIXELS)
        most = PIECE_PIXELS;
    r->lines_a_piece = h->samples < most ? most / h->samples : 1;
    r->pieces_a_line = h->samples < most ? 1 : (h->samples + most - 1) / most;
    r->piece_samples = (h->samples + r->pieces_a_line - 1) / r->pieces_a_line;
}

static struct cube_part part_of(const struct run *r, size_t piece)
{
    size_t samples = r->cube->header.samples;
    struct cube_part p = { .line = r->line + piece / r->pieces_a_line * r->lines_a_piece,
                           .sample = piece % r->pieces_a_line * r->piece_samples };
    size_t lines = r->file->lines - p.line, left = samples - p.sample;
    p.lines = lines < r->lines_a_piece ? lines : r->lines_a_piece;
    p.samples = left < r->piece_samples ? left : r->piece_samples;
    return p;
}

static size_t piece_pixels(const struct run *r)
{
    return r->lines_a_piece * r->piece_samples;
}

/* Rows of pixels that begin a power of two apart would share one set of the cache; and there is
 * room for a whole group at the end. */
static size_t row_of(const struct run *r)
{
    return piece_pixels(r) + MAP_FIT_GROUP;
}

static enum status worker_open(const struct run *r, struct worker *w)
{
    struct cube_part largest = { 0, r->lines_a_piece, 0, r->piece_samples };
    w->bytes = malloc(cube_file_scratch(r->cube, r->grid, &largest));
    w->used = malloc(r->grid->used * row_of(r) * sizeof *w->used);
    w->map = malloc(map_fit_bands(r->fit) * row_of(r) * sizeof *w->map);
    if (w->bytes == NULL || w->used == NULL || w->map == NULL)
        return STATUS_NO_MEMORY;
    return map_scratch_open(r->fit, FIT_PIXELS + MAP_FIT_GROUP, &w->scratch);
}

static void worker_close(struct worker *w)
{
    free(w->bytes);
    free(w->used);
    free(w->map);
    map_scratch_close(w->scratch);
}

static enum status fill(struct run *r, struct worker *w, const struct cube_part *part)
{
    size_t n = part->lines * part->samples;
    enum status s = w->scratch == NULL ? worker_open(r, w) : STATUS_OK;
    if (s == STATUS_NO_MEMORY)
        log_error("%s", status_text(s));
    if (s == STATUS_OK)
        s = cube_file_read(r->cube, r->grid, part, w->bytes, row_of(r), w->used);
    for (size_t i = 0; i < n && s == STATUS_OK; i += FIT_PIXELS) {
        size_t some = n - i < FIT_PIXELS ? n - i : FIT_PIXELS;
        s = map_fit_run(r->fit, w->scratch, w->used + i, some, row_of(r), w->map + i);
        if (s != STATUS_OK)
            log_error("line %zu: %s", part->line, status_text(s));
    }
    for (size_t b = 0; b < r->file->bands && s == STATUS_OK; b++)
        s = map_file_write(r->file, b, part->line, part->sample, n, w->map + b * row_of(r));
    return s;
}

/* ---- how far it is ------------------------------------------------------------------- */

/* The next piece, and lines that it is time to read ahead of it, if there are any. */
static size_t take_piece(struct run *r, struct worker *w, size_t *ahead, size_t *lines)
{
    const struct envi_header *h = &r->cube->header;
    size_t window = AHEAD_BYTES / (h->samples * h->bands * envi_value_size(h->type)) + 1;
    pthread_mutex_lock(&r->lock);
    size_t piece = w->piece = r->next++, line = part_of(r, piece).line;
    size_t left = r->file->lines - r->expected;
    *ahead = r->expected;
    *lines = line + window < r->expected ? 0 : left < window ? left : window;
    r->expected += *lines;
    pthread_mutex_unlock(&r->lock);
    return piece;
}

static void put_piece(struct run *r, struct worker *w)
{
    pthread_mutex_lock(&r->lock);
    w->piece = SIZE_MAX;
    pthread_mutex_unlock(&r->lock);
}

/* Lines before this one are in the file. */
static size_t lines_done(struct run *r)
{
    pthread_mutex_lock(&r->lock);
    size_t piece = r->next;
    for (size_t i = 0; i < PARALLEL_MAX_THREADS; i++)
        if (r->worker[i].piece < piece)
            piece = r->worker[i].piece;
    pthread_mutex_unlock(&r->lock);
    size_t lines = r->line + piece / r->pieces_a_line * r->lines_a_piece;
    return lines < r->file->lines ? lines : r->file->lines;
}

/* By the thread that asked for the map, after each of its pieces. */
static enum status tell(struct run *r)
{
    size_t done = lines_done(r);
    if (!progress_go_on(r->progress, done, r->file->lines))
        return STATUS_CANCELLED;
    if (now() - r->noted_at <= NOTE_S || done == r->noted || done == r->file->lines)
        return STATUS_OK;
    r->noted = done;
    enum status s = map_file_note(r->file, done);
    r->noted_at = now();
    return s;
}

/* Pieces are taken in their order under our own lock: only so is it known which are in hand. */
static enum status do_piece(size_t any, unsigned worker, void *context)
{
    struct run *r = context;
    struct worker *w = &r->worker[worker];
    size_t ahead, lines;
    (void)any;
    struct cube_part part = part_of(r, take_piece(r, w, &ahead, &lines));
    if (lines > 0)
        cube_file_expect(r->cube, r->grid, ahead, lines);
    enum status s = fill(r, w, &part);
    if (s == STATUS_OK) {
        put_piece(r, w);
        s = worker == 0 ? tell(r) : STATUS_OK;
    }
    return s;
}

/* ---- all of it ----------------------------------------------------------------------- */

static void prepare(struct run *r)
{
    cut(r);
    size_t lines = r->file->lines - r->line;
    r->pieces = (lines + r->lines_a_piece - 1) / r->lines_a_piece * r->pieces_a_line;
    for (size_t i = 0; i < PARALLEL_MAX_THREADS; i++)
        r->worker[i].piece = SIZE_MAX;
    pthread_mutex_init(&r->lock, NULL);
}

static void run_close(struct run *r)
{
    for (size_t i = 0; i < PARALLEL_MAX_THREADS; i++)
        worker_close(&r->worker[i]);
    pthread_mutex_destroy(&r->lock);
    free(r);
}

enum status map_run(struct map_file *file, const struct cube_file *cube,
                    const struct band_grid *grid, const struct map_fit *fit, unsigned threads,
                    const struct progress *progress)
{
    struct run *r = calloc(1, sizeof *r);
    if (r == NULL) {
        log_error("%s", status_text(STATUS_NO_MEMORY));
        return STATUS_NO_MEMORY;
    }
    *r = (struct run){ .file = file,
                       .cube = cube,
                       .grid = grid,
                       .fit = fit,
                       .progress = progress,
                       .line = file->done,
                       .expected = file->done,
                       .noted = file->done,
                       .noted_at = now() };
    prepare(r);
    enum status s = parallel_run(r->pieces, threads, do_piece, r);
    file->done = lines_done(r);
    if (s == STATUS_OK && !progress_go_on(progress, file->done, file->lines))
        s = STATUS_CANCELLED;
    if (s != STATUS_OK && file->done > r->noted)
        (void)map_file_note(file, file->done);
    run_close(r);
    return s;
}
