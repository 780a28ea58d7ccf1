/* map_run.c - rounds of lines; a round is shared out in pieces. */
#include "cli/map_run.h"

#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <time.h>

#include "base/log.h"
#include "base/parallel.h"

/* Of a piece: what a core's own cache holds of it, and yet long rows to work along. */
enum { PIECE_PIXELS = 2048, PIECE_BYTES = 8 << 20 };
/* A round: long beside the pieces that some threads wait for at its end, short for who waits for
 * the stop.  And how often what is done is noted. */
#define ROUND_S 0.25
#define NOTE_S 5.0

struct worker {
    struct map_scratch *scratch;
    unsigned char *bytes;
    float *used, *map;
};

struct run {
    struct map_file *file;
    const struct cube_file *cube;
    const struct band_grid *grid;
    const struct map_fit *fit;
    /* Pieces of a line, or lines of a piece: one of them is 1. */
    size_t pieces_a_line, lines_a_piece, piece_samples;
    size_t line, lines; /* of the round */
    struct worker worker[PARALLEL_MAX_THREADS];
};

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* ---- names -------------------------------------------------------------------------- */

static enum status check_name(const char *prefix, const char *ending, const struct cube_file *cube)
{
    const struct stat *own[] = { &cube->header_stat, &cube->data_stat };
    char path[MAP_FILE_PATH_SIZE];
    struct stat there;
    if (snprintf(path, sizeof path, "%s%s", prefix, ending) >= (int)sizeof path ||
        stat(path, &there) != 0)
        return STATUS_OK;
    for (size_t i = 0; i < 2; i++) {
        if (there.st_dev == own[i]->st_dev && there.st_ino == own[i]->st_ino) {
            log_error("%s is the cube itself; give the map another name (--out NAME)", path);
            return STATUS_EXISTS;
        }
    }
    return STATUS_OK;
}

enum status map_run_check_names(const char *prefix, const struct cube_file *cube)
{
    static const char *const endings[] = { ".img", ".hdr", ".img.part", ".img.resume" };
    enum status s = STATUS_OK;
    for (size_t i = 0; i < sizeof endings / sizeof *endings && s == STATUS_OK; i++)
        s = check_name(prefix, endings[i], cube);
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
    size_t lines = r->line + r->lines - p.line, left = samples - p.sample;
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
    return map_scratch_open(r->fit, row_of(r), &w->scratch);
}

static void worker_close(struct worker *w)
{
    free(w->bytes);
    free(w->used);
    free(w->map);
    map_scratch_close(w->scratch);
}

static enum status do_piece(size_t piece, unsigned worker, void *context)
{
    struct run *r = context;
    struct worker *w = &r->worker[worker];
    struct cube_part part = part_of(r, piece);
    size_t n = part.lines * part.samples;
    enum status s = w->scratch == NULL ? worker_open(r, w) : STATUS_OK;
    if (s == STATUS_NO_MEMORY)
        log_error("%s", status_text(s));
    if (s == STATUS_OK)
        s = cube_file_read(r->cube, r->grid, &part, w->bytes, row_of(r), w->used);
    if (s == STATUS_OK) {
        s = map_fit_run(r->fit, w->scratch, w->used, n, row_of(r), w->map);
        if (s != STATUS_OK)
            log_error("line %zu: %s", part.line, status_text(s));
    }
    for (size_t b = 0; b < r->file->bands && s == STATUS_OK; b++)
        s = map_file_write(r->file, b, part.line, part.sample, n, w->map + b * row_of(r));
    return s;
}

/* ---- rounds ------------------------------------------------------------------------- */

/* Lines for the next round, after one that took so long: whole pieces for each thread. */
static size_t next_lines(const struct run *r, unsigned threads, double took_s)
{
    size_t least = threads * r->lines_a_piece;
    double wanted = (double)r->lines * ROUND_S / (took_s > 1e-4 ? took_s : 1e-4);
    if (wanted > 4.0 * (double)r->lines)
        wanted = 4.0 * (double)r->lines;
    size_t lines = wanted > (double)least ? (size_t)wanted / least * least : least;
    return lines;
}

static enum status do_round(struct run *r, unsigned threads)
{
    size_t pieces = (r->lines + r->lines_a_piece - 1) / r->lines_a_piece * r->pieces_a_line;
    size_t after = r->line + r->lines, left = r->file->lines - after;
    if (left > 0)
        cube_file_expect(r->cube, r->grid, after, left < r->lines ? left : r->lines);
    return parallel_run(pieces, threads, do_piece, r);
}

enum status map_run(struct map_file *file, const struct cube_file *cube,
                    const struct band_grid *grid, const struct map_fit *fit, unsigned threads,
                    const struct progress *progress)
{
    struct run *r = calloc(1, sizeof *r);
    enum status s = r != NULL ? STATUS_OK : STATUS_NO_MEMORY;
    size_t done = file->done, noted = done, lines = 0;
    double noted_at = now();
    if (r == NULL) {
        log_error("%s", status_text(s));
        return s;
    }
    *r = (struct run){ .file = file, .cube = cube, .grid = grid, .fit = fit };
    cut(r);
    lines = threads * r->lines_a_piece;
    while (s == STATUS_OK && done < file->lines) {
        double began = now();
        r->line = done;
        r->lines = file->lines - done < lines ? file->lines - done : lines;
        s = do_round(r, threads);
        if (s != STATUS_OK)
            break;
        done += r->lines;
        lines = next_lines(r, threads, now() - began);
        if (!progress_go_on(progress, done, file->lines))
            s = STATUS_CANCELLED;
        else if (now() - noted_at > NOTE_S && done < file->lines) {
            s = map_file_note(file, done);
            noted = done;
            noted_at = now();
        }
    }
    if (s != STATUS_OK && done > noted)
        (void)map_file_note(file, done);
    file->done = done;
    for (size_t i = 0; i < PARALLEL_MAX_THREADS; i++)
        worker_close(&r->worker[i]);
    free(r);
    return s;
}
