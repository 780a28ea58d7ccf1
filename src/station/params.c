/* params.c - look-ups by exact name. */
#include "station/params.h"

#include <math.h>
#include <nettle/base16.h>
#include <nettle/sha2.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "json/print.h"
#include "station/strict_json.h"
#include "station/wire.h"

const char *params_text(const struct request *request, const char *name)
{
    return cJSON_GetStringValue(strict_json_member(request->params, name));
}

double params_number(const struct request *request, const char *name, double absent)
{
    const cJSON *value = strict_json_member(request->params, name);
    return value != NULL ? value->valuedouble : absent;
}

int64_t params_integer(const struct request *request, const char *name, int64_t absent)
{
    const cJSON *value = strict_json_member(request->params, name);
    return value != NULL ? (int64_t)value->valuedouble : absent;
}

bool params_is_true(const struct request *request, const char *name)
{
    return cJSON_IsTrue(strict_json_member(request->params, name));
}

bool params_has(const struct request *request, const char *name)
{
    return strict_json_member(request->params, name) != NULL;
}

void params_copy(const struct request *request, const char *name, char *into, size_t size)
{
    const char *text = params_text(request, name);
    snprintf(into, size, "%s", text != NULL ? text : "");
}

void params_lower_uuids(struct request *request)
{
    static const char *const names[] = { "uuid", "id", "subject", "corrects", "after" };
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        const cJSON *value = strict_json_member(request->params, names[i]);
        char *text = value != NULL ? value->valuestring : NULL; /* the request's own */
        for (; text != NULL && *text != '\0'; text++)
            if (*text >= 'A' && *text <= 'F')
                *text = (char)(*text - 'A' + 'a');
    }
}

enum specular params_specular(const struct request *request)
{
    enum specular specular = SPECULAR_UNKNOWN;
    (void)specular_parse(params_text(request, "specular"), &specular);
    return specular;
}

bool params_by(const struct request *request, enum match_by *ret)
{
    const char *text = params_text(request, "by");
    for (int by = MATCH_RGB; text != NULL && by <= MATCH_SPECTRUM; by++) {
        if (strcmp(match_by_name((enum match_by)by), text) != 0)
            continue;
        *ret = (enum match_by)by;
        return true;
    }
    return false;
}

bool params_wish(const struct request *request, struct refine_wish *ret, struct refusal *refusal)
{
    static const char *const alone[] = { "noise", "placement", "fix" };
    const cJSON *fix = strict_json_member(request->params, "fix");
    const char *kind = params_text(request, "refine");
    *ret = refine_wish_none();
    for (size_t i = 0; kind == NULL && i < sizeof alone / sizeof *alone; i++) {
        if (!params_has(request, alone[i]))
            continue;
        refusal_set(refusal, REASON_PARAMS_INVALID, "`%s` goes with `refine`", alone[i]);
        snprintf(refusal->path, sizeof refusal->path, "/params/%s", alone[i]);
        return false;
    }
    if (kind == NULL)
        return true;
    (void)refine_kind_parse(kind, &ret->kind); /* the description lists them */
    ret->white = params_number(request, "noise", NAN);
    ret->placement = params_number(request, "placement", NAN);
    for (size_t i = 0; i < SKIN_PARAMETERS; i++) {
        const cJSON *value = strict_json_member(fix, skin_parameter_name(i));
        ret->fix[i] = value != NULL ? value->valuedouble : (double)NAN;
    }
    return true;
}

bool params_scene(const struct request *request, struct scene *ret, bool *has,
                  struct refusal *refusal)
{
    static const char *const inside[] = { "by", "k", "refine", "noise", "placement", "fix" };
    const cJSON *scene = strict_json_member(request->params, "scene");
    char why[SCENE_WHY_SIZE];
    *has = scene != NULL;
    for (size_t i = 0; *has && i < sizeof inside / sizeof *inside; i++) {
        if (!params_has(request, inside[i]))
            continue;
        refusal_set(refusal, REASON_PARAMS_INVALID,
                    "`%s` does not go with `scene`: say it in the scene", inside[i]);
        snprintf(refusal->path, sizeof refusal->path, "/params/%s", inside[i]);
        return false;
    }
    if (!*has || wire_read_scene(scene, ret, why) == STATUS_OK)
        return true;
    params_refuse_scene(refusal, why);
    return false;
}

void params_refuse_scene(struct refusal *refusal, const char *why)
{
    refusal_set(refusal, REASON_PARAMS_INVALID, "%s", why);
    snprintf(refusal->path, sizeof refusal->path, "/params/scene");
}

/* ---- what is asked ------------------------------------------------------------------ */

static int compare_names(const void *left, const void *right)
{
    const cJSON *const *x = left, *const *y = right;
    return strcmp((*x)->string, (*y)->string);
}

static enum status hash_member(struct sha256_ctx *hash, const cJSON *member)
{
    char *text;
    size_t n;
    enum status s = json_print(member, PROTOCOL_MAX_LINE, &text, &n);
    if (s != STATUS_OK)
        return s;
    sha256_update(hash, strlen(member->string) + 1, (const uint8_t *)member->string);
    sha256_update(hash, n + 1, (const uint8_t *)text);
    free(text);
    return STATUS_OK;
}

enum status params_sha256(const struct request *request, char hex[65])
{
    const cJSON *sorted[STRICT_JSON_MAX_MEMBERS] = { NULL }, *member;
    uint8_t digest[SHA256_DIGEST_SIZE];
    struct sha256_ctx hash;
    enum status s = STATUS_OK;
    size_t n = 0;
    cJSON_ArrayForEach(member, request->params)
    {
        if (strcmp(member->string, "lease") != 0 && strcmp(member->string, "uuid") != 0)
            sorted[n++] = member;
    }
    qsort(sorted, n, sizeof(const cJSON *), compare_names);
    sha256_init(&hash);
    const char *method = method_name(request->method);
    sha256_update(&hash, strlen(method) + 1, (const uint8_t *)method);
    for (size_t i = 0; i < n && s == STATUS_OK; i++)
        s = hash_member(&hash, sorted[i]);
    if (s != STATUS_OK)
        return s;
    sha256_digest(&hash, sizeof digest, digest);
    base16_encode_update(hex, sizeof digest, digest);
    hex[64] = '\0';
    return STATUS_OK;
}
