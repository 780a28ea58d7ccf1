/* answer_scene.h - what a scene wants of a record's spectrum: planned, run, told and kept. */
#ifndef SKINSPEC_STATION_ANSWER_SCENE_H
#define SKINSPEC_STATION_ANSWER_SCENE_H

#include <cjson/cJSON.h>

#include "db/store.h"
#include "plan/costs.h"
#include "plan/scene.h"
#include "station/tables.h"

/* What plans are made by from here on: to be called, if at all, before any thread asks for an
 * answer; without it those compiled in.  *costs stays the caller's. */
void answer_scene_costs(const struct costs *costs);

/* The match object of the record's SCE spectrum and replicates, with `plan`, into *ret.  table:
 * the one at hand, may be NULL.  With `keep`, also into the record, for which a plan is made that
 * searches a table: table_name, table_sha256, method, match_json, and refined_json where the skin
 * was refined; without the rows of `nearest` and without the time it took, so that the same
 * measurement is the same record.  Statuses of plan_make(), plan_open() and plan_run();
 * STATUS_RANGE where a record cannot keep it; why[] then says what is wrong and what to do, or is
 * "". */
enum status answer_scene(struct loaded_table *table, const struct scene *scene, bool keep,
                         struct store_record *record, cJSON **ret, char why[SCENE_WHY_SIZE]);

/* Whether the record of a measurement can have what the scene wants of spectra on these bands:
 * statuses and why[] of answer_scene() with `keep`, as far as they do not depend on what is
 * measured; but of colours alone (table NULL) those that every record has are enough, and others
 * are STATUS_RANGE. */
enum status answer_scene_check(struct loaded_table *table, const struct scene *scene,
                               double first_nm, double step_nm, size_t bands,
                               char why[SCENE_WHY_SIZE]);

/* Whether a stored match was made by a scene; then that, with all that was chosen. */
bool answer_has_scene(const cJSON *match);
enum status answer_scene_of(const cJSON *match, struct scene *ret);

#endif
