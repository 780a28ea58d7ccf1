/* cmd_subjects.c - `skinspec store subjects | add-subject | forget-subject`: people, and the
 * random ids that records know them by. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "cli/command.h"
#include "cli/member.h"
#include "cli/options.h"
#include "cli/prompt.h"
#include "cli/remote.h"

/* ---- subjects ----------------------------------------------------------------------- */

static const struct argp_option list_options[] = {
    OPTION_ROW_SOCKET,
    OPTION_ROWS_JSON,
    { 0 },
};

static void print_known(const char *text)
{
    if (*text != '\0')
        printf("  %s", text);
}

static void print_subject(const cJSON *subject)
{
    const cJSON *person = member(subject, "person");
    fputs(member_text(subject, "id"), stdout);
    print_known(member_true(subject, "forgotten") ? "(forgotten)" : member_text(subject, "label"));
    print_known(member_text(person, "name"));
    if (member(person, "birth_year") != NULL)
        printf("  born %.0f", member_number(person, "birth_year"));
    putchar('\n');
}

static void take_subject(void *context, cJSON *subject)
{
    out_item(context, subject, print_subject);
}

/* A page; `next` of it, "" after the last.  False: logged. */
static bool print_page(struct remote *remote, struct out *out, char next[64])
{
    cJSON *params = cJSON_CreateObject();
    if (*next != '\0')
        cJSON_AddStringToObject(params, "after", next);
    cJSON *page = remote_page(remote, METHOD_SUBJECT_LIST, params, "subjects", take_subject, out);
    if (page == NULL)
        return false;
    snprintf(next, 64, "%s", member_text(page, "next"));
    cJSON_Delete(page);
    return true;
}

int cmd_subjects(int argc, char **argv)
{
    static const struct argp argp = {
        list_options,
        option_parse_station,
        "",
        "The subjects in the order they were added: the random id that records know, the label, "
        "and the person where one was given and not forgotten.\v"
        "Needs the right 'clinic'.\n\n"
        "Example: skinspec store subjects --json\n",
        NULL,
        NULL,
        NULL
    };
    struct option_station station = { NULL, OUT_PLAIN };
    struct remote *remote;
    struct out out;
    char next[64] = "";
    option_parse(&argp, "store subjects", argc, argv, &station);
    if (remote_open(station.socket, NULL, &remote) != STATUS_OK)
        return EXIT_FAILURE;
    out_begin(&out, station.format);
    bool good = print_page(remote, &out, next);
    while (good && *next != '\0')
        good = print_page(remote, &out, next);
    remote_close(remote);
    return out_end(&out) == STATUS_OK && good ? EXIT_SUCCESS : EXIT_FAILURE;
}

/* ---- add-subject -------------------------------------------------------------------- */

enum { OPTION_LABEL = OPTION_OWN, OPTION_NAME, OPTION_BIRTH_YEAR, OPTION_NOTES };

static const struct argp_option add_options[] = {
    { "label", OPTION_LABEL, "TEXT", 0, "Short name for lists", 0 },
    { "name", OPTION_NAME, "TEXT", 0, "The person's name", 0 },
    { "birth-year", OPTION_BIRTH_YEAR, "YEAR", 0, "1850..2200", 0 },
    { "notes", OPTION_NOTES, "TEXT", 0, "Free text; may have several lines", 0 },
    OPTION_ROW_SOCKET,
    OPTION_ROWS_JSON_ONE,
    { 0 },
};

struct add_arguments {
    struct option_station station;
    const char *label, *name, *notes;
    size_t birth_year; /* 0: not given */
};

static error_t parse_add(int key, char *text, struct argp_state *state)
{
    struct add_arguments *a = state->input;
    switch (key) {
    case OPTION_LABEL:
        a->label = text;
        break;
    case OPTION_NAME:
        a->name = text;
        break;
    case OPTION_BIRTH_YEAR:
        a->birth_year = option_count(state, "birth-year", text, 1850, 2200);
        break;
    case OPTION_NOTES:
        a->notes = text;
        break;
    default:
        return option_station(key, text, state, &a->station);
    }
    return 0;
}

static cJSON *add_params(const struct add_arguments *a)
{
    cJSON *params = cJSON_CreateObject(), *person = cJSON_CreateObject();
    if (a->label != NULL)
        cJSON_AddStringToObject(params, "label", a->label);
    if (a->name != NULL)
        cJSON_AddStringToObject(person, "name", a->name);
    if (a->birth_year > 0)
        cJSON_AddNumberToObject(person, "birth_year", (double)a->birth_year);
    if (a->notes != NULL)
        cJSON_AddStringToObject(person, "notes", a->notes);
    if (cJSON_GetArraySize(person) > 0)
        cJSON_AddItemToObject(params, "person", person);
    else
        cJSON_Delete(person);
    return params;
}

int cmd_add_subject(int argc, char **argv)
{
    static const struct argp argp = {
        add_options,
        parse_add,
        "",
        "Add a subject and print its random id, which 'skinspec measure --subject' takes.  Records "
        "hold this id alone; label, name, birth year and notes can be erased later by 'skinspec "
        "store forget-subject'.\v"
        "Needs the right 'clinic'.\n\n"
        "Example: skinspec store add-subject --label P17 --birth-year 1984\n",
        NULL,
        NULL,
        NULL
    };
    struct add_arguments a = { .station = { NULL, OUT_PLAIN } };
    struct remote *remote;
    option_parse(&argp, "store add-subject", argc, argv, &a);
    if (remote_open(a.station.socket, NULL, &remote) != STATUS_OK)
        return EXIT_FAILURE;
    cJSON *result = remote_ask(remote, METHOD_SUBJECT_ADD, add_params(&a));
    bool good = result != NULL;
    if (good && a.station.format != OUT_PLAIN) {
        out_one(result);
    } else if (good) {
        puts(member_text(result, "id"));
        cJSON_Delete(result);
    }
    remote_close(remote);
    return out_exit(good);
}

/* ---- forget-subject ----------------------------------------------------------------- */

static const struct argp_option forget_options[] = {
    { "yes", OPTION_YES, NULL, 0, "Ask nobody", 0 },
    OPTION_ROW_SOCKET,
    OPTION_ROWS_JSON_ONE,
    { 0 },
};

struct forget_arguments {
    struct option_station station;
    const char *id;
    bool yes;
};

static error_t parse_forget(int key, char *text, struct argp_state *state)
{
    struct forget_arguments *a = state->input;
    switch (key) {
    case OPTION_YES:
        a->yes = true;
        break;
    case ARGP_KEY_ARG:
        if (a->id != NULL)
            argp_error(state, "one ID at a time");
        a->id = option_uuid(state, "ID", text);
        break;
    case ARGP_KEY_END:
        if (a->id == NULL)
            argp_error(state, "which subject? 'skinspec store subjects' lists the ids");
        break;
    default:
        return option_station(key, text, state, &a->station);
    }
    return 0;
}

int cmd_forget_subject(int argc, char **argv)
{
    static const struct argp argp = {
        forget_options,
        parse_forget,
        "ID",
        "Erase label, name, birth year and notes of a subject for good.  Measurements stay, under "
        "the random id.\v"
        "Backups, and damaged files that were moved aside, are not reached.  Needs the right "
        "'admin'.\n\n"
        "Example: skinspec store forget-subject 3e1f2c3a-5b6d-4e8f-9a0b-1c2d3e4f5a6b\n",
        NULL,
        NULL,
        NULL
    };
    struct forget_arguments a = { .station = { NULL, OUT_PLAIN } };
    struct remote *remote;
    option_parse(&argp, "store forget-subject", argc, argv, &a);
    if (!a.yes) {
        int refused = prompt_refuses("Erase this person for good?");
        if (refused != EXIT_SUCCESS)
            return refused;
    }
    if (remote_open(a.station.socket, NULL, &remote) != STATUS_OK)
        return EXIT_FAILURE;
    cJSON *params = cJSON_CreateObject();
    cJSON_AddStringToObject(params, "id", a.id);
    cJSON *result = remote_ask(remote, METHOD_SUBJECT_FORGET, params);
    bool good = result != NULL;
    if (good && a.station.format != OUT_PLAIN) {
        out_one(result);
    } else if (good) {
        puts(member_true(result, "erased")
                 ? "forgotten; the bytes are overwritten"
                 : "forgotten; the last bytes go when a reader that still holds them is done, at "
                   "the latest with the station's next start");
        cJSON_Delete(result);
    }
    remote_close(remote);
    return out_exit(good);
}
