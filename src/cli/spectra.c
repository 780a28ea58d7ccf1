/* spectra.c - a spectrum file opened, cut into pieces, and read row by row. */
#include "cli/spectra_private.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/log.h"

const struct spectrum *spectra_bands(const struct spectra *spectra)
{
    return spectra->is_csv ? &spectra->bands : NULL;
}

const struct spectrum *spectra_first_bands(const struct spectra *s)
{
    if (s->is_csv || s->has_bands)
        return &s->bands;
    if (s->ahead_line > 0)
        log_error("%s:%zu:%zu: %s; none of the first rows has a spectrum", s->path, s->ahead_line,
                  s->ahead_column, s->ahead_error);
    else
        log_error("%s: empty; expected an object of JSON a line, with a spectrum", s->path);
    return NULL;
}

const char *spectra_path(const struct spectra *spectra)
{
    return spectra->path;
}

void spectra_position(const struct spectra *spectra, size_t *done, size_t *total)
{
    struct stat st;
    bool known = fstat(spectra->fd, &st) == 0 && S_ISREG(st.st_mode);
    *done = known ? (size_t)spectra->cutter.offset : 0;
    *total = known ? (size_t)st.st_size : 0;
}

bool spectra_has_specular(const struct spectra *spectra)
{
    return !spectra->is_csv || spectra->specular_column < spectra->header.n;
}

bool spectra_has_id(const struct spectra *spectra)
{
    return spectra->id_column < spectra->header.n;
}

size_t spectra_carried(const struct spectra *spectra)
{
    return spectra->carried_n;
}

const char *spectra_carried_name(const struct spectra *spectra, size_t i)
{
    return spectra->header.field[spectra->carried[i]].text;
}

const char *spectra_carried_text(const struct spectra *spectra, const struct spectra_row *row,
                                 size_t i)
{
    size_t column = spectra->carried[i];
    return column < row->record.n ? row->record.field[column].text : "";
}

const char *spectra_shown(const char *text, char cut[SPECTRA_SHOWN_SIZE])
{
    if (strlen(text) < 40)
        return text;
    size_t n = 36;
    while (n > 0 && ((unsigned char)text[n] & 0xc0) == 0x80)
        n--; /* not inside a UTF-8 sequence */
    snprintf(cut, SPECTRA_SHOWN_SIZE, "%.*s...", (int)n, text);
    return cut;
}

/* ---- before the first row ----------------------------------------------------------- */

struct spectra_source spectra_source_csv(const char *path)
{
    return (struct spectra_source){ .path = path, .format = SPECTRA_CSV };
}

/* Why the input gave no more. */
static enum status input_error(const struct spectra *s, enum status status)
{
    if (status == STATUS_IO)
        log_error("%s: %s", s->path, strerror(errno));
    else if (status != STATUS_OK && status != STATUS_NOT_FOUND && status != STATUS_CANCELLED)
        log_error("%s: %s", s->path, status_text(status));
    return status;
}

static enum status open_input(struct spectra *s, const char *path)
{
    bool standard_input = strcmp(path, "-") == 0;
    s->path = standard_input ? "<stdin>" : path;
    s->fd = standard_input ? STDIN_FILENO : open(path, O_RDONLY | O_CLOEXEC);
    cutter_init(&s->cutter, s->fd);
    if (s->fd >= 0)
        return STATUS_OK;
    log_error("%s: %s", path, strerror(errno));
    return errno == ENOENT ? STATUS_NOT_FOUND : STATUS_IO;
}

/* Comments before it may be a piece by themselves. */
static enum status first_record(struct spectra *s, struct piece *piece, struct csv_record *ret)
{
    enum status status = STATUS_NOT_FOUND;
    while (status == STATUS_NOT_FOUND) {
        struct csv csv;
        status = cutter_next(&s->cutter, 1, piece);
        if (status == STATUS_NOT_FOUND) {
            log_error("%s: empty; expected a header as id,400,410,...,700 and a row per spectrum",
                      s->path);
            return STATUS_FORMAT;
        }
        if (status != STATUS_OK)
            return input_error(s, status);
        csv_init(&csv, piece->text, piece->n, piece->line);
        status = csv_read(&csv, ret);
        if (status == STATUS_FORMAT)
            log_error("%s:%zu:%zu: %s", s->path, csv.error_line, csv.error_column, csv.error);
    }
    return status;
}

/* The first record of `from` becomes the header of s. */
static enum status read_header(struct spectra *s, struct spectra *from)
{
    struct piece piece = { 0 };
    enum status status = first_record(from, &piece, &s->header);
    s->header_text = piece.text;
    from->cutter.row = 0;
    return status == STATUS_OK ? spectra_read_columns(s) : status;
}

/* Of another file: the messages about it name that one. */
static enum status read_header_of(struct spectra *s, const char *path)
{
    struct spectra other = { .fd = -1 };
    const char *own = s->path;
    enum status status = open_input(&other, path);
    s->path = other.path;
    if (status == STATUS_OK)
        status = read_header(s, &other);
    s->path = own;
    cutter_done(&other.cutter);
    if (other.fd > STDIN_FILENO)
        close(other.fd);
    return status;
}

static enum status find_format(struct spectra *s, enum spectra_format asked)
{
    char first = '\0';
    s->is_csv = asked == SPECTRA_CSV;
    if (asked == SPECTRA_EITHER) {
        enum status status = input_error(s, cutter_peek(&s->cutter, &first));
        if (status != STATUS_OK)
            return status;
        s->is_csv = first != '{';
    }
    s->cutter.records = s->is_csv ? CUTTER_CSV : CUTTER_LINES;
    return STATUS_OK;
}

/* The first good of so many rows. */
static enum status find_bands_in(struct spectra *s, size_t rows, struct piece *piece, bool *all)
{
    struct spectra_row row = { .quiet = true };
    enum status status = cutter_look_ahead(&s->cutter, rows, piece);
    *all = piece->rows < rows;
    if (status != STATUS_OK)
        return status;
    struct spectra_piece lines = { .piece = *piece, .at = piece->text, .line = piece->line };
    while (!s->has_bands && spectra_read_line(&lines, &row) == STATUS_OK) {
        if (row.good) {
            s->has_bands = true;
            s->bands.first_nm = row.spectrum.first_nm;
            s->bands.step_nm = row.spectrum.step_nm;
            s->bands.n = row.spectrum.n;
        } else if (s->ahead_line == 0) {
            memcpy(s->ahead_error, row.error, sizeof s->ahead_error);
            s->ahead_line = row.error_line;
            s->ahead_column = row.error_column;
        }
    }
    spectra_row_done(&row);
    return STATUS_OK; /* what no reader takes is told when it is its turn */
}

/* One row is waited for, more only where that is bad. */
static enum status find_bands(struct spectra *s)
{
    struct piece piece = { 0 };
    enum status status = STATUS_OK;
    bool all = false;
    for (size_t rows = 1; rows <= SPECTRA_AHEAD && status == STATUS_OK && !s->has_bands && !all;
         rows *= 4)
        status = find_bands_in(s, rows, &piece, &all);
    piece_done(&piece);
    return status == STATUS_NOT_FOUND ? STATUS_OK : input_error(s, status);
}

/* Records belong to the part that they begin in; lines and rows are counted from the file's
 * beginning on, so what lies before is passed over, not jumped over. */
static enum status find_shard(struct spectra *s, size_t shard, size_t shards)
{
    struct stat st;
    struct cutter *cutter = &s->cutter;
    if (shards == 0)
        return STATUS_OK;
    if (fstat(s->fd, &st) != 0 || !S_ISREG(st.st_mode)) {
        log_error("%s: only a file has parts; give one, or let the pipe be split (docs/scale.md)",
                  s->path);
        return STATUS_UNSUPPORTED;
    }
    double bytes = (double)((uint64_t)st.st_size - cutter->offset) / (double)shards;
    uint64_t data = cutter->offset;
    if (shard < shards)
        cutter->last_from = data + (uint64_t)(bytes * (double)shard);
    return input_error(s, cutter_skip_to(cutter, data + (uint64_t)(bytes * (double)(shard - 1))));
}

enum status spectra_open(const struct spectra_source *source, struct spectra **ret)
{
    struct spectra *s = calloc(1, sizeof *s);
    if (s == NULL)
        return STATUS_NO_MEMORY;
    s->bands.aperture_mm = NAN;
    enum status status = open_input(s, source->path);
    if (status == STATUS_OK)
        status = find_format(s, source->format);
    if (status == STATUS_OK && s->is_csv)
        status = source->header != NULL ? read_header_of(s, source->header) : read_header(s, s);
    if (status == STATUS_OK && !s->is_csv && source->look_ahead)
        status = find_bands(s);
    if (status == STATUS_OK)
        status = find_shard(s, source->shard, source->shards);
    if (status != STATUS_OK) {
        spectra_close(s);
        return status;
    }
    *ret = s;
    return STATUS_OK;
}

void spectra_close(struct spectra *spectra)
{
    if (spectra == NULL)
        return;
    if (spectra->fd > STDIN_FILENO)
        close(spectra->fd);
    cutter_done(&spectra->cutter);
    spectra_piece_done(&spectra->current);
    csv_record_done(&spectra->header);
    free(spectra->header_text);
    free(spectra->band);
    free(spectra->carried);
    free(spectra);
}

/* ---- rows --------------------------------------------------------------------------- */

void spectra_begin_row(struct spectra_row *row, size_t line)
{
    row->good = true;
    row->error[0] = '\0';
    row->line = line;
    row->id = NULL;
    row->id_is_number = false;
    row->members.n = 0;
    row->values = NULL;
    row->spectrum.specular = SPECULAR_UNKNOWN;
    row->spectrum.aperture_mm = NAN;
}

void spectra_mark(struct spectra_row *row, size_t line, size_t column, const char *format,
                  va_list args)
{
    vsnprintf(row->error, sizeof row->error, format, args);
    row->good = false;
    row->error_line = line;
    row->error_column = column;
}

static void tell(const struct spectra *spectra, const struct spectra_row *row)
{
    log_error("%s:%zu:%zu: %s", spectra->path, row->error_line, row->error_column, row->error);
}

const char *spectra_value_fault(double x, const char *nm, char text[SPECTRA_ERROR_SIZE])
{
    if (x >= 0.0 && x <= 2.0)
        return NULL;
    if (x < 0.0)
        snprintf(text, SPECTRA_ERROR_SIZE, "%g at %s nm is negative; expected a reflectance 0..1",
                 x, nm);
    else if (x <= 200.0)
        snprintf(text, SPECTRA_ERROR_SIZE,
                 "%g at %s nm is above 2; this looks like percent: divide by 100", x, nm);
    else
        snprintf(text, SPECTRA_ERROR_SIZE, "%g at %s nm is above 2; expected a reflectance 0..1", x,
                 nm);
    return text;
}

/* The column a message points to; the row is as wide as the header, or it would
 * have been refused before. */
static size_t column_of(const struct spectra *s, int at)
{
    if (at == SPECTRA_AT_SPECULAR && spectra_has_specular(s))
        return s->specular_column;
    for (size_t i = 0; at >= 0 && i < s->header.n; i++)
        if (s->band[i] == at)
            return i;
    return 0;
}

void spectra_refuse(const struct spectra *spectra, struct spectra_row *row, int at,
                    const char *format, ...)
{
    va_list args;
    va_start(args, format);
    if (spectra->is_csv) {
        const struct csv_field *field = &row->record.field[column_of(spectra, at)];
        spectra_mark(row, field->line, field->column, format, args);
    } else {
        spectra_mark(row, row->line, spectra_line_column(row, at), format, args);
    }
    va_end(args);
    if (!row->quiet)
        tell(spectra, row);
}

void spectra_row_done(struct spectra_row *row)
{
    csv_record_done(&row->record);
}

/* ---- pieces ------------------------------------------------------------------------- */

void spectra_piece_done(struct spectra_piece *piece)
{
    piece_done(&piece->piece);
}

enum status spectra_take(struct spectra *spectra, size_t rows, struct spectra_piece *ret)
{
    enum status s = input_error(spectra, cutter_next(&spectra->cutter, rows, &ret->piece));
    if (s != STATUS_OK)
        return s;
    ret->at = ret->piece.text;
    ret->line = ret->piece.line;
    ret->row = ret->piece.rows_before;
    ret->error = NULL;
    csv_init(&ret->csv, ret->piece.text, ret->piece.n, ret->piece.line);
    return STATUS_OK;
}

static void add_message(const struct spectra *s, size_t line, size_t column, const char *message,
                        struct text *text)
{
    char place[64];
    snprintf(place, sizeof place, ":%zu:%zu: ", line, column);
    text_add(text, s->path, strlen(s->path));
    text_add(text, place, strlen(place));
    text_add(text, message, strlen(message) + 1);
}

void spectra_add_message(const struct spectra *spectra, const struct spectra_row *row,
                         struct text *text)
{
    add_message(spectra, row->error_line, row->error_column, row->error, text);
}

void spectra_add_piece_message(const struct spectra *spectra, const struct spectra_piece *piece,
                               struct text *text)
{
    add_message(spectra, piece->error_line, piece->error_column, piece->error, text);
}

void spectra_stop_on(struct spectra *spectra, const int fd[2])
{
    memcpy(spectra->cutter.stop_fd, fd, sizeof spectra->cutter.stop_fd);
}

size_t spectra_rows(const struct spectra *spectra)
{
    return spectra->cutter.row;
}

enum status spectra_skip(struct spectra *spectra, size_t rows)
{
    return input_error(spectra, cutter_skip_rows(&spectra->cutter, rows));
}

/* What spreadsheets leave below their data: ",,,," */
static bool is_blank(const struct csv_record *record)
{
    for (size_t i = 0; i < record->n; i++)
        if (*record->field[i].text != '\0')
            return false;
    return true;
}

static enum status read_record(const struct spectra *spectra, struct spectra_piece *piece,
                               struct spectra_row *row)
{
    enum status s;
    do
        s = csv_read(&piece->csv, &row->record);
    while (s == STATUS_OK && is_blank(&row->record));
    if (s == STATUS_OK)
        spectra_read_fields(spectra, row);
    piece->error = piece->csv.error;
    piece->error_line = piece->csv.error_line;
    piece->error_column = piece->csv.error_column;
    return s;
}

enum status spectra_read(const struct spectra *spectra, struct spectra_piece *piece,
                         struct spectra_row *row)
{
    enum status s =
        spectra->is_csv ? read_record(spectra, piece, row) : spectra_read_line(piece, row);
    if (s == STATUS_OK)
        row->number = ++piece->row;
    return s;
}

enum status spectra_next(struct spectra *spectra, struct spectra_row *row)
{
    enum { ROWS = 256 };
    struct spectra_piece *piece = &spectra->current;
    enum status s = STATUS_NOT_FOUND;
    for (;;) {
        if (spectra->has_current)
            s = spectra_read(spectra, piece, row);
        if (s != STATUS_NOT_FOUND)
            break;
        s = spectra_take(spectra, ROWS, piece);
        if (s != STATUS_OK)
            return s;
        spectra->has_current = true;
    }
    if (s == STATUS_FORMAT)
        log_error("%s:%zu:%zu: %s", spectra->path, piece->error_line, piece->error_column,
                  piece->error);
    else if (s != STATUS_OK)
        log_error("%s: %s", spectra->path, status_text(s));
    else if (!row->good)
        tell(spectra, row);
    return s;
}
