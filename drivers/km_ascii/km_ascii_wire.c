/* km_ascii_wire.c - lines, identity, spectra: what both dialects share. */
#include "drivers/km_ascii/km_ascii_wire.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* ---- a line ------------------------------------------------------------------------- */

static bool is_digit(char c)
{
    return c >= '0' && c <= '9';
}

bool km_read_reply(const char *line, struct km_reply *ret)
{
    bool ok = strncmp(line, "OK", 2) == 0;
    if ((!ok && strncmp(line, "ER", 2) != 0) || !is_digit(line[2]) || !is_digit(line[3]))
        return false;
    ret->ok = ok;
    ret->code = (unsigned)(line[2] - '0') * 10 + (unsigned)(line[3] - '0');
    ret->fields = 0;
    line += 4;
    while (*line == ',') {
        if (ret->fields == KM_MAX_FIELDS)
            return false;
        struct km_field *field = &ret->field[ret->fields++];
        field->at = line + 1;
        field->n = strcspn(field->at, ",");
        line = field->at + field->n;
    }
    return *line == '\0';
}

bool km_read_unsigned(struct km_field field, unsigned most, unsigned *ret)
{
    unsigned value = 0;
    if (field.n == 0 || field.n > 9)
        return false;
    for (size_t i = 0; i < field.n; i++) {
        if (!is_digit(field.at[i]))
            return false;
        value = value * 10 + (unsigned)(field.at[i] - '0');
    }
    if (value > most)
        return false;
    *ret = value;
    return true;
}

void km_read_text(struct km_field field, char *ret, size_t size)
{
    size_t n = 0;
    for (size_t i = 0; i < field.n && n + 1 < size; i++)
        if (field.at[i] >= ' ' && field.at[i] <= '~' && (n > 0 || field.at[i] != ' '))
            ret[n++] = field.at[i];
    while (n > 0 && ret[n - 1] == ' ')
        n--;
    ret[n] = '\0';
}

const struct km_code *km_find_code(const struct km_dialect *dialect, const struct km_reply *reply)
{
    for (const struct km_code *code = dialect->codes; code->text != NULL; code++)
        if (code->ok == reply->ok && code->number == reply->code)
            return code;
    return NULL;
}

/* ---- identity ----------------------------------------------------------------------- */

static bool is_text(struct km_field field, const char *text)
{
    return field.n == strlen(text) && memcmp(field.at, text, field.n) == 0;
}

static const struct km_dialect *find_model(struct km_field id, const char **name)
{
    static const struct km_dialect *const dialects[2] = { &km_cm700d, &km_cm2600d };
    for (size_t i = 0; i < 2; i++)
        for (const struct km_model *model = dialects[i]->models; model->id != NULL; model++)
            if (is_text(id, model->id)) {
                *name = model->name;
                return dialects[i];
            }
    return NULL;
}

/* `104` is 1.04; what is not three digits stays as it is. */
static void read_version(struct km_field field, char *ret, size_t size)
{
    unsigned version;
    if (field.n == 3 && km_read_unsigned(field, 999, &version))
        snprintf(ret, size, "%u.%02u", version / 100, version % 100);
    else
        km_read_text(field, ret, size);
}

/* First, last, step: at least two bands, and no more than a line can carry. */
static bool read_grid(const struct km_field field[3], struct driver_grid *ret)
{
    unsigned first, last, step;
    if (!km_read_unsigned(field[0], 1000, &first) || !km_read_unsigned(field[1], 1000, &last) ||
        !km_read_unsigned(field[2], 100, &step))
        return false;
    if (first < 300 || last <= first || step < 1 || (last - first) % step != 0 ||
        (last - first) / step + 1 > KM_MAX_FIELDS)
        return false;
    *ret = (struct driver_grid){ first, step, (last - first) / step + 1 };
    return true;
}

const struct km_dialect *km_read_identity(const struct km_reply *reply, struct driver_identity *ret)
{
    const char *name;
    struct driver_grid grid;
    ret->model[0] = '\0';
    if (!reply->ok || reply->fields < 1)
        return NULL;
    km_read_text(reply->field[0], ret->model, sizeof ret->model);
    const struct km_dialect *dialect = find_model(reply->field[0], &name);
    /* Geometry 0 is di:8, de:8: the only one with a gloss trap. */
    if (dialect == NULL || reply->fields != KM_IDENTITY_FIELDS || !is_text(reply->field[3], "0") ||
        !read_grid(&reply->field[4], &grid))
        return NULL;
    *ret = (struct driver_identity){
        .maker = "Konica Minolta",
        .geometry = DRIVER_GEOMETRY_D8,
        .has_sci = true,
        .has_sce = true,
        .has_button = true,
        .has_battery = true,
        .has_stored_samples = dialect->has_samples,
        .has_user_calibration = dialect->white_user != NULL,
        .grid = { grid },
        .grids = 1,
        .aperture_mm = { 8.0, 3.0 },
        .apertures = 2,
        .max_averages = dialect->max_averages,
        .max_delay_ms = dialect->max_delay_ms,
    };
    snprintf(ret->model, sizeof ret->model, "%s", name);
    read_version(reply->field[1], ret->firmware, sizeof ret->firmware);
    km_read_text(reply->field[2], ret->serial, sizeof ret->serial);
    return dialect;
}

/* ---- spectra ------------------------------------------------------------------------ */

/* `20.12`, ` 4.5`: one to three digits behind the dot, counts of 0.001 %. */
static bool read_dotted(struct km_field field, size_t dot, int32_t *ret)
{
    unsigned whole, part;
    size_t digits = field.n - dot - 1;
    if (digits < 1 || digits > 3 ||
        !km_read_unsigned((struct km_field){ field.at, dot }, 9999, &whole) ||
        !km_read_unsigned((struct km_field){ field.at + dot + 1, digits }, 999, &part))
        return false;
    for (; digits < 3; digits++)
        part *= 10;
    *ret = (int32_t)(whole * 1000 + part);
    return true;
}

static bool read_value(const struct km_dialect *dialect, struct km_field field, bool dotted,
                       int32_t *ret)
{
    unsigned value;
    while (dialect->dots && field.n > 1 && *field.at == ' ') { /* a fixed width */
        field.at++;
        field.n--;
    }
    const char *dot = memchr(field.at, '.', field.n);
    if ((dot != NULL) != dotted)
        return false;
    if (dot != NULL)
        return read_dotted(field, (size_t)(dot - field.at), ret);
    if (field.n > 6 || !km_read_unsigned(field, 999999, &value))
        return false;
    *ret = (int32_t)(value * (dialect->dots ? 10 : 1)); /* 0.01 % in counts */
    return true;
}

enum km_doubt km_read_spectrum(const struct km_dialect *dialect, const struct km_reply *reply,
                               size_t first, size_t n, int32_t *raw)
{
    if (reply->fields != first + n || n == 0)
        return KM_WRONG_COUNT;
    const struct km_field *field = &reply->field[first];
    bool dotted = dialect->dots && memchr(field->at, '.', field->n) != NULL;
    for (size_t i = 0; i < n; i++)
        if (!read_value(dialect, field[i], dotted, &raw[i]))
            return KM_NO_NUMBER;
    return KM_SOUND;
}

enum km_doubt km_doubt_spectrum(const struct km_dialect *dialect, size_t n, const int32_t *raw)
{
    const int32_t jump = (int32_t)lround(KM_JUMP_LIMIT / dialect->raw_unit);
    int32_t most = 0;
    for (size_t i = 0; i < n; i++) {
        if (raw[i] < 0 || raw[i] > dialect->most)
            return KM_OUT_OF_RANGE;
        if (i > 0 && abs(raw[i] - raw[i - 1]) > jump)
            return KM_JUMP;
        most = raw[i] > most ? raw[i] : most;
    }
    return most == 0 ? KM_ALL_ZERO : KM_SOUND;
}

enum km_doubt km_doubt_pair(const struct km_dialect *dialect, size_t n, const int32_t *sci,
                            const int32_t *sce, bool gloss)
{
    const int32_t slack = (int32_t)lround(KM_ORDER_SLACK / dialect->raw_unit);
    const int32_t limit = (int32_t)lround(KM_GLOSS_LIMIT / dialect->raw_unit);
    if (memcmp(sci, sce, n * sizeof *sci) == 0)
        return KM_SAME;
    for (size_t i = 0; i < n; i++)
        if (sci[i] < sce[i] - slack)
            return KM_ORDER;
    for (size_t i = 0; gloss && n >= 2 && i < n; i++) {
        size_t before = i == 0 ? 1 : i - 1, behind = i + 1 == n ? i - 1 : i + 1;
        int32_t expect = (sci[before] - sce[before] + sci[behind] - sce[behind]) / 2;
        if (abs(sci[i] - sce[i] - expect) > limit)
            return KM_GLOSS;
    }
    return KM_SOUND;
}

const char *km_doubt_text(enum km_doubt doubt)
{
    static const char *const text[] = {
        [KM_SOUND] = "",
        [KM_WRONG_COUNT] = "a spectrum came with another number of bands than the instrument "
                           "states: measure again; if it stays so, check the cable",
        [KM_NO_NUMBER] = "a spectrum came with a value that is no number: measure again; if it "
                         "stays so, check the cable",
        [KM_OUT_OF_RANGE] = "a band is outside 0 to 200 %: calibrate and measure again",
        [KM_ALL_ZERO] = "no light came back at all: calibrate and measure again",
        [KM_JUMP] = "neighbouring bands differ by more than any surface's do: calibrate and "
                    "measure again",
        [KM_ORDER] = "there is less light with the gloss than without it: hold the instrument "
                     "still and measure again",
        [KM_GLOSS] = "the gloss alone jumps from band to band, as when a value came damaged: "
                     "measure again; if it stays so, check the cable",
        [KM_SAME] = "the spectra with and without gloss are one and the same: measure again",
    };
    return text[doubt];
}

/* ---- clock -------------------------------------------------------------------------- */

void km_write_clock(int64_t realtime_s, char ret[KM_COMMAND_SIZE])
{
    struct tm utc;
    time_t at = (time_t)realtime_s;
    if (gmtime_r(&at, &utc) == NULL ||
        strftime(ret, KM_COMMAND_SIZE, "DTS,%Y,%m,%d,%H,%M,%S", &utc) == 0)
        ret[0] = '\0';
}
