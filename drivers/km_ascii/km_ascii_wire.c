/* km_ascii_wire.c - lines, identity, spectra: what both dialects share. */
#include "drivers/km_ascii/km_ascii_wire.h"

#include <stdio.h>
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
    reading_plain_text(field.at, field.n, ret, size);
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

enum doubt km_read_spectrum(const struct km_dialect *dialect, const struct km_reply *reply,
                            size_t first, size_t n, int32_t *raw)
{
    if (reply->fields != first + n || n == 0)
        return DOUBT_WRONG_COUNT;
    const struct km_field *field = &reply->field[first];
    bool dotted = dialect->dots && memchr(field->at, '.', field->n) != NULL;
    for (size_t i = 0; i < n; i++)
        if (!read_value(dialect, field[i], dotted, &raw[i]))
            return DOUBT_NO_NUMBER;
    return DOUBT_NONE;
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
