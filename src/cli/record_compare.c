/* record_compare.c - two trees, leaf by leaf. */
#include "cli/record_compare.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cli/member.h"
#include "cli/out.h"
#include "json/give.h"
#include "json/print.h"

enum { PATH_SIZE = 160, TEXT_LIMIT = 16 << 20, SHOWN = 200 };

/* Of any length; to be freed. */
static char *text_of(const cJSON *value)
{
    char *text;
    if (value == NULL)
        return NULL;
    if (json_print(value, TEXT_LIMIT, &text, NULL) != STATUS_OK)
        out_of_memory();
    return text;
}

static void add_shown(cJSON *object, const char *name, const char *text)
{
    char shown[SHOWN + 4];
    if (text == NULL)
        return;
    snprintf(shown, sizeof shown, "%.*s%s", (int)SHOWN, text, strlen(text) > SHOWN ? "..." : "");
    cJSON_AddStringToObject(object, name, shown);
}

static void tell(cJSON *found, const char *path, const cJSON *captured, const cJSON *here)
{
    char *was = text_of(captured), *is = text_of(here);
    if (was == NULL || is == NULL || strcmp(was, is) != 0) {
        cJSON *one = cJSON_CreateObject();
        cJSON_AddStringToObject(one, "member", path);
        add_shown(one, "captured", was);
        add_shown(one, "here", is);
        json_give_item(found, one);
    }
    free(was);
    free(is);
}

static void compare(cJSON *found, const char *path, const cJSON *captured, const cJSON *here);

static void compare_members(cJSON *found, const char *path, const cJSON *captured,
                            const cJSON *here)
{
    char below[PATH_SIZE];
    const cJSON *one;
    cJSON_ArrayForEach(one, captured)
    {
        snprintf(below, sizeof below, "%s%s%s", path, *path != '\0' ? "." : "", one->string);
        compare(found, below, one, member(here, one->string));
    }
    cJSON_ArrayForEach(one, here)
    {
        snprintf(below, sizeof below, "%s%s%s", path, *path != '\0' ? "." : "", one->string);
        if (member(captured, one->string) == NULL)
            tell(found, below, NULL, one);
    }
}

static void compare_items(cJSON *found, const char *path, const cJSON *captured, const cJSON *here)
{
    char below[PATH_SIZE];
    int n = cJSON_GetArraySize(captured);
    if (n != cJSON_GetArraySize(here)) {
        snprintf(below, sizeof below, "%s: how many", path);
        cJSON *was = cJSON_CreateNumber(n), *is = cJSON_CreateNumber(cJSON_GetArraySize(here));
        tell(found, below, was, is);
        cJSON_Delete(was);
        cJSON_Delete(is);
        return;
    }
    for (int i = 0; i < n; i++) {
        snprintf(below, sizeof below, "%s[%d]", path, i);
        compare(found, below, cJSON_GetArrayItem(captured, i), cJSON_GetArrayItem(here, i));
    }
}

static void compare(cJSON *found, const char *path, const cJSON *captured, const cJSON *here)
{
    if (cJSON_IsObject(captured) && cJSON_IsObject(here))
        compare_members(found, path, captured, here);
    else if (cJSON_IsArray(captured) && cJSON_IsArray(here))
        compare_items(found, path, captured, here);
    else
        tell(found, path, captured, here);
}

/* Without those that a clock raises. */
static cJSON *flags_of(const cJSON *record)
{
    cJSON *flags = cJSON_CreateArray();
    const cJSON *flag;
    cJSON_ArrayForEach(flag, member(record, "flags"))
    {
        const char *name = cJSON_GetStringValue(flag);
        if (name != NULL && strcmp(name, "calibration_old") != 0 &&
            strcmp(name, "lease_expired") != 0)
            json_give_item(flags, cJSON_CreateString(name));
    }
    return flags;
}

static void compare_flags(cJSON *found, const cJSON *captured, const cJSON *here)
{
    cJSON *was = flags_of(captured), *is = flags_of(here);
    tell(found, "flags", was, is);
    cJSON_Delete(was);
    cJSON_Delete(is);
}

static void compare_match(cJSON *found, const cJSON *captured, const cJSON *here)
{
    const char *was = member_text(captured, "table_sha256"),
               *is = member_text(here, "table_sha256");
    if (captured != NULL && here != NULL && strcmp(was, is) != 0)
        tell(found, "match.table_sha256", member(captured, "table_sha256"),
             member(here, "table_sha256"));
    else
        compare(found, "match", captured, here);
}

cJSON *record_compare(const cJSON *captured, const cJSON *here)
{
    cJSON *found = cJSON_CreateArray();
    const cJSON *one;
    cJSON_ArrayForEach(one, captured)
    {
        if (strcmp(one->string, "flags") == 0)
            compare_flags(found, captured, here);
        else if (strcmp(one->string, "match") == 0)
            compare_match(found, one, member(here, "match"));
        else
            compare(found, one->string, one, member(here, one->string));
    }
    if (member(captured, "match") == NULL && member(here, "match") != NULL)
        tell(found, "match", NULL, member(here, "match"));
    if (found == NULL)
        out_of_memory();
    return found;
}
