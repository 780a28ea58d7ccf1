/* samples.c - what the instrument stored when nobody was connected. */
#include <stdio.h>
#include <string.h>

#include "drivers/km_ascii/conversation.h"

/* The CM-2600d's are not read, see km_ascii.h. */
static enum driver_result fail_unsupported(struct driver_error *error)
{
    return driver_fail(error, DRIVER_UNSUPPORTED, NULL,
                       "stored samples of this model cannot be read: use the maker's program");
}

static enum driver_result count(struct instrument *in, size_t *ret, struct driver_error *error)
{
    struct km_state state;
    enum driver_result r = km_query_state(in, km_deadline(in, 0), &state, error);
    if (r == DRIVER_OK)
        *ret = state.samples;
    return r;
}

enum driver_result km_stored_count(struct instrument *in, size_t *ret, struct driver_error *error)
{
    struct driver_error attempt;
    size_t n = 0;
    if (!in->identity.has_stored_samples)
        return fail_unsupported(error);
    enum driver_result r = km_begin(in, "stored_count", &attempt);
    if (r == DRIVER_OK)
        r = count(in, &n, &attempt);
    if (r != DRIVER_OK) {
        *error = attempt;
        return km_end(in, r);
    }
    *ret = n;
    return DRIVER_OK;
}

/* ---- one ---------------------------------------------------------------------------- */

struct header {
    unsigned area, specular;
    char name[DRIVER_NAME_SIZE];
};

/* SPR,n: area, specular, target, year, month, day, hour, minute, second, custom, name. */
static enum driver_result read_header(struct instrument *in, unsigned number, struct header *ret,
                                      struct driver_error *error)
{
    char question[KM_COMMAND_SIZE];
    struct km_reply reply;
    snprintf(question, sizeof question, "SPR,%u", number);
    enum driver_result r = km_query(in, question, 11, km_deadline(in, 0), &reply, error);
    if (r != DRIVER_OK)
        return r;
    if (!km_read_unsigned(reply.field[0], 2, &ret->area) ||
        !km_read_unsigned(reply.field[1], 3, &ret->specular) || ret->area == 0 ||
        ret->specular == 0)
        return driver_fail(error, DRIVER_PROTOCOL, NULL,
                           "the header of stored sample %u cannot be: is this the right driver?",
                           number);
    km_read_text(reply.field[10], ret->name, sizeof ret->name);
    return DRIVER_OK;
}

/* The only spectrum of a sample: programs differ in whether it is asked for by its mode or as
 * the first, so that whichever is there is it. */
static enum driver_result read_single(struct instrument *in, unsigned number, unsigned mode,
                                      struct km_spectra *ret, struct driver_error *error)
{
    char question[KM_COMMAND_SIZE];
    bool confirmed;
    struct driver_error attempt;
    int32_t *raw = mode == 1 ? ret->sci : ret->sce;
    snprintf(question, sizeof question, "SDR,%05u,%u", number, mode);
    enum driver_result r =
        km_read_one(in, question, false, raw, &ret->warnings, &confirmed, &attempt);
    bool none = r == DRIVER_REFUSED || (r == DRIVER_PROTOCOL && strcmp(attempt.code, "ER03") == 0);
    if (none && mode != 1) {
        snprintf(question, sizeof question, "SDR,%05u,1", number);
        return km_read_one(in, question, false, raw, &ret->warnings, &confirmed, error);
    }
    if (r != DRIVER_OK)
        *error = attempt;
    return r;
}

static enum driver_result read_listed(struct instrument *in, unsigned number,
                                      struct driver_reading *ret, struct driver_error *error)
{
    char command[KM_COMMAND_SIZE];
    struct header header;
    struct km_spectra spectra;
    enum driver_result r = read_header(in, number, &header, error);
    if (r != DRIVER_OK)
        return r;
    snprintf(command, sizeof command, "SDR,%05u", number);
    r = header.specular == 3 ? km_read_both(in, command, &spectra, error)
                             : read_single(in, number, header.specular, &spectra, error);
    if (r != DRIVER_OK)
        return r;
    double aperture_mm = in->identity.aperture_mm[header.area == in->area[0] ? 0 : 1];
    reading_init(in->dialect->raw_unit, spectra.warnings, ret);
    if (header.specular != 1)
        reading_add(&in->identity.grid[0], spectra.sce, SPECULAR_SCE, aperture_mm, ret);
    if (header.specular != 2)
        reading_add(&in->identity.grid[0], spectra.sci, SPECULAR_SCI, aperture_mm, ret);
    memcpy(ret->sample, header.name, sizeof ret->sample);
    if (ret->sample[0] == '\0')
        snprintf(ret->sample, sizeof ret->sample, "sample %u", number);
    return DRIVER_OK;
}

/* ------------------------------------------------------------------------------------- */

static enum driver_result read_stored(struct instrument *in, size_t i, struct driver_reading *ret,
                                      struct driver_error *error)
{
    size_t n;
    enum driver_result r = count(in, &n, error);
    if (r != DRIVER_OK)
        return r;
    if (i >= n)
        return driver_fail(error, DRIVER_REFUSED, NULL,
                           "no sample %zu: the instrument has stored %zu", i + 1, n);
    return read_listed(in, (unsigned)i + 1, ret, error);
}

enum driver_result km_stored_read(struct instrument *in, size_t i, struct driver_reading *ret,
                                  struct driver_error *error)
{
    struct driver_error attempt;
    if (!in->identity.has_stored_samples)
        return fail_unsupported(error);
    char call[32];
    snprintf(call, sizeof call, "stored_read %zu", i);
    enum driver_result r = km_begin(in, call, &attempt);
    if (r == DRIVER_OK)
        r = read_stored(in, i, ret, &attempt);
    if (r != DRIVER_OK)
        *error = attempt;
    return km_end(in, r);
}
