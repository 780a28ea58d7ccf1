/* map_fit.c - pixels judged, laid out as spectra, fitted all at once, and put back. */
#include "cli/map_fit.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/vectors.h"
#include "match/refine_many.h"

/* Name and meaning of a map's band. */
enum { NAME_SIZE = 32, MEANING_SIZE = 64 };
/* Half of a 95 % interval, in standard errors. */
#define Z_95 1.959963984540054

struct map_fit {
    const struct band_grid *grid;
    struct map_fit_options options;
    struct noise noise;
    struct refine_many *many;
    enum vectors vectors;
    size_t parameters; /* that are free */
    enum skin_parameter parameter[SKIN_PARAMETERS];
    double lo[SKIN_PARAMETERS], hi[SKIN_PARAMETERS]; /* that the fit may go to; [parameters] */
    char name[MAP_BANDS_MAX][NAME_SIZE], meaning[MAP_BANDS_MAX][MEANING_SIZE];
};

struct map_scratch {
    size_t pixels;
    float *banded;    /* [grid n][pixels]; NULL where the bands are the grid */
    uint32_t *masked; /* [pixels] */
    size_t *which;    /* [pixels]: which pixel a fitted spectrum is */
    double *answers;  /* [bands less the flags][pixels]: values, errors, rms, lower, upper ends */
    uint32_t *flags;  /* [pixels], of the fit */
};

const char *map_flag_name(size_t i)
{
    static const char *const names[MAP_FLAG_COUNT] = {
        "ignored",
        "not_a_number",
        "out_of_range",
        "refused",
        "not_converged",
        "residual_too_large",
        "Cm_at_bound",
        "Bm_at_bound",
        "Ch_at_bound",
        "SO2_at_bound",
        "epidermis_mm_at_bound",
        "scattering_a_at_bound",
        "scattering_b_at_bound",
    };
    return i < MAP_FLAG_COUNT ? names[i] : "unknown";
}

/* ---- which fit ---------------------------------------------------------------------- */

static void name_band(struct map_fit *f, size_t band, const char *name, const char *ending,
                      const char *meaning, const char *of)
{
    snprintf(f->name[band], NAME_SIZE, "%s%s", name, ending);
    snprintf(f->meaning[band], MEANING_SIZE, "%s%s", meaning, of);
}

static void name_bands(struct map_fit *f)
{
    static const char *const meanings[SKIN_PARAMETERS] = {
        "melanin fraction of the epidermis", "share of eumelanin",
        "blood fraction of the dermis",      "oxygen saturation",
        "thickness of the epidermis in mm",  "scattering at 500 nm in 1/mm",
        "exponent of the scattering",
    };
    for (size_t i = 0; i < f->parameters; i++) {
        const char *name = skin_parameter_name(f->parameter[i]);
        name_band(f, i, name, "", meanings[f->parameter[i]], "");
        name_band(f, f->parameters + i, name, "_se", "standard error of ", name);
    }
    name_band(f, 2 * f->parameters, "rms", "", "what the fit leaves of R", "");
    for (size_t i = 0; i < f->parameters && f->options.intervals; i++) {
        const char *name = skin_parameter_name(f->parameter[i]);
        size_t lower = 2 * f->parameters + 1 + i;
        name_band(f, lower, name, "_lo", "lower end of the 95 % interval of ", name);
        name_band(f, lower + f->parameters, name, "_hi", "upper end of the 95 % interval of ",
                  name);
    }
    name_band(f, map_fit_bands(f) - 1, "flags", "", "a set of bits", "");
}

enum status map_fit_open(const struct map_fit_options *options, const struct band_grid *grid,
                         struct map_fit **ret, const char **why)
{
    struct recipe recipe = recipe_default(options->model);
    struct refine_wish wish = options->wish;
    struct fit fit;
    enum noise_source source;
    struct map_fit *f = calloc(1, sizeof *f);
    if (why != NULL)
        *why = NULL;
    if (f == NULL)
        return STATUS_NO_MEMORY;
    f->grid = grid;
    f->options = *options;
    f->vectors = vectors_best();
    if (!isnan(options->epidermis_mm)) {
        recipe.epidermis_mm = options->epidermis_mm;
        wish.fix[SKIN_EPIDERMIS_MM] = options->epidermis_mm;
    }
    enum status s = refine_wish_fit(&wish, &recipe, &fit, why);
    if (s == STATUS_OK)
        s = refine_wish_noise(&wish, NULL, 1, &f->noise, &source);
    if (s == STATUS_OK)
        s = refine_many_open(&fit, grid->first_nm, grid->step_nm, grid->n, &f->noise, &f->many,
                             why);
    if (s != STATUS_OK) {
        map_fit_close(f);
        return s;
    }
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        if (fit.role[i].free) {
            f->lo[f->parameters] = fit.role[i].lo;
            f->hi[f->parameters] = fit.role[i].hi;
            f->parameter[f->parameters++] = (enum skin_parameter)i;
        }
    name_bands(f);
    *ret = f;
    return STATUS_OK;
}

void map_fit_close(struct map_fit *f)
{
    if (f != NULL)
        refine_many_close(f->many);
    free(f);
}

size_t map_fit_bands(const struct map_fit *f)
{
    return (f->options.intervals ? 4 : 2) * f->parameters + 2;
}

const char *map_fit_band_name(const struct map_fit *f, size_t band)
{
    return f->name[band];
}

const char *map_fit_band_meaning(const struct map_fit *f, size_t band)
{
    return f->meaning[band];
}

const struct noise *map_fit_noise(const struct map_fit *f)
{
    return &f->noise;
}

/* ---- pixels ------------------------------------------------------------------------- */

enum status map_scratch_open(const struct map_fit *f, size_t pixels, struct map_scratch **ret)
{
    struct map_scratch *s = calloc(1, sizeof *s);
    if (s == NULL)
        return STATUS_NO_MEMORY;
    s->pixels = pixels;
    if (!f->grid->as_is)
        s->banded = malloc(f->grid->n * pixels * sizeof *s->banded);
    s->masked = malloc(pixels * sizeof *s->masked);
    s->which = malloc(pixels * sizeof *s->which);
    s->answers = malloc((map_fit_bands(f) - 1) * pixels * sizeof *s->answers);
    s->flags = malloc(pixels * sizeof *s->flags);
    if ((s->banded == NULL && !f->grid->as_is) || s->masked == NULL || s->which == NULL ||
        s->answers == NULL || s->flags == NULL) {
        map_scratch_close(s);
        return STATUS_NO_MEMORY;
    }
    *ret = s;
    return STATUS_OK;
}

void map_scratch_close(struct map_scratch *s)
{
    if (s == NULL)
        return;
    free(s->banded);
    free(s->masked);
    free(s->which);
    free(s->answers);
    free(s->flags);
    free(s);
}

/* Values of a group as they stand in the file. */
VECTORS_INLINE void judge_values(const struct map_fit *f, const float *used, size_t row,
                                 uint32_t *restrict masked)
{
    bool has_ignore = f->options.has_ignore;
    float ignore = has_ignore ? (float)f->options.ignore : 0.0f;
    for (size_t b = 0; b < f->grid->used; b++) {
        const float *value = used + b * row;
        VECTORS_LOOP
        for (size_t x = 0; x < MAP_FIT_GROUP;
             x++) /* neither NaN nor an infinity less itself is 0 */
            masked[x] |= value[x] - value[x] == 0.0f ? 0u : (uint32_t)MAP_NOT_A_NUMBER;
        if (!has_ignore)
            continue;
        VECTORS_LOOP
        for (size_t x = 0; x < MAP_FIT_GROUP; x++)
            masked[x] |= value[x] == ignore ? (uint32_t)MAP_IGNORED : 0u;
    }
}

/* Values of a group on the grid become, times factor, reflectances, the surface still in them;
 * then it is taken off, and what is below 0 by so little that noise explains it becomes 0, as in
 * base/spectrum.h. */
VECTORS_INLINE void judge_reflectances(const struct map_fit *f, float factor, float *banded,
                                       size_t row, uint32_t *restrict masked)
{
    bool sci = !isnan(f->options.surface);
    float surface = sci ? (float)f->options.surface : 0.0f;
    float least = sci ? (float)(f->options.surface - SPECTRUM_SURFACE_SLACK) : 0.0f;
    if (least < 0.0f)
        least = 0.0f;
    for (size_t b = 0; b < f->grid->n; b++) {
        float *restrict R = banded + b * row;
        VECTORS_LOOP
        for (size_t x = 0; x < MAP_FIT_GROUP; x++) {
            R[x] *= factor;
            masked[x] |= ((R[x] > least) & (R[x] <= (float)MAP_R_MAX)) != 0
                             ? 0u
                             : (uint32_t)MAP_OUT_OF_RANGE;
        }
        if (!sci)
            continue;
        VECTORS_LOOP
        for (size_t x = 0; x < MAP_FIT_GROUP; x++)
            R[x] = R[x] > surface ? R[x] - surface : 0.0f;
    }
}

/* Rows of whole groups, the last of which may be of anything beyond n. */
VECTORS_INLINE void judge_kind(const struct map_fit *f, float *used, size_t n, size_t row,
                               struct map_scratch *s)
{
    bool as_is = f->grid->as_is;
    float factor = (float)(1.0 / f->options.scale);
    for (size_t x = 0; x < n; x += MAP_FIT_GROUP) {
        uint32_t masked[MAP_FIT_GROUP] = { 0 };
        judge_values(f, used + x, row, masked);
        if (as_is)
            judge_reflectances(f, factor, used + x, row, masked);
        memcpy(s->masked + x, masked, sizeof masked);
    }
    if (as_is)
        return;
    band_grid_apply(f->grid, used, n, row, s->pixels, factor, s->banded);
    for (size_t x = 0; x < n; x += MAP_FIT_GROUP)
        judge_reflectances(f, 1.0f, s->banded + x, s->pixels, s->masked + x);
}

static void judge_plain(const struct map_fit *f, float *used, size_t n, size_t row,
                        struct map_scratch *s)
{
    judge_kind(f, used, n, row, s);
}

VECTORS_AVX2 static void judge_avx2(const struct map_fit *f, float *used, size_t n, size_t row,
                                    struct map_scratch *s)
{
    judge_kind(f, used, n, row, s);
}

VECTORS_AVX512 static void judge_avx512(const struct map_fit *f, float *used, size_t n, size_t row,
                                        struct map_scratch *s)
{
    judge_kind(f, used, n, row, s);
}

/* Reflectances on the grid, in place of used[] or into s->banded, and what is wrong with them. */
static void judge(const struct map_fit *f, float *used, size_t n, size_t row, struct map_scratch *s)
{
    if (f->vectors == VECTORS_WITH_AVX512)
        judge_avx512(f, used, n, row, s);
    else if (f->vectors == VECTORS_WITH_AVX2)
        judge_avx2(f, used, n, row, s);
    else
        judge_plain(f, used, n, row, s);
}

/* What a fill value or a NaN does to the reflectances tells nothing more. */
static uint32_t first_reason(uint32_t masked)
{
    return masked & (uint32_t)MAP_IGNORED        ? (uint32_t)MAP_IGNORED
           : masked & (uint32_t)MAP_NOT_A_NUMBER ? (uint32_t)MAP_NOT_A_NUMBER
                                                 : masked;
}

/* The pixels to fit, moved to the front of their rows where others lie between them; how many. */
static size_t choose(const struct map_fit *f, struct map_scratch *s, size_t n, size_t row, float *R)
{
    size_t count = 0;
    uint32_t any = 0;
    for (size_t x = 0; x < n; x++)
        any |= s->masked[x];
    if (any == 0)
        return n;
    for (size_t x = 0; x < n; x++) {
        s->masked[x] = first_reason(s->masked[x]);
        s->which[count] = x;
        count += s->masked[x] == 0 ? 1 : 0;
    }
    for (size_t b = 0; b < f->grid->n && count < n; b++)
        for (size_t i = 0; i < count; i++)
            R[b * row + i] = R[b * row + s->which[i]];
    return count;
}

/* Without branches: of several at once. */
VECTORS_INLINE uint32_t flags_of(uint32_t refined)
{
    uint32_t all = (uint32_t)REFINE_AT_BOUND * ((1u << SKIN_PARAMETERS) - 1);
    uint32_t flags = (refined & all) / (uint32_t)REFINE_AT_BOUND * (uint32_t)MAP_AT_BOUND;
    flags |= refined & (uint32_t)REFINE_NOT_CONVERGED ? (uint32_t)MAP_NOT_CONVERGED : 0u;
    flags |= refined & (uint32_t)REFINE_RESIDUAL_TOO_LARGE ? (uint32_t)MAP_RESIDUAL_TOO_LARGE : 0u;
    return refined & (uint32_t)REFINE_MANY_REFUSED ? (uint32_t)MAP_REFUSED : flags;
}

/* All n were fitted: in whole groups, the last of which ends with anything. */
VECTORS_INLINE void put_kind(const struct map_fit *f, const struct map_scratch *s, size_t n,
                             size_t row, float *map)
{
    size_t numbers = map_fit_bands(f) - 1;
    for (size_t b = 0; b < numbers; b++)
        for (size_t i = 0; i < n; i += MAP_FIT_GROUP) {
            float *restrict to = map + b * row + i;
            const double *from = s->answers + b * s->pixels + i;
            for (size_t k = 0; k < MAP_FIT_GROUP; k++)
                to[k] = (float)from[k];
        }
    for (size_t i = 0; i < n; i += MAP_FIT_GROUP) {
        float *restrict to = map + numbers * row + i;
        const uint32_t *from = s->flags + i;
        for (size_t k = 0; k < MAP_FIT_GROUP; k++)
            to[k] = (float)flags_of(from[k]);
    }
}

static void put_plain(const struct map_fit *f, const struct map_scratch *s, size_t n, size_t row,
                      float *map)
{
    put_kind(f, s, n, row, map);
}

VECTORS_AVX2 static void put_avx2(const struct map_fit *f, const struct map_scratch *s, size_t n,
                                  size_t row, float *map)
{
    put_kind(f, s, n, row, map);
}

VECTORS_AVX512 static void put_avx512(const struct map_fit *f, const struct map_scratch *s,
                                      size_t n, size_t row, float *map)
{
    put_kind(f, s, n, row, map);
}

static void put_all(const struct map_fit *f, const struct map_scratch *s, size_t n, size_t row,
                    float *map)
{
    if (f->vectors == VECTORS_WITH_AVX512)
        put_avx512(f, s, n, row, map);
    else if (f->vectors == VECTORS_WITH_AVX2)
        put_avx2(f, s, n, row, map);
    else
        put_plain(f, s, n, row, map);
}

static void put_back(const struct map_fit *f, const struct map_scratch *s, size_t count, size_t n,
                     size_t row, float *map)
{
    size_t numbers = map_fit_bands(f) - 1;
    for (size_t b = 0; b < numbers; b++) {
        float *to = map + b * row;
        const double *from = s->answers + b * s->pixels;
        for (size_t x = 0; x < n; x++)
            to[x] = NAN;
        for (size_t i = 0; i < count; i++)
            to[s->which[i]] = (float)from[i];
    }
    for (size_t x = 0; x < n; x++)
        map[numbers * row + x] = (float)s->masked[x];
    for (size_t i = 0; i < count; i++)
        map[numbers * row + s->which[i]] = (float)flags_of(s->flags[i]);
}

/* Of the intervals, from values and standard errors. */
static void find_ends(const struct map_fit *f, struct map_scratch *s, size_t count)
{
    for (size_t i = 0; i < f->parameters; i++) {
        const double *value = s->answers + i * s->pixels;
        const double *se = s->answers + (f->parameters + i) * s->pixels;
        double *lower = s->answers + (2 * f->parameters + 1 + i) * s->pixels;
        double *upper = lower + f->parameters * s->pixels;
        for (size_t x = 0; x < count; x++) { /* NaN stays NaN, as fmax() would not have it */
            double lo = value[x] - Z_95 * se[x], hi = value[x] + Z_95 * se[x];
            lower[x] = lo < f->lo[i] ? f->lo[i] : lo;
            upper[x] = hi > f->hi[i] ? f->hi[i] : hi;
        }
    }
}

enum status map_fit_run(const struct map_fit *f, struct map_scratch *s, float *used, size_t n,
                        size_t row, float *map)
{
    float *R = f->grid->as_is ? used : s->banded;
    size_t R_row = f->grid->as_is ? row : s->pixels;
    judge(f, used, n, row, s);
    size_t count = choose(f, s, n, R_row, R);
    struct refine_rows rows = { .R_float = R, .stride = 1, .band_stride = R_row, .n = count };
    struct refine_answers answers = { .rms = s->answers + 2 * f->parameters * s->pixels,
                                      .flags = s->flags };
    for (size_t i = 0; i < f->parameters; i++) {
        answers.value[f->parameter[i]] = s->answers + i * s->pixels;
        answers.se[f->parameter[i]] = s->answers + (f->parameters + i) * s->pixels;
    }
    enum status status = count > 0 ? refine_many_run(f->many, &rows, 1, &answers) : STATUS_OK;
    if (status == STATUS_OK && f->options.intervals)
        find_ends(f, s, count);
    if (status == STATUS_OK && count == n)
        put_all(f, s, n, row, map);
    else if (status == STATUS_OK)
        put_back(f, s, count, n, row, map);
    return status;
}
