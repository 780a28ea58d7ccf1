/* match_scene.c - a scene's way from its file to answers. */
#include "cli/match_scene.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "cli/find_table.h"
#include "cli/options.h"
#include "db/costs_file.h"
#include "db/table_file.h"
#include "station/strict_json.h"
#include "station/wire.h"

struct match_scene {
    const char *file, *costs; /* NULL: none are looked for */
    char own_costs[COSTS_PATH_SIZE];
    struct plan plan;
    struct plan_table at_hand;
    struct table_file_info info;
    char path[FIND_TABLE_PATH_SIZE], name[TABLE_NAME_SIZE];
    bool has_table, has_matcher;
    struct table table;
    struct table_file_bytes bytes;
    struct matcher matcher;
    struct plan_runner *runner;
};

/* ---- the file ----------------------------------------------------------------------- */

enum { FILE_MAX_BYTES = 65536 };

static enum status read_text(const char *path, char text[FILE_MAX_BYTES + 1], size_t *n)
{
    FILE *f = fopen(path, "rb");
    if (f == NULL) {
        log_error("cannot read the scene %s: %s", path, strerror(errno));
        return STATUS_IO;
    }
    *n = fread(text, 1, FILE_MAX_BYTES + 1, f);
    bool failed = ferror(f) != 0;
    fclose(f);
    if (failed || *n > FILE_MAX_BYTES) {
        log_error("%s: %s", path, failed ? "it cannot be read" : "too long for a scene; 64 KiB do");
        return STATUS_IO;
    }
    return STATUS_OK;
}

/* Where a byte stands, for people: from 1. */
static size_t line_of(const char *text, size_t offset)
{
    size_t line = 1;
    for (size_t i = 0; i < offset; i++)
        line += text[i] == '\n' ? 1u : 0u;
    return line;
}

static const char *fault_text(enum strict_json_fault fault)
{
    switch (fault) {
    case STRICT_JSON_UTF8:
        return "text that is not UTF-8; save the file as UTF-8";
    case STRICT_JSON_NUL:
        return "a NUL in the text; take it out";
    case STRICT_JSON_DUPLICATE:
        return "a name that stands twice in one object; say it once";
    case STRICT_JSON_DEPTH:
    case STRICT_JSON_MEMBERS:
        return "more within each other, or in one object, than a scene has; an object such as "
               "{\"want\": [\"lab\"]} will do";
    case STRICT_JSON_NUMBER:
        return "a number beyond what a double holds, or of more than 63 bytes; write it shorter";
    default:
        return "this is not JSON; a scene is an object such as {\"want\": [\"lab\"]}";
    }
}

static int read_scene(const char *path, struct scene *ret)
{
    static char text[FILE_MAX_BYTES + 1];
    char why[SCENE_WHY_SIZE] = "";
    enum strict_json_fault fault;
    cJSON *object = NULL;
    size_t n, offset = 0;
    if (read_text(path, text, &n) != STATUS_OK)
        return EXIT_FAILURE;
    enum status s = strict_json_parse(text, n, &object, &fault, &offset);
    if (s != STATUS_OK) {
        log_error("%s:%zu: %s", path, line_of(text, offset),
                  s == STATUS_NO_MEMORY ? status_text(s) : fault_text(fault));
        return s == STATUS_NO_MEMORY ? EXIT_FAILURE : EXIT_USAGE;
    }
    s = wire_read_scene(object, ret, why);
    cJSON_Delete(object);
    if (s != STATUS_OK)
        log_error("%s: %s", path, why);
    return s == STATUS_OK ? EXIT_SUCCESS : EXIT_USAGE;
}

/* ---- the plan ----------------------------------------------------------------------- */

/* Where no skin is wanted no table is looked for. */
static int find(struct match_scene *m, const struct scene *scene, const char *table,
                const char *tables_folder)
{
    const char *usual = scene->model != NULL ? scene->model->name : FIND_TABLE_DEFAULT;
    if (table != NULL) {
        if (find_table(table, tables_folder, m->path) != STATUS_OK)
            return EXIT_FAILURE;
    } else if (!scene_wants_skin(scene) || !find_table_if_there(usual, tables_folder, m->path)) {
        return EXIT_SUCCESS;
    }
    if (table_file_info(m->path, &m->info) != STATUS_OK)
        return EXIT_FAILURE;
    table_file_name(m->path, m->name);
    m->at_hand = (struct plan_table){ m->name, &m->info.recipe, m->info.rows };
    m->has_table = true;
    return EXIT_SUCCESS;
}

/* One that is named must be there; this machine's may be missing, but not be wrong. */
static enum status find_costs(struct match_scene *m, const char *named, const struct costs **ret)
{
    static struct costs costs;
    *ret = costs_builtin();
    if (named == NULL && costs_file_path(m->own_costs) != STATUS_OK)
        return STATUS_OK;
    m->costs = named != NULL ? named : m->own_costs;
    enum status s = costs_file_read(m->costs, &costs);
    if (s == STATUS_OK)
        *ret = &costs;
    if (s != STATUS_NOT_FOUND || named == NULL)
        return s == STATUS_NOT_FOUND ? STATUS_OK : s;
    log_error("there are no costs %s; `skinspec bench --calibrate --costs %s` makes them", named,
              named);
    return s;
}

int match_scene_open(const char *file, const char *table, const char *tables_folder,
                     const char *costs, const struct spectrum *bands, struct match_scene **ret)
{
    const struct costs *known;
    char why[SCENE_WHY_SIZE] = "";
    struct scene scene;
    int exit_status = read_scene(file, &scene);
    if (exit_status != EXIT_SUCCESS)
        return exit_status;
    struct match_scene *m = calloc(1, sizeof *m);
    if (m == NULL) {
        log_error("%s", status_text(STATUS_NO_MEMORY));
        return EXIT_FAILURE;
    }
    m->file = file;
    exit_status = find(m, &scene, table, tables_folder);
    if (exit_status == EXIT_SUCCESS && find_costs(m, costs, &known) != STATUS_OK)
        exit_status = EXIT_FAILURE;
    if (exit_status != EXIT_SUCCESS) {
        match_scene_close(m);
        return exit_status;
    }
    struct plan_at_hand hand = { known,           &m->at_hand,    m->has_table ? 1 : 0,
                                 bands->first_nm, bands->step_nm, bands->n };
    if (plan_make(&scene, &hand, &m->plan, why) != STATUS_OK) {
        log_error("%s: %s", file, why);
        exit_status = EXIT_USAGE;
    }
    if (exit_status == EXIT_SUCCESS)
        *ret = m;
    else
        match_scene_close(m);
    return exit_status;
}

int match_scene_prepare(struct match_scene *m)
{
    const struct plan *plan = &m->plan;
    bool searches = plan_runs(plan, PLAN_SEARCH);
    const char *why = NULL;
    enum status s = STATUS_OK;
    if (searches) {
        enum table_file_parts parts =
            plan_runs(plan, PLAN_SPECTRA) ? TABLE_FILE_WHOLE : TABLE_FILE_WITHOUT_SPECTRA;
        if (table_file_read_parts(m->path, parts, &m->table, &m->bytes) != STATUS_OK)
            return EXIT_FAILURE;
        s = matcher_open(&m->table, plan->scene.by, &m->matcher);
        m->has_matcher = s == STATUS_OK;
    }
    if (s == STATUS_OK)
        s = plan_open(plan, searches ? &m->matcher : NULL, &m->runner, &why);
    if (s != STATUS_OK)
        log_error("%s: %s", m->file, why != NULL ? why : status_text(s));
    return s == STATUS_OK ? EXIT_SUCCESS : EXIT_FAILURE;
}

void match_scene_close(struct match_scene *m)
{
    if (m == NULL)
        return;
    plan_close(m->runner);
    if (m->has_matcher)
        matcher_close(&m->matcher);
    table_done(&m->table);
    free(m);
}

void match_scene_inputs(const struct match_scene *m, struct inputs *inputs)
{
    inputs_add_path(inputs, "the scene", m->file);
    inputs_add_path(inputs, "the table", m->has_table ? m->path : NULL);
    inputs_add_path(inputs, "the file of costs", m->costs);
}

/* ---- answers ------------------------------------------------------------------------ */

bool match_scene_suits(const struct match_scene *m, const struct spectrum *spectrum,
                       struct spectrum *planned)
{
    const struct plan *p = &m->plan;
    planned->first_nm = p->given_first_nm;
    planned->step_nm = p->given_step_nm;
    planned->n = p->given_bands;
    return spectrum->first_nm == planned->first_nm && spectrum->step_nm == planned->step_nm &&
           spectrum->n == planned->n;
}

enum status match_scene_run(const struct match_scene *m, const struct spectrum *spectrum,
                            struct match_scene_answer *ret, const char **why)
{
    ret->work = (struct plan_work){ 0 };
    if (spectrum->specular != SPECULAR_SCE)
        return STATUS_UNSUPPORTED;
    return plan_run(m->runner, spectrum, 1, spectrum, ret->hits, &ret->answer, &ret->work, why);
}

/* Its numbers are finite: only memory can be wanting. */
static cJSON *made(enum status s, cJSON *object)
{
    if (s != STATUS_OK)
        out_of_memory();
    return object;
}

void match_scene_json(const struct match_scene *m, const struct match_scene_answer *a,
                      cJSON *object)
{
    const struct table *table = m->has_matcher ? &m->table : NULL;
    cJSON *answer = NULL, *plan = NULL;
    size_t k = (m->plan.scene.wanted & SCENE_NEAREST) != 0 ? m->plan.scene.k : 0;
    enum status s = wire_plan_answer(&m->plan, table, &a->answer, a->hits, k, &answer);
    answer = made(s, answer);
    while (answer->child != NULL) {
        cJSON *member = cJSON_DetachItemViaPointer(answer, answer->child);
        cJSON_AddItemToObject(object, member->string, member);
    }
    cJSON_Delete(answer);
    s = wire_plan(&m->plan, &a->work, NAN, &plan); /* no time: see match_scene_json() */
    cJSON_AddItemToObject(object, "plan", made(s, plan));
}

static void show_plan(const struct plan *plan)
{
    const struct plan_estimate *e = &plan->estimated;
    const double number[] = {
        e->us,  e->coefficient[0], e->coefficient[1], e->coefficient[2], e->dE00,
        e->rms, e->white,          e->placement
    };
    static const char *const name[] = { "us",   "Cm",  "Bm",          "Ch",
                                        "dE00", "rms", "under noise", "placement" };
    printf("runs");
    for (int part = 0; part < PLAN_PARTS_RUN; part++)
        if (plan_runs(plan, (enum plan_part)part))
            printf("  %s", plan_part_name((enum plan_part)part));
    printf("\n");
    for (size_t i = 0; i < plan->omissions; i++) {
        char words[PLAN_WORDS_SIZE];
        plan_omission_words(plan, i, words);
        printf("leaves out  %-18s %s\n", plan_part_name(plan->omission[i].part), words);
    }
    printf("expects");
    for (size_t i = 0; i < sizeof number / sizeof *number; i++)
        if (!isnan(number[i]))
            printf("  %s %.3g", name[i], number[i]);
    printf("\n");
}

void match_scene_show(const struct match_scene *m, enum out_format format)
{
    cJSON *plan = NULL;
    if (format == OUT_PLAIN) {
        show_plan(&m->plan);
        return;
    }
    enum status s = wire_plan(&m->plan, NULL, NAN, &plan);
    out_one(made(s, plan));
}
