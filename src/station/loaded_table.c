/* loaded_table.c - rows, and a matcher for each way of comparing that was asked for. */
#include "station/loaded_table.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>

#include "base/log.h"
#include "db/table_file.h"

enum { WAYS = MATCH_SPECTRUM + 1 };

struct loaded_table {
    struct table table;
    pthread_mutex_t lock; /* held while a matcher is made */
    struct matcher matcher[WAYS];
    atomic_bool made[WAYS]; /* matcher[] is there and only read from now on */
};

enum status loaded_table_open(const char *path, struct loaded_table **ret)
{
    struct loaded_table *t = calloc(1, sizeof *t);
    if (t == NULL) {
        log_error("table '%s': %s", path, status_text(STATUS_NO_MEMORY));
        return STATUS_NO_MEMORY;
    }
    enum status s = table_file_read(path, &t->table);
    if (s != STATUS_OK) {
        free(t);
        return s;
    }
    pthread_mutex_init(&t->lock, NULL);
    for (size_t by = 0; by < WAYS; by++)
        atomic_init(&t->made[by], false);
    *ret = t;
    return STATUS_OK;
}

void loaded_table_close(struct loaded_table *t)
{
    if (t == NULL)
        return;
    for (size_t by = 0; by < WAYS; by++)
        if (atomic_load(&t->made[by]))
            matcher_close(&t->matcher[by]);
    pthread_mutex_destroy(&t->lock);
    table_done(&t->table);
    free(t);
}

const struct table *loaded_table(const struct loaded_table *t)
{
    return &t->table;
}

bool loaded_matcher_is_made(struct loaded_table *t, enum match_by by)
{
    return atomic_load_explicit(&t->made[by], memory_order_acquire);
}

enum status loaded_matcher(struct loaded_table *t, enum match_by by, const struct matcher **ret)
{
    enum status s = STATUS_OK;
    if (!loaded_matcher_is_made(t, by)) {
        pthread_mutex_lock(&t->lock);
        if (!loaded_matcher_is_made(t, by)) /* not by another thread meanwhile */
            s = matcher_open(&t->table, by, &t->matcher[by]);
        if (s == STATUS_OK)
            atomic_store_explicit(&t->made[by], true, memory_order_release);
        pthread_mutex_unlock(&t->lock);
    }
    if (s == STATUS_OK)
        *ret = &t->matcher[by];
    return s;
}
