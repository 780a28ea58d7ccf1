/* audit_dump.h - the canonical dump of a row (db/audit.h), hashed as it is made.
 *
 * From the row as SQLite gives it, or, while it is being written, from the values in hand:
 * both give the same digest. */
#ifndef SKINSPEC_DB_AUDIT_DUMP_H
#define SKINSPEC_DB_AUDIT_DUMP_H

#include <stddef.h>
#include <stdint.h>

#include <nettle/sha2.h>
#include <sqlite3.h>

enum { AUDIT_HASH_SIZE = 32 };

struct audit_dump {
    struct sha256_ctx sha256;
};

/* before: the hash that the row's is chained to; NULL for a digest. */
void audit_dump_begin(struct audit_dump *dump, const uint8_t before[AUDIT_HASH_SIZE],
                      const char *table);
void audit_dump_end(struct audit_dump *dump, uint8_t ret[AUDIT_HASH_SIZE]);

/* One column that is not NULL.  A float must be as SQLite gives it back: not NAN, not -0. */
void audit_dump_integer(struct audit_dump *dump, const char *name, int64_t x);
void audit_dump_float(struct audit_dump *dump, const char *name, double x);
void audit_dump_text(struct audit_dump *dump, const char *name, const char *text, size_t n);
void audit_dump_blob(struct audit_dump *dump, const char *name, const void *bytes, size_t n);

/* The first `columns` of the row that the statement stands on.  A value that could not
 * be had for want of memory is taken as empty: sqlite3_errcode() tells. */
void audit_dump_row(struct audit_dump *dump, sqlite3_stmt *row, int columns);

#endif
