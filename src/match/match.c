/* match.c - colour of the query, search, and what is to be said about the row. */
#include "match/match.h"

#include <math.h>
#include <stdlib.h>

#include "colour/delta_e.h"
#include "colour/lab.h"
#include "colour/srgb.h"
#include "colour/xyz.h"

const char *match_flag_name(size_t i)
{
    static const char *const name[MATCH_FLAG_COUNT] = {
        "Cm_at_limit", "Bm_at_limit", "Ch_at_limit", "Bm_undetermined",
        "tie",         "poor_fit",    "no_colour",   "bands_zeroed",
    };
    return i < MATCH_FLAG_COUNT ? name[i] : "unknown";
}

enum match_by matcher_default_by(const struct table *table)
{
    return table->spectrum != NULL ? MATCH_SPECTRUM : MATCH_RGB;
}

/* Weights laid on the table's own bands; none where bands that colour/xyz.h does not
 * take were put into a table by hand: spectra on them have no colour. */
static enum status open_weights(const struct table *table, struct xyz_weights **ret)
{
    const struct recipe *recipe = &table->recipe;
    *ret = NULL;
    if (recipe->bands == 0)
        return STATUS_OK;
    struct xyz_weights *weights = calloc(1, sizeof *weights);
    if (weights == NULL)
        return STATUS_NO_MEMORY;
    if (xyz_weights_init(recipe->illuminant, recipe->observer, recipe->first_nm, recipe->step_nm,
                         recipe->bands, weights) == STATUS_OK)
        *ret = weights;
    else
        free(weights);
    return STATUS_OK;
}

enum status matcher_open(const struct table *table, enum match_by by, struct matcher *ret)
{
    struct matcher matcher = { .table = table, .by = by };
    enum status s = nearest_open(table, by, &matcher.nearest);
    if (s == STATUS_OK)
        s = open_weights(table, &matcher.weights);
    if (s == STATUS_OK)
        *ret = matcher;
    else
        matcher_close(&matcher);
    return s;
}

void matcher_close(struct matcher *matcher)
{
    nearest_close(matcher->nearest);
    free(matcher->weights);
    matcher->nearest = NULL;
    matcher->weights = NULL;
}

/* The part of the spectrum that colour is taken from: the table's bands where the
 * spectrum is on the same grid and has them all, then true; else all of it. */
static bool colour_bands(const struct recipe *recipe, const struct spectrum *s, size_t *first,
                         size_t *n)
{
    *first = 0;
    *n = s->n;
    if (recipe->bands == 0 || s->step_nm != recipe->step_nm)
        return false;
    size_t begin = spectrum_band(s, recipe->first_nm);
    if (begin + recipe->bands > s->n)
        return false;
    *first = begin;
    *n = recipe->bands;
    return true;
}

static enum status colour_of(const struct xyz_weights *weights, const double *value, double Lab[3],
                             double rgb[3])
{
    double XYZ[3];
    xyz_from_reflectance(weights, value, XYZ);
    if (isnan(XYZ[0] + XYZ[1] + XYZ[2]))
        return STATUS_UNSUPPORTED; /* a band was not measured */
    lab_from_xyz(XYZ, weights->white, Lab);
    srgb_linear_from_xyz(XYZ, weights->white, rgb);
    return STATUS_OK;
}

/* own: weights of the table's bands, where they have been made (may be NULL). */
static enum status colour_with(const struct recipe *recipe, const struct xyz_weights *own,
                               const struct spectrum *spectrum, double Lab[3], double rgb[3])
{
    struct xyz_weights weights;
    size_t first, n;
    if (colour_bands(recipe, spectrum, &first, &n) && own != NULL)
        return colour_of(own, spectrum->value + first, Lab, rgb);
    enum status s = xyz_weights_init(recipe->illuminant, recipe->observer,
                                     spectrum_nm(spectrum, first), spectrum->step_nm, n, &weights);
    return s == STATUS_OK ? colour_of(&weights, spectrum->value + first, Lab, rgb) : s;
}

enum status matcher_colour(const struct table *table, const struct spectrum *spectrum,
                           double Lab[3], double rgb[3])
{
    return colour_with(&table->recipe, NULL, spectrum, Lab, rgb);
}

static bool at_limit(const struct axis *axis, double value)
{
    return axis->n > 1 && (value == axis->lo || value == axis->hi);
}

static unsigned flags_of(const struct matcher *matcher, const struct spectrum *spectrum,
                         const struct match *match, const struct nearest_hit *hits, bool no_colour)
{
    const struct grid *grid = &matcher->table->recipe.grid;
    unsigned flags = 0;
    flags |= at_limit(&grid->Cm, match->row.Cm) ? MATCH_CM_AT_LIMIT : 0u;
    flags |= at_limit(&grid->Ch, match->row.Ch) ? MATCH_CH_AT_LIMIT : 0u;
    if (match->row.Cm == 0.0)
        flags |= MATCH_BM_UNDETERMINED;
    else if (at_limit(&grid->Bm, match->row.Bm))
        flags |= MATCH_BM_AT_LIMIT;
    if (match->found > 1 && hits[1].distance == hits[0].distance)
        flags |= MATCH_TIE;
    if (match->rms > MATCH_POOR_RMS || (isnan(match->rms) && match->dE00 > MATCH_POOR_DE00))
        flags |= MATCH_POOR_FIT;
    if (isnan(match->dE00) && !no_colour)
        flags |= MATCH_NO_COLOUR;
    for (size_t i = 0; i < spectrum->n; i++)
        if (spectrum->flag[i] & SPECTRUM_BAND_ZEROED)
            flags |= MATCH_BANDS_ZEROED;
    return flags;
}

enum status matcher_match(const struct matcher *matcher, const struct spectrum *spectrum, size_t k,
                          struct nearest_hit *hits, struct match *ret)
{
    return matcher_match_asked(matcher, &(struct match_ask){ 0 }, spectrum, k, hits, ret);
}

enum status matcher_match_asked(const struct matcher *matcher, const struct match_ask *ask,
                                const struct spectrum *spectrum, size_t k, struct nearest_hit *hits,
                                struct match *ret)
{
    struct nearest_query query = { .spectrum = spectrum, .range = ask->range, .work = ask->work };
    bool no_colour = ask->no_colour && matcher->by == MATCH_SPECTRUM;
    struct match match = { .by = matcher->by, .dE00 = NAN, .rms = NAN };
    struct nearest_hit two[2]; /* a tie shows only in the second */
    if (k == 0)
        return STATUS_RANGE;
    if (spectrum->specular != SPECULAR_SCE)
        return STATUS_UNSUPPORTED;
    query.has_colour = !no_colour && colour_with(&matcher->table->recipe, matcher->weights,
                                                 spectrum, query.Lab, query.rgb) == STATUS_OK;
    struct nearest_hit *found = k < 2 ? two : hits;
    enum status s = nearest_find(matcher->nearest, &query, k < 2 ? 2 : k, found, &match.found);
    if (s != STATUS_OK)
        return s;
    match.row_index = found[0].row;
    match.distance = found[0].distance;
    table_get(matcher->table, match.row_index, &match.row);
    if (query.has_colour)
        match.dE00 = delta_e_2000(query.Lab, match.row.Lab);
    if (matcher->by == MATCH_SPECTRUM)
        match.rms = match.distance;
    else if (!ask->no_spectra)
        match.rms = nearest_rms(matcher->table, match.row_index, spectrum);
    match.flags = flags_of(matcher, spectrum, &match, found, no_colour);
    if (k < 2) {
        hits[0] = two[0];
        match.found = 1;
    }
    *ret = match;
    return STATUS_OK;
}
