/* station_table.h - the table a request names, and what is told of the default one. */
#ifndef SKINSPEC_STATION_STATION_TABLE_H
#define SKINSPEC_STATION_STATION_TABLE_H

#include "match/refined_match.h"
#include "station/protocol.h"
#include "station/tables.h"

struct station;

/* The table a request names (NULL: the default one).  STATUS_OK; STATUS_CANCELLED: it is being
 * loaded, come again when station_table_changed() says so; STATUS_NOT_FOUND with
 * *refusal. */
enum status station_table(struct station *station, const char *name, struct loaded_table **ret,
                          struct refusal *refusal);

/* Whether a fit that is wished for can be had of the table (REFINE_NOT: it need not); false with
 * *refusal: table_unsuitable, or params_invalid for what is to be fixed. */
bool station_table_refines(const struct loaded_table *table, const struct refine_wish *wish,
                           struct refusal *refusal);

/* "table": how the default one stands, and what is wrong with it under error_name. */
void station_table_add(struct station *station, cJSON *object, const char *error_name);

void station_table_changed(void *station, const char *name);

#endif
