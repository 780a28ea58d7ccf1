/* envi_header.c - fields one by one, then whether they make a cube. */
#include "cube/envi_header.h"

#include <ctype.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "base/number.h"

/* Of one number or word; lists are read item by item. */
enum { NAME_SIZE = 64, WORD_SIZE = 64 };

enum field {
    FIELD_SAMPLES,
    FIELD_LINES,
    FIELD_BANDS,
    FIELD_OFFSET,
    FIELD_TYPE,
    FIELD_INTERLEAVE,
    FIELD_ORDER,
    FIELD_WAVELENGTH,
    FIELD_UNITS,
    FIELD_SCALE,
    FIELD_IGNORE,
    FIELD_BBL,
    FIELD_COMPRESSION,
    FIELD_GAIN,
    FIELD_SHIFT,
    FIELD_FRAMES,
    FIELDS
};

static const char *const field_names[FIELDS] = {
    "samples",
    "lines",
    "bands",
    "header offset",
    "data type",
    "interleave",
    "byte order",
    "wavelength",
    "wavelength units",
    "reflectance scale factor",
    "data ignore value",
    "bbl",
    "file compression",
    "data gain values",
    "data offset values",
    "major frame offsets",
};

/* A field's value as it stands in the text, without braces. */
struct value {
    const char *text;
    size_t n, line; /* line 0: the field is not there */
};

struct reader {
    const char *at, *end;
    size_t line;
    struct value field[FIELDS];
    struct envi_fault *fault;
};

__attribute__((format(printf, 4, 5))) static enum status
refuse(struct reader *r, enum status s, size_t line, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    r->fault->line = line;
    vsnprintf(r->fault->text, sizeof r->fault->text, format, arguments);
    va_end(arguments);
    return s;
}

static bool blank(char c)
{
    return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\v' || c == '\f';
}

static struct value trimmed(const char *text, const char *end, size_t line)
{
    while (text < end && blank(*text))
        text++;
    while (text < end && blank(end[-1]))
        end--;
    return (struct value){ text, (size_t)(end - text), line };
}

/* As much of a value as a message shows, in printable characters. */
static const char *shown(const struct value *v, char ret[WORD_SIZE])
{
    enum { MOST = 32 };
    size_t n = v->n < MOST ? v->n : MOST;
    for (size_t i = 0; i < n; i++)
        ret[i] = v->text[i] >= ' ' && v->text[i] <= '~' ? v->text[i] : '?';
    snprintf(ret + n, WORD_SIZE - n, "%s", v->n > MOST ? "..." : "");
    return ret;
}

/* ---- the fields --------------------------------------------------------------------- */

/* Lower case, one space between words, none around. */
static void normalise(const char *text, const char *end, char ret[NAME_SIZE])
{
    size_t n = 0;
    for (; text < end && n + 1 < NAME_SIZE; text++) {
        if (!blank(*text))
            ret[n++] = (char)tolower((unsigned char)*text);
        else if (n > 0 && ret[n - 1] != ' ')
            ret[n++] = ' ';
    }
    while (n > 0 && ret[n - 1] == ' ')
        n--;
    ret[n] = '\0';
}

static const char *line_end(const struct reader *r)
{
    const char *end = memchr(r->at, '\n', (size_t)(r->end - r->at));
    return end != NULL ? end : r->end;
}

static void next_line(struct reader *r, const char *end)
{
    r->at = end < r->end ? end + 1 : end;
    r->line++;
}

/* From after the '=': to the end of the line, or to the brace that closes. */
static enum status read_value(struct reader *r, const char *name, const char *text,
                              struct value *ret)
{
    size_t line = r->line;
    const char *end = line_end(r);
    while (text < end && blank(*text))
        text++;
    if (text == end || *text != '{') {
        *ret = trimmed(text, end, line);
        next_line(r, end);
        return STATUS_OK;
    }
    const char *close = memchr(text, '}', (size_t)(r->end - text));
    if (close == NULL)
        return refuse(r, STATUS_FORMAT, line, "the brace after '%s =' is never closed", name);
    *ret = trimmed(text + 1, close, line);
    while ((end = line_end(r)) < close)
        next_line(r, end);
    next_line(r, end);
    return STATUS_OK;
}

static enum status read_field(struct reader *r)
{
    const char *end = line_end(r);
    struct value all = trimmed(r->at, end, r->line), value = all;
    if (all.n == 0 || all.text[0] == ';') {
        next_line(r, end);
        return STATUS_OK;
    }
    const char *equals = memchr(all.text, '=', all.n);
    char name[NAME_SIZE], text[WORD_SIZE];
    if (equals == NULL)
        return refuse(r, STATUS_FORMAT, r->line, "'%s' is no 'name = value'", shown(&all, text));
    normalise(all.text, equals, name);
    enum status s = read_value(r, name, equals + 1, &value);
    if (s != STATUS_OK)
        return s;
    for (size_t i = 0; i < FIELDS; i++) {
        if (strcmp(name, field_names[i]) != 0)
            continue;
        if (r->field[i].line != 0)
            return refuse(r, STATUS_FORMAT, value.line,
                          "'%s' is here a second time (first in line %zu)", name, r->field[i].line);
        r->field[i] = value;
    }
    return STATUS_OK;
}

static enum status read_fields(struct reader *r)
{
    static const char mark[] = "\xef\xbb\xbf"; /* that some editors put before UTF-8 */
    if (r->end - r->at >= 3 && memcmp(r->at, mark, 3) == 0)
        r->at += 3;
    const char *end = line_end(r);
    struct value magic = trimmed(r->at, end, 1);
    if (magic.n != 4 || memcmp(magic.text, "ENVI", 4) != 0)
        return refuse(r, STATUS_FORMAT, 1,
                      "this is no ENVI header: its first line must be 'ENVI'; give the cube's "
                      ".hdr file");
    if (memchr(r->at, '\0', (size_t)(r->end - r->at)) != NULL)
        return refuse(r, STATUS_FORMAT, 0, "this is no text: it holds zero bytes");
    next_line(r, end);
    while (r->at < r->end) {
        enum status s = read_field(r);
        if (s != STATUS_OK)
            return s;
    }
    return STATUS_OK;
}

/* ---- what they say ------------------------------------------------------------------ */

static enum status missing(struct reader *r, enum field which, const char *example)
{
    return refuse(r, STATUS_FORMAT, 0, "'%s' is missing; add a line such as '%s = %s'",
                  field_names[which], field_names[which], example);
}

static enum status take_count(struct reader *r, enum field which, size_t low, size_t high,
                              size_t *ret)
{
    const struct value *v = &r->field[which];
    char text[WORD_SIZE], word[NUMBER_LONGEST];
    size_t n = 0;
    if (v->n < sizeof word) {
        memcpy(word, v->text, v->n);
        word[v->n] = '\0';
        if (number_parse_count(word, high, &n) == STATUS_OK && n >= low) {
            *ret = n;
            return STATUS_OK;
        }
    }
    return refuse(r, STATUS_FORMAT, v->line, "%s is '%s'; expected a whole number from %zu to %zu",
                  field_names[which], shown(v, text), low, high);
}

static enum status take_number(struct reader *r, enum field which, double *ret)
{
    const struct value *v = &r->field[which];
    char text[WORD_SIZE];
    if (number_parse_n(v->text, v->n, ret) == STATUS_OK)
        return STATUS_OK;
    return refuse(r, STATUS_FORMAT, v->line, "%s is '%s'; expected a number", field_names[which],
                  shown(v, text));
}

/* One number for each band, between commas. */
static enum status take_list(struct reader *r, enum field which, size_t n, double *ret)
{
    const struct value *v = &r->field[which];
    const char *at = v->text, *end = v->text + v->n;
    char text[WORD_SIZE];
    size_t found = 0;
    while (at < end) {
        const char *comma = memchr(at, ',', (size_t)(end - at));
        struct value item = trimmed(at, comma != NULL ? comma : end, v->line);
        double x;
        if (number_parse_n(item.text, item.n, &x) != STATUS_OK)
            return refuse(r, STATUS_FORMAT, v->line, "%s %zu is '%s'; expected a number",
                          field_names[which], found + 1, shown(&item, text));
        if (found < n)
            ret[found] = x;
        found++;
        at = comma != NULL ? comma + 1 : end;
    }
    if (found == n)
        return STATUS_OK;
    return refuse(r, STATUS_FORMAT, v->line, "%s has %zu values, but there are %zu bands",
                  field_names[which], found, n);
}

static enum status take_shape(struct reader *r, struct envi_header *h)
{
    static const struct {
        enum field which;
        const char *example;
    } needed[] = {
        { FIELD_SAMPLES, "640" }, { FIELD_LINES, "480" },      { FIELD_BANDS, "31" },
        { FIELD_TYPE, "4" },      { FIELD_INTERLEAVE, "bil" }, { FIELD_ORDER, "0" },
    };
    size_t offset = 0;
    for (size_t i = 0; i < sizeof needed / sizeof *needed; i++)
        if (r->field[needed[i].which].line == 0)
            return missing(r, needed[i].which, needed[i].example);
    enum status s = take_count(r, FIELD_SAMPLES, 1, INT32_MAX, &h->samples);
    if (s == STATUS_OK)
        s = take_count(r, FIELD_LINES, 1, INT32_MAX, &h->lines);
    if (s == STATUS_OK)
        s = take_count(r, FIELD_BANDS, 1, ENVI_MAX_BANDS, &h->bands);
    if (s == STATUS_OK && r->field[FIELD_OFFSET].line != 0)
        s = take_count(r, FIELD_OFFSET, 0, INT32_MAX, &offset);
    h->offset = offset;
    return s;
}

static enum status take_type(struct reader *r, struct envi_header *h)
{
    static const char *const names[] = {
        "", "uint8",   "int16", "int32", "float32", "float64", "complex64", "",
        "", "complex", "",      "",      "uint16",  "uint32",  "int64",     "uint64",
    };
    const struct value *v = &r->field[FIELD_TYPE];
    size_t code = 0;
    enum status s = take_count(r, FIELD_TYPE, 1, 15, &code);
    if (s != STATUS_OK)
        return s;
    if (code != ENVI_FLOAT32 && code != ENVI_UINT16)
        return refuse(r, STATUS_UNSUPPORTED, v->line,
                      "data type %zu%s%s%s is not taken; 4 (float32) and 12 (uint16) are, so "
                      "convert the cube to one of them",
                      code, names[code][0] != '\0' ? " (" : "", names[code],
                      names[code][0] != '\0' ? ")" : "");
    h->type = (enum envi_type)code;
    return STATUS_OK;
}

static enum status take_order(struct reader *r, struct envi_header *h)
{
    static const enum envi_interleave all[] = { ENVI_BIL, ENVI_BIP, ENVI_BSQ };
    const struct value *v = &r->field[FIELD_INTERLEAVE];
    char name[NAME_SIZE], text[WORD_SIZE];
    size_t order = 0, i = 0;
    normalise(v->text, v->text + v->n, name);
    while (i < 3 && strcmp(name, envi_interleave_name(all[i])) != 0)
        i++;
    if (i == 3)
        return refuse(r, STATUS_UNSUPPORTED, v->line,
                      "interleave is '%s'; bil, bip and bsq are taken", shown(v, text));
    h->interleave = all[i];
    enum status s = take_count(r, FIELD_ORDER, 0, 1, &order);
    h->big_endian = order == 1;
    return s;
}

/* What a wavelength is to be multiplied by to be in nm; 0: refused. */
static double unit_of(struct reader *r, const double *wavelength, size_t n)
{
    static const struct {
        const char *name;
        double nm;
    } units[] = {
        { "nanometers", 1.0 },  { "nanometer", 1.0 },  { "nanometres", 1.0 },  { "nm", 1.0 },
        { "micrometers", 1e3 }, { "micrometer", 1e3 }, { "micrometres", 1e3 }, { "microns", 1e3 },
        { "um", 1e3 },          { "\xc2\xb5m", 1e3 }, /* micro sign */
    };
    const struct value *v = &r->field[FIELD_UNITS];
    char name[NAME_SIZE], text[WORD_SIZE];
    normalise(v->text, v->text + v->n, name);
    for (size_t i = 0; i < sizeof units / sizeof *units; i++)
        if (strcmp(name, units[i].name) == 0)
            return units[i].nm;
    if (v->line == 0 || strcmp(name, "unknown") == 0) {
        if (wavelength[0] >= 100.0 && wavelength[n - 1] <= 20000.0)
            return 1.0;
        if (wavelength[0] >= 0.1 && wavelength[n - 1] <= 20.0)
            return 1e3;
    }
    (void)refuse(r, STATUS_UNSUPPORTED, v->line,
                 "wavelength units are '%s'; nanometers and micrometers are taken",
                 v->line == 0 ? "not said, and the wavelengths look like neither" : shown(v, text));
    return 0.0;
}

static enum status take_wavelengths(struct reader *r, struct envi_header *h)
{
    const struct value *v = &r->field[FIELD_WAVELENGTH];
    if (v->line == 0)
        return refuse(r, STATUS_FORMAT, 0,
                      "'wavelength' is missing; add 'wavelength = {400, 410, ...}' with the "
                      "wavelength of each band");
    enum status s = take_list(r, FIELD_WAVELENGTH, h->bands, h->nm);
    if (s != STATUS_OK)
        return s;
    for (size_t i = 1; i < h->bands; i++)
        if (!(h->nm[i] > h->nm[i - 1]))
            return refuse(r, STATUS_FORMAT, v->line,
                          "wavelengths must increase from band to band; %g of band %zu follows %g",
                          h->nm[i], i + 1, h->nm[i - 1]);
    double unit = unit_of(r, h->nm, h->bands);
    for (size_t i = 0; i < h->bands; i++)
        h->nm[i] *= unit;
    return unit > 0.0 ? STATUS_OK : STATUS_UNSUPPORTED;
}

static enum status take_bad_bands(struct reader *r, struct envi_header *h)
{
    double good[ENVI_MAX_BANDS] = { 0 };
    if (r->field[FIELD_BBL].line == 0)
        return STATUS_OK;
    enum status s = take_list(r, FIELD_BBL, h->bands, good);
    for (size_t i = 0; i < h->bands && s == STATUS_OK; i++)
        h->bad[i] = good[i] == 0.0;
    return s;
}

static enum status take_scale(struct reader *r, struct envi_header *h)
{
    enum status s = STATUS_OK;
    h->scale = NAN;
    if (r->field[FIELD_SCALE].line != 0) {
        s = take_number(r, FIELD_SCALE, &h->scale);
        if (s == STATUS_OK && !(h->scale > 0.0))
            return refuse(r, STATUS_FORMAT, r->field[FIELD_SCALE].line,
                          "reflectance scale factor is %g; it is what stands for R = 1 and must "
                          "be above 0",
                          h->scale);
    }
    h->has_ignore = s == STATUS_OK && r->field[FIELD_IGNORE].line != 0;
    if (h->has_ignore) {
        const struct value *v = &r->field[FIELD_IGNORE];
        char name[NAME_SIZE];
        normalise(v->text, v->text + v->n, name);
        if (strcmp(name, "nan") == 0 || strcmp(name, "-nan") == 0)
            h->has_ignore = false; /* what is no number is left out anyway */
        else
            s = take_number(r, FIELD_IGNORE, &h->ignore);
    }
    return s;
}

/* What would have to be done to the values before they are what the other fields say. */
static enum status refuse_treatment(struct reader *r)
{
    static const enum field treatments[] = { FIELD_COMPRESSION, FIELD_GAIN, FIELD_SHIFT,
                                             FIELD_FRAMES };
    for (size_t i = 0; i < sizeof treatments / sizeof *treatments; i++) {
        const struct value *v = &r->field[treatments[i]];
        bool nothing = v->line == 0;
        if (treatments[i] == FIELD_COMPRESSION || treatments[i] == FIELD_FRAMES)
            nothing = nothing || strspn(v->text, "0, \t\r\n") >= v->n;
        if (!nothing)
            return refuse(r, STATUS_UNSUPPORTED, v->line,
                          "'%s' is not taken; write the cube anew as plain reflectance, without it",
                          field_names[treatments[i]]);
    }
    return STATUS_OK;
}

enum status envi_header_parse(const char *text, size_t n, struct envi_header *ret,
                              struct envi_fault *fault)
{
    static const struct envi_header none;
    struct reader r = { .at = text, .end = text + n, .line = 1, .fault = fault };
    struct envi_header h = none;
    fault->line = 0;
    fault->text[0] = '\0';
    enum status s = read_fields(&r);
    if (s == STATUS_OK)
        s = take_shape(&r, &h);
    if (s == STATUS_OK)
        s = take_type(&r, &h);
    if (s == STATUS_OK)
        s = take_order(&r, &h);
    if (s == STATUS_OK)
        s = refuse_treatment(&r);
    if (s == STATUS_OK)
        s = take_wavelengths(&r, &h);
    if (s == STATUS_OK)
        s = take_bad_bands(&r, &h);
    if (s == STATUS_OK)
        s = take_scale(&r, &h);
    if (s == STATUS_OK && envi_data_size(&h) == UINT64_MAX)
        s = refuse(&r, STATUS_FORMAT, r.field[FIELD_SAMPLES].line,
                   "%zu samples, %zu lines and %zu bands are more than a file can hold", h.samples,
                   h.lines, h.bands);
    if (s == STATUS_OK)
        *ret = h;
    return s;
}

/* ---- where a value lies, and what it is --------------------------------------------- */

const char *envi_interleave_name(enum envi_interleave interleave)
{
    static const char *const names[] = { "bil", "bip", "bsq" };
    return (size_t)interleave < 3 ? names[interleave] : "unknown";
}

size_t envi_value_size(enum envi_type type)
{
    return type == ENVI_UINT16 ? 2 : 4;
}

uint64_t envi_data_size(const struct envi_header *h)
{
    /* 2^31 samples, as many lines and 2^12 bands of 4 bytes would not fit. */
    uint64_t pixels = (uint64_t)h->samples * h->lines;
    uint64_t each = (uint64_t)h->bands * envi_value_size(h->type);
    uint64_t most = (uint64_t)INT64_MAX - h->offset;
    return pixels > most / each ? UINT64_MAX : pixels * each;
}

uint64_t envi_place(const struct envi_header *h, size_t line, size_t sample, size_t band)
{
    uint64_t value = 0;
    switch (h->interleave) {
    case ENVI_BIL:
        value = ((uint64_t)line * h->bands + band) * h->samples + sample;
        break;
    case ENVI_BIP:
        value = ((uint64_t)line * h->samples + sample) * h->bands + band;
        break;
    case ENVI_BSQ:
        value = ((uint64_t)band * h->lines + line) * h->samples + sample;
        break;
    }
    return h->offset + value * envi_value_size(h->type);
}

/* Bytes are put together by shifts, which compilers turn into moves and swaps, and where values
 * follow each other into those of vectors. */
static inline float uint16_value(const unsigned char *b, bool big_endian)
{
    return (float)(big_endian ? b[0] << 8 | b[1] : b[1] << 8 | b[0]);
}

static inline float float32_value(const unsigned char *b, bool big_endian)
{
    uint32_t bits =
        big_endian
            ? (uint32_t)b[0] << 24 | (uint32_t)b[1] << 16 | (uint32_t)b[2] << 8 | (uint32_t)b[3]
            : (uint32_t)b[3] << 24 | (uint32_t)b[2] << 16 | (uint32_t)b[1] << 8 | (uint32_t)b[0];
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* Values that stand apart, by fours: or counting them takes as long as fetching them. */
static inline void uint16_apart(const unsigned char *b, size_t n, size_t step, bool big_endian,
                                float *ret)
{
    size_t i = 0;
    for (; i + 4 <= n; i += 4, b += 4 * step) {
        ret[i] = uint16_value(b, big_endian);
        ret[i + 1] = uint16_value(b + step, big_endian);
        ret[i + 2] = uint16_value(b + 2 * step, big_endian);
        ret[i + 3] = uint16_value(b + 3 * step, big_endian);
    }
    for (; i < n; i++, b += step)
        ret[i] = uint16_value(b, big_endian);
}

static inline void float32_apart(const unsigned char *b, size_t n, size_t step, bool big_endian,
                                 float *ret)
{
    size_t i = 0;
    for (; i + 4 <= n; i += 4, b += 4 * step) {
        ret[i] = float32_value(b, big_endian);
        ret[i + 1] = float32_value(b + step, big_endian);
        ret[i + 2] = float32_value(b + 2 * step, big_endian);
        ret[i + 3] = float32_value(b + 3 * step, big_endian);
    }
    for (; i < n; i++, b += step)
        ret[i] = float32_value(b, big_endian);
}

static void uint16_values(const unsigned char *b, size_t n, size_t step, bool big_endian,
                          float *ret)
{
    if (step == 2 && big_endian)
        for (size_t i = 0; i < n; i++)
            ret[i] = uint16_value(b + 2 * i, true);
    else if (step == 2)
        for (size_t i = 0; i < n; i++)
            ret[i] = uint16_value(b + 2 * i, false);
    else if (big_endian)
        uint16_apart(b, n, step, true, ret);
    else
        uint16_apart(b, n, step, false, ret);
}

static void float32_values(const unsigned char *b, size_t n, size_t step, bool big_endian,
                           float *ret)
{
    if (step == 4 && big_endian)
        for (size_t i = 0; i < n; i++)
            ret[i] = float32_value(b + 4 * i, true);
    else if (step == 4)
        for (size_t i = 0; i < n; i++)
            ret[i] = float32_value(b + 4 * i, false);
    else if (big_endian)
        float32_apart(b, n, step, true, ret);
    else
        float32_apart(b, n, step, false, ret);
}

void envi_values(const struct envi_header *h, const void *bytes, size_t n, size_t stride,
                 float *ret)
{
    size_t step = stride * envi_value_size(h->type);
    if (h->type == ENVI_UINT16)
        uint16_values(bytes, n, step, h->big_endian, ret);
    else
        float32_values(bytes, n, step, h->big_endian, ret);
}
