/* tables.c - a list of names, each with its file, a job that reads it, and what came out. */
#include "station/tables.h"

#include <dirent.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/clock.h"
#include "base/log.h"
#include "base/utf8.h"

enum {
    PATH_SIZE = 4096,
    NAME_MAX_LENGTH = 63, /* what the protocol takes as a name */
    RETRY_MS = 1000,      /* after a failure that the file is not to blame for */
};

/* ---- one that is known -------------------------------------------------------------- */

/* Whether a file is the one that was looked at. */
struct stamp {
    dev_t device;
    ino_t inode;
    off_t size;
    struct timespec modified, changed;
};

struct entry {
    struct job job;
    struct tables *tables;
    struct entry *next;
    char name[NAME_MAX_LENGTH + 1];
    size_t folder;
    struct stamp stamp;
    bool there;     /* folder and stamp are of a file that exists */
    bool looked_at; /* it was read, or is being read */
    bool busy;      /* the job is on its way: job_* are the thread's, folder stays */
    bool wanted;    /* somebody waits for it to be loaded */
    enum status status;
    int64_t failed_at_ms;
    char error[TABLES_ERROR_SIZE];
    struct table_file_info info;
    struct loaded_table *loaded;
    /* what the job is to do, and what came out */
    bool job_load;
    enum status job_status;
    struct table_file_info job_info;
    struct loaded_table *job_loaded;
};

struct tables {
    struct tables_settings settings;
    char *folder[TABLES_MAX_FOLDERS];
    size_t folders;
    char *default_name;
    char missing[TABLES_ERROR_SIZE]; /* said of the default table where it is not there */
    struct entry *first;             /* by name; a name once known stays in the list */
};

static enum tables_state state_of(const struct entry *e)
{
    if (e->loaded != NULL)
        return TABLES_READY;
    if (e->busy)
        return TABLES_LOADING;
    if (!e->there)
        return TABLES_UNKNOWN;
    return e->status == STATUS_OK ? TABLES_AVAILABLE : TABLES_FAILED;
}

/* ---- its file ----------------------------------------------------------------------- */

/* A name never holds what could lead out of the folder. */
static bool name_is_valid(const char *name)
{
    static const char allowed[] =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
    size_t n = strlen(name);
    return n >= 1 && n <= NAME_MAX_LENGTH && strspn(name, allowed) == n && name[0] != '-';
}

static bool path_of(const struct tables *tables, size_t folder, const char *name,
                    char path[PATH_SIZE])
{
    return snprintf(path, PATH_SIZE, "%s/table-%s.db", tables->folder[folder], name) < PATH_SIZE;
}

static bool find_file(const struct tables *tables, const char *name, size_t *folder,
                      struct stamp *ret)
{
    char path[PATH_SIZE];
    struct stat st;
    for (size_t i = 0; i < tables->folders; i++) {
        if (!path_of(tables, i, name, path) || stat(path, &st) != 0)
            continue;
        *folder = i;
        *ret = (struct stamp){ st.st_dev, st.st_ino, st.st_size, st.st_mtim, st.st_ctim };
        return true;
    }
    return false;
}

static bool same_time(struct timespec a, struct timespec b)
{
    return a.tv_sec == b.tv_sec && a.tv_nsec == b.tv_nsec;
}

static bool same_stamp(const struct stamp *a, const struct stamp *b)
{
    return a->device == b->device && a->inode == b->inode && a->size == b->size &&
           same_time(a->modified, b->modified) && same_time(a->changed, b->changed);
}

/* ---- messages ----------------------------------------------------------------------- */

/* What `skinspec table build` calls the model; the default table has its model's name. */
static const char *model_of(const char *name)
{
    return strcmp(name, TABLES_DEFAULT) == 0 ? name : "MODEL";
}

static void say_refused(struct entry *e)
{
    const char *folder = e->tables->folder[e->folder];
    snprintf(e->error, sizeof e->error,
             "table '%s' is refused: %s; look closer with 'skinspec table verify %s/table-%s.db', "
             "or make it anew with 'skinspec table build --model %s --out %s/table-%s.db --force'",
             e->name, status_text(e->status), folder, e->name, model_of(e->name), folder, e->name);
    utf8_make_plain(e->error); /* a path need not be UTF-8, and a long one is cut */
}

static void say_missing(struct tables *tables)
{
    const char *name = tables->default_name;
    const char *folder = tables->folders > 0 ? tables->folder[0] : "DIR";
    snprintf(tables->missing, sizeof tables->missing,
             "there is no table '%s'; make it with 'mkdir -p %s && skinspec table build --model "
             "%s --out %s/table-%s.db'",
             name, folder, model_of(name), folder, name);
    utf8_make_plain(tables->missing);
}

/* ---- reading it --------------------------------------------------------------------- */

/* On the thread. */
static void run(struct job *job, void *thread)
{
    struct entry *e = (struct entry *)job;
    char path[PATH_SIZE];
    (void)thread;
    (void)path_of(e->tables, e->folder, e->name, path);
    e->job_status = table_file_info(path, &e->job_info);
    if (e->job_status != STATUS_OK || !e->job_load)
        return;
    e->job_status = loaded_table_open(path, &e->job_loaded);
    if (e->job_status != STATUS_OK)
        return;
    /* Made here, the loop never has to wait for it; without memory it is tried again then. */
    const struct matcher *matcher;
    (void)loaded_matcher(e->job_loaded, matcher_default_by(loaded_table(e->job_loaded)), &matcher);
    /* Should the file have been replaced in between, what is in memory counts. */
    const struct table *table = loaded_table(e->job_loaded);
    e->job_info.recipe = table->recipe;
    e->job_info.rows = table->n;
    memcpy(e->job_info.content_sha256, table->sha256, sizeof table->sha256);
}

static void cancel(struct job *job)
{
    ((struct entry *)job)->job_status = STATUS_CANCELLED;
}

static void done(struct job *job);

static void start(struct entry *e, bool load)
{
    e->job.run = run;
    e->job.cancel = cancel;
    e->job.done = done;
    e->job_load = load;
    e->job_loaded = NULL;
    e->wanted = load;
    e->looked_at = true;
    e->busy = true;
    job_queue_put(e->tables->settings.queue, &e->job);
}

/* On the loop's thread. */
static void done(struct job *job)
{
    struct entry *e = (struct entry *)job;
    const struct tables_settings *settings = &e->tables->settings;
    e->busy = false;
    e->status = e->job_status;
    if (e->status == STATUS_OK) {
        e->info = e->job_info;
        e->loaded = e->job_loaded;
    } else {
        e->failed_at_ms = clock_monotonic_ms();
        say_refused(e);
    }
    if (!e->wanted)
        return;
    if (e->status == STATUS_OK && e->loaded == NULL) { /* wanted while it was only looked at */
        start(e, true);
        return;
    }
    e->wanted = false;
    if (e->loaded != NULL)
        log_info("table '%s': %zu rows loaded from %s", e->name, e->info.rows,
                 e->tables->folder[e->folder]);
    settings->changed(settings->context, e->name);
}

/* Whether it failed for a reason that may have passed while the file is the same. */
static bool retry_is_due(const struct entry *e)
{
    return (e->status == STATUS_IO || e->status == STATUS_NO_MEMORY || e->status == STATUS_DB) &&
           clock_monotonic_ms() - e->failed_at_ms >= RETRY_MS;
}

/* See how its file is, and have it read where it is new, or wanted and not loaded. */
static void refresh(struct entry *e, bool want)
{
    size_t folder = 0;
    struct stamp stamp;
    if (e->loaded != NULL)
        return;
    if (e->busy) {
        e->wanted = e->wanted || want;
        return;
    }
    e->there = find_file(e->tables, e->name, &folder, &stamp);
    if (!e->there) {
        e->looked_at = false;
        return;
    }
    bool is_new = !e->looked_at || folder != e->folder || !same_stamp(&stamp, &e->stamp);
    e->folder = folder;
    e->stamp = stamp;
    want = want || strcmp(e->name, e->tables->default_name) == 0;
    if (is_new || retry_is_due(e) || (want && e->status == STATUS_OK))
        start(e, want);
}

/* ---- the list of them --------------------------------------------------------------- */

/* Where a name stands in the list, or would. */
static struct entry **place_of(struct tables *tables, const char *name)
{
    struct entry **at = &tables->first;
    while (*at != NULL && strcmp((*at)->name, name) < 0)
        at = &(*at)->next;
    return at;
}

/* The entry of a name; NULL for one that never was a file's. */
static struct entry *find(struct tables *tables, const char *name)
{
    struct entry *e = *place_of(tables, name);
    return e != NULL && strcmp(e->name, name) == 0 ? e : NULL;
}

static struct entry *find_or_add(struct tables *tables, const char *name)
{
    struct entry *e = find(tables, name), **at = place_of(tables, name);
    struct stamp stamp;
    size_t folder;
    if (e != NULL || !name_is_valid(name) || !find_file(tables, name, &folder, &stamp))
        return e;
    e = calloc(1, sizeof *e);
    if (e == NULL) {
        log_error("table '%s': %s", name, status_text(STATUS_NO_MEMORY));
        return NULL;
    }
    snprintf(e->name, sizeof e->name, "%s", name);
    e->tables = tables;
    e->next = *at;
    *at = e;
    return e;
}

static void read_folder(struct tables *tables, const char *folder)
{
    char name[TABLE_NAME_SIZE], file[TABLE_NAME_SIZE + 16];
    DIR *d = opendir(folder);
    if (d == NULL)
        return;
    for (struct dirent *in; (in = readdir(d)) != NULL;) {
        table_file_name(in->d_name, name);
        snprintf(file, sizeof file, "table-%s.db", name);
        if (strcmp(file, in->d_name) == 0)
            (void)find_or_add(tables, name);
    }
    closedir(d);
}

static void read_folders(struct tables *tables)
{
    for (size_t i = 0; i < tables->folders; i++)
        read_folder(tables, tables->folder[i]);
    for (struct entry *e = tables->first; e != NULL; e = e->next)
        refresh(e, false);
}

enum status tables_open(const struct tables_settings *settings, struct tables **ret)
{
    struct tables *tables = calloc(1, sizeof *tables);
    if (tables == NULL)
        return STATUS_NO_MEMORY;
    tables->settings = *settings;
    tables->default_name = strdup(settings->default_name);
    if (tables->default_name == NULL)
        goto fail;
    for (size_t i = 0; i < TABLES_MAX_FOLDERS && settings->folder[i] != NULL; i++) {
        tables->folder[i] = strdup(settings->folder[i]);
        if (tables->folder[i] == NULL)
            goto fail;
        tables->folders++;
    }
    say_missing(tables);
    read_folders(tables);
    *ret = tables;
    return STATUS_OK;
fail:
    tables_close(tables);
    return STATUS_NO_MEMORY;
}

void tables_close(struct tables *tables)
{
    if (tables == NULL)
        return;
    for (struct entry *e = tables->first, *next; e != NULL; e = next) {
        next = e->next;
        loaded_table_close(e->busy ? e->job_loaded : e->loaded);
        free(e);
    }
    for (size_t i = 0; i < tables->folders; i++)
        free(tables->folder[i]);
    free(tables->default_name);
    free(tables);
}

/* ---- asking ------------------------------------------------------------------------- */

static struct entry *look_up(struct tables *tables, const char *name, bool want)
{
    struct entry *e = find_or_add(tables, name != NULL ? name : tables->default_name);
    if (e != NULL)
        refresh(e, want);
    return e;
}

enum tables_state tables_get(struct tables *tables, const char *name, struct loaded_table **ret)
{
    const struct entry *e = look_up(tables, name, true);
    if (e == NULL)
        return TABLES_UNKNOWN;
    if (e->loaded != NULL)
        *ret = e->loaded;
    return state_of(e);
}

enum tables_state tables_look(struct tables *tables, const char *name)
{
    const struct entry *e = look_up(tables, name, false);
    return e != NULL ? state_of(e) : TABLES_UNKNOWN;
}

struct loaded_table *tables_by_hash(struct tables *tables, const char *sha256)
{
    for (const struct entry *e = tables->first; e != NULL; e = e->next)
        if (e->loaded != NULL && strcmp(loaded_table(e->loaded)->sha256, sha256) == 0)
            return e->loaded;
    return NULL;
}

const char *tables_error(struct tables *tables, const char *name)
{
    if (name == NULL)
        name = tables->default_name;
    const struct entry *e = find(tables, name);
    enum tables_state state = e != NULL ? state_of(e) : TABLES_UNKNOWN;
    if (state == TABLES_FAILED)
        return e->error;
    return state == TABLES_UNKNOWN && strcmp(name, tables->default_name) == 0 ? tables->missing
                                                                              : "";
}

void tables_list(struct tables *tables, tables_visit *visit, void *context)
{
    struct tables_entry entry;
    read_folders(tables);
    for (const struct entry *e = tables->first; e != NULL; e = e->next) {
        memset(&entry, 0, sizeof entry);
        entry.state = state_of(e);
        if (entry.state == TABLES_UNKNOWN)
            continue;
        snprintf(entry.name, sizeof entry.name, "%s", e->name);
        entry.is_default = strcmp(e->name, tables->default_name) == 0;
        entry.info_known = entry.state == TABLES_READY || entry.state == TABLES_AVAILABLE;
        if (entry.info_known)
            entry.info = e->info;
        entry.error = entry.state == TABLES_FAILED ? e->error : "";
        visit(context, &entry);
    }
}
