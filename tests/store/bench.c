/* bench.c - records a second of one thread, each group durable, beside a bare append and
 * fdatasync.  Small records are spectra that a client sent: 31 bands, a match and a uuid;
 * readings have three replicates, SCE and SCI, besides.
 *
 *     bench FOLDER [RECORDS]
 */
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

#include "db/store.h"
#include "tests/store/records.h"

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void report(const char *what, size_t records, double seconds, double *took, size_t groups)
{
    qsort(took, groups, sizeof *took, compare);
    printf("%-28s %8.0f /s   group p50 %7.0f us  p99 %7.0f us\n", what, (double)records / seconds,
           1e6 * took[groups / 2], 1e6 * took[groups * 99 / 100]);
}

static void bare(const char *folder, size_t n, double *took)
{
    char path[512], block[4096] = { 1 };
    snprintf(path, sizeof path, "%s/bare", folder);
    int fd = open(path, O_WRONLY | O_CREAT | O_TRUNC | O_APPEND, 0600);
    double start = now();
    for (size_t i = 0; i < n; i++) {
        double t = now();
        if (write(fd, block, sizeof block) != (ssize_t)sizeof block || fdatasync(fd) != 0)
            exit(1);
        took[i] = now() - t;
    }
    report("4 KiB append + fdatasync", n, now() - start, took, n);
    close(fd);
    unlink(path);
}

static void make_small(struct store_record *record)
{
    memset(&record->instrument, 0, sizeof record->instrument);
    record->replicates = 0;
    for (size_t i = 0; i < STORE_MAX_REPLICATES; i++)
        record->replicate[i].n = record->replicate_sci[i].n = 0;
    record->fence = 0;
    record->site[0] = '\0';
}

static void grouped(struct store *store, struct store_record *record, size_t n, size_t group,
                    double *took)
{
    static struct dice dice = { 5 };
    char what[64];
    size_t groups = 0;
    double start = now();
    for (size_t i = 0; i < n; i += group) {
        double t = now();
        bool known;
        enum status s = store_begin(store);
        for (size_t j = 0; j < group && s == STATUS_OK; j++) {
            records_uuid(&dice, record->uuid);
            s = store_add_record(store, record, &known);
        }
        if (s != STATUS_OK || store_commit(store) != STATUS_OK)
            exit(1);
        took[groups++] = now() - t;
    }
    snprintf(what, sizeof what, "%s, groups of %zu", record->replicates == 0 ? "small" : "readings",
             group);
    report(what, groups * group, now() - start, took, groups);
}

int main(int argc, char **argv)
{
    enum { GROUPS = 4 };
    static const size_t group[GROUPS] = { 1, 10, 32, 100 };
    struct dice dice = { 1 };
    struct store *store;
    struct store_record *record = records_make(&dice);
    size_t n = argc > 2 ? (size_t)atol(argv[2]) : 2000;
    double *took = calloc(n + 1, sizeof *took);
    if (argc < 2 || record == NULL || took == NULL ||
        store_open(argv[1], NULL, &store) != STATUS_OK)
        return 2;
    bare(argv[1], n / 4, took);
    for (size_t i = 0; i < GROUPS; i++)
        grouped(store, record, n, group[i], took);
    make_small(record);
    for (size_t i = 0; i < GROUPS; i++)
        grouped(store, record, n, group[i], took);
    store_close(store);
    free(record);
    free(took);
    return 0;
}
