/* markdown.c - docs/error-vs-time.md. */
#include "trial/markdown.h"

#include <math.h>
#include <string.h>

#include "trial/csv.h"

enum { NUMBER_SIZE = 24 };

/* Three digits, never an exponent; "-" where there is none. */
static const char *three(double x, char text[NUMBER_SIZE])
{
    if (isnan(x))
        snprintf(text, NUMBER_SIZE, "-");
    else if (x >= 99.95)
        snprintf(text, NUMBER_SIZE, "%.0f", x);
    else if (x >= 9.995)
        snprintf(text, NUMBER_SIZE, "%.1f", x);
    else
        snprintf(text, NUMBER_SIZE, "%.2f", x);
    return text;
}

static const char *small(double x, char text[NUMBER_SIZE])
{
    if (isnan(x))
        snprintf(text, NUMBER_SIZE, "-");
    else if (x < 0.00095)
        snprintf(text, NUMBER_SIZE, "%.1e", x);
    else
        snprintf(text, NUMBER_SIZE, x < 0.0995 ? "%.4f" : "%.3f", x);
    return text;
}

/* ---- what to conclude --------------------------------------------------------------- */

static double times_of(const struct trial_result *r, bool own)
{
    return own ? r->own.times : r->transport.times;
}

/* The least `times` of a model's methods (NULL: all) that take at most us; NULL: none. */
static const struct trial_result *best(const struct trial *t, const struct model *model, bool own,
                                       double us)
{
    const struct trial_result *ret = NULL;
    for (size_t i = 0; i < t->results; i++) {
        const struct trial_result *r = &t->result[i];
        if ((model != NULL && r->method.model != model) || isnan(times_of(r, own)) || r->us > us)
            continue;
        if (ret == NULL || times_of(r, own) < times_of(ret, own) ||
            (times_of(r, own) <= times_of(ret, own) && r->us < ret->us))
            ret = r;
    }
    return ret;
}

/* The quickest whose `times` is at most so much. */
static const struct trial_result *quickest(const struct trial *t, const struct model *model,
                                           bool own, double times)
{
    const struct trial_result *ret = NULL;
    for (size_t i = 0; i < t->results; i++) {
        const struct trial_result *r = &t->result[i];
        if ((model == NULL || r->method.model == model) && times_of(r, own) <= times &&
            (ret == NULL || r->us < ret->us))
            ret = r;
    }
    return ret;
}

static void tell(FILE *f, const struct trial_result *r, bool own)
{
    char name[TRIAL_NAME_SIZE], us[NUMBER_SIZE], times[NUMBER_SIZE];
    fprintf(f, "%s (%s us, %s times what noise allows)", trial_method_name(&r->method, name),
            three(r->us, us), three(times_of(r, own), times));
}

#define AS_GOOD 1.1 /* what of a tenth more is still called as good */

static void conclude_own(FILE *f, const struct trial *t, const char *model_name)
{
    const struct model *model = model_find(model_name);
    const struct trial_result *least = best(t, model, true, INFINITY), *row = NULL;
    if (least == NULL)
        return;
    const struct trial_result *quick = quickest(t, model, true, AS_GOOD * times_of(least, true));
    for (size_t i = 0; i < t->results; i++) {
        const struct trial_result *r = &t->result[i];
        if (r->method.model == model && r->method.rows > 0 && r->method.refine == REFINE_NOT &&
            (row == NULL || times_of(r, true) < times_of(row, true)))
            row = r;
    }
    fprintf(f, "- Where skin is what **%s** says: least error by ", model_name);
    tell(f, least, true);
    if (quick != least) {
        fputs("; as good to a tenth and quickest: ", f);
        tell(f, quick, true);
    }
    if (row != NULL) {
        fputs("; of rows alone the best is ", f);
        tell(f, row, true);
    }
    fputs(".\n", f);
}

static void conclude_transport(FILE *f, const struct trial *t)
{
    static const double limits[] = { 1.0, 3.0, 10.0, 100.0 };
    const struct trial_result *least = best(t, NULL, false, INFINITY), *last = NULL;
    if (least == NULL)
        return;
    fputs("- Where skin is what **transport-32** says: least error by ", f);
    tell(f, least, false);
    const struct trial_result *quick = quickest(t, NULL, false, AS_GOOD * times_of(least, false));
    if (quick != least) {
        fputs("; as good to a tenth and quickest: ", f);
        tell(f, quick, false);
    }
    fputs(".\n", f);
    for (size_t i = 0; i < sizeof limits / sizeof *limits; i++) {
        const struct trial_result *r = best(t, NULL, false, limits[i]);
        if (r == NULL || r == last || r == least)
            continue;
        fprintf(f, "  - Within %g us: ", limits[i]);
        tell(f, r, false);
        fputs(".\n", f);
        last = r;
    }
}

/* What a model's own error costs: its fit on spectra of its own and on transport's. */
static void conclude_model_error(FILE *f, const struct trial *t)
{
    char a[NUMBER_SIZE], b[NUMBER_SIZE];
    const char *between = "- What the model costs beside noise, by the fit from the closed form "
                          "(own spectra, then transport-32's): ";
    for (size_t i = 0; i < t->results; i++) {
        const struct trial_result *r = &t->result[i];
        const struct trial_method *m = &r->method;
        if (m->rows > 0 || m->refine != REFINE_THREE || m->interval || m->batch ||
            m->kernel != TRIAL_QUICK)
            continue;
        fprintf(f, "%s%s %s and %s", between, m->model->name, three(r->own.times, a),
                three(r->transport.times, b));
        between = ", ";
    }
    fputs(between[0] == ',' ? ". Where the second is far larger, no table and no search helps.\n"
                            : "",
          f);
}

static void conclude_models(FILE *f, const struct trial *t)
{
    char us[NUMBER_SIZE], rms[NUMBER_SIZE], name[TRIAL_FORWARD_NAME_SIZE];
    const char *between = "- Models on the front: ";
    const struct trial_forward *last = NULL;
    for (;;) {
        const struct trial_forward *next = NULL;
        for (size_t i = 0; i < t->forwards; i++) {
            const struct trial_forward *p = &t->forward[i];
            if (p->front && (last == NULL || p->us > last->us) &&
                (next == NULL || p->us < next->us))
                next = p;
        }
        if (next == NULL)
            break;
        fprintf(f, "%s%s (%s us, rms %s)", between, trial_forward_name(next, name),
                three(next->us, us), small(next->rms_R, rms));
        between = ", ";
        last = next;
    }
    fputs(last != NULL ? ".\n" : "", f);
}

/* ---- tables ------------------------------------------------------------------------- */

static void cells(FILE *f, const double rmse[3], bool front)
{
    char text[NUMBER_SIZE];
    for (size_t k = 0; k < 3; k++)
        fprintf(f, front ? " | **%s**" : " | %s", small(rmse[k], text));
}

static void result_row(FILE *f, const struct trial_result *r)
{
    char name[TRIAL_NAME_SIZE], a[NUMBER_SIZE], b[NUMBER_SIZE], c[NUMBER_SIZE], d[NUMBER_SIZE];
    char e[NUMBER_SIZE];
    fprintf(f, "| %s | %s; %s", trial_method_name(&r->method, name), three(r->us, a),
            three(r->us_p95, b));
    cells(f, r->own.rmse, r->own.front);
    cells(f, r->transport.rmse, r->transport.front);
    fprintf(f, " | %s | %s | %s |\n", three(r->transport.dE00, c), small(r->transport.rms_R, d),
            three(1e-6 * r->bytes, e));
}

static void model_table(FILE *f, const struct trial *t, const struct model *model)
{
    const struct trial_bound *bound = trial_bound_of(t, model);
    char text[3][NUMBER_SIZE];
    bool any = false;
    for (size_t i = 0; i < t->results; i++) {
        if (t->result[i].method.model != model)
            continue;
        if (!any)
            fprintf(f,
                    "\n### %s\n\n| method | us: median; 95 %% | Cm | Bm | Ch | Cm (transport) | "
                    "Bm (transport) | Ch (transport) | dE00 | rms R | MB |\n"
                    "|---|---|---|---|---|---|---|---|---|---|---|\n",
                    model->name);
        any = true;
        result_row(f, &t->result[i]);
    }
    if (any && bound != NULL)
        fprintf(f, "| what noise allows | | %s | %s | %s | | | | | | |\n",
                small(bound->sd[0], text[0]), small(bound->sd[1], text[1]),
                small(bound->sd[2], text[2]));
}

static void forward_table(FILE *f, const struct trial *t)
{
    char name[TRIAL_FORWARD_NAME_SIZE], a[NUMBER_SIZE], b[NUMBER_SIZE], c[NUMBER_SIZE];
    char d[NUMBER_SIZE], e[NUMBER_SIZE];
    fputs("\n## The models\n\nOne spectrum of 31 bands, against transport-32, and that against 64 "
          "streams. Kernels differ by less than 1e-11: their errors are the model's.\n\n"
          "| model | us: median; 95 % | rms R | worst | dE00 |\n|---|---|---|---|---|\n",
          f);
    for (size_t i = 0; i < t->forwards; i++) {
        const struct trial_forward *p = &t->forward[i];
        fprintf(f,
                p->front ? "| **%s** | %s; %s | %s | %s | %s |\n"
                         : "| %s | %s; %s | %s | %s | %s |\n",
                trial_forward_name(p, name), three(p->us, a), three(p->us_p95, b),
                small(p->rms_R, c), small(p->worst_R, d), three(p->dE00, e));
    }
}

/* ---- the page ----------------------------------------------------------------------- */

static void head(FILE *f, const struct trial *t, const char *machine, const char *picture)
{
    const char *slash = picture != NULL ? strrchr(picture, '/') : NULL;
    fprintf(f,
            "# Error against run time\n\nMade by `skinspec bench` in one run; `make error-vs-time` "
            "makes it anew.\n\nMachine: %s.\n%zu skins, seed %llu, %zu rounds.\n",
            machine, t->skins, (unsigned long long)t->seed, t->rounds);
    if (picture != NULL)
        fprintf(f, "\n![error against time](%s)\n", slash != NULL ? slash + 1 : picture);
}

static void how(FILE *f, const struct trial *t)
{
    fprintf(
        f,
        "\n## How it was measured\n\n"
        "- Skins: Cm 0.005..0.2 and Ch 0.001..0.1 evenly in the logarithm, Bm 0..1 evenly, the "
        "rest "
        "as the default tables; 31 bands, 400..700 nm; white noise of 0.003, the same for every "
        "method.\n"
        "- Cm, Bm, Ch: root mean square error. The first three columns are of spectra made by the "
        "method's own model, the next three of spectra made by transport-32. dE00 and rms R: the "
        "skin found against the skin that was there, both without noise, by transport-32's "
        "spectra; means. A parameter that the fit holds has no error here.\n"
        "- What noise allows: the Cramer-Rao bound, root mean square over the same skins. Answers "
        "that keep to bounds may do better. Of transport-32's spectra it is %s's.\n"
        "- Times: one thread, monotonic clock (from 0.1 ms on the thread's own) less what reading "
        "it takes; one spectrum after the "
        "other (below 1 us up to 16 at a time), half of either set, at most 256; methods in turns "
        "over %zu rounds after one that does not count. A spectrum's time is the median of its "
        "rounds; given are the median and the 95th percentile of spectra. A nearest row's time is "
        "all of `matcher_match()`: colour, search, dE00, rms, flags; of a batch of 256 each has "
        "its share.\n"
        "- MB: what table, index and fit take from malloc(), measured.\n"
        "- Bold: on the front, nothing tried is both quicker and better in the worst of the three "
        "(first columns: of the same model; next: of all).\n",
        trial_bound_of_transport, t->rounds);
}

void trial_markdown(FILE *stream, const struct trial *trial, const char *machine,
                    const char *picture)
{
    head(stream, trial, machine, picture);
    fputs("\n## What to conclude\n\n", stream);
    conclude_own(stream, trial, "half-space");
    conclude_own(stream, trial, "two-layer");
    conclude_transport(stream, trial);
    conclude_model_error(stream, trial);
    conclude_models(stream, trial);
    fputs("\n## From a spectrum to a skin\n", stream);
    for (size_t i = 0; i < MODEL_COUNT; i++)
        model_table(stream, trial, &model_list[i]);
    forward_table(stream, trial);
    how(stream, trial);
}
