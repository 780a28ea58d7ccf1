/* match_rows.c - SCE or SCI settled, the nearest row or the fit found, the answer printed. */
#include "cli/match_rows.h"

#include <math.h>
#include <stdlib.h>

#include "base/log.h"
#include "cli/colour_row.h"
#include "cli/match_fits.h"
#include "cli/options.h"
#include "cli/row_out.h"

struct match_rows {
    struct match_wish wish;
    const struct spectra *spectra;
    const struct table *table;
    struct matcher matcher;
    struct match_fits *fits;   /* NULL: the nearest row is the answer */
    struct match_scene *scene; /* NULL: none, else in place of table, matcher and fits */
    struct match_columns columns;
};

struct match_scratch {
    struct spectra_row row;
    struct match match;
    struct refined_match refined;    /* in place of it, where there is a fit */
    struct match_scene_answer scene; /* in place of both, where there is a scene */
    struct nearest_hit hits[MATCH_OUT_MAX_K];
    const struct refiner *refiner; /* of the last row, and of many */
    double first_nm, step_nm;
    size_t bands;
};

/* ---- before the first row ----------------------------------------------------------- */

static int open_matcher(struct match_rows *rows)
{
    const struct table *table = rows->table;
    enum match_by by = rows->wish.by_given ? rows->wish.by : matcher_default_by(table);
    if (rows->wish.rgb_float)
        by = MATCH_RGB_FLOAT;
    enum status s = matcher_open(table, by, &rows->matcher);
    if (s == STATUS_UNSUPPORTED) {
        log_error("table '%s' (model %s) has no spectra, so --by spectrum cannot be had of it; use "
                  "rgb, lab or de2000, or another table",
                  table->name, table->recipe.model->name);
        return EXIT_USAGE;
    }
    if (s != STATUS_OK)
        log_error("%s", status_text(s));
    return s == STATUS_OK ? EXIT_SUCCESS : EXIT_FAILURE;
}

/* Bands that these share with the table. */
static size_t common_bands(const struct match_rows *rows, const struct spectrum *bands)
{
    struct spectrum ones = *bands;
    for (size_t i = 0; i < ones.n; i++)
        ones.value[i] = 1.0; /* measured, for the count */
    return nearest_common_bands(rows->table, &ones);
}

static const char too_few_common[] = "%zu bands in common with table '%s' (%g..%g nm by %g); a "
                                     "comparison of spectra needs %d";

/* What is wrong for all rows is said once. */
static int check_bands(const struct match_rows *rows)
{
    const struct recipe *recipe = &rows->table->recipe;
    const struct spectrum *bands = spectra_bands(rows->spectra);
    static struct xyz_weights weights;
    if (bands == NULL) /* each has its own */
        return EXIT_SUCCESS;
    if (rows->matcher.by != MATCH_SPECTRUM)
        return colour_weights(rows->spectra, recipe->illuminant, recipe->observer, &weights) ==
                       STATUS_OK
                   ? EXIT_SUCCESS
                   : EXIT_FAILURE;
    size_t common = common_bands(rows, bands);
    if (common >= NEAREST_MIN_BANDS)
        return EXIT_SUCCESS;
    spectra_bands_error(rows->spectra, too_few_common, common, rows->table->name, recipe->first_nm,
                        recipe->first_nm + (double)(recipe->bands - 1) * recipe->step_nm,
                        recipe->step_nm, (int)NEAREST_MIN_BANDS);
    return EXIT_FAILURE;
}

/* The fit for the table and the bands of the file; of NDJSON, whether the wish fits the table. */
static int open_fits(struct match_rows *rows)
{
    const struct refine_wish *wish = &rows->wish.refine;
    const struct spectrum *bands = spectra_bands(rows->spectra);
    const struct refiner *refiner;
    const char *why = NULL;
    struct fit fit;
    enum status s = STATUS_NO_MEMORY;
    if (wish->kind == REFINE_NOT)
        return EXIT_SUCCESS;
    rows->fits = match_fits_open(wish, rows->table);
    if (rows->fits != NULL)
        s = bands != NULL ? match_fits_find(rows->fits, bands, &refiner, &why)
                          : refine_wish_fit(wish, &rows->table->recipe, &fit, &why);
    if (s == STATUS_OK)
        return EXIT_SUCCESS;
    log_error("--refine with table '%s' (model %s): %s", rows->table->name,
              rows->table->recipe.model->name, why != NULL ? why : status_text(s));
    return s == STATUS_NO_MEMORY ? EXIT_FAILURE : EXIT_USAGE;
}

struct match_rows *match_rows_open(const struct match_wish *wish, const struct spectra *spectra,
                                   const struct table *table, int *exit_status)
{
    struct match_rows *rows = calloc(1, sizeof *rows);
    *exit_status = EXIT_FAILURE;
    if (rows == NULL) {
        log_error("%s", status_text(STATUS_NO_MEMORY));
        return NULL;
    }
    rows->wish = *wish;
    rows->spectra = spectra;
    rows->table = table;
    match_columns_init(&rows->columns, wish->refine.kind, wish->k);
    *exit_status = open_matcher(rows);
    if (*exit_status == EXIT_SUCCESS)
        *exit_status = check_bands(rows);
    if (*exit_status == EXIT_SUCCESS)
        *exit_status = open_fits(rows);
    if (*exit_status == EXIT_SUCCESS)
        return rows;
    match_rows_close(rows);
    return NULL;
}

struct match_rows *match_rows_open_scene(const struct match_wish *wish,
                                         const struct spectra *spectra, struct match_scene *scene)
{
    struct match_rows *rows = calloc(1, sizeof *rows);
    if (rows == NULL) {
        log_error("%s", status_text(STATUS_NO_MEMORY));
        return NULL;
    }
    rows->wish = *wish;
    rows->spectra = spectra;
    rows->scene = scene;
    return rows;
}

void match_rows_close(struct match_rows *rows)
{
    if (rows == NULL)
        return;
    match_fits_close(rows->fits);
    matcher_close(&rows->matcher);
    free(rows);
}

bool match_rows_have_fits(const struct match_rows *rows)
{
    return rows->fits != NULL || rows->scene != NULL;
}

struct match_scratch *match_scratch_open(void)
{
    return calloc(1, sizeof(struct match_scratch));
}

void match_scratch_close(struct match_scratch *scratch)
{
    if (scratch == NULL)
        return;
    spectra_row_done(&scratch->row);
    free(scratch);
}

void match_printed_done(struct match_printed *printed)
{
    text_done(&printed->text);
    text_done(&printed->messages);
}

/* ---- a row -------------------------------------------------------------------------- */

const char match_rows_tell_specular[] =
    "it is not said whether the mirror reflection is in these spectra: say --specular sce, or "
    "--specular sci --surface S (skin: about 0.04), or add a column 'specular'";

/* Make the row SCE, or refuse it. */
static void settle_specular(const struct match_rows *rows, struct spectra_row *row)
{
    const struct match_wish *wish = &rows->wish;
    struct spectrum *s = &row->spectrum;
    size_t band;
    if (s->specular == SPECULAR_UNKNOWN)
        s->specular = wish->specular;
    else if (wish->specular != SPECULAR_UNKNOWN && wish->specular != s->specular)
        spectra_refuse(rows->spectra, row, SPECTRA_AT_SPECULAR,
                       "the row says %s, the option --specular %s", specular_name(s->specular),
                       specular_name(wish->specular));
    if (!row->good || s->specular == SPECULAR_SCE)
        return;
    if (s->specular == SPECULAR_UNKNOWN)
        spectra_refuse(rows->spectra, row, SPECTRA_AT_SPECULAR, "%s", match_rows_tell_specular);
    else if (isnan(wish->surface))
        spectra_refuse(rows->spectra, row, SPECTRA_AT_SPECULAR,
                       "specular is sci: these values include the mirror reflection; say --surface "
                       "S, the part to take off (skin: about 0.04)");
    else if (spectrum_remove_surface(s, wish->surface, &band) != STATUS_OK)
        spectra_refuse(rows->spectra, row, (int)band,
                       "at %g nm the reflectance %g is less than the surface %g to take off",
                       spectrum_nm(s, band), s->value[band], wish->surface);
}

/* The fit for the row's bands: as a rule the last one. */
static enum status find_refiner(struct match_rows *rows, struct match_scratch *scratch,
                                const char **why)
{
    const struct spectrum *s = &scratch->row.spectrum;
    if (scratch->refiner != NULL && scratch->first_nm == s->first_nm &&
        scratch->step_nm == s->step_nm && scratch->bands == s->n)
        return STATUS_OK;
    scratch->first_nm = s->first_nm;
    scratch->step_nm = s->step_nm;
    scratch->bands = s->n;
    scratch->refiner = NULL;
    return match_fits_find(rows->fits, s, &scratch->refiner, why);
}

static enum status answer(struct match_rows *rows, struct match_scratch *scratch, const char **why)
{
    const struct spectrum *spectrum = &scratch->row.spectrum;
    size_t k = rows->wish.k > 0 ? rows->wish.k : 1;
    *why = NULL;
    if (rows->scene != NULL)
        return match_scene_run(rows->scene, spectrum, &scratch->scene, why);
    if (rows->fits == NULL)
        return matcher_match(&rows->matcher, spectrum, k, scratch->hits, &scratch->match);
    enum status s = find_refiner(rows, scratch, why);
    if (s == STATUS_OK)
        s = refined_match(&rows->matcher, scratch->refiner, &rows->wish.refine, spectrum, 1,
                          spectrum, k, scratch->hits, &scratch->refined, why);
    return s;
}

/* A row by itself that the table or the light has too little of. */
static void refuse_answer(const struct match_rows *rows, struct spectra_row *row, enum status s,
                          const char *why)
{
    if (rows->scene == NULL && s == STATUS_UNSUPPORTED && why == NULL &&
        spectra_bands(rows->spectra) == NULL) {
        const struct recipe *recipe = &rows->table->recipe;
        if (rows->matcher.by == MATCH_SPECTRUM)
            spectra_refuse(rows->spectra, row, 0, too_few_common,
                           common_bands(rows, &row->spectrum), rows->table->name, recipe->first_nm,
                           recipe->first_nm + (double)(recipe->bands - 1) * recipe->step_nm,
                           recipe->step_nm, (int)NEAREST_MIN_BANDS);
        else
            spectra_refuse(rows->spectra, row, 0,
                           "these bands give no colour, which --by %s needs; expected 400 to 700 "
                           "nm by 10, 5 or 1",
                           match_by_name(rows->matcher.by));
        return;
    }
    spectra_refuse(rows->spectra, row, SPECTRA_AT_ROW, "%s", why != NULL ? why : status_text(s));
}

/* A scene is planned once. */
static bool has_planned_bands(const struct match_rows *rows, struct spectra_row *row)
{
    const struct spectrum *s = &row->spectrum;
    struct spectrum planned;
    if (rows->scene == NULL || match_scene_suits(rows->scene, s, &planned))
        return true;
    spectra_refuse(rows->spectra, row, 0,
                   "%zu bands %g..%g nm by %g; the scene is planned for the first row's, %zu bands "
                   "%g..%g nm by %g: give these rows to a run of their own",
                   s->n, s->first_nm, spectrum_nm(s, s->n - 1), s->step_nm, planned.n,
                   planned.first_nm, spectrum_nm(&planned, planned.n - 1), planned.step_nm);
    return false;
}

static void print_csv(const struct match_rows *rows, const struct match_scratch *scratch,
                      struct out *out)
{
    size_t k = rows->wish.k;
    row_out_carried(out, rows->spectra, &scratch->row);
    if (rows->fits != NULL)
        match_out_refined_csv(out, rows->table, &scratch->refined, scratch->hits, k);
    else
        match_out_csv(out, rows->table, &scratch->match, scratch->hits, k);
    out_text(out, "");
    out_row(out);
}

static void print_json(const struct match_rows *rows, const struct match_scratch *scratch,
                       struct out *out)
{
    size_t k = rows->wish.k;
    cJSON *object = row_out_object(&scratch->row);
    if (rows->scene != NULL)
        match_scene_json(rows->scene, &scratch->scene, object);
    else if (rows->fits != NULL)
        match_out_refined_json(object, rows->table, &scratch->refined, scratch->hits, k);
    else
        match_out_json(object, rows->table, &scratch->match, scratch->hits, k);
    row_out_members(object, &scratch->row, match_out_members, match_out_members_n);
    out_object(out, object);
}

static void print_row(struct match_rows *rows, struct match_scratch *scratch, struct out *out,
                      struct match_printed *ret)
{
    struct spectra_row *row = &scratch->row;
    const char *why;
    if (row->good)
        settle_specular(rows, row);
    if (row->good && has_planned_bands(rows, row)) {
        enum status s = answer(rows, scratch, &why);
        if (s != STATUS_OK)
            refuse_answer(rows, row, s, why);
    }
    if (!row->good) {
        ret->bad = true;
        spectra_add_message(rows->spectra, row, &ret->messages);
        row_out_bad(out, rows->spectra, row, rows->columns.n);
    } else if (out->format == OUT_PLAIN) {
        print_csv(rows, scratch, out);
    } else {
        print_json(rows, scratch, out);
    }
}

/* ---- a piece ------------------------------------------------------------------------ */

void match_rows_begin(const struct match_rows *rows, bool header, struct text *into)
{
    struct out out;
    out_begin_part(&out, rows->wish.format, 0, into);
    if (rows->wish.format == OUT_JSON)
        text_add(into, "[", 1);
    if (header)
        row_out_header(&out, rows->spectra, rows->columns.name, rows->columns.n);
}

void match_rows_end(const struct match_rows *rows, size_t objects, struct text *into)
{
    if (rows->wish.format == OUT_JSON)
        text_add(into, objects > 0 ? "\n]\n" : "]\n", objects > 0 ? 3 : 2);
}

void match_rows_print(struct match_rows *rows, struct spectra_piece *piece, size_t objects,
                      bool strict, struct match_scratch *scratch, struct match_printed *ret)
{
    struct out out;
    struct spectra_row *row = &scratch->row;
    enum status s = STATUS_OK;
    ret->text.n = ret->messages.n = ret->rows = 0;
    ret->bad = false;
    out_begin_part(&out, rows->wish.format, objects, &ret->text);
    row->quiet = true;
    while (s == STATUS_OK) {
        s = spectra_read(rows->spectra, piece, row);
        if (s != STATUS_OK)
            break;
        print_row(rows, scratch, &out, ret);
        ret->rows++;
        if (strict && !row->good)
            s = STATUS_CANCELLED;
    }
    if (s == STATUS_FORMAT)
        spectra_add_piece_message(rows->spectra, piece, &ret->messages);
    else if (s == STATUS_NO_MEMORY)
        out_of_memory();
    ret->status = s == STATUS_NOT_FOUND ? STATUS_OK : s;
}
