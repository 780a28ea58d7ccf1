/* export.c - a page is filled record by record, until one more would be too much. */
#include "station/export.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/number.h"
#include "base/version.h"
#include "json/print.h"
#include "station/strict_json.h"
#include "station/wire.h"

enum {
    FIRST_NM = 360, /* of the columns of a CSV file */
    LAST_NM = 740,
    FULL_FIRST_NM = 400, /* what `skinspec match` and a CGATS file want without a gap */
    FULL_LAST_NM = 700,
    STEP_NM = 10,
    FIRST_CAPACITY = 4096,
};

/* ---- text that grows ---------------------------------------------------------------- */

struct text {
    char *bytes; /* bytes[n] is NUL */
    size_t n, capacity;
    bool failed; /* no memory: what was put since is lost */
};

static void put_bytes(struct text *t, const char *bytes, size_t n)
{
    size_t capacity = t->capacity > 0 ? t->capacity : FIRST_CAPACITY;
    while (capacity <= t->n + n)
        capacity *= 2;
    char *larger = capacity > t->capacity ? realloc(t->bytes, capacity) : t->bytes;
    if (larger == NULL) {
        t->failed = true;
        return;
    }
    t->bytes = larger;
    t->capacity = capacity;
    memcpy(t->bytes + t->n, bytes, n);
    t->n += n;
    t->bytes[t->n] = '\0';
}

static void put(struct text *t, const char *text)
{
    put_bytes(t, text, strlen(text));
}

static void put_integer(struct text *t, int64_t x)
{
    char text[NUMBER_TEXT_SIZE];
    snprintf(text, sizeof text, "%lld", (long long)x);
    put(t, text);
}

/* ---- a page ------------------------------------------------------------------------- */

struct page {
    struct store_reader *reader;
    const struct format *format;
    struct export_request request; /* nothing left to the default */
    struct text text;
    size_t records; /* in this page, those left out included */
    int64_t next_seq;
    bool full; /* there was one more */
    enum status status;
};

struct format {
    const char *name, *tail;
    enum status (*head)(struct page *page);
    enum status (*record)(struct page *page, const struct store_record *record);
};

/* ---- csv ---------------------------------------------------------------------------- */

static const char csv_columns[] =
    "id,seq,taken_at,uuid,operator,instrument,serial,specular,aperture_mm,surface,subject,site,"
    "X,Y,Z,L,a,b,R,G,B,ITA,illuminant,observer,Cm,Bm,Ch,dE00,rms,by,table,match_flags,flags,"
    "corrects,calibration_id,fence,refine,SO2,epidermis_mm,scattering_a,scattering_b";
static const char csv_fit_columns[] = "chi_square,degrees,p,noise,placement,row,nearest_Cm,"
                                      "nearest_Bm,nearest_Ch";
enum { FIT_COLUMNS = 9 };

static enum status csv_head(struct page *page)
{
    struct text *t = &page->text;
    put(t, csv_columns);
    for (size_t i = 0; i < SKIN_PARAMETERS; i++) {
        static const char *const ends[] = { "_se", "_lo", "_hi" };
        for (size_t j = 0; j < 3; j++) {
            put(t, ",");
            put(t, skin_parameter_name(i));
            put(t, ends[j]);
        }
    }
    put(t, ",");
    put(t, csv_fit_columns);
    for (int nm = FIRST_NM; nm <= LAST_NM; nm += STEP_NM) {
        put(t, nm < FULL_FIRST_NM || nm > FULL_LAST_NM ? ",nm" : ",");
        put_integer(t, nm);
    }
    put(t, "\r\n");
    return STATUS_OK;
}

/* Cells bring the comma before them; the first of a row, its id, is put without. */
static void csv_number(struct text *t, double x)
{
    char text[NUMBER_TEXT_SIZE];
    put(t, ",");
    if (!isnan(x))
        put(t, number_format_exact(x, text));
}

static bool is_formula(const char *text)
{
    return *text != '\0' && strchr("=+-@\t\r\n", *text) != NULL;
}

/* Blanks at the ends need quotes too: readers drop them. */
static bool needs_quotes(const char *text)
{
    size_t n = strlen(text);
    return strpbrk(text, ",\"\r\n") != NULL || (n > 0 && (text[0] == ' ' || text[n - 1] == ' '));
}

static void csv_text(struct text *t, const char *text)
{
    bool quotes = needs_quotes(text);
    put(t, quotes ? ",\"" : ",");
    if (is_formula(text))
        put(t, "'");
    for (const char *part = text; *part != '\0';) {
        size_t n = strcspn(part, "\"");
        put_bytes(t, part, n);
        if (part[n] == '"')
            put(t, "\"\"");
        part += n + (part[n] == '"');
    }
    put(t, quotes ? "\"" : "");
}

/* The tokens of a JSON array, between semicolons. */
static void csv_tokens(struct text *t, const cJSON *array)
{
    const cJSON *one;
    const char *between = ",";
    if (cJSON_GetArraySize(array) == 0)
        put(t, ",");
    cJSON_ArrayForEach(one, array)
    {
        put(t, between);
        put(t, cJSON_IsString(one) ? one->valuestring : "");
        between = ";";
    }
}

/* JSON of the store; *ret stays NULL where it is none. */
static enum status parse(const char *text, cJSON **ret)
{
    enum strict_json_fault fault;
    enum status s = strict_json_parse(text, strlen(text), ret, &fault, NULL);
    return s == STATUS_FORMAT ? STATUS_OK : s;
}

static void csv_identity(struct text *t, const struct store_record *r)
{
    const struct store_instrument *i = &r->instrument;
    char name[sizeof i->maker + sizeof i->model];
    snprintf(name, sizeof name, "%s%s%s", i->maker, *i->maker != '\0' ? " " : "", i->model);
    put(t, r->id);
    csv_number(t, (double)r->seq);
    csv_text(t, r->taken_at);
    csv_text(t, r->uuid);
    csv_text(t, r->operator_name);
    csv_text(t, name);
    csv_text(t, i->serial);
    csv_text(t, r->specular != SPECULAR_UNKNOWN ? specular_name(r->specular) : "");
    csv_number(t, r->aperture_mm);
    csv_number(t, r->surface);
    csv_text(t, r->subject);
    csv_text(t, r->site);
}

static void csv_colour(struct text *t, const struct store_record *r)
{
    for (size_t i = 0; i < 3; i++)
        csv_number(t, r->XYZ[i]);
    for (size_t i = 0; i < 3; i++)
        csv_number(t, r->Lab[i]);
    for (size_t i = 0; i < 3; i++)
        csv_number(t, isnan(r->XYZ[i]) ? (double)NAN : r->sRGB[i]);
    csv_number(t, r->ITA);
    csv_text(t, r->illuminant);
    csv_text(t, r->observer);
}

static void csv_numbers(struct text *t, const double *x, size_t n)
{
    for (size_t i = 0; i < n; i++)
        csv_number(t, x[i]);
}

static void csv_empty(struct text *t, size_t n)
{
    for (size_t i = 0; i < n; i++)
        put(t, ",");
}

/* The answer: of a refined match that, else the nearest row. */
static void csv_match(struct text *t, const struct wire_match *m, const cJSON *flags)
{
    const struct table_row *row = &m->match.row;
    const struct refined *r = &m->refined.refined;
    const double nearest[] = { row->Cm, row->Bm, row->Ch, m->match.dE00, m->match.rms };
    const double refined[] = { r->value[SKIN_CM], r->value[SKIN_BM], r->value[SKIN_CH], r->dE00,
                               r->rms };
    csv_numbers(t, m->is_refined ? refined : nearest, 5);
    csv_text(t, match_by_name(m->match.by));
    csv_text(t, m->table);
    csv_tokens(t, flags);
}

/* How sure it is. */
static void csv_refined(struct text *t, const struct refined_match *match)
{
    const struct refined *r = &match->refined;
    const struct table_row *row = &match->nearest.row;
    const double fit[FIT_COLUMNS] = { r->chi_square,
                                      (double)r->degrees,
                                      r->degrees > 0 ? r->chi_square_p : (double)NAN,
                                      r->noise.white,
                                      r->noise.placement,
                                      (double)match->nearest.row_index + 1.0,
                                      row->Cm,
                                      row->Bm,
                                      row->Ch };
    csv_text(t, refine_kind_name(match->wish.kind));
    csv_numbers(t, r->value + SKIN_SO2, SKIN_PARAMETERS - SKIN_SO2);
    for (size_t i = 0; i < SKIN_PARAMETERS; i++) {
        const double one[] = { r->se[i], r->lo[i], r->hi[i] };
        csv_numbers(t, one, 3);
    }
    csv_numbers(t, fit, FIT_COLUMNS);
}

/* Reflectance at that wavelength, NAN where it was not measured. */
static double value_at(const struct spectrum *s, int nm)
{
    size_t i = spectrum_band(s, nm);
    return i < s->n ? s->value[i] : NAN;
}

static enum status csv_record(struct page *page, const struct store_record *r)
{
    struct text *t = &page->text;
    cJSON *flags = NULL, *match = NULL;
    struct wire_match m;
    enum status s = parse(r->flags, &flags);
    if (s == STATUS_OK)
        s = parse(r->refined_json[0] != '\0' ? r->refined_json : r->match_json, &match);
    bool matched = wire_read_match(match, &m) == STATUS_OK;
    csv_identity(t, r);
    csv_colour(t, r);
    if (matched)
        csv_match(t, &m, strict_json_member(match, "flags"));
    else
        csv_empty(t, 8);
    csv_tokens(t, flags);
    csv_text(t, r->corrects);
    csv_text(t, r->calibration_id);
    csv_number(t, r->fence > 0 ? (double)r->fence : (double)NAN);
    if (matched && m.is_refined)
        csv_refined(t, &m.refined);
    else
        csv_empty(t, 1 + (SKIN_PARAMETERS - SKIN_SO2) + (size_t)3 * SKIN_PARAMETERS + FIT_COLUMNS);
    for (int nm = FIRST_NM; nm <= LAST_NM; nm += STEP_NM)
        csv_number(t, value_at(&r->spectrum, nm));
    put(t, "\r\n");
    cJSON_Delete(flags);
    cJSON_Delete(match);
    return s;
}

/* ---- json --------------------------------------------------------------------------- */

static enum status json_head(struct page *page)
{
    put(&page->text, "[");
    return STATUS_OK;
}

static enum status json_record(struct page *page, const struct store_record *record)
{
    cJSON *object = NULL;
    char *text = NULL;
    enum status s = wire_record(record, &object);
    if (s == STATUS_OK)
        s = json_print(object, SIZE_MAX, &text, NULL);
    if (s == STATUS_OK) {
        put(&page->text, page->request.first && page->records == 0 ? "\n" : ",\n");
        put(&page->text, text);
    }
    cJSON_Delete(object);
    free(text);
    return s;
}

/* ---- cgats -------------------------------------------------------------------------- */

static bool fits_cgats(const struct store_record *r)
{
    bool fits = !isnan(r->XYZ[0]);
    for (int nm = FULL_FIRST_NM; nm <= FULL_LAST_NM; nm += STEP_NM)
        fits = fits && !isnan(value_at(&r->spectrum, nm));
    return fits;
}

struct count {
    int64_t all, fit;
};

static bool count_record(void *context, const struct store_record *record)
{
    struct count *count = context;
    count->all++;
    count->fit += fits_cgats(record);
    return true;
}

static enum status list(const struct page *page, store_visit *visit, void *context)
{
    const struct export_request *r = &page->request;
    struct store_query query = { r->since_seq, r->until_seq, NULL, -1 };
    if (r->until_seq == 0) /* an empty store; what comes meanwhile is not asked for */
        return STATUS_OK;
    return store_list(page->reader, &query, visit, context);
}

/* The number of sets stands before them, so all records of the file are looked at first. */
static enum status cgats_head(struct page *page)
{
    struct text *t = &page->text;
    struct count count = { 0, 0 };
    enum status s = list(page, count_record, &count);
    put(t, "SPECT\n\n"
           "DESCRIPTOR \"Reflectance of skin\"\n"
           "ORIGINATOR \"skinspec " SKINSPEC_VERSION "\"\n"
           "MEAS_TYPE \"REFLECTIVE\"\n"
           "WEIGHTING_FUNCTION \"ILLUMINANT, D65\"\n"
           "WEIGHTING_FUNCTION \"OBSERVER, 10 degree\"\n"
           "SPECTRAL_BANDS \"31\"\n"
           "SPECTRAL_START_NM \"400.0\"\n"
           "SPECTRAL_END_NM \"700.0\"\n"
           "SPECTRAL_NORM \"100.0\"\n"
           "# records left out for want of a band or a colour: ");
    put_integer(t, count.all - count.fit);
    put(t, "\n\nNUMBER_OF_FIELDS 38\nBEGIN_DATA_FORMAT\n"
           "SAMPLE_ID XYZ_X XYZ_Y XYZ_Z LAB_L LAB_A LAB_B");
    for (int nm = FULL_FIRST_NM; nm <= FULL_LAST_NM; nm += STEP_NM) {
        put(t, " SPEC_");
        put_integer(t, nm);
    }
    put(t, "\nEND_DATA_FORMAT\n\nNUMBER_OF_SETS ");
    put_integer(t, count.fit);
    put(t, "\nBEGIN_DATA\n");
    return s;
}

/* ArgyllCMS takes a number without a point for an integer, and refuses it. */
static void cgats_number(struct text *t, double x)
{
    char text[NUMBER_TEXT_SIZE];
    put(t, " ");
    put(t, number_format(x, 9, text));
    put(t, strpbrk(text, ".e") == NULL ? ".0" : "");
}

static enum status cgats_record(struct page *page, const struct store_record *r)
{
    struct text *t = &page->text;
    if (!fits_cgats(r))
        return STATUS_OK;
    put(t, "\"");
    put(t, r->id);
    put(t, "\"");
    for (size_t i = 0; i < 3; i++)
        cgats_number(t, r->XYZ[i]);
    for (size_t i = 0; i < 3; i++)
        cgats_number(t, r->Lab[i]);
    for (int nm = FULL_FIRST_NM; nm <= FULL_LAST_NM; nm += STEP_NM)
        cgats_number(t, 100.0 * value_at(&r->spectrum, nm));
    put(t, "\n");
    return STATUS_OK;
}

/* ---- all of them -------------------------------------------------------------------- */

static const struct format formats[] = {
    [EXPORT_CSV] = { "csv", "", csv_head, csv_record },
    [EXPORT_JSON] = { "json", "\n]\n", json_head, json_record },
    [EXPORT_CGATS] = { "cgats", "END_DATA\n", cgats_head, cgats_record },
};
enum { FORMATS = sizeof formats / sizeof *formats };

enum status export_format_parse(const char *text, enum export_format *ret)
{
    for (size_t i = 0; i < FORMATS; i++) {
        if (strcmp(text, formats[i].name) == 0) {
            *ret = (enum export_format)i;
            return STATUS_OK;
        }
    }
    return STATUS_NOT_FOUND;
}

/* The tail has its room kept: nobody knows yet whether another page follows. */
static bool add_record(void *context, const struct store_record *record)
{
    struct page *p = context;
    size_t before = p->text.n;
    p->full = p->records == p->request.limit;
    if (p->full)
        return false;
    p->status = p->format->record(p, record);
    if (p->status != STATUS_OK || p->text.failed)
        return false;
    p->full = p->records > 0 && p->text.n + strlen(p->format->tail) > p->request.bytes;
    if (p->full) {
        p->text.n = before;
        p->text.bytes[before] = '\0';
        return false;
    }
    p->records++;
    p->next_seq = record->seq;
    return true;
}

static enum status fill(struct page *page)
{
    enum status s = STATUS_OK;
    put(&page->text, ""); /* there is a text from here on, be it empty */
    if (page->request.until_seq == 0)
        s = store_newest(page->reader, &page->request.until_seq);
    if (s == STATUS_OK && page->request.first)
        s = page->format->head(page);
    if (s == STATUS_OK)
        s = list(page, add_record, page);
    if (s == STATUS_OK)
        s = page->status;
    if (s == STATUS_OK && !page->full)
        put(&page->text, page->format->tail);
    return s == STATUS_OK && page->text.failed ? STATUS_NO_MEMORY : s;
}

enum status export_page(struct store_reader *reader, const struct export_request *request,
                        struct export_page *ret)
{
    struct page page = { .reader = reader,
                         .format = &formats[request->format],
                         .request = *request,
                         .next_seq = request->since_seq };
    if (page.request.bytes == 0)
        page.request.bytes = EXPORT_PAGE_BYTES;
    enum status s = fill(&page);
    if (s == STATUS_OK)
        *ret = (struct export_page){ page.text.bytes, page.text.n, page.next_seq,
                                     page.request.until_seq, page.full };
    else
        free(page.text.bytes);
    return s;
}
