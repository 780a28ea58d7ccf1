/* cmd_replay.c - a captured session again, through a station of its own, and what differs. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/log.h"
#include "cli/command.h"
#include "cli/member.h"
#include "cli/options.h"
#include "cli/out.h"
#include "cli/private_station.h"
#include "cli/remote.h"
#include "cli/replay_run.h"
#include "cli/replay_script.h"
#include "cli/stop.h"

enum { OPTION_TABLES = OPTION_OWN, OPTION_WITH, SHOWN_DIFFERENCES = 8 };

static const struct argp_option options[] = {
    { "tables", OPTION_TABLES, "DIR", 0, "Look here first for the station's tables", 0 },
    { "with", OPTION_WITH, "OPTIONS", 0,
      "What stands after the instrument's address, as tile=FILE,port_mm=8 (as the capture says, "
      "its files beside the capture)",
      0 },
    OPTION_ROWS_JSON_ONE,
    { 0 },
};

struct arguments {
    const char *path, *tables, *with;
    enum out_format format;
};

static error_t parse(int key, char *text, struct argp_state *state)
{
    struct arguments *a = state->input;
    if (option_format(key, &a->format))
        return 0;
    switch (key) {
    case OPTION_TABLES:
        a->tables = text;
        return 0;
    case OPTION_WITH:
        a->with = text;
        return 0;
    case ARGP_KEY_ARG:
        option_file(state, text, &a->path);
        return 0;
    case ARGP_KEY_END:
        if (a->path == NULL)
            argp_error(state, "give a capture: FILE of 'skinspecd --record FILE'");
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

/* ---- telling ------------------------------------------------------------------------ */

static void print_difference(const cJSON *one)
{
    const char *name = member_text(one, "member");
    if (strcmp(name, "match.table_sha256") == 0) {
        printf("    another table: %s in the capture, %s here; the match is not compared.\n"
               "    --tables DIR names the folder of the table it was matched with\n",
               member_text(one, "captured"), member_text(one, "here"));
        return;
    }
    const char *captured = member_text(one, "captured"), *here = member_text(one, "here");
    printf("    %s: %s in the capture, %s here\n", name, *captured != '\0' ? captured : "nothing",
           *here != '\0' ? here : "nothing");
    if (strcmp(name, "match") == 0 && *here == '\0')
        puts("    there is no table here to match with: --tables DIR, or 'skinspec table build'");
}

static void print_step(const cJSON *step)
{
    const cJSON *one;
    int n = 0, all = cJSON_GetArraySize(member(step, "differences"));
    printf("%s: %s\n", member_text(step, "step"), member_text(step, "outcome"));
    cJSON_ArrayForEach(one, member(step, "differences"))
    {
        if (n++ < SHOWN_DIFFERENCES)
            print_difference(one);
    }
    if (all > SHOWN_DIFFERENCES)
        printf("    and %d more; --json tells all\n", all - SHOWN_DIFFERENCES);
    fflush(stdout);
}

static void print_nothing(const cJSON *step)
{
    log_info("%s: %s", member_text(step, "step"), member_text(step, "outcome"));
}

static int count(const cJSON *steps, const char *outcome)
{
    int n = 0;
    const cJSON *step;
    cJSON_ArrayForEach(step, steps)
    {
        n += strcmp(member_text(step, "outcome"), outcome) == 0;
    }
    return n;
}

/* ---- a part -------------------------------------------------------------------------- */

/* An option of the captured address, "tile=tile.csv": a file beside the capture, if there is one
 * of that name. */
static void put_captured_option(FILE *to, const char *capture, const char *option, int n)
{
    const char *value = memchr(option, '=', (size_t)n), *end = strrchr(capture, '/');
    char path[PRIVATE_PATH_SIZE];
    if (value != NULL) {
        int name = (int)(value + 1 - option);
        snprintf(path, sizeof path, "%.*s%.*s", end != NULL ? (int)(end + 1 - capture) : 0, capture,
                 n - name, option + name);
        if (n > name && access(path, R_OK) == 0) {
            fprintf(to, ",%.*s%s", name, option, path);
            return;
        }
    }
    fprintf(to, ",%.*s", n, option);
}

/* "DRIVER:replay:FILE,options" */
static char *address_of(const struct replay_script *script, const struct arguments *a,
                        const char *path)
{
    const char *kept = member_text(script->station, "options");
    char *address = NULL;
    size_t size;
    FILE *to = open_memstream(&address, &size);
    if (to == NULL)
        out_of_memory();
    fprintf(to, "%s:replay:%s", script->driver, path);
    if (a->with != NULL)
        fprintf(to, ",%s", a->with);
    for (size_t n; a->with == NULL && *kept != '\0'; kept += n + (kept[n] == ',')) {
        n = strcspn(kept, ",");
        put_captured_option(to, script->path, kept, (int)n);
    }
    if (fclose(to) != 0)
        out_of_memory();
    return address;
}

static enum status start(struct private_station *station, const struct replay_script *script,
                         const struct arguments *a, const char *path)
{
    const char *option[16] = { "--instrument" };
    size_t n = 1;
    const char *table = member_text(script->station, "table");
    const char *policy = member_text(script->station, "calibration_policy");
    char *address = address_of(script, a, path);
    option[n++] = address;
    if (a->tables != NULL) {
        option[n++] = "--tables";
        option[n++] = a->tables;
    }
    if (*table != '\0') {
        option[n++] = "--table";
        option[n++] = table;
    }
    if (*policy != '\0') {
        option[n++] = "--calibration-policy";
        option[n++] = policy;
    }
    option[n] = NULL;
    enum status s = private_station_start(station, option);
    free(address);
    return s;
}

static bool play(struct private_station *station, const struct replay_script *script, size_t i,
                 const struct arguments *a, struct stop *stop, cJSON *told)
{
    char path[PRIVATE_PATH_SIZE];
    struct remote *remote;
    private_station_path(station, "capture", path);
    if (replay_script_write(script, i, path) != STATUS_OK ||
        start(station, script, a, path) != STATUS_OK)
        return false;
    bool good = remote_open(station->socket, NULL, &remote) == STATUS_OK;
    if (good) {
        good = replay_run(remote, stop, &script->parts[i], told,
                          a->format == OUT_PLAIN ? print_step : print_nothing);
        remote_close(remote);
    }
    private_station_stop(station);
    if (!good && stop->signal == 0)
        private_station_show_log(station);
    return good;
}

/* ---- all ---------------------------------------------------------------------------- */

static int conclude(const struct arguments *a, const struct replay_script *script, cJSON *told,
                    bool whole)
{
    int differ = count(told, "differs"), same = count(told, "same"),
        open = count(told, "not compared");
    bool good = whole && differ == 0;
    if (a->format != OUT_PLAIN) {
        cJSON *result = cJSON_CreateObject();
        cJSON_AddStringToObject(result, "capture", script->path);
        cJSON_AddStringToObject(result, "driver", script->driver);
        cJSON_AddItemToObject(result, "steps", told);
        cJSON_AddBoolToObject(result, "whole", whole);
        cJSON_AddBoolToObject(result, "same", good);
        out_one(result);
        return out_exit(good);
    }
    if (good && open == 0)
        printf("same: %d measurement%s bit for bit\n", same, same == 1 ? "" : "s");
    else if (good)
        printf("same as far as the capture says: %d measurements bit for bit, %d that it does not "
               "tell the end of\n",
               same, open);
    else if (whole)
        printf("differs in %d step%s\n", differ, differ == 1 ? "" : "s");
    cJSON_Delete(told);
    return out_exit(good);
}

static int replay(const struct arguments *a)
{
    struct replay_script script;
    struct private_station station;
    struct stop stop;
    int exit_status = EXIT_FAILURE;
    if (replay_script_read(a->path, &script) != STATUS_OK)
        return EXIT_FAILURE;
    if (stop_begin(&stop) != STATUS_OK) {
        replay_script_free(&script);
        return EXIT_FAILURE;
    }
    if (private_station_begin(&station) == STATUS_OK) {
        cJSON *told = cJSON_CreateArray();
        bool whole = true;
        for (size_t i = 0; i < script.n && whole; i++)
            whole = play(&station, &script, i, a, &stop, told);
        private_station_end(&station);
        if (stop.signal == 0)
            exit_status = conclude(a, &script, told, whole);
        else
            cJSON_Delete(told);
    }
    replay_script_free(&script);
    stop_end(&stop);
    stop_as_asked(&stop);
    return exit_status;
}

int cmd_replay(int argc, char **argv)
{
    static const struct argp argp = {
        options,
        parse,
        "FILE",
        "Do again what a capture of 'skinspecd --record FILE' holds: a skinspecd of its own is "
        "started in a private folder, with the capture for an instrument, is asked what the "
        "station "
        "was asked then, and each record is compared with the captured one, bit for bit.\v"
        "Exit status 0: all the same; 1: something differs (which member, and both values), or "
        "could not be done.  Another table than then counts as a difference.\n\n"
        "Examples:\n"
        "  skinspec replay session.txt\n"
        "  skinspec replay session.txt --tables build/tables --json\n",
        NULL,
        NULL,
        NULL
    };
    struct arguments a = { .format = OUT_PLAIN };
    option_parse(&argp, "replay", argc, argv, &a);
    return replay(&a);
}
