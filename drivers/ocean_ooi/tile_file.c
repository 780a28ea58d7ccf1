/* tile_file.c - a reader that trusts no certificate. */
#include "drivers/ocean_ooi/tile_file.h"

#include <errno.h>
#include <math.h>
#include <nettle/base16.h>
#include <nettle/sha2.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "base/number.h"

#define STEP_MAX_NM 20.0
#define FIRST_NM 400.0
#define LAST_NM 700.0
#define MOST 1.2

enum column { COLUMN_OTHER, COLUMN_NM, COLUMN_ID, COLUMN_SPECULAR, COLUMN_GEOMETRY, COLUMN_WHAT };

struct reader {
    const char *path;
    size_t line;
    char *rest; /* of the file; NULL behind its end */
    enum column column[OOI_TILE_COLUMNS];
    size_t columns;
    struct driver_error *error;
};

static enum driver_result refuse(const struct reader *r, const char *why)
{
    return driver_fail(r->error, DRIVER_UNSUPPORTED, NULL, "%.200s:%zu: %s", r->path, r->line, why);
}

static enum driver_result refuse_file(const char *path, struct driver_error *error, const char *why)
{
    return driver_fail(error, DRIVER_UNSUPPORTED, NULL, "%.200s: %s", path, why);
}

/* ---- lines and fields --------------------------------------------------------------- */

/* The next line with something on it; NULL at the end. */
static char *next_line(struct reader *r)
{
    while (r->rest != NULL && *r->rest != '\0') {
        char *line = r->rest, *end = strchr(line, '\n');
        r->rest = end != NULL ? end + 1 : NULL;
        if (end != NULL)
            *end = '\0';
        line[strcspn(line, "\r")] = '\0';
        r->line++;
        if (line[0] != '\0' && line[0] != '#')
            return line;
    }
    return NULL;
}

/* Cut the field at *rest off, without the spaces around it; NULL behind the last. */
static char *next_field(char **rest)
{
    char *field = *rest;
    if (field == NULL)
        return NULL;
    char *comma = strchr(field, ',');
    if (comma != NULL)
        *comma = '\0';
    *rest = comma != NULL ? comma + 1 : NULL;
    field += strspn(field, " \t");
    for (size_t n = strlen(field); n > 0 && (field[n - 1] == ' ' || field[n - 1] == '\t'); n--)
        field[n - 1] = '\0';
    return field;
}

/* ---- the header --------------------------------------------------------------------- */

static enum column column_named(const char *name, double *nm)
{
    if (number_parse(name, nm) == STATUS_OK)
        return COLUMN_NM;
    if (strcasecmp(name, "id") == 0)
        return COLUMN_ID;
    if (strcasecmp(name, "specular") == 0)
        return COLUMN_SPECULAR;
    if (strcasecmp(name, "geometry") == 0)
        return COLUMN_GEOMETRY;
    return strcasecmp(name, "what") == 0 ? COLUMN_WHAT : COLUMN_OTHER;
}

static bool has_column(const struct reader *r, enum column column)
{
    for (size_t i = 0; i < r->columns; i++)
        if (r->column[i] == column)
            return true;
    return false;
}

/* The grid must leave no band of 400..700 nm to guess. */
static enum driver_result check_grid(const struct reader *r, const struct ooi_tile_file *f)
{
    double least = INFINITY, widest = 0.0;
    if (f->columns < 2)
        return refuse(r, "needs wavelengths in nm for column names, 400,410,...,700: commas "
                         "between fields, '.' for the point");
    if (f->nm[f->columns - 1] < 200.0 || f->nm[0] > 2500.0)
        return refuse(r, "these wavelengths are no nm: give them in nm, 400,410,...,700");
    if (f->nm[0] > FIRST_NM || f->nm[f->columns - 1] < LAST_NM)
        return refuse(r, "does not reach from 400 to 700 nm: ask the maker for a certificate "
                         "that does");
    for (size_t i = 1; i < f->columns; i++)
        if (f->nm[i] > FIRST_NM && f->nm[i - 1] < LAST_NM) {
            least = fmin(least, f->nm[i] - f->nm[i - 1]);
            widest = fmax(widest, f->nm[i] - f->nm[i - 1]);
        }
    if (widest > STEP_MAX_NM || widest > 1.5 * least)
        return refuse(r, "bands are missing between 400 and 700 nm: give them all, in even "
                         "steps of 20 nm or less");
    return DRIVER_OK;
}

static enum driver_result read_header(struct reader *r, struct ooi_tile_file *ret)
{
    char *line = next_line(r);
    if (line == NULL)
        return refuse(r, "is empty: needs a header and a spectrum, as in the certificate");
    for (char *field; (field = next_field(&line)) != NULL; r->columns++) {
        double nm;
        if (r->columns == OOI_TILE_COLUMNS)
            return refuse(r, "more than 1024 columns: leave out what is not 380..740 nm");
        r->column[r->columns] = column_named(field, &nm);
        if (r->column[r->columns] != COLUMN_NM)
            continue;
        if (ret->columns > 0 && !(nm > ret->nm[ret->columns - 1]))
            return refuse(r, "wavelengths must rise from column to column");
        ret->nm[ret->columns++] = nm;
    }
    if (!has_column(r, COLUMN_ID) || !has_column(r, COLUMN_SPECULAR))
        return refuse(r, "needs the columns id and specular: the tile's serial number, and sce "
                         "where the certificate says 8/d with the gloss excluded");
    return check_grid(r, ret);
}

/* ---- rows --------------------------------------------------------------------------- */

static void take_name(const char *field, char id[DRIVER_NAME_SIZE])
{
    size_t n = 0;
    for (; n < DRIVER_NAME_SIZE - 1 && field[n] != '\0'; n++)
        id[n] = field[n] >= 0x20 && field[n] < 0x7f ? field[n] : '?';
    id[n] = '\0';
}

static bool is_d8(const char *field)
{
    static const char *const names[] = { "d/8", "8/d", "di:8", "8:di", "d8", "8d" };
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (strcasecmp(field, names[i]) == 0)
            return true;
    return false;
}

static enum driver_result read_value(const struct reader *r, const char *field, double *ret)
{
    double value;
    if (number_parse(field, &value) != STATUS_OK)
        return refuse(r, "a reflectance is no number: each field is a fraction, 0.987");
    if (value > MOST)
        return refuse(r, "a reflectance is above 1.2: is this percent?  Write fractions, 0.987 "
                         "for 98.7 %");
    if (value < 0.0)
        return refuse(r, "a reflectance is negative: copy the certificate again");
    *ret = value;
    return DRIVER_OK;
}

static enum driver_result read_word(const struct reader *r, enum column column, const char *field,
                                    struct ooi_tile *tile)
{
    switch (column) {
    case COLUMN_ID:
        take_name(field, tile->id);
        return tile->id[0] != '\0' ? DRIVER_OK : refuse(r, "id is empty: name the tile");
    case COLUMN_SPECULAR:
        if (strcasecmp(field, "sci") == 0)
            return refuse(r, "specular says sci, which holds the gloss: this needs the "
                             "certificate's sce values (8/d, gloss excluded)");
        if (strcasecmp(field, "sce") != 0)
            return refuse(r, "specular must say sce: see the certificate");
        return DRIVER_OK;
    case COLUMN_GEOMETRY:
        return is_d8(field) ? DRIVER_OK
                            : refuse(r, "geometry must be d/8 or 8/d, as that of the sphere: ask "
                                        "the maker for such a certificate");
    case COLUMN_WHAT:
        if (strcasecmp(field, "measured") != 0 && strcasecmp(field, "certified") != 0)
            return refuse(r, "what must say measured or certified");
        tile->what = strcasecmp(field, "measured") == 0 ? OOI_TILE_MEASURED : OOI_TILE_CERTIFIED;
        return DRIVER_OK;
    default:
        return DRIVER_OK;
    }
}

static enum driver_result read_row(const struct reader *r, char *line, struct ooi_tile *tile)
{
    size_t column = 0, band = 0;
    tile->what = OOI_TILE_UNSAID;
    for (char *field; (field = next_field(&line)) != NULL; column++) {
        if (column == r->columns)
            return refuse(r, "more fields than the header has");
        enum driver_result result = r->column[column] == COLUMN_NM
                                        ? read_value(r, field, &tile->value[band++])
                                        : read_word(r, r->column[column], field, tile);
        if (result != DRIVER_OK)
            return result;
    }
    return column == r->columns ? DRIVER_OK : refuse(r, "fewer fields than the header has");
}

static void hash_file(const char *text, size_t n, char ret[OOI_FILE_HASH_SIZE])
{
    struct sha256_ctx sha256;
    uint8_t digest[SHA256_DIGEST_SIZE];
    sha256_init(&sha256);
    sha256_update(&sha256, n, (const uint8_t *)text);
    sha256_digest(&sha256, sizeof digest, digest);
    base16_encode_update(ret, sizeof digest, digest);
    ret[2 * sizeof digest] = '\0';
}

enum driver_result ooi_tile_parse(char *text, size_t n, const char *path, struct ooi_tile_file *ret,
                                  struct driver_error *error)
{
    struct reader r = { .path = path, .rest = text, .error = error };
    if (strlen(text) != n)
        return refuse_file(path, error, "is no text: save it as CSV");
    hash_file(text, n, ret->sha256);           /* before it is cut up */
    if (strncmp(text, "\xef\xbb\xbf", 3) == 0) /* as spreadsheets write it */
        r.rest += 3;
    ret->columns = ret->rows = 0;
    enum driver_result result = read_header(&r, ret);
    for (char *line; result == DRIVER_OK && (line = next_line(&r)) != NULL; ret->rows++) {
        if (ret->rows == OOI_TILE_ROWS)
            return refuse(&r, "more than 32 spectra: leave out what is not needed");
        result = read_row(&r, line, &ret->row[ret->rows]);
    }
    if (result == DRIVER_OK && ret->rows == 0)
        return refuse(&r, "no spectrum below the header");
    return result;
}

enum driver_result ooi_tile_read(const char *path, struct ooi_tile_file *ret,
                                 struct driver_error *error)
{
    FILE *stream = fopen(path, "re");
    if (stream == NULL)
        return driver_fail(error, DRIVER_UNSUPPORTED, NULL,
                           "%.200s: %s: name the certificate's CSV file, readable for the station",
                           path, strerror(errno));
    char *text = malloc(OOI_FILE_BYTES + 1);
    if (text == NULL) {
        fclose(stream);
        return driver_fail(error, DRIVER_FAULT, NULL, "not enough memory");
    }
    size_t n = fread(text, 1, OOI_FILE_BYTES, stream);
    enum driver_result result = DRIVER_OK;
    if (ferror(stream))
        result = refuse_file(path, error, strerror(errno));
    else if (n == OOI_FILE_BYTES)
        result = refuse_file(path, error, "is larger than 1 MB: not a certificate");
    fclose(stream);
    text[n] = '\0';
    if (result == DRIVER_OK)
        result = ooi_tile_parse(text, n, path, ret, error);
    free(text);
    return result;
}

/* ---- what it is of ------------------------------------------------------------------ */

double ooi_tile_at(const struct ooi_tile_file *file, size_t row, double nm)
{
    const double *value = file->row[row].value;
    size_t k = 1; /* the column at or after nm; the ends' lines go on */
    while (k + 1 < file->columns && file->nm[k] < nm)
        k++;
    double part = (nm - file->nm[k - 1]) / (file->nm[k] - file->nm[k - 1]);
    return fmin(fmax(value[k - 1] + part * (value[k] - value[k - 1]), 0.0), MOST);
}

static double mean_of(const struct ooi_tile_file *file, size_t row)
{
    double sum = 0.0;
    for (size_t b = 0; b < OOI_BANDS; b++)
        sum += ooi_tile_at(file, row, OOI_FIRST_NM + (double)b * OOI_STEP_NM);
    return sum / OOI_BANDS;
}

enum driver_result ooi_tile_is_white(const struct ooi_tile_file *file, const char *path,
                                     struct driver_error *error)
{
    if (file->rows != 1)
        return refuse_file(path, error, "holds more than one spectrum: keep the white tile's");
    if (file->row[0].what == OOI_TILE_MEASURED)
        return refuse_file(path, error, "is a measured spectrum: this needs the certified one");
    if (mean_of(file, 0) < 0.5)
        return refuse_file(path, error, "is of no white tile: its mean is below 0.5");
    return DRIVER_OK;
}

/* The one row of this id and kind; file->rows where there is none, or are several. */
static size_t find_row(const struct ooi_tile_file *file, const char *id, enum ooi_tile_what what)
{
    size_t found = file->rows;
    for (size_t i = 0; i < file->rows; i++)
        if (file->row[i].what == what && strcmp(file->row[i].id, id) == 0) {
            if (found != file->rows)
                return file->rows;
            found = i;
        }
    return found;
}

enum driver_result ooi_tile_greys(const struct ooi_tile_file *file, const char *path, size_t *ret,
                                  double (*measured)[OOI_BANDS], double (*certified)[OOI_BANDS],
                                  struct driver_error *error)
{
    size_t n = 0;
    for (size_t i = 0; i < file->rows; i++) {
        const char *id = file->row[i].id;
        size_t m = find_row(file, id, OOI_TILE_MEASURED);
        size_t c = find_row(file, id, OOI_TILE_CERTIFIED);
        if (m == file->rows || c == file->rows)
            return driver_fail(error, DRIVER_UNSUPPORTED, NULL,
                               "%.200s: '%s' must have one row with what = measured and one with "
                               "what = certified",
                               path, id);
        if (m != i) /* each pair once */
            continue;
        for (size_t b = 0; b < OOI_BANDS; b++) {
            double nm = OOI_FIRST_NM + (double)b * OOI_STEP_NM;
            measured[n][b] = ooi_tile_at(file, m, nm);
            certified[n][b] = ooi_tile_at(file, c, nm);
        }
        n++;
    }
    *ret = n;
    return DRIVER_OK;
}
