/* table_file.h - a table file read into memory.
 *
 * Before SQLite sees the file its header, version and pages hash are checked, so
 * a foreign, truncated or altered file is refused by name.  Every refusal is
 * logged once, with what to do about it. */
#ifndef SKINSPEC_DB_TABLE_FILE_H
#define SKINSPEC_DB_TABLE_FILE_H

#include <stdbool.h>

#include "base/status.h"
#include "match/table.h"

/* STATUS_NOT_FOUND, STATUS_IO, STATUS_FORMAT (not a table), STATUS_VERSION,
 * STATUS_DAMAGED, STATUS_NO_MEMORY.  table_done() gives the memory back.  The
 * name is the file's without folder, "table-" and ".db". */
enum status table_file_read(const char *path, struct table *ret);

/* What of a table is loaded.  Without spectra it takes a third of the memory, and is searched by
 * colour only; its recipe keeps the bands they were of. */
enum table_file_parts { TABLE_FILE_WHOLE, TABLE_FILE_WITHOUT_SPECTRA };

/* The same, of what is wanted.  *bytes_ret, where it is not NULL: what was read of the file and
 * what the table takes in memory.  The file is read whole in either case: its hash is checked. */
struct table_file_bytes {
    size_t file, memory;
};
enum status table_file_read_parts(const char *path, enum table_file_parts parts, struct table *ret,
                                  struct table_file_bytes *bytes_ret);

struct table_file_info {
    struct recipe recipe;
    size_t rows;
    long long bytes;
    bool rtree;
    char code_version[32];
    char content_sha256[TABLE_SHA256_SIZE], pages_sha256[TABLE_SHA256_SIZE];
};

/* The same checks, but of the rows only what SQLite knows about them. */
enum status table_file_info(const char *path, struct table_file_info *ret);

/* Whether the file's header says that it is a table, of whatever format and state. */
bool table_file_is_table(const char *path);

/* The name answers give a table of that path. */
void table_file_name(const char *path, char name[TABLE_NAME_SIZE]);

#endif
