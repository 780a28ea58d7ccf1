/* match_stream.c - pieces of the input through base/flow; signals, progress, and the exit status.
 */
#include "cli/match_stream.h"

#include <errno.h>
#include <poll.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "base/flow.h"
#include "base/log.h"
#include "base/parallel.h"
#include "cli/options.h"
#include "cli/progress_bar.h"
#include "cli/stop.h"

/* One piece on its way: taken, answered, given. */
struct slot {
    struct spectra_piece piece;
    struct match_printed printed;
};

struct stream {
    const struct match_stream_options *options;
    struct match_rows *rows;
    struct spectra *spectra;
    enum out_format format;
    size_t rows_a_piece;
    size_t rows_before; /* of the input, before the first that is answered */
    struct slot *slot;
    struct match_scratch *scratch[PARALLEL_MAX_THREADS];
    struct answers answers;
    size_t given; /* rows */
    bool all_good, not_written;
    bool bad_one; /* that it was to stop at */
    bool whole;   /* all that was to be answered is, and stands where it was to go */
    struct stop stop;
    int enough; /* readable: nothing more will be given */
    struct progress progress;
};

/* ---- what base/flow asks for -------------------------------------------------------- */

static bool is_stopped(struct stream *s)
{
    struct pollfd fd = { s->stop.fd, POLLIN, 0 };
    return poll(&fd, 1, 0) > 0;
}

static enum status take(void *context, size_t slot)
{
    struct stream *s = context;
    if (is_stopped(s))
        return STATUS_CANCELLED;
    return spectra_take(s->spectra, s->rows_a_piece, &s->slot[slot].piece);
}

static void work(void *context, size_t slot, unsigned worker)
{
    struct stream *s = context;
    struct spectra_piece *piece = &s->slot[slot].piece;
    match_rows_print(s->rows, piece, piece->piece.rows_before - s->rows_before, s->options->strict,
                     s->scratch[worker], &s->slot[slot].printed);
}

static void tell(const struct text *messages)
{
    for (size_t at = 0; at < messages->n; at += strlen(messages->bytes + at) + 1)
        log_error("%s", messages->bytes + at);
}

static enum status give(void *context, size_t slot)
{
    struct stream *s = context;
    const struct match_printed *printed = &s->slot[slot].printed;
    size_t done, total;
    enum status written = answers_write(&s->answers, &printed->text);
    s->given += printed->rows;
    s->all_good = s->all_good && !printed->bad;
    s->bad_one = printed->status == STATUS_CANCELLED;
    tell(&printed->messages);
    s->not_written = written != STATUS_OK;
    if (s->not_written)
        return written;
    spectra_position(s->spectra, &done, &total);
    progress_go_on(&s->progress, done, total);
    return printed->status;
}

static void stop_taking(void *context)
{
    const struct stream *s = context;
    const uint64_t one = 1;
    while (write(s->enough, &one, sizeof one) < 0 && errno == EINTR)
        ;
}

/* ---- beginning and end -------------------------------------------------------------- */

static enum status open_scratches(struct stream *s, unsigned threads)
{
    s->slot = calloc(flow_slots(threads), sizeof *s->slot);
    bool good = s->slot != NULL;
    for (unsigned i = 0; i < threads && good; i++) {
        s->scratch[i] = match_scratch_open();
        good = s->scratch[i] != NULL;
    }
    if (!good)
        log_error("%s", status_text(STATUS_NO_MEMORY));
    return good ? STATUS_OK : STATUS_NO_MEMORY;
}

static void close_scratches(struct stream *s, unsigned threads)
{
    for (size_t i = 0; s->slot != NULL && i < flow_slots(threads); i++) {
        spectra_piece_done(&s->slot[i].piece);
        match_printed_done(&s->slot[i].printed);
    }
    for (unsigned i = 0; i < threads; i++)
        match_scratch_close(s->scratch[i]);
    free(s->slot);
}

static enum status open_answers(struct stream *s)
{
    static const enum answers_kind kinds[] = {
        [OUT_PLAIN] = ANSWERS_CSV, [OUT_JSON] = ANSWERS_ARRAY, [OUT_NDJSON] = ANSWERS_LINES
    };
    const struct match_stream_options *o = s->options;
    struct text begin = { 0 };
    match_rows_begin(s->rows, o->header, &begin);
    enum status status = answers_open(o->out, o->mode, &begin, kinds[s->format], &s->answers);
    text_done(&begin);
    return status;
}

/* How far it came, and how to go on. */
static void tell_where(const struct stream *s)
{
    size_t rows = s->answers.rows_before + s->given;
    const char *out = s->options->out;
    if (rows == 0 || s->whole)
        return;
    if (s->format == OUT_JSON && out != NULL)
        log_error("stopped after %zu rows; an array is whole or not at all, so they are not in %s; "
                  "--ndjson in place of --json can be gone on with",
                  rows, out);
    else if (s->format == OUT_JSON)
        log_error("stopped after %zu rows; the array has no end; --ndjson in place of --json can "
                  "be gone on with",
                  rows);
    else if (out != NULL)
        log_error("stopped after %zu rows, which are whole in %s; %s the same command goes on",
                  rows, out, answers_how_to_go_on(s->options->mode));
    else
        log_error("stopped after %zu rows; if they went to a file, the same command with --out "
                  "FILE --resume goes on",
                  rows);
}

static void run(struct stream *s)
{
    const struct flow flow = { take, work, give, stop_taking, s };
    struct progress_bar bar;
    struct text end = { 0 };
    /* A bar among results on the same terminal would be in the way. */
    bool with_bar = s->options->out != NULL || isatty(STDOUT_FILENO) != 1;
    enum status status = STATUS_OK;
    if (with_bar)
        s->progress = progress_bar_begin_drawing(&bar, "match");
    status = spectra_skip(s->spectra, s->answers.rows_before);
    if (status == STATUS_OK)
        status = flow_run(&flow, s->options->threads);
    if (with_bar)
        progress_bar_end(&bar);
    /* An array that ends says that all is in it. */
    s->whole = (status == STATUS_NOT_FOUND || s->bad_one) && !s->not_written;
    match_rows_end(s->rows, s->given, &end);
    if (s->whole && end.n > 0)
        s->whole = answers_write(&s->answers, &end) == STATUS_OK;
    text_done(&end);
    enum status closed = answers_close(&s->answers, status == STATUS_NOT_FOUND, s->whole);
    s->whole = s->whole && closed == STATUS_OK;
}

static int begin_and_run(struct stream *s)
{
    const int stops[] = { s->stop.fd, s->enough };
    if (open_scratches(s, s->options->threads) != STATUS_OK || open_answers(s) != STATUS_OK)
        return EXIT_FAILURE;
    spectra_stop_on(s->spectra, stops);
    s->rows_before = spectra_rows(s->spectra) + s->answers.rows_before;
    run(s);
    if (is_stopped(s)) {
        stop_take(&s->stop);
        tell_where(s);
    }
    return s->all_good && s->whole ? EXIT_SUCCESS : EXIT_FAILURE;
}

int match_stream(struct match_rows *rows, struct spectra *spectra, enum out_format format,
                 const struct match_stream_options *options)
{
    /* A fit takes as long as many look-ups: so that a small file has pieces for all cores. */
    enum { ROWS = 256, FITS = 16 };
    struct stream *s = calloc(1, sizeof *s);
    int exit_status = EXIT_FAILURE;
    if (s == NULL || stop_begin(&s->stop) != STATUS_OK) {
        free(s);
        return EXIT_FAILURE;
    }
    s->options = options;
    s->rows = rows;
    s->spectra = spectra;
    s->format = format;
    s->rows_a_piece = match_rows_have_fits(rows) ? FITS : ROWS;
    s->all_good = true;
    s->enough = eventfd(0, EFD_CLOEXEC);
    if (s->enough < 0)
        log_error("cannot wait for the input: %s", strerror(errno));
    else
        exit_status = begin_and_run(s);
    if (s->enough >= 0)
        close(s->enough);
    close_scratches(s, options->threads);
    struct stop stop = s->stop;
    free(s);
    stop_end(&stop);
    stop_as_asked(&stop);
    return exit_status;
}
