/* table_out.c - the members of a table's description, one a line or as JSON. */
#include "cli/table_out.h"

#include <stdio.h>
#include <string.h>

#include "base/number.h"
#include "cli/out.h"
#include "db/table_schema.h"

/* Members in the order they are printed, as text for people and JSON. */
static void text_member(bool json, cJSON *object, const char *name, const char *value)
{
    if (json)
        cJSON_AddStringToObject(object, name, value);
    else
        printf("%-15s %s\n", name, value);
}

static void number_member(bool json, cJSON *object, const char *name, double x)
{
    char text[NUMBER_TEXT_SIZE];
    if (json)
        out_member(object, name, x);
    else
        printf("%-15s %s\n", name, number_format_exact(x, text));
}

void table_out_info(bool json, const char *path, const struct table_file_info *info)
{
    struct table_meta meta;
    struct out out;
    char name[TABLE_NAME_SIZE];
    cJSON *object = cJSON_CreateObject();
    table_meta_of(&info->recipe, &meta);
    table_file_name(path, name);
    out_begin(&out, OUT_NDJSON);
    text_member(json, object, "name", name);
    text_member(json, object, "path", path);
    for (size_t i = 0; i < TABLE_META_COUNT; i++) {
        double x;
        if (strcmp(meta.key[i], "code_version") == 0)
            text_member(json, object, meta.key[i], info->code_version);
        else if (number_parse(meta.value[i], &x) == STATUS_OK)
            number_member(json, object, meta.key[i], x);
        else
            text_member(json, object, meta.key[i], meta.value[i]);
    }
    number_member(json, object, "bytes", (double)info->bytes);
    text_member(json, object, "rtree", info->rtree ? "yes" : "no");
    text_member(json, object, "trust", info->recipe.model->trust);
    text_member(json, object, TABLE_CONTENT_KEY, info->content_sha256);
    text_member(json, object, TABLE_PAGES_KEY, info->pages_sha256);
    if (json)
        out_object(&out, object);
    else
        cJSON_Delete(object);
}
