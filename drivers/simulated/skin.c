/* skin.c - spectra by src/optics, and spectra from a file. */
#include "drivers/simulated/skin.h"

#include <assert.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "base/number.h"
#include "optics/model.h"

enum { MAX_COLUMNS = SPECTRUM_MAX_BANDS, MAX_ROWS = 100000 };

/* A file's spectra; bands == 0 where there is no file. */
struct played {
    size_t bands, rows;
    double nm[MAX_COLUMNS];
    double *value; /* row after row */
};

struct skin {
    const struct model *model;
    struct tissue tissue;
    double pressure;
    size_t replicates;
    struct played played;
};

/* ---- the file ---------------------------------------------------------------------- */

/* A file while it is read. */
struct reader {
    FILE *stream;
    const char *path;
    size_t line;
    char *text; /* the line, cut up in place */
    size_t capacity;
    bool is_band[MAX_COLUMNS];
    size_t columns, specular; /* specular == columns: no such column */
    struct driver_error *error;
};

static enum driver_result refuse_file(struct reader *r, const char *why)
{
    return driver_fail(r->error, DRIVER_UNSUPPORTED, NULL, "simulated: spectra=%.200s:%zu: %s",
                       r->path, r->line, why);
}

/* Next line with something on it, without its end.  false at the end of the file. */
static bool next_line(struct reader *r)
{
    while (getline(&r->text, &r->capacity, r->stream) >= 0) {
        r->line++;
        r->text[strcspn(r->text, "\r\n")] = '\0';
        if (r->text[0] != '\0' && r->text[0] != '#')
            return true;
    }
    return false;
}

/* Nothing more came: the file is at fault, or too short. */
static enum driver_result refuse_end(struct reader *r, const char *too_short)
{
    return refuse_file(r, ferror(r->stream) ? strerror(errno) : too_short);
}

/* Cut the field at *rest off; NULL behind the last. */
static char *next_field(char **rest)
{
    char *field = *rest;
    if (field == NULL)
        return NULL;
    char *comma = strchr(field, ',');
    if (comma != NULL)
        *comma = '\0';
    *rest = comma != NULL ? comma + 1 : NULL;
    return field;
}

static enum driver_result read_header(struct reader *r, struct played *ret)
{
    size_t specular = MAX_COLUMNS;
    if (!next_line(r))
        return refuse_end(r, "no header");
    char *rest = r->text;
    for (char *field; (field = next_field(&rest)) != NULL; r->columns++) {
        double nm;
        if (r->columns == MAX_COLUMNS)
            return refuse_file(r, "more than 1024 columns");
        if (strcmp(field, "specular") == 0)
            specular = r->columns;
        if (number_parse(field, &nm) != STATUS_OK)
            continue;
        if (ret->bands > 0 && nm <= ret->nm[ret->bands - 1])
            return refuse_file(r, "wavelengths must rise");
        r->is_band[r->columns] = true;
        ret->nm[ret->bands++] = nm;
    }
    r->specular = specular < r->columns ? specular : r->columns;
    return ret->bands >= 2 ? DRIVER_OK : refuse_file(r, "needs wavelengths for column names");
}

static enum driver_result read_row(struct reader *r, double *value)
{
    size_t column = 0;
    char *rest = r->text;
    for (char *field; (field = next_field(&rest)) != NULL; column++) {
        if (column == r->columns)
            return refuse_file(r, "more fields than the header has");
        if (column == r->specular && strcasecmp(field, "sce") != 0)
            return refuse_file(r, "specular must be sce: the surface is added here");
        if (!r->is_band[column])
            continue;
        if (number_parse(field, value) != STATUS_OK || !(*value >= 0.0 && *value <= 1.0))
            return refuse_file(r, "reflectance must be a number from 0 to 1");
        value++;
    }
    return column == r->columns ? DRIVER_OK : refuse_file(r, "fewer fields than the header has");
}

static enum driver_result read_rows(struct reader *r, struct played *ret)
{
    size_t capacity = 0;
    assert(ret->bands >= 2); /* the header saw to it */
    while (next_line(r)) {
        if (ret->rows == MAX_ROWS)
            return refuse_file(r, "more than 100000 spectra");
        if (ret->rows == capacity) {
            capacity = capacity == 0 ? 16 : 2 * capacity;
            double *more = realloc(ret->value, capacity * ret->bands * sizeof *more);
            if (more == NULL)
                return refuse_file(r, "not enough memory");
            ret->value = more;
        }
        enum driver_result result = read_row(r, ret->value + ret->rows * ret->bands);
        if (result != DRIVER_OK)
            return result;
        ret->rows++;
    }
    return ret->rows > 0 && !ferror(r->stream) ? DRIVER_OK : refuse_end(r, "no spectra");
}

static enum driver_result read_file(const char *path, struct played *ret,
                                    struct driver_error *error)
{
    struct reader r = { .path = path, .error = error };
    r.stream = fopen(path, "re");
    if (r.stream == NULL)
        return refuse_file(&r, strerror(errno));
    enum driver_result result = read_header(&r, ret);
    if (result == DRIVER_OK)
        result = read_rows(&r, ret);
    free(r.text);
    fclose(r.stream);
    return result;
}

static double played_at(const struct played *p, size_t row, double nm)
{
    const double *value = p->value + row * p->bands;
    size_t k = 1; /* the band at or after nm */
    if (nm <= p->nm[0])
        return value[0];
    if (nm >= p->nm[p->bands - 1])
        return value[p->bands - 1];
    while (p->nm[k] < nm)
        k++;
    double part = (nm - p->nm[k - 1]) / (p->nm[k] - p->nm[k - 1]);
    return value[k - 1] + part * (value[k] - value[k - 1]);
}

/* ---- the skin ------------------------------------------------------------------------ */

enum driver_result skin_open(const struct options *options, struct skin **ret,
                             struct driver_error *error)
{
    struct skin *skin = calloc(1, sizeof *skin);
    if (skin == NULL)
        return driver_fail(error, DRIVER_FAULT, NULL, "simulated: not enough memory");
    skin->model = model_find(options->model);
    skin->tissue = tissue_of(options->Cm, options->Bm, options->Ch);
    skin->tissue.epidermis_mm = options->epidermis_mm;
    skin->pressure = options->pressure;
    skin->replicates = (size_t)options->replicates;
    if (options->spectra[0] != '\0') {
        enum driver_result r = read_file(options->spectra, &skin->played, error);
        if (r != DRIVER_OK) {
            skin_close(skin);
            return r;
        }
    }
    *ret = skin;
    return DRIVER_OK;
}

void skin_close(struct skin *skin)
{
    if (skin == NULL)
        return;
    free(skin->played.value);
    free(skin);
}

/* The options leave no value that the models refuse. */
static void compute(const struct skin *skin, size_t replicate, const struct driver_grid *grid,
                    double *R)
{
    struct chromophores chromophores;
    double scratch[MEDIUM_SCRATCH(SPECTRUM_MAX_BANDS)];
    struct tissue tissue = skin->tissue;
    if (skin->pressure > 0.0) /* then there are two replicates or more */
        tissue.Ch *= 1.0 - skin->pressure * (double)replicate / (double)(skin->replicates - 1);
    (void)chromophores_init(grid->first_nm, grid->step_nm, grid->n, &chromophores);
    (void)model_reflectance(skin->model, &tissue, &chromophores, scratch, R);
}

void skin_reflectance(const struct skin *skin, size_t shot, const struct driver_grid *grid,
                      double *R)
{
    const struct played *p = &skin->played;
    if (p->rows == 0) {
        compute(skin, shot % skin->replicates, grid, R);
        return;
    }
    for (size_t i = 0; i < grid->n; i++) {
        double nm = grid->first_nm + (double)i * grid->step_nm;
        R[i] = played_at(p, shot / skin->replicates % p->rows, nm);
    }
}

double skin_port_share(double aperture_mm, double nm)
{
    double red = fmin(fmax((nm - 400.0) / 300.0, 0.0), 1.0);
    double small = fmin(fmax((8.0 - aperture_mm) / 5.0, 0.0), 1.0);
    return 1.0 - 0.1 * small * red;
}

double skin_surface(double at_550, double nm)
{
    double ratio = 550.0 / nm;
    return at_550 * (1.0 + 0.05 * (ratio * ratio - 1.0));
}
