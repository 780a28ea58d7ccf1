/* match_scene.h - `skinspec match --scene FILE`: a scene read from a file, planned for the tables
 * at hand, and run for spectra, on any thread. */
#ifndef SKINSPEC_CLI_MATCH_SCENE_H
#define SKINSPEC_CLI_MATCH_SCENE_H

#include <cjson/cJSON.h>

#include "base/spectrum.h"
#include "base/status.h"
#include "cli/inputs.h"
#include "cli/out.h"
#include "plan/plan_run.h"

struct match_scene;

/* The scene of a file for spectra on these bands, and its plan.  table: the one at hand (NULL: the
 * default table of the scene's model, if it is there).  costs: a file of them (NULL: this
 * machine's, if it is there, else those compiled in).  The exit status; what is wrong was
 * logged. */
int match_scene_open(const char *file, const char *table, const char *tables_folder,
                     const char *costs, const struct spectrum *bands, struct match_scene **ret);

/* What the plan needs is loaded and made. */
int match_scene_prepare(struct match_scene *scene);
void match_scene_close(struct match_scene *scene); /* takes NULL */

/* The files that it is made of: scene, costs, table. */
void match_scene_inputs(const struct match_scene *scene, struct inputs *inputs);

/* One spectrum's; a place for each that is on its way. */
struct match_scene_answer {
    struct plan_answer answer;
    struct plan_work work;
    struct nearest_hit hits[SCENE_MAX_K];
};

/* Whether a spectrum has the bands that it is planned for, which else are in *planned. */
bool match_scene_suits(const struct match_scene *scene, const struct spectrum *spectrum,
                       struct spectrum *planned);

/* Statuses and *why of plan_run(). */
enum status match_scene_run(const struct match_scene *scene, const struct spectrum *spectrum,
                            struct match_scene_answer *ret, const char **why);

/* The members of an answer, and its `plan`.  Nothing in it is of the clock: the same row comes out
 * the same to the byte in every run, which going on and sharing out rest on. */
void match_scene_json(const struct match_scene *scene, const struct match_scene_answer *answer,
                      cJSON *object);

/* The plan alone, for a person or as an object. */
void match_scene_show(const struct match_scene *scene, enum out_format format);

#endif
