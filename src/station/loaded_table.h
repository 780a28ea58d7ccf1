/* loaded_table.h - a table in memory and the matchers made from it: for any thread. */
#ifndef SKINSPEC_STATION_LOADED_TABLE_H
#define SKINSPEC_STATION_LOADED_TABLE_H

#include <stdbool.h>

#include "match/match.h"

struct loaded_table;

/* Statuses of table_file_read(), logged. */
enum status loaded_table_open(const char *path, struct loaded_table **ret);
void loaded_table_close(struct loaded_table *t); /* takes NULL */

const struct table *loaded_table(const struct loaded_table *t);

/* A matcher, made on first use and kept; may take a while then.  Statuses of
 * matcher_open(). */
enum status loaded_matcher(struct loaded_table *t, enum match_by by, const struct matcher **ret);

/* Never waits, even while another thread makes it. */
bool loaded_matcher_is_made(struct loaded_table *t, enum match_by by);

#endif
