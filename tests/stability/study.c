/* study.c - every case through a function and its twin, and the worst of them. */
#include "tests/stability/study.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define COUNTS_AS_ZERO 1e-300
enum { STEP = -50, CHECK_EVERY = 32 };

size_t study_input_count(const struct study *s)
{
    size_t n = 0;
    while (n < STUDY_INPUTS && s->input[n] != NULL)
        n++;
    return n;
}

size_t study_output_count(const struct study *s)
{
    size_t n = 0;
    while (n < STUDY_OUTPUTS && s->output[n] != NULL)
        n++;
    return n;
}

/* ---- cases ---------------------------------------------------------------------- */

void cases_add(struct cases *c, const double *x)
{
    if (c->n == c->room) {
        c->room = 2 * c->room + 256;
        double *more = realloc(c->x, c->room * c->inputs * sizeof *more);
        if (more == NULL) {
            fprintf(stderr, "stability: no memory for cases\n");
            abort();
        }
        c->x = more;
    }
    double *row = c->x + c->n++ * c->inputs;
    for (size_t i = 0; i < c->inputs; i++)
        row[i] = fabs(x[i]) < COUNTS_AS_ZERO ? 0.0 : x[i];
}

void cases_product(struct cases *c, const struct axis_of_cases *axis)
{
    size_t at[STUDY_INPUTS] = { 0 };
    double x[STUDY_INPUTS];
    for (size_t i = 0; i < c->inputs;) {
        for (size_t j = 0; j < c->inputs; j++)
            x[j] = axis[j].value[at[j]];
        cases_add(c, x);
        for (i = 0; i < c->inputs && ++at[i] == axis[i].n; i++)
            at[i] = 0;
    }
}

double cases_decades(struct cases *c, double from, double to)
{
    return pow(10.0, dice_between(&c->dice, from, to));
}

static struct cases cases_of(const struct study *s)
{
    struct cases c = { .inputs = study_input_count(s), .dice = { 20141127 } };
    s->cases(&c);
    return c;
}

/* ---- one case ------------------------------------------------------------------- */

/* Sum of |x df/dx| for every output. */
static void sensitivity(const struct study *s, const wide *x, wide *sum)
{
    size_t inputs = study_input_count(s), outputs = study_output_count(s);
    wide moved[STUDY_INPUTS], up[STUDY_OUTPUTS], down[STUDY_OUTPUTS];
    if (s->sensitivity != NULL) {
        s->sensitivity(x, sum);
        return;
    }
    for (size_t j = 0; j < outputs; j++)
        sum[j] = w_int(0);
    memcpy(moved, x, inputs * sizeof *moved);
    for (size_t i = 0; i < s->varied; i++) {
        size_t mark = wide_mark();
        wide step = w_mul(x[i], w_two_to(STEP));
        if (w_is_zero(step))
            continue;
        moved[i] = w_add(x[i], step);
        s->twin(moved, up);
        moved[i] = w_sub(x[i], step);
        s->twin(moved, down);
        moved[i] = x[i];
        for (size_t j = 0; j < outputs; j++) {
            wide slope = w_mul(w_sub(up[j], down[j]), w_two_to(-STEP - 1));
            w_add_to(sum[j], w_abs(slope));
        }
        wide_release(mark);
    }
}

static bool counts_as_zero(wide x)
{
    return w_less(w_abs(x), w(COUNTS_AS_ZERO));
}

/* |ours - exact| in units of the last place of exact, or of `scale` where exact is 0. */
static double error_ulp(double ours, wide exact, wide scale)
{
    if (mpfr_inf_p(exact) != 0)
        return ours == w_double(exact) ? 0.0 : (double)INFINITY;
    if (!isfinite(ours))
        return INFINITY;
    if (fabs(ours) < COUNTS_AS_ZERO && fabs(w_double(exact)) < COUNTS_AS_ZERO)
        return 0.0;
    wide error = w_abs(w_sub(w(ours), exact));
    if (w_is_zero(error))
        return 0.0;
    wide of = counts_as_zero(exact) ? scale : exact;
    if (w_is_zero(of))
        return INFINITY;
    return w_double(w_div(error, w_two_to(mpfr_get_exp(of) - 53)));
}

/* Bits to which the twin agrees with itself at half as many bits again. */
static double agreement(const struct study *s, const wide *x, const wide *y, const wide *sum)
{
    wide wider[STUDY_OUTPUTS];
    double least = (double)wide_bits;
    wide_bits += wide_bits / 2;
    s->twin(x, wider);
    for (size_t j = 0; j < study_output_count(s); j++) {
        if (mpfr_inf_p(y[j]) != 0 && mpfr_equal_p(y[j], wider[j]) != 0)
            continue;
        wide off = w_abs(w_sub(wider[j], y[j])), scale = w_max(w_abs(wider[j]), sum[j]);
        if (w_is_zero(off) || w_less(off, w(COUNTS_AS_ZERO)))
            continue;
        double bits = -INFINITY;
        if (!w_is_zero(scale) && mpfr_number_p(scale) != 0 && mpfr_number_p(off) != 0)
            bits = (double)(mpfr_get_exp(scale) - mpfr_get_exp(off));
        least = fmin(least, bits);
    }
    wide_bits = WIDE_BITS;
    return least;
}

void study_print_case(const struct study *s, const double *x, FILE *to)
{
    for (size_t i = 0; i < study_input_count(s); i++)
        fprintf(to, " %s %.17g", s->input[i], x[i]);
}

static void judge_output(const struct study *s, const double *x, const double *ours, size_t j,
                         wide exact, wide sum, FILE *misses, struct verdict *v)
{
    double ulp = error_ulp(ours[j], exact, sum);
    double condition = 1.0;
    if (ulp > 0.0 && !counts_as_zero(exact) && mpfr_number_p(exact) != 0)
        condition = w_double(w_div(sum, w_abs(exact)));
    double judged = ulp / fmax(1.0, condition);
    if (isnan(judged)) /* no verdict must not pass for a good one */
        judged = INFINITY;
    v->most_ulp = fmax(v->most_ulp, ulp);
    if (misses != NULL && judged > s->bar) {
        fprintf(misses, "%s %s:", s->name, s->output[j]);
        study_print_case(s, x, misses);
        fprintf(misses, ": %.17g for %.17g, %.3g ulp, condition %.3g\n", ours[j], w_double(exact),
                ulp, condition);
    }
    if (!(judged > v->judged) && v->judged >= 0.0)
        return;
    memcpy(v->x, x, study_input_count(s) * sizeof *x);
    v->judged = judged;
    v->ulp = ulp;
    v->condition = condition;
    v->output = j;
    v->ours = ours[j];
    v->exact = w_double(exact);
}

/* The condition costs many times the value: only where the error alone is the worst. */
static void judge(const struct study *s, const double *x, bool check, FILE *misses,
                  struct verdict *v)
{
    size_t outputs = study_output_count(s);
    double ours[STUDY_OUTPUTS];
    wide X[STUDY_INPUTS], Y[STUDY_OUTPUTS], sum[STUDY_OUTPUTS];
    bool worst = check;
    v->cases++;
    if (!s->ours(x, ours)) {
        v->refused++;
        return;
    }
    size_t mark = wide_mark();
    for (size_t i = 0; i < study_input_count(s); i++)
        X[i] = w(x[i]);
    s->twin(X, Y);
    for (size_t j = 0; j < outputs; j++)
        worst = worst ||
                error_ulp(ours[j], Y[j], Y[j]) > (misses ? fmin(v->judged, s->bar) : v->judged);
    if (worst) {
        sensitivity(s, X, sum);
        for (size_t j = 0; j < outputs; j++)
            judge_output(s, x, ours, j, Y[j], sum[j], misses, v);
    } else {
        for (size_t j = 0; j < outputs; j++)
            v->most_ulp = fmax(v->most_ulp, error_ulp(ours[j], Y[j], Y[j]));
    }
    if (check) {
        double bits = agreement(s, X, Y, sum);
        v->twin_bits = fmin(v->twin_bits, bits);
        if (misses != NULL && bits < STUDY_TWIN_BITS) {
            fprintf(misses, "%s: the twin itself holds %.0f bits at", s->name, bits);
            study_print_case(s, x, misses);
            fprintf(misses, "\n");
        }
    }
    wide_release(mark);
}

struct verdict study_run(const struct study *s, size_t every, FILE *misses)
{
    struct verdict v = { .judged = -1.0, .twin_bits = WIDE_BITS };
    struct cases c = cases_of(s);
    for (size_t i = 0; i < c.n; i += every)
        judge(s, c.x + i * c.inputs, i / every % CHECK_EVERY == 0, misses, &v);
    free(c.x);
    v.met = v.judged >= 0.0 && v.judged <= s->bar && v.twin_bits >= STUDY_TWIN_BITS;
    return v;
}

double *study_outputs(const struct study *s, uint64_t *n)
{
    struct cases c = cases_of(s);
    size_t outputs = study_output_count(s);
    double *all = malloc((c.n * outputs + 1) * sizeof *all);
    *n = c.n * outputs;
    for (size_t i = 0; i < c.n && all != NULL; i++)
        if (!s->ours(c.x + i * c.inputs, all + i * outputs))
            for (size_t j = 0; j < outputs; j++)
                all[i * outputs + j] = NAN;
    free(c.x);
    return all;
}
