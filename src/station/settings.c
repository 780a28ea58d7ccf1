/* settings.c - the options of skinspecd. */
#include "station/settings.h"

#include <argp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "base/number.h"
#include "base/version.h"
#include "drivers/registry.h"
#include "station/tables.h"

const char *argp_program_version = "skinspecd " SKINSPEC_VERSION;

enum {
    EXIT_USAGE = 2,
    MOST = 4096,
    KEY_SOCKET = 0x100,
    KEY_STATE,
    KEY_TABLES,
    KEY_TABLE,
    KEY_INSTRUMENT,
    KEY_USER,
    KEY_KIOSK_GROUP,
    KEY_CLINIC_GROUP,
    KEY_ADMIN_GROUP,
    KEY_MAX_CLIENTS,
    KEY_MAX_PER_USER,
    KEY_MAX_PER_PROCESS,
    KEY_CALIBRATION_HOURS,
    KEY_CALIBRATION_POLICY,
    KEY_WAL_LIMIT,
    KEY_RECORD,
    KEY_DRIVERS,
    KEY_VERBOSE,
};

static const struct argp_option options[] = {
    { "socket", KEY_SOCKET, "PATH", 0,
      "Where to listen (SKINSPEC_SOCKET, $XDG_RUNTIME_DIR/skinspec.sock, "
      "/run/skinspec/skinspecd.sock)",
      0 },
    { "state", KEY_STATE, "DIR", 0,
      "Folder of station.db (STATE_DIRECTORY, /var/lib/skinspec); it must exist", 0 },
    { "instrument", KEY_INSTRUMENT, "DRIVER[:ADDRESS]|auto", 0,
      "An instrument of the station; give it once for each.  A driver without an address: all of "
      "its instruments that are plugged in; auto: those of every driver",
      0 },
    { "tables", KEY_TABLES, "DIR", 0, "Look here first for tables", 0 },
    { "table", KEY_TABLE, "NAME", 0, "Table to match with by default (" TABLES_DEFAULT ")", 0 },
    { "calibration-hours", KEY_CALIBRATION_HOURS, "H", 0,
      "A calibration is old after this many hours, suspend included; 0: never (8)", 0 },
    { "calibration-policy", KEY_CALIBRATION_POLICY, "block|warn", 0,
      "What an old calibration does: no measurement, or one with a flag (block)", 0 },
    { "user", KEY_USER, "NAME", 0, "Run as this account; refuse to start where it is missing", 0 },
    { "kiosk-group", KEY_KIOSK_GROUP, "NAME", 0, "Who may measure and match (skinspec)", 0 },
    { "clinic-group", KEY_CLINIC_GROUP, "NAME", 0,
      "Who may also see all records and subjects (skinspec-clinic)", 0 },
    { "admin-group", KEY_ADMIN_GROUP, "NAME", 0, "Who may do everything (skinspec-admin)", 0 },
    { "max-clients", KEY_MAX_CLIENTS, "N", 0, "Connections at a time (64)", 0 },
    { "max-per-user", KEY_MAX_PER_USER, "N", 0, "Connections of one user (48)", 0 },
    { "max-per-process", KEY_MAX_PER_PROCESS, "N", 0, "Connections of one process (16)", 0 },
    { "wal-limit", KEY_WAL_LIMIT, "MB", 0,
      "Store nothing more while a program that keeps reading station.db has made its -wal grow "
      "beyond this (1024)",
      0 },
    { "record", KEY_RECORD, "FILE", 0,
      "Write every byte to and from the instrument, and what the station was asked, to a new file "
      "that 'skinspec replay' takes; no names of people are in it.  One --instrument with a wire",
      0 },
    { "drivers", KEY_DRIVERS, NULL, 0,
      "List the drivers and end: NAME, then VID:PID and tty or usb of each device that is taken "
      "when it is plugged in",
      0 },
    { "verbose", KEY_VERBOSE, NULL, 0, "Log more", 0 },
    { 0 },
};

static size_t count(struct argp_state *state, const char *option, const char *text)
{
    size_t n = 0;
    if (number_parse_count(text, MOST, &n) != STATUS_OK || n == 0)
        argp_error(state, "--%s wants a whole number from 1 to %d, not '%s'", option, (int)MOST,
                   text);
    return n;
}

static void copy_path(struct argp_state *state, const char *option, const char *text,
                      char path[SETTINGS_PATH_SIZE])
{
    if (*text == '\0' || strlen(text) >= SETTINGS_PATH_SIZE)
        argp_error(state, "--%s wants a path of 1 to %d bytes", option, SETTINGS_PATH_SIZE - 1);
    snprintf(path, SETTINGS_PATH_SIZE, "%s", text);
}

static void add_discovered(struct settings *s, const struct driver *driver)
{
    size_t n = 0;
    while (s->discovered[n] != NULL && s->discovered[n] != driver)
        n++;
    if (n < SETTINGS_MAX_DRIVERS)
        s->discovered[n] = driver;
}

/* Of "DRIVER[:ADDRESS]"; NULL: there is none. */
static const struct driver *driver_of(const char *text)
{
    char name[64];
    snprintf(name, sizeof name, "%.*s", (int)strcspn(text, ":"), text);
    return driver_find(name);
}

static void add_instrument(struct argp_state *state, struct settings *s, const char *text)
{
    char name[64];
    const struct driver *driver = driver_of(text);
    snprintf(name, sizeof name, "%.*s", (int)strcspn(text, ":"), text);
    if (strcmp(text, "auto") == 0) {
        s->discovers_all = true;
        for (size_t i = 0; driver_registry[i] != NULL; i++)
            if (driver_registry[i]->matches != NULL)
                add_discovered(s, driver_registry[i]);
        return;
    }
    if (driver != NULL && driver->matches != NULL && strcmp(text, name) == 0) {
        add_discovered(s, driver);
        return;
    }
    if (driver == NULL) {
        char known[256] = "";
        for (size_t i = 0; driver_registry[i] != NULL; i++)
            snprintf(known + strlen(known), sizeof known - strlen(known), " %s",
                     driver_registry[i]->name);
        argp_error(state, "--instrument: there is no driver '%s'; there are:%s", name, known);
    }
    if (s->instruments_n == SETTINGS_MAX_INSTRUMENTS)
        argp_error(state, "at most %d instruments", (int)SETTINGS_MAX_INSTRUMENTS);
    s->instruments[s->instruments_n++] = text;
}

/* One instrument, of one driver: a capture is one conversation. */
static void check_record(struct argp_state *state, struct settings *s)
{
    size_t discovered = 0;
    while (s->discovered[discovered] != NULL)
        discovered++;
    if (s->record == NULL)
        return;
    if (!s->discovers_all && s->instruments_n + discovered == 0)
        argp_error(state,
                   "--record wants an instrument to write down: --instrument DRIVER:ADDRESS");
    if (s->discovers_all || s->instruments_n + discovered > 1)
        argp_error(state, "--record writes one instrument down, and more than one could come: give "
                          "one --instrument DRIVER:ADDRESS, and not auto");
    s->recorded = discovered > 0 ? s->discovered[0] : driver_of(s->instruments[0]);
    if (s->recorded->has_no_wire)
        argp_error(state,
                   "--record: '%s' has no wire, so there are no bytes to write down; give an "
                   "instrument that has one",
                   s->recorded->name);
}

static void list_drivers(void)
{
    for (size_t i = 0; driver_registry[i] != NULL; i++) {
        const struct driver_match *match = driver_registry[i]->matches;
        printf("%s", driver_registry[i]->name);
        for (; match != NULL && match->vid != 0; match++) {
            printf(" %04x:", match->vid);
            printf(match->pid != 0 ? "%04x" : "*", match->pid);
            printf(" %s", match->bus == DRIVER_BUS_TTY ? "tty" : "usb");
        }
        putchar('\n');
    }
    exit(fflush(stdout) == 0 ? EXIT_SUCCESS : EXIT_FAILURE);
}

static void set_policy(struct argp_state *state, struct settings *s, const char *text)
{
    s->calibration_blocks = strcmp(text, "block") == 0;
    if (!s->calibration_blocks && strcmp(text, "warn") != 0)
        argp_error(state, "--calibration-policy wants block or warn, not '%s'", text);
}

static void set_hours(struct argp_state *state, struct settings *s, const char *text)
{
    if (number_parse(text, &s->calibration_hours) != STATUS_OK || s->calibration_hours < 0.0 ||
        s->calibration_hours > 100000.0)
        argp_error(state, "--calibration-hours wants a number from 0 to 100000, not '%s'", text);
}

static error_t parse_limit(int key, char *text, struct argp_state *state, struct settings *s)
{
    switch (key) {
    case KEY_MAX_CLIENTS:
        s->max_clients = count(state, "max-clients", text);
        return 0;
    case KEY_MAX_PER_USER:
        s->max_per_user = count(state, "max-per-user", text);
        return 0;
    case KEY_MAX_PER_PROCESS:
        s->max_per_process = count(state, "max-per-process", text);
        return 0;
    case KEY_WAL_LIMIT:
        s->wal_limit_mb = count(state, "wal-limit", text);
        return 0;
    case KEY_CALIBRATION_HOURS:
        set_hours(state, s, text);
        return 0;
    case KEY_CALIBRATION_POLICY:
        set_policy(state, s, text);
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static error_t parse(int key, char *text, struct argp_state *state)
{
    struct settings *s = state->input;
    switch (key) {
    case KEY_SOCKET:
        copy_path(state, "socket", text, s->socket);
        break;
    case KEY_STATE:
        copy_path(state, "state", text, s->state);
        break;
    case KEY_TABLES:
        s->tables = text;
        break;
    case KEY_TABLE:
        s->table = text;
        break;
    case KEY_INSTRUMENT:
        add_instrument(state, s, text);
        break;
    case KEY_USER:
        s->user = text;
        break;
    case KEY_KIOSK_GROUP:
        s->kiosk_group = text;
        break;
    case KEY_CLINIC_GROUP:
        s->clinic_group = text;
        break;
    case KEY_ADMIN_GROUP:
        s->admin_group = text;
        break;
    case KEY_RECORD:
        s->record = text;
        break;
    case KEY_DRIVERS:
        list_drivers();
        break;
    case KEY_VERBOSE:
        s->verbose = true;
        break;
    case ARGP_KEY_END:
        check_record(state, s);
        break;
    case ARGP_KEY_ARG:
        argp_error(state, "there is nothing to do with '%s'", text);
        break;
    default:
        return parse_limit(key, text, state, s);
    }
    return 0;
}

/* FOLDER/NAME of an environment variable, whole or not at all: another place than was meant
 * would go unnoticed. */
static void take_path(const char *variable, const char *folder, const char *name,
                      char path[SETTINGS_PATH_SIZE])
{
    int n = snprintf(path, SETTINGS_PATH_SIZE, "%s%s", folder, name);
    if (n >= 0 && n < SETTINGS_PATH_SIZE)
        return;
    log_error("%s is too long: a path of at most %d bytes is wanted", variable,
              SETTINGS_PATH_SIZE - 1 - (int)strlen(name));
    exit(EXIT_USAGE);
}

static bool has(const char *value)
{
    return value != NULL && *value != '\0';
}

/* Those that no option has named. */
static void default_paths(struct settings *s)
{
    const char *socket = getenv("SKINSPEC_SOCKET"), *runtime = getenv("XDG_RUNTIME_DIR");
    const char *state = getenv("STATE_DIRECTORY");
    if (*s->socket == '\0' && has(socket))
        take_path("SKINSPEC_SOCKET", socket, "", s->socket);
    else if (*s->socket == '\0' && has(runtime))
        take_path("XDG_RUNTIME_DIR", runtime, "/skinspec.sock", s->socket);
    else if (*s->socket == '\0')
        take_path("", "/run/skinspec/skinspecd.sock", "", s->socket);
    if (*s->state == '\0' && has(state))
        take_path("STATE_DIRECTORY", state, "", s->state);
    else if (*s->state == '\0')
        take_path("", "/var/lib/skinspec", "", s->state);
}

void settings_read(int argc, char **argv, struct settings *ret)
{
    static const struct argp argp = {
        options,
        parse,
        NULL,
        "The measuring station: drives instruments, matches what they measure, keeps the records, "
        "and answers programs on a Unix socket.\v"
        "To try it without an instrument:\n\n"
        "  skinspecd --socket /tmp/s.sock --state /tmp/state --instrument simulated\n"
        "  SKINSPEC_SOCKET=/tmp/s.sock skinspec status\n\n"
        "It stays in the foreground and ends on SIGTERM or Ctrl-C.  Under systemd it takes the "
        "socket it is given, says when it is ready, and feeds the watchdog.",
        NULL,
        NULL,
        NULL
    };
    *ret = (struct settings){
        .table = TABLES_DEFAULT,
        .kiosk_group = "skinspec",
        .clinic_group = "skinspec-clinic",
        .admin_group = "skinspec-admin",
        .max_clients = 64,
        .max_per_user = 48,
        .max_per_process = 16,
        .calibration_hours = 8.0,
        .wal_limit_mb = 1024,
        .calibration_blocks = true,
    };
    argp_err_exit_status = EXIT_USAGE;
    argp_parse(&argp, argc, argv, 0, NULL, ret);
    default_paths(ret);
}
