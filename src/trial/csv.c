/* csv.c - one line a method, bound or model. */
#include "trial/csv.h"

#include <math.h>
#include <string.h>

#include "base/number.h"

static const char *const names[] = {
    "kind",      "name",         "model",        "rows",         "by",        "answer",
    "interval",  "batch",        "kernel",       "us",           "us_p95",    "timed",
    "Cm",        "Bm",           "Ch",           "dE00_own",     "rms_R_own", "times_own",
    "front_own", "Cm_transport", "Bm_transport", "Ch_transport", "dE00",      "rms_R",
    "times",     "front",        "worst_R",      "bytes",
};

const char *trial_kind_name(const struct trial_method *m)
{
    if (m->refine != REFINE_NOT)
        return refine_kind_name(m->refine);
    return m->rows > 0 ? "nearest" : "closed form";
}

static void number(FILE *stream, double x)
{
    char text[NUMBER_TEXT_SIZE];
    fprintf(stream, ",%s", isnan(x) ? "" : number_format(x, 4, text));
}

static void numbers(FILE *stream, const double *x, size_t n)
{
    for (size_t i = 0; i < n; i++)
        number(stream, x[i]);
}

static void errors(FILE *stream, const struct trial_errors *e)
{
    numbers(stream, e->rmse, 3);
    number(stream, e->dE00);
    number(stream, e->rms_R);
    number(stream, e->times);
    fprintf(stream, ",%d", e->front);
}

static void inversion(FILE *stream, const struct trial_result *r)
{
    const struct trial_method *m = &r->method;
    char name[TRIAL_NAME_SIZE], bytes[NUMBER_TEXT_SIZE];
    fprintf(stream, "inversion,\"%s\",%s,%zu,%s,%s,%d,%d,%s", trial_method_name(m, name),
            m->model->name, m->rows, m->rows > 0 ? match_by_name(m->by) : "", trial_kind_name(m),
            m->interval, m->batch, m->kernel == TRIAL_PLAIN ? "plain" : "quick");
    number(stream, r->us);
    number(stream, r->us_p95);
    fprintf(stream, ",%zu", r->timed);
    errors(stream, &r->own);
    errors(stream, &r->transport);
    fprintf(stream, ",,%s\n", number_format(r->bytes, 15, bytes));
}

static void bound(FILE *stream, const struct trial_bound *b)
{
    fprintf(stream, "bound,\"%s, what noise allows\",%s,,,,,,,,,", b->model->name, b->model->name);
    numbers(stream, b->sd, 3);
    fputs(",,,,,,,,,,,,,\n", stream);
}

static void forward(FILE *stream, const struct trial_forward *f)
{
    char name[TRIAL_FORWARD_NAME_SIZE];
    bool quick = f->kind == TRIAL_FORWARD_QUICK || f->kind == TRIAL_FORWARD_QUICK_SLOPES;
    bool slopes = f->kind == TRIAL_FORWARD_SLOPES || f->kind == TRIAL_FORWARD_QUICK_SLOPES;
    fprintf(stream, "forward,\"%s\",%s,,,%s,,,%s", trial_forward_name(f, name), f->model->name,
            slopes ? "slopes" : "R", quick ? "quick" : "plain");
    number(stream, f->us);
    number(stream, f->us_p95);
    fprintf(stream, ",%zu,,,,,,,,,,", f->timed);
    number(stream, f->dE00);
    number(stream, f->rms_R);
    fprintf(stream, ",,%d", f->front);
    number(stream, f->worst_R);
    fputs(",\n", stream);
}

void trial_csv(FILE *stream, const struct trial *trial, const char *machine)
{
    fprintf(stream, "# machine: %s\n# %zu skins, seed %llu, %zu rounds, white noise %g, %d bands\n",
            machine, trial->skins, (unsigned long long)trial->seed, trial->rounds, TRIAL_NOISE,
            (int)TRIAL_BANDS);
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        fprintf(stream, "%s%s", i > 0 ? "," : "", names[i]);
    fputc('\n', stream);
    for (size_t i = 0; i < trial->results; i++)
        inversion(stream, &trial->result[i]);
    for (size_t i = 0; i < trial->bounds; i++)
        bound(stream, &trial->bound[i]);
    for (size_t i = 0; i < trial->forwards; i++)
        forward(stream, &trial->forward[i]);
}

void trial_costs(const struct trial *trial, const char *machine, struct costs *ret)
{
    memset(ret, 0, sizeof *ret);
    snprintf(ret->machine, sizeof ret->machine, "%s", machine);
    for (size_t i = 0; i < trial->results && ret->n < COSTS_MAX; i++) {
        const struct trial_result *r = &trial->result[i];
        const struct trial_method *m = &r->method;
        if (m->kernel != TRIAL_QUICK || m->batch)
            continue;
        struct cost c = { .model = m->model,
                          .rows = m->rows,
                          .by = m->by,
                          .refine = m->refine,
                          .interval = m->interval,
                          .us = r->us,
                          .us_p95 = r->us_p95 };
        memcpy(c.rmse, r->own.rmse, sizeof c.rmse);
        memcpy(c.rmse_transport, r->transport.rmse, sizeof c.rmse_transport);
        c.dE00 = r->transport.dE00;
        c.rms_R = r->transport.rms_R;
        c.bytes = r->bytes;
        ret->cost[ret->n++] = c;
    }
}
