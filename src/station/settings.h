/* settings.h - how skinspecd was told to run. */
#ifndef SKINSPEC_STATION_SETTINGS_H
#define SKINSPEC_STATION_SETTINGS_H

#include <stdbool.h>
#include <stddef.h>

struct driver;

enum { SETTINGS_MAX_INSTRUMENTS = 16, SETTINGS_MAX_DRIVERS = 16, SETTINGS_PATH_SIZE = 512 };

struct settings {
    char socket[SETTINGS_PATH_SIZE]; /* not used under socket activation */
    char state[SETTINGS_PATH_SIZE];
    const char *tables;                                /* folder to look into first; NULL */
    const char *table;                                 /* name of the default one */
    const char *instruments[SETTINGS_MAX_INSTRUMENTS]; /* "DRIVER[:ADDRESS]" */
    size_t instruments_n;
    /* Whose instruments are taken as they are plugged in; ends with NULL. */
    const struct driver *discovered[SETTINGS_MAX_DRIVERS + 1];
    bool discovers_all;            /* "auto" was given */
    const char *record;            /* capture to write; NULL: none */
    const struct driver *recorded; /* whose instrument is recorded */
    const char *user;              /* account to run as; NULL: stay who it is */
    const char *kiosk_group, *clinic_group, *admin_group;
    size_t max_clients, max_per_user, max_per_process;
    double calibration_hours; /* 0: no limit of the station's own */
    size_t wal_limit_mb;      /* of station.db-wal; above it nothing is stored */
    bool calibration_blocks;  /* an old one blocks; else it warns */
    bool verbose;
};

/* Ends the program with status 2 and a message for options, and for paths of the environment,
 * that cannot be. */
void settings_read(int argc, char **argv, struct settings *ret);

#endif
