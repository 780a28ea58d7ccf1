/* table_verify.c - stored rows against rows computed anew, chunk by chunk. */
#include "db/table_verify.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "db/table_file.h"
#include "db/table_hash.h"
#include "db/table_schema.h"
#include "match/table_maker.h"

enum { CHUNK_ROWS = 8192 };

/* Position of a float among all floats, so that neighbours differ by 1. */
static int64_t float_order(float x)
{
    int32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits >= 0 ? bits : (int64_t)INT32_MIN - bits;
}

struct comparison {
    struct table_verify_report report;
    double worst_share; /* of what is tolerated, so that numbers and spectra compare */
};

static void note(struct comparison *c, double *worst, double difference, double tolerated,
                 size_t id)
{
    if (isnan(difference))
        difference = INFINITY; /* a NaN in the file agrees with nothing */
    *worst = fmax(*worst, difference);
    if (difference / tolerated > c->worst_share) {
        c->worst_share = difference / tolerated;
        c->report.worst_id = id;
    }
}

static bool same_bits(const double *x, const double *y, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        uint64_t p, q;
        memcpy(&p, &x[i], sizeof p);
        memcpy(&q, &y[i], sizeof q);
        if (p != q)
            return false;
    }
    return true;
}

static void compare_row(const struct table *stored, size_t i, const struct table *made, size_t j,
                        struct comparison *comparison)
{
    struct table_verify_report *r = &comparison->report;
    struct table_row a, b;
    size_t id = i + 1;
    table_get(stored, i, &a);
    table_get(made, j, &b);
    const double x[9] = { a.Cm,     a.Bm,     a.Ch,     a.Lab[0], a.Lab[1],
                          a.Lab[2], a.rgb[0], a.rgb[1], a.rgb[2] };
    const double y[9] = { b.Cm,     b.Bm,     b.Ch,     b.Lab[0], b.Lab[1],
                          b.Lab[2], b.rgb[0], b.rgb[1], b.rgb[2] };
    bool identical = same_bits(x, y, 9);
    for (int c = 0; c < 9; c++)
        note(comparison, &r->worst, fabs(x[c] - y[c]), TABLE_VERIFY_TOLERANCE, id);
    const float *p = table_spectrum(stored, i), *q = table_spectrum(made, j);
    for (size_t band = 0; band < stored->recipe.bands; band++) {
        double ulps = (double)llabs(float_order(p[band]) - float_order(q[band]));
        note(comparison, &r->worst_spectrum, ulps, TABLE_VERIFY_SPECTRUM_ULPS, id);
        identical = identical && ulps == 0.0;
    }
    r->identical_rows += identical ? 1 : 0;
}

static enum status compare(const struct table *stored, unsigned threads,
                           const struct progress *progress, struct comparison *c)
{
    struct table made = { 0 };
    struct table_maker *maker = NULL;
    size_t capacity = stored->n < CHUNK_ROWS ? stored->n : CHUNK_ROWS;
    enum status s = table_init(&stored->recipe, capacity, &made);
    if (s == STATUS_OK)
        s = table_maker_open(&stored->recipe, threads, &maker);
    for (size_t first = 0; first < stored->n && s == STATUS_OK; first += capacity) {
        size_t count = stored->n - first < capacity ? stored->n - first : capacity;
        if (!progress_go_on(progress, first, stored->n)) {
            s = STATUS_CANCELLED;
            break;
        }
        s = table_maker_rows(maker, first, count, &made);
        for (size_t i = 0; i < count && s == STATUS_OK; i++)
            compare_row(stored, first + i, &made, i, c);
    }
    table_maker_close(maker);
    table_done(&made);
    if (s == STATUS_OK && !progress_go_on(progress, stored->n, stored->n))
        s = STATUS_CANCELLED;
    return s;
}

/* The hash covers the code version that wrote the table, so it is taken from the
 * file and not from this program. */
static bool content_hash_matches(const struct table *stored, const char *code_version)
{
    struct table_meta meta;
    struct table_content_hash hash;
    char hex[TABLE_SHA256_SIZE];
    table_meta_of(&stored->recipe, &meta);
    for (size_t i = 0; i < TABLE_META_COUNT; i++)
        if (strcmp(meta.key[i], "code_version") == 0)
            memcpy(meta.value[i], code_version, strlen(code_version) + 1);
    table_content_begin(&hash, &meta);
    table_content_rows(&hash, stored, 0, stored->n, 1);
    table_content_end(&hash, hex);
    return strcmp(hex, stored->sha256) == 0;
}

static enum status judge(const char *path, const struct table_verify_report *r)
{
    if (!r->content_hash_matches) {
        log_error("table '%s': its rows do not match its content hash; build it anew", path);
        return STATUS_DAMAGED;
    }
    if (!(r->worst <= TABLE_VERIFY_TOLERANCE && r->worst_spectrum <= TABLE_VERIFY_SPECTRUM_ULPS)) {
        log_error("table '%s': row %zu differs from what this program computes by %.3g "
                  "(spectra: %.0f units in the last place); build it anew",
                  path, r->worst_id, r->worst, r->worst_spectrum);
        return STATUS_DAMAGED;
    }
    return STATUS_OK;
}

enum status table_verify(const char *path, unsigned threads, const struct progress *progress,
                         struct table_verify_report *ret)
{
    struct table stored = { 0 };
    struct table_file_info info;
    enum status s = table_file_info(path, &info);
    if (s == STATUS_OK)
        s = table_file_read(path, &stored);
    if (s != STATUS_OK)
        return s;
    struct comparison c = { .report.rows = stored.n };
    s = compare(&stored, threads, progress, &c);
    if (s == STATUS_OK) {
        c.report.content_hash_matches = content_hash_matches(&stored, info.code_version);
        s = judge(path, &c.report);
        *ret = c.report;
    } else if (s != STATUS_CANCELLED) {
        log_error("table '%s': %s", path, status_text(s));
    }
    table_done(&stored);
    return s;
}
