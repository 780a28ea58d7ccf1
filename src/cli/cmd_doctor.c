/* cmd_doctor.c - what is plugged in and what is wrong with it; or a walk through one instrument. */
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "base/log.h"
#include "cli/command.h"
#include "cli/doctor_device.h"
#include "cli/doctor_walk.h"
#include "cli/member.h"
#include "cli/options.h"
#include "cli/out.h"
#include "cli/private_station.h"
#include "cli/remote.h"
#include "cli/stop.h"
#include "json/give.h"

enum { OPTION_RECORD = OPTION_OWN, OPTION_TABLES, NAME_SIZE = 256 };

static const struct argp_option options[] = {
    { "instrument", OPTION_INSTRUMENT, "DRIVER:ADDRESS", 0,
      "Walk through what this one can do, as skinspecd --instrument names it", 0 },
    { "record", OPTION_RECORD, "FILE", 0,
      "Where the capture of that goes (skinspec-DRIVER-DATE.capture)", 0 },
    { "tables", OPTION_TABLES, "DIR", 0, "Look here first for the station's tables", 0 },
    OPTION_ROWS_JSON_ONE,
    { 0 },
};

struct arguments {
    const char *instrument, *record, *tables;
    enum out_format format;
};

static error_t parse(int key, char *text, struct argp_state *state)
{
    struct arguments *a = state->input;
    if (option_format(key, &a->format))
        return 0;
    switch (key) {
    case OPTION_INSTRUMENT:
        a->instrument = text;
        return 0;
    case OPTION_RECORD:
        a->record = text;
        return 0;
    case OPTION_TABLES:
        a->tables = text;
        return 0;
    case ARGP_KEY_ARG:
        option_unexpected(state, text);
        return 0;
    case ARGP_KEY_END:
        if (a->record != NULL && a->instrument == NULL)
            argp_error(state, "--record goes with --instrument DRIVER:ADDRESS");
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

/* ---- what is there ------------------------------------------------------------------- */

static void print_problems(const cJSON *problems, const char *indent)
{
    const cJSON *one;
    cJSON_ArrayForEach(one, problems)
    {
        printf("%swrong: %s\n%s   do: %s\n", indent, member_text(one, "what"), indent,
               member_text(one, "do"));
    }
}

static void print_taker(const cJSON *device)
{
    const char *driver = member_text(device, "driver"), *by_id = member_text(device, "by_id");
    const char *name = *by_id != '\0' ? by_id : member_text(device, "node");
    if (*driver != '\0' && strcmp(member_text(device, "kind"), "tty") == 0)
        printf(
            "  %s takes it: skinspecd --instrument auto; to try it: skinspec doctor --instrument "
            "%s:%s\n",
            driver, driver, member_text(device, "node"));
    else if (*driver != '\0')
        printf("  %s takes it; to try it: skinspec doctor --instrument %s:usb:%s and what the "
               "driver wants besides (docs/drivers.md)\n",
               driver, driver, member_text(device, "usb"));
    else
        printf("  no driver takes it by itself: where an instrument is behind this port, name it: "
               "skinspecd --instrument DRIVER:%s\n",
               name);
}

static void print_device(const cJSON *device)
{
    printf("%s  %s  %s %s%s%s\n", member_text(device, "node"), member_text(device, "usb"),
           member_text(device, "maker"), member_text(device, "product"),
           member(device, "serial") != NULL ? ", serial " : "", member_text(device, "serial"));
    if (member(device, "mode") != NULL)
        printf("  %s:%s %s\n", member_text(device, "owner"), member_text(device, "group"),
               member_text(device, "mode"));
    print_taker(device);
    print_problems(member(device, "problems"), "  ");
}

/* Of what a driver takes; an adaptor nobody named is none of ours. */
static bool has_problems(const cJSON *found)
{
    const cJSON *device;
    bool some = cJSON_GetArraySize(member(found, "programs")) > 0;
    cJSON_ArrayForEach(device, member(found, "devices"))
    {
        some = some || (member(device, "driver") != NULL &&
                        cJSON_GetArraySize(member(device, "problems")) > 0);
    }
    return some;
}

static void print_found(const cJSON *found)
{
    const cJSON *device;
    printf("skinspecd: %s\n", member_text(found, "skinspecd"));
    cJSON_ArrayForEach(device, member(found, "devices"))
    {
        print_device(device);
    }
    if (cJSON_GetArraySize(member(found, "devices")) == 0)
        puts("no tty of a USB device and no USB instrument is there: connect it and switch it on; "
             "'lsusb' and 'sudo dmesg' tell what the system has seen");
    print_problems(member(found, "programs"), "");
}

static int look(const struct arguments *a)
{
    struct doctor_match matches[DOCTOR_MATCHES];
    struct private_station station;
    if (private_station_begin(&station) != STATUS_OK)
        return EXIT_FAILURE;
    char *drivers = private_station_ask(&station, "--drivers");
    cJSON *found = cJSON_CreateObject();
    cJSON_AddStringToObject(found, "skinspecd", station.program);
    private_station_end(&station);
    if (drivers == NULL) {
        cJSON_Delete(found);
        return EXIT_FAILURE;
    }
    size_t n = doctor_read_matches(drivers, matches);
    free(drivers);
    json_give_member(found, "devices", doctor_devices(matches, n));
    json_give_member(found, "programs", doctor_disturbers());
    bool good = !has_problems(found);
    if (a->format != OUT_PLAIN) {
        out_one(found);
    } else {
        print_found(found);
        cJSON_Delete(found);
    }
    return out_exit(good);
}

/* ---- a walk -------------------------------------------------------------------------- */

static const char *name_capture(const struct arguments *a, char name[NAME_SIZE])
{
    char date[32];
    time_t now = time(NULL);
    struct tm utc;
    if (a->record != NULL)
        return a->record;
    gmtime_r(&now, &utc);
    strftime(date, sizeof date, "%Y%m%dT%H%M%SZ", &utc);
    snprintf(name, NAME_SIZE, "skinspec-%.*s-%s.capture",
             (int)(strcspn(a->instrument, ":") < 40 ? strcspn(a->instrument, ":") : 40),
             a->instrument, date);
    return name;
}

/* At its end, once nobody else writes to it.  False: logged. */
static bool add_notes(const char *path, const cJSON *notes)
{
    const cJSON *one;
    int fd = open(path, O_WRONLY | O_APPEND | O_CLOEXEC);
    FILE *to = fd >= 0 ? fdopen(fd, "a") : NULL;
    if (to == NULL) {
        if (fd >= 0)
            close(fd);
        if (errno != ENOENT) /* the station said why there is none */
            log_error("%s: %s: what was found is not noted in it", path, strerror(errno));
        return false;
    }
    cJSON_ArrayForEach(one, notes)
    {
        fprintf(to, "# doctor: %s: ", member_text(one, "step"));
        for (const char *c = member_text(one, "outcome"); *c != '\0'; c++)
            putc((unsigned char)*c < ' ' ? ' ' : *c, to);
        putc('\n', to);
    }
    bool good = fflush(to) == 0 && !ferror(to);
    int why = errno;
    good = fclose(to) == 0 && good;
    if (!good)
        log_error("%s: %s: what was found is not noted in it", path, strerror(why));
    return good;
}

static bool failed(const cJSON *notes)
{
    const cJSON *one;
    cJSON_ArrayForEach(one, notes)
    {
        if (strncmp(member_text(one, "outcome"), "failed", 6) == 0)
            return true;
    }
    return false;
}

static void tell_end(const struct arguments *a, const char *path, cJSON *notes, bool whole)
{
    if (a->format != OUT_PLAIN) {
        cJSON *result = cJSON_CreateObject();
        cJSON_AddStringToObject(result, "capture", path);
        cJSON_AddBoolToObject(result, "whole", whole);
        cJSON_AddItemToObject(result, "steps", notes);
        out_one(result);
        return;
    }
    printf("The capture is %s.\n"
           "It holds every byte to and from the instrument, its serial number, the spectra of what "
           "was measured and your answers; no names.  'less' shows it: it is text.\n"
           "See that it can be done again:  skinspec replay %s\n"
           "Send it to those who maintain skinspec, with what went wrong in your own words; with "
           "it a driver that was only simulated becomes one that was seen.\n",
           path, path);
    cJSON_Delete(notes);
}

static bool start(struct private_station *station, const struct arguments *a, const char *path)
{
    const char *option[8] = { "--instrument", a->instrument, "--record", path };
    if (a->tables != NULL) {
        option[4] = "--tables";
        option[5] = a->tables;
    }
    return private_station_start(station, option) == STATUS_OK;
}

static bool walk_with(struct private_station *station, const struct arguments *a, const char *path,
                      struct stop *stop, cJSON *notes)
{
    char driver[64];
    struct remote *remote;
    if (!start(station, a, path))
        return false;
    bool good = remote_open(station->socket, NULL, &remote) == STATUS_OK;
    if (good) {
        snprintf(driver, sizeof driver, "%.*s", (int)strcspn(a->instrument, ":"), a->instrument);
        good = doctor_walk(remote, stop, driver, notes);
        remote_close(remote);
    }
    private_station_stop(station);
    if (!good && cJSON_GetArraySize(notes) == 0)
        private_station_show_log(station);
    return good;
}

static int walk(const struct arguments *a)
{
    char name[NAME_SIZE];
    struct private_station station;
    struct stop stop;
    const char *path = name_capture(a, name);
    if (access(path, F_OK) == 0) {
        log_error("%s is there: a capture is never written over; give --record another name", path);
        return EXIT_FAILURE;
    }
    if (stop_begin(&stop) != STATUS_OK)
        return EXIT_FAILURE;
    bool whole = false, noted = false;
    cJSON *notes = cJSON_CreateArray();
    if (private_station_begin(&station) == STATUS_OK) {
        whole = walk_with(&station, a, path, &stop, notes);
        private_station_end(&station);
        noted = add_notes(path, notes);
    }
    bool good = whole && noted && !failed(notes);
    if (noted)
        tell_end(a, path, notes, whole);
    else
        cJSON_Delete(notes);
    stop_end(&stop);
    stop_as_asked(&stop);
    return out_exit(good);
}

int cmd_doctor(int argc, char **argv)
{
    static const struct argp argp = {
        options,
        parse,
        "",
        "What is plugged in, which driver takes it, and what is wrong: permissions, rules that are "
        "missing, programs that hold or disturb a port, each with what to do.  Nothing is opened.\n"
        "With --instrument a person is led through all that one can do (identity, calibrations, "
        "shots, button, cable, and what nobody could say without one), and every byte is "
        "recorded.\v"
        "Exit status 0: nothing is wrong; 1: something is, or a step failed or was left.\n\n"
        "Examples:\n"
        "  skinspec doctor\n"
        "  skinspec doctor --instrument km_ascii:/dev/ttyACM0\n"
        "  skinspec doctor --instrument ocean_ooi:usb,tile=tile.csv,port_mm=8 --record first.txt\n",
        NULL,
        NULL,
        NULL
    };
    struct arguments a = { .format = OUT_PLAIN };
    option_parse(&argp, "doctor", argc, argv, &a);
    return a.instrument != NULL ? walk(&a) : look(&a);
}
