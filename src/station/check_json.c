/* check_json.c - members one by one. */
#include "station/check_json.h"

#include <stdio.h>

#include "json/give.h"
#include "station/wire.h"

static void add_known(cJSON *object, const char *name, const char *text)
{
    if (*text != '\0')
        cJSON_AddStringToObject(object, name, text);
}

static void add_instrument(cJSON *object, const struct store_instrument *i)
{
    char name[sizeof i->maker + sizeof i->model];
    snprintf(name, sizeof name, "%s%s%s", i->maker, *i->maker != '\0' ? " " : "", i->model);
    cJSON_AddStringToObject(object, "instrument", name);
    add_known(object, "serial", i->serial);
}

/* One with a value that is none is left out, which the reply's reader notices. */
static void add_spectrum(cJSON *object, const struct spectrum *spectrum)
{
    cJSON *made = NULL;
    (void)wire_spectrum(spectrum, &made);
    json_give_member(object, "spectrum", made);
}

cJSON *check_json(const struct store_check *c)
{
    cJSON *object = cJSON_CreateObject();
    cJSON_AddStringToObject(object, "id", c->id);
    cJSON_AddNumberToObject(object, "seq", (double)c->seq);
    cJSON_AddStringToObject(object, "uuid", c->uuid);
    cJSON_AddStringToObject(object, "taken_at", c->taken_at);
    add_known(object, "operator", c->operator_name);
    cJSON_AddStringToObject(object, "tile", c->tile);
    add_instrument(object, &c->instrument);
    cJSON_AddNumberToObject(object, "aperture_mm", c->aperture_mm);
    cJSON_AddNumberToObject(object, "replicates", (double)c->replicates);
    add_spectrum(object, &c->spectrum);
    cJSON_AddNumberToObject(object, "dE00", c->dE00);
    cJSON_AddNumberToObject(object, "rms", c->rms);
    cJSON_AddNumberToObject(object, "limit", c->limit_dE00);
    cJSON_AddBoolToObject(object, "passed", c->passed);
    cJSON_AddStringToObject(object, "reference_id", c->reference_id);
    cJSON_AddStringToObject(object, "calibration_id", c->calibration_id);
    cJSON_AddNumberToObject(object, "fence", (double)c->fence);
    return object;
}

cJSON *check_tile_json(const struct store_check_tile *t)
{
    cJSON *object = cJSON_CreateObject();
    cJSON_AddStringToObject(object, "id", t->id);
    cJSON_AddStringToObject(object, "uuid", t->uuid);
    cJSON_AddStringToObject(object, "taken_at", t->taken_at);
    cJSON_AddStringToObject(object, "who", t->who);
    cJSON_AddStringToObject(object, "tile", t->tile);
    cJSON_AddStringToObject(object, "source", store_tile_source_name(t->source));
    cJSON_AddNumberToObject(object, "limit", t->limit_dE00);
    if (t->source == STORE_TILE_LIMIT)
        return object;
    cJSON_AddNumberToObject(object, "aperture_mm", t->aperture_mm);
    add_spectrum(object, &t->spectrum);
    if (t->source == STORE_TILE_CERTIFICATE)
        return object;
    add_instrument(object, &t->instrument);
    cJSON_AddNumberToObject(object, "replicates", (double)t->replicates);
    cJSON_AddStringToObject(object, "calibration_id", t->calibration_id);
    return object;
}
