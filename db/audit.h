/* audit.h - who did what, chained so that no row can be changed unnoticed.
 *
 * The canonical dump of a row is its table's name and "\n", and then for each column
 * that is not NULL, in the order of the table,
 *
 *     NAME "=" TYPE LENGTH ":" BYTES "\n"
 *
 *   TYPE  BYTES (LENGTH of them, LENGTH in decimal)
 *   i     an integer in decimal
 *   f     a float64 as 16 hexadecimal digits, sign and exponent first
 *   t     text, UTF-8
 *   b     a blob
 *
 * NULL is left out so that a column added later, NULL in old rows, leaves old dumps
 * as they were.
 *
 *   digests  of an audit row: the SHA-256 of the dump of each row it is about, one
 *            after the other (measurement, then its match, where there is one)
 *   hash     SHA-256 of the hash of the row before (32 zero bytes before the first)
 *            and of the dump of the audit row without `hash`
 *
 * Every row of station, subject, site, instrument, calibration, check_tile, check_reading,
 * measurement and match is what one audit row is about.  subject_person is not: it can be erased,
 * and not even a hash of a name stays.
 *
 * What this cannot notice: the newest rows cut off together with their audit rows, or
 * the whole chain written anew.  Whoever keeps a copy of the last hash can. */
#ifndef SKINSPEC_DB_AUDIT_H
#define SKINSPEC_DB_AUDIT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <sqlite3.h>

#include "base/status.h"
#include "db/audit_dump.h"

/* Actions about rows.  Any other is free text about nothing but itself. */
#define AUDIT_STATION "station.make"
#define AUDIT_SUBJECT "subject.add"
#define AUDIT_SITE "site.add"
#define AUDIT_INSTRUMENT "instrument.add"
#define AUDIT_CALIBRATION "calibration.add"
#define AUDIT_CHECK_TILE "check_tile.add"
#define AUDIT_CHECK "check.add"
#define AUDIT_MEASUREMENT "measurement.add"

enum { AUDIT_KINDS = 8, AUDIT_ROWS_EACH = 2 };

/* Statements of one connection, and the end of the chain while nobody else can write. */
struct audit {
    sqlite3_stmt *last, *insert, *row[AUDIT_KINDS][AUDIT_ROWS_EACH];
    bool tail_known;
    int64_t id;
    uint8_t hash[AUDIT_HASH_SIZE];
};

enum status audit_prepare(sqlite3 *db, struct audit *ret); /* logs nothing; done() on failure too */
void audit_done(struct audit *audit);

/* Append one row in the transaction that is open, after the rows it is about.
 * entity: their id.  who and entity may be "".  STATUS_NOT_FOUND where there is no
 * such row, and what SQLite says.  The end of the chain is read once and kept:
 * audit_forget_tail() at the begin of each transaction and whenever something was rolled
 * back. */
enum status audit_append(struct audit *audit, const char *at, const char *who, const char *action,
                         const char *entity);

void audit_forget_tail(struct audit *audit);

/* The same where the digests of the rows are in hand (db/audit_dump.h), in the order
 * above. */
struct audit_digests {
    uint8_t bytes[AUDIT_ROWS_EACH * AUDIT_HASH_SIZE];
    size_t n;
};
enum status audit_append_known(struct audit *audit, const char *at, const char *who,
                               const char *action, const char *entity,
                               const struct audit_digests *digests);

/* Check the chain from the first row to the last against the rows it is about, and
 * that there is none besides.  STATUS_DAMAGED, with what[] naming the first thing that
 * is wrong, else what SQLite says; logs nothing. */
struct audit_report {
    int64_t rows;
    char last_hash[2 * AUDIT_HASH_SIZE + 1]; /* hexadecimal; "" without rows */
    char what[256];
};
enum status audit_verify(sqlite3 *db, struct audit_report *ret);

#endif
