/* costs.c - costs as text: read, written, and those compiled in. */
#include "plan/costs.h"

#include <assert.h>
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "base/number.h"
#include "optics/tissue.h"
#include "plan/costs_default.h"

static const char header[] = "model,rows,by,refine,interval,us,us_p95,Cm,Bm,Ch,Cm_transport,"
                             "Bm_transport,Ch_transport,dE00,rms_R,bytes";
static const char machine_line[] = "# machine: ";
static const char count_line[] = "# costs: ";
static const char not_refined[] = "none"; /* refine_kind_name() has no name for it */

const struct scene_range costs_skins[3] = { { 0.005, 0.2 },
                                            { 0.0, 1.0 },
                                            { TISSUE_CH_MIN, TISSUE_CH_MAX } };

enum { FIELDS = 16, LINE_MAX_BYTES = 512 };

/* ---- names -------------------------------------------------------------------------- */

static bool by_parse(const char *text, enum match_by *ret)
{
    for (int by = MATCH_RGB; by <= MATCH_SPECTRUM; by++) {
        if (strcmp(text, match_by_name((enum match_by)by)) == 0) {
            *ret = (enum match_by)by;
            return true;
        }
    }
    return false;
}

static bool refine_parse(const char *text, enum refine_kind *ret)
{
    if (strcmp(text, not_refined) != 0)
        return refine_kind_parse(text, ret) == STATUS_OK;
    *ret = REFINE_NOT;
    return true;
}

static bool flag_parse(const char *text, bool *ret)
{
    *ret = text[0] == '1';
    return (text[0] == '0' || text[0] == '1') && text[1] == '\0';
}

/* Blank: not measured, where that may be. */
static bool amount_parse(const char *text, bool may_be_blank, double *ret)
{
    if (text[0] == '\0' && may_be_blank) {
        *ret = NAN;
        return true;
    }
    return number_parse(text, ret) == STATUS_OK && *ret >= 0.0;
}

/* ---- reading ------------------------------------------------------------------------ */

/* The fields of a line, which is cut up for it; false where they are not FIELDS. */
static bool cut(char *line, char *field[FIELDS])
{
    size_t n = 0;
    for (char *at = line; at != NULL; n++) {
        char *comma = strchr(at, ',');
        if (n == FIELDS)
            return false;
        field[n] = at;
        if (comma != NULL)
            *comma++ = '\0';
        at = comma;
    }
    return n == FIELDS;
}

static bool cost_parse(char *line, struct cost *ret)
{
    char *field[FIELDS];
    struct cost c = { 0 };
    if (!cut(line, field))
        return false;
    c.model = model_find(field[0]);
    bool good =
        c.model != NULL && number_parse_count(field[1], GRID_ROWS_MAX, &c.rows) == STATUS_OK;
    good = good && by_parse(field[2], &c.by) && refine_parse(field[3], &c.refine) &&
           flag_parse(field[4], &c.interval);
    good = good && amount_parse(field[5], false, &c.us) && amount_parse(field[6], false, &c.us_p95);
    for (size_t i = 0; i < 3; i++)
        good = good && amount_parse(field[7 + i], true, &c.rmse[i]) &&
               amount_parse(field[10 + i], true, &c.rmse_transport[i]);
    good = good && amount_parse(field[13], true, &c.dE00) &&
           amount_parse(field[14], true, &c.rms_R) && amount_parse(field[15], false, &c.bytes);
    if (good)
        *ret = c;
    return good;
}

/* What the lines said so far. */
struct reading {
    bool seen;    /* the line of names */
    size_t count; /* with costs->counted */
};

static bool take_comment(const char *line, struct reading *reading, struct costs *ret)
{
    size_t n = sizeof machine_line - 1, m = sizeof count_line - 1;
    if (strncmp(line, machine_line, n) == 0)
        snprintf(ret->machine, sizeof ret->machine, "%.*s", COSTS_MACHINE_SIZE - 1, line + n);
    if (strncmp(line, count_line, m) != 0)
        return true;
    ret->counted = true;
    return number_parse_count(line + m, COSTS_MAX, &reading->count) == STATUS_OK;
}

/* One line without its end into *ret. */
static bool take_line(char *line, struct reading *reading, struct costs *ret)
{
    if (line[0] == '\0')
        return true;
    if (line[0] == '#')
        return take_comment(line, reading, ret);
    if (!reading->seen) {
        reading->seen = true;
        return strcmp(line, header) == 0;
    }
    size_t most = ret->counted ? reading->count : COSTS_MAX;
    return ret->n < most && cost_parse(line, &ret->cost[ret->n++]);
}

/* More of a text into *costs, *line counted on; what is there after a fault is of no use. */
static enum status read_lines(const char *text, struct reading *reading, struct costs *costs,
                              size_t *line)
{
    char copy[LINE_MAX_BYTES];
    for (const char *at = text; *at != '\0';) {
        size_t n = strcspn(at, "\n"), body = n > 0 && at[n - 1] == '\r' ? n - 1 : n;
        ++*line;
        if (body >= sizeof copy)
            return STATUS_FORMAT;
        memcpy(copy, at, body);
        copy[body] = '\0';
        if (!take_line(copy, reading, costs))
            return STATUS_FORMAT;
        at += at[n] == '\n' ? n + 1 : n;
    }
    return STATUS_OK;
}

enum status costs_parse(const char *text, struct costs *ret, size_t *line)
{
    struct costs *costs = calloc(1, sizeof *costs);
    size_t at = 0;
    struct reading reading = { false, 0 };
    enum status s = costs != NULL ? read_lines(text, &reading, costs, &at) : STATUS_NO_MEMORY;
    bool few = s == STATUS_OK && (costs->n == 0 || (costs->counted && costs->n < reading.count));
    if (few) { /* the line that is not there */
        at++;
        s = STATUS_FORMAT;
    }
    if (s == STATUS_OK)
        *ret = *costs;
    else
        *line = at;
    free(costs);
    return s;
}

/* ---- those compiled in -------------------------------------------------------------- */

static struct costs builtin;

/* Without an allocation, so that it cannot fail in a station that has no memory left. */
static void read_builtin(void)
{
    struct reading reading = { false, 0 };
    size_t line = 0;
    enum status s = STATUS_OK;
    for (size_t i = 0; costs_default_lines[i] != NULL && s == STATUS_OK; i++)
        s = read_lines(costs_default_lines[i], &reading, &builtin, &line);
    assert(s == STATUS_OK && builtin.n > 0); /* a test reads it */
}

const struct costs *costs_builtin(void)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    (void)pthread_once(&once, read_builtin);
    return &builtin;
}

/* ---- writing ------------------------------------------------------------------------ */

static void print_amount(FILE *stream, double x)
{
    char text[NUMBER_TEXT_SIZE];
    fprintf(stream, ",%s", isnan(x) ? "" : number_format(x, 4, text));
}

void costs_print(FILE *stream, const struct costs *costs)
{
    fprintf(stream, "%s%s\n%s%zu\n%s\n", machine_line, costs->machine, count_line, costs->n,
            header);
    for (size_t i = 0; i < costs->n; i++) {
        const struct cost *c = &costs->cost[i];
        char bytes[NUMBER_TEXT_SIZE];
        fprintf(stream, "%s,%zu,%s,%s,%d", c->model->name, c->rows, match_by_name(c->by),
                c->refine == REFINE_NOT ? not_refined : refine_kind_name(c->refine), c->interval);
        print_amount(stream, c->us);
        print_amount(stream, c->us_p95);
        for (size_t k = 0; k < 3; k++)
            print_amount(stream, c->rmse[k]);
        for (size_t k = 0; k < 3; k++)
            print_amount(stream, c->rmse_transport[k]);
        print_amount(stream, c->dE00);
        print_amount(stream, c->rms_R);
        fprintf(stream, ",%s\n", number_format(c->bytes, 15, bytes));
    }
}
