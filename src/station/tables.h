/* tables.h - the tables there are to match with, each loaded when it is first asked for.
 *
 * Names come from the files table-NAME.db in the folders, the first folder that has a name
 * wins; a client gives a name and never a path: letters, digits, - and _, 63 at most, no - at the
 * front; other files are passed over.  Reading and hashing happen on a thread; all functions
 * here are for the loop's thread.  A table that was loaded stays as long as the station runs. */
#ifndef SKINSPEC_STATION_TABLES_H
#define SKINSPEC_STATION_TABLES_H

#include <stdbool.h>
#include <stddef.h>

#include "db/table_file.h"
#include "station/job.h"
#include "station/loaded_table.h"

enum tables_state {
    TABLES_READY,     /* in memory */
    TABLES_LOADING,   /* on the way, or new and being looked at */
    TABLES_AVAILABLE, /* on disk */
    TABLES_FAILED,    /* refused: the error says why and what to do */
    TABLES_UNKNOWN,   /* there is no such file; for the default one: missing */
};

enum { TABLES_MAX_FOLDERS = 8, TABLES_ERROR_SIZE = 512 };
#define TABLES_DEFAULT "two-layer"

struct tables_settings {
    /* NULL ends; those that are not there are passed over. */
    const char *folder[TABLES_MAX_FOLDERS];
    const char *default_name; /* TABLES_DEFAULT */
    struct job_queue *queue;  /* of the thread that loads */
    /* A load has ended, well or not: on the loop's thread. */
    void (*changed)(void *context, const char *name);
    void *context;
};

struct tables;

/* The settings are copied, the folders are read, each table is looked at (on the thread), the
 * default one loaded.  STATUS_NO_MEMORY. */
enum status tables_open(const struct tables_settings *settings, struct tables **ret);

/* Takes NULL.  The thread has ended before, and the inbox is not drained afterwards. */
void tables_close(struct tables *tables);

/* name NULL: the default one.  TABLES_READY sets *ret.  TABLES_LOADING: not yet, and a load was
 * begun where none was; changed() tells the end.  A file that is new since the start is
 * found.  One that FAILED is tried again when its file has changed, or after a second where
 * memory or the system failed and not the file. */
enum tables_state tables_get(struct tables *tables, const char *name, struct loaded_table **ret);

/* The state without asking for a load; a default table that has appeared or changed is
 * loaded all the same. */
enum tables_state tables_look(struct tables *tables, const char *name);

/* By the hash of its content, among those in memory; NULL. */
struct loaded_table *tables_by_hash(struct tables *tables, const char *sha256);

/* Why a table FAILED, or, for the default one that is UNKNOWN, which command makes it; "".
 * As it was last seen; name NULL: the default one. */
const char *tables_error(struct tables *tables, const char *name);

/* All there are, by name, folders read anew. */
struct tables_entry {
    char name[TABLE_NAME_SIZE];
    enum tables_state state;
    bool is_default;
    bool info_known; /* where it is READY or AVAILABLE */
    struct table_file_info info;
    const char *error;
};
typedef void tables_visit(void *context, const struct tables_entry *entry);
void tables_list(struct tables *tables, tables_visit *visit, void *context);

#endif
