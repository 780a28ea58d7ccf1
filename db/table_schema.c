/* table_schema.c - the SQL of a table file, and its meta rows. */
#include "db/table_schema.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/number.h"
#include "base/version.h"

const char table_settings_sql[] =
    /* Fewer pages are quicker to fill and to read, and hold rows with less between them. */
    "PRAGMA page_size = 16384;"
    /* Until it is renamed the file may be lost, not half kept. */
    "PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF; PRAGMA locking_mode = EXCLUSIVE;";

const char table_schema_sql[] =
    /* What the table was made from; `skinspec table verify` rebuilds it from here. */
    "CREATE TABLE meta(\n"
    "  key   TEXT PRIMARY KEY,\n"
    "  value TEXT NOT NULL\n"
    ") WITHOUT ROWID;\n"
    "CREATE TABLE entry(\n"
    "  id INTEGER PRIMARY KEY,   -- 1 .. rows, in the order of the grid: ch fastest, then bm, cm\n"
    "  cm REAL NOT NULL,         -- melanin fraction of the epidermis\n"
    "  bm REAL NOT NULL,         -- eumelanin share of the melanin\n"
    "  ch REAL NOT NULL,         -- blood fraction of the dermis\n"
    "  l  REAL NOT NULL,         -- CIE L*, a*, b* under meta's illuminant and observer\n"
    "  a  REAL NOT NULL,\n"
    "  b  REAL NOT NULL,\n"
    "  r  REAL NOT NULL,         -- linear sRGB, 1 for white, not clipped\n"
    "  g  REAL NOT NULL,\n"
    "  b_ REAL NOT NULL,\n"
    "  spectrum BLOB             -- reflectance per band, little-endian float32; NULL without\n"
    ");\n";

const char table_schema_rtree_sql[] =
    "CREATE VIRTUAL TABLE entry_lab USING rtree(\n"
    "  id, l_min, l_max, a_min, a_max, b_min, b_max  -- float32, rounded outwards\n"
    ");\n";

static void add(struct table_meta *meta, size_t *n, const char *key, const char *value)
{
    meta->key[*n] = key;
    snprintf(meta->value[*n], TABLE_META_VALUE_SIZE, "%s", value);
    ++*n;
}

static void bands_format(const struct recipe *recipe, char *text, size_t size)
{
    char first[NUMBER_TEXT_SIZE], last[NUMBER_TEXT_SIZE], step[NUMBER_TEXT_SIZE];
    if (recipe->bands == 0) {
        snprintf(text, size, "none");
        return;
    }
    double last_nm = recipe->first_nm + (double)(recipe->bands - 1) * recipe->step_nm;
    snprintf(text, size, "%s:%s:%s", number_format_exact(recipe->first_nm, first),
             number_format_exact(last_nm, last), number_format_exact(recipe->step_nm, step));
}

/* Keys in alphabetical order: the canonical dump relies on it. */
void table_meta_of(const struct recipe *recipe, struct table_meta *ret)
{
    char axis[AXIS_TEXT_SIZE], number[NUMBER_TEXT_SIZE], bands[TABLE_META_VALUE_SIZE];
    size_t n = 0;
    bands_format(recipe, bands, sizeof bands);
    add(ret, &n, "bands_nm", bands);
    add(ret, &n, "bm", axis_format(&recipe->grid.Bm, axis));
    add(ret, &n, "ch", axis_format(&recipe->grid.Ch, axis));
    add(ret, &n, "cm", axis_format(&recipe->grid.Cm, axis));
    add(ret, &n, "code_version", SKINSPEC_VERSION);
    add(ret, &n, "epidermis_mm", number_format_exact(recipe->epidermis_mm, number));
    add(ret, &n, "eta", number_format_exact(recipe->eta, number));
    add(ret, &n, "gamma", number_format_exact(recipe->gamma, number));
    add(ret, &n, "illuminant", illuminant_name(recipe->illuminant));
    add(ret, &n, "model", recipe->model->name);
    add(ret, &n, "observer_deg", observer_name(recipe->observer));
    add(ret, &n, "rgb_reading", recipe->rgb_reading == RGB_READING_CODED ? "coded" : "linear");
    snprintf(number, sizeof number, "%zu", grid_rows(&recipe->grid));
    add(ret, &n, "rows", number);
}

enum status table_bands_parse(const char *text, double *first_nm, double *step_nm, size_t *bands)
{
    char copy[TABLE_META_VALUE_SIZE];
    double first, last, step;
    if (strlen(text) >= sizeof copy)
        return STATUS_FORMAT;
    strcpy(copy, text);
    char *second = strchr(copy, ':');
    char *third = second != NULL ? strchr(second + 1, ':') : NULL;
    if (third == NULL)
        return STATUS_FORMAT;
    *second++ = '\0';
    *third++ = '\0';
    if (number_parse(copy, &first) != STATUS_OK || number_parse(second, &last) != STATUS_OK ||
        number_parse(third, &step) != STATUS_OK)
        return STATUS_FORMAT;
    double steps = nearbyint((last - first) / step);
    if (!(step > 0.0 && last >= first && steps < SPECTRUM_MAX_BANDS) ||
        fabs(first + steps * step - last) > 1e-9)
        return STATUS_RANGE;
    *first_nm = first;
    *step_nm = step;
    *bands = (size_t)steps + 1;
    return STATUS_OK;
}

struct meta_reader {
    table_meta_lookup *lookup;
    void *context;
    const char *bad_key;
};

static const char *value_of(struct meta_reader *r, const char *key)
{
    const char *value = r->lookup(r->context, key);
    if (value == NULL && r->bad_key == NULL)
        r->bad_key = key;
    return value != NULL ? value : "";
}

/* Remember the first key that was not understood. */
static void expect(struct meta_reader *r, const char *key, bool understood)
{
    if (!understood && r->bad_key == NULL)
        r->bad_key = key;
}

static void read_axis(struct meta_reader *r, const char *key, struct axis *ret)
{
    expect(r, key, axis_parse(value_of(r, key), ret) == STATUS_OK);
}

static void read_number(struct meta_reader *r, const char *key, double *ret)
{
    expect(r, key, number_parse(value_of(r, key), ret) == STATUS_OK);
}

enum status table_meta_recipe(table_meta_lookup *lookup, void *context, struct recipe *ret,
                              const char **bad_key)
{
    struct meta_reader r = { lookup, context, NULL };
    struct recipe recipe = { .model = model_find(value_of(&r, "model")) };
    expect(&r, "model", recipe.model != NULL);
    read_axis(&r, "cm", &recipe.grid.Cm);
    read_axis(&r, "bm", &recipe.grid.Bm);
    read_axis(&r, "ch", &recipe.grid.Ch);
    read_number(&r, "epidermis_mm", &recipe.epidermis_mm);
    read_number(&r, "eta", &recipe.eta);
    read_number(&r, "gamma", &recipe.gamma);
    const char *bands = value_of(&r, "bands_nm");
    if (strcmp(bands, "none") != 0)
        expect(&r, "bands_nm",
               table_bands_parse(bands, &recipe.first_nm, &recipe.step_nm, &recipe.bands) ==
                   STATUS_OK);
    expect(&r, "illuminant",
           illuminant_parse(value_of(&r, "illuminant"), &recipe.illuminant) == STATUS_OK);
    expect(&r, "observer_deg",
           observer_parse(value_of(&r, "observer_deg"), &recipe.observer) == STATUS_OK);
    const char *reading = value_of(&r, "rgb_reading");
    recipe.rgb_reading = strcmp(reading, "coded") == 0 ? RGB_READING_CODED : RGB_READING_LINEAR;
    expect(&r, "rgb_reading", strcmp(reading, "coded") == 0 || strcmp(reading, "linear") == 0);
    if (r.bad_key != NULL) {
        *bad_key = r.bad_key;
        return STATUS_FORMAT;
    }
    *ret = recipe;
    return STATUS_OK;
}
