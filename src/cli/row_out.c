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
    if (!spectra_has_id(spectra))
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

cJSON *row_out_object(const struct spectra_row *row)
{
    cJSON *object = cJSON_CreateObject();
    if (row->id != NULL)
        cJSON_AddStringToObject(object, "id", row->id);
    else
        out_member(object, "id", (double)row->number);
    return object;
}
