/* station_schema.h - the SQL of station.db, version by version.
 *
 * docs/data.md describes the file for people who query it. */
#ifndef SKINSPEC_DB_STATION_SCHEMA_H
#define SKINSPEC_DB_STATION_SCHEMA_H

#include <stddef.h>

#include <sqlite3.h>

#include "base/status.h"

/* SQLite's own header fields say what the file is before any SQL is run. */
enum { STATION_APPLICATION_ID = 0x536b5374 /* "SkSt" */ };

/* A text in the schema by which a file with a spoilt header is still known as ours. */
#define STATION_SIGN "-- skinspec: the station that owns this file"

/* The SQL that leads to a version from the one before, user_version included: so it
 * is raised in the same transaction.  Columns may be added to a table that the audit
 * chain covers if they are NULL in the rows there are (db/audit.h). */
enum { STATION_STEP_PARTS = 8 };
struct station_step {
    int version;
    const char *sql[STATION_STEP_PARTS]; /* in this order; NULL for none */
};

extern const struct station_step station_steps[];
extern const size_t station_steps_n;
int station_version(void); /* of the last step: what this program writes */

/* Bring a database to the last of these steps, each in one transaction: what fails or is
 * killed leaves the version before.  STATUS_VERSION, and nothing done, where it is
 * newer; STATUS_DB for a step that fails or does not raise user_version to its own. */
enum status station_migrate(sqlite3 *db, const struct station_step *steps, size_t n);

#endif
