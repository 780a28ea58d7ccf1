/* row_out.c - carried columns, ids and errors, in CSV and JSON. */
#include "cli/row_out.h"

#include <stdio.h>
#include <string.h>

static bool is_ours(const char *name, const char *const *names, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (strcmp(names[i], name) == 0)
            return true;
    return strcmp(name, "error") == 0;
}

void row_out_header(struct out *out, const struct spectra *spectra, const char *const *names,
                    size_t n)
{
    if (out->format != OUT_PLAIN)
        return;
    if (!spectra_has_id(spectra))
        out_text(out, "id");
    for (size_t i = 0; i < spectra_carried(spectra); i++) {
        char renamed[256];
        const char *name = spectra_carried_name(spectra, i);
        if (is_ours(name, names, n)) {
            snprintf(renamed, sizeof renamed, "input_%s", name);
            name = renamed;
        }
        out_text(out, name);
    }
    for (size_t i = 0; i < n; i++)
        out_text(out, names[i]);
    out_text(out, "error");
    out_row(out);
}

void row_out_carried(struct out *out, const struct spectra *spectra, const struct spectra_row *row)
{
    if (!spectra_has_id(spectra) && row->id != NULL) /* of NDJSON, which has no columns */
        out_text(out, row->id);
    else if (!spectra_has_id(spectra))
        out_number(out, (double)row->number, 17);
    for (size_t i = 0; i < spectra_carried(spectra); i++)
        out_text(out, spectra_carried_text(spectra, row, i));
}

void row_out_bad(struct out *out, const struct spectra *spectra, const struct spectra_row *row,
                 size_t n)
{
    if (out->format != OUT_PLAIN) {
        cJSON *object = row_out_object(row);
        cJSON_AddStringToObject(object, "error", row->error);
        out_object(out, object);
        return;
    }
    row_out_carried(out, spectra, row);
    for (size_t i = 0; i < n; i++)
        out_text(out, "");
    out_text(out, row->error);
    out_row(out);
}

/* JSON as it stands in the input. */
static void add_raw(cJSON *object, const char *name, const char *json)
{
    if (cJSON_AddRawToObject(object, name, json) == NULL)
        out_of_memory();
}

cJSON *row_out_object(const struct spectra_row *row)
{
    cJSON *object = cJSON_CreateObject();
    if (row->id != NULL && row->id_is_number)
        add_raw(object, "id", row->id);
    else if (row->id != NULL)
        cJSON_AddStringToObject(object, "id", row->id);
    else
        out_member(object, "id", (double)row->number);
    return object;
}

static bool is_taken(const cJSON *object, const char *name, const char *const *names, size_t n)
{
    return is_ours(name, names, n) || cJSON_GetObjectItemCaseSensitive(object, name) != NULL;
}

/* A name that nothing else has, in `into`. */
static const char *free_name(const cJSON *object, const char *name, const char *const *names,
                             size_t n, struct text *into)
{
    static const char before[] = "input_";
    size_t prefixes = 0;
    do {
        into->n = 0;
        for (size_t i = 0; i < prefixes; i++)
            text_add(into, before, strlen(before));
        text_add(into, name, strlen(name) + 1);
        prefixes++;
    } while (is_taken(object, into->bytes, names, n));
    return into->bytes;
}

void row_out_members(cJSON *object, const struct spectra_row *row, const char *const *names,
                     size_t n)
{
    struct text name = { 0 };
    for (size_t i = 0; i < row->members.n; i++) {
        const struct json_member *member = &row->members.member[i];
        if (strcmp(member->name, "id") != 0 && strcmp(member->name, "spectrum") != 0)
            add_raw(object, free_name(object, member->name, names, n, &name), member->value);
    }
    text_done(&name);
}
