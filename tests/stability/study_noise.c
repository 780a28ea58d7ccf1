/* study_noise.c - the noise of replicates: v^T C^-1 v by whitening beside elimination of C, and
 * what replicates say of their placement. */
#include <math.h>

#include "match/noise.h"
#include "tests/stability/rooms.h"
#include "tests/stability/twins.h"

/* ---- v^T C^-1 v: seed, n, white, placement, ratio, bands, vector, missing, replicates ---- */

enum { MOST = SPECTRUM_MAX_BANDS, BLOCK = 32 };
enum { SPACED, TWICE, ALL_700, NEAR_700, CLOSE_700, ALL_550, BAND_KINDS };
enum { BY_CHANCE, LEVEL, LEVEL_AND_SLOPE, NEARLY_LEVEL, VECTOR_KINDS };

struct vector {
    size_t n, replicates;
    struct noise noise;
    double nm[MOST], weight[MOST], v[MOST];
};

static double nm_of(int kind, size_t i, size_t n)
{
    switch (kind) {
    case SPACED:
        return 360.0 + floor(400.0 * (double)i / (double)n * 64.0) / 64.0;
    case TWICE:
        return 400.0 + (double)(i / 2 % 40) * 10.0;
    case NEAR_700:
        return 700.0 + (double)i * 0x1p-13;
    case CLOSE_700:
        return 700.0 + (double)i * 0x1p-30;
    case ALL_550:
        return 550.0;
    default:
        return 700.0;
    }
}

static void vector_of(const double *x, struct vector *r)
{
    struct dice dice = { (uint64_t)x[0] };
    r->n = (size_t)x[1];
    r->noise = (struct noise){ x[2], x[3], x[4] };
    r->replicates = (size_t)x[8];
    for (size_t i = 0; i < r->n; i++) {
        double chance = dice_between(&dice, -1.0, 1.0);
        r->nm[i] = nm_of((int)x[5], i, r->n);
        r->weight[i] = x[7] != 0.0 && i % 3 == 1 ? 0.0 : 1.0;
        double level_and_slope = 0.5 - (r->nm[i] - 550.0) / 256.0;
        double v[VECTOR_KINDS] = { chance, 0.5, level_and_slope, 0.5 + 1e-8 * chance };
        r->v[i] = r->weight[i] * v[(int)x[6]];
    }
}

static bool whitened_ours(const double *x, double *y)
{
    static struct vector r;
    static double scratch[WHITENER_SCRATCH(MOST)];
    struct whitener w;
    vector_of(x, &r);
    whitener_init(&r.noise, r.replicates, r.nm, r.weight, r.n, scratch, &w);
    whitener_apply(&w, r.v);
    y[0] = 0.0;
    for (size_t first = 0; first < r.n; first += BLOCK) { /* no rounding of a long sum */
        double sum = 0.0;
        for (size_t i = first; i < r.n && i < first + BLOCK; i++)
            sum += r.v[i] * r.v[i] / w.white2;
        y[0] += sum;
    }
    return true;
}

/* Level and slope of the placement, the vector, and u = C^-1 v. */
struct wide_vector {
    wide white2, p[MOST], s[MOST], v[MOST], u[MOST];
};

static wide product(wide *x, wide *y, size_t n)
{
    wide sum = w_int(0);
    for (size_t i = 0; i < n; i++) {
        size_t mark = wide_mark();
        w_add_to(sum, w_mul(x[i], y[i]));
        wide_release(mark);
    }
    return sum;
}

static wide wide_slope(double nm)
{
    return w_div(w_mul(w_sqrt(w_int(3)), w_sub(w(nm), w_int(550))), w_int(150));
}

/* Up to so many bands C itself is eliminated; of more, its two directions alone, with as many
 * bits again as that loses. */
enum { ELIMINATED = 24, MORE_BITS = 600, ULP = -53 };

static void eliminate(const struct vector *r, struct wide_vector *a)
{
    static wide m[ELIMINATED * (ELIMINATED + 1)];
    size_t n = r->n, columns = n + 1;
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j < n; j++) {
            wide c = w_add(w_mul(a->p[i], a->p[j]), w_mul(a->s[i], a->s[j]));
            m[i * columns + j] = i == j ? w_add(c, a->white2) : c;
        }
        m[i * columns + n] = w_copy(a->v[i]);
    }
    twin_eliminate(m, n, columns);
    for (size_t i = 0; i < n; i++)
        a->u[i] = m[i * columns + n];
}

static void by_directions(const struct vector *r, struct wide_vector *a)
{
    size_t n = r->n;
    wide ps = product(a->p, a->s, n);
    wide m[2 * 3] = { w_add(product(a->p, a->p, n), a->white2),
                      ps,
                      product(a->p, a->v, n),
                      w_copy(ps),
                      w_add(product(a->s, a->s, n), a->white2),
                      product(a->s, a->v, n) };
    twin_eliminate(m, 2, 3);
    for (size_t i = 0; i < n; i++) {
        wide along = w_add(w_mul(m[2], a->p[i]), w_mul(m[5], a->s[i]));
        a->u[i] = w_div(w_sub(a->v[i], along), a->white2);
    }
}

static void wide_vector_of(const wide *x, struct vector *r, struct wide_vector *a)
{
    double chosen[9];
    for (int i = 0; i < 9; i++)
        chosen[i] = w_double(x[i]);
    vector_of(chosen, r);
    a->white2 = w_square(x[2]);
    for (size_t i = 0; i < r->n; i++) {
        a->p[i] = w_mul(w(r->weight[i]), x[3]);
        a->s[i] = w_mul(w_mul(a->p[i], x[4]), wide_slope(r->nm[i]));
        a->v[i] = w(r->v[i]);
    }
    if (r->n <= ELIMINATED)
        eliminate(r, a);
    else
        by_directions(r, a);
}

static void whitened_of(const wide *x, wide *q, wide *sensitivity)
{
    static struct vector r;
    static struct wide_vector a;
    mpfr_prec_t narrow = wide_bits;
    wide_bits += MORE_BITS;
    wide_vector_of(x, &r, &a);
    wide replicates = w_copy(x[8]);
    *q = w_mul(replicates, product(a.v, a.u, r.n));
    wide pu = w_abs(product(a.p, a.u, r.n)), su = w_abs(product(a.s, a.u, r.n));
    /* By white, then by v, also the square of one ulp of it, and by both directions. */
    wide half = w_mul(a.white2, product(a.u, a.u, r.n));
    for (size_t i = 0; i < r.n; i++) {
        size_t mark = wide_mark();
        w_add_to(half, w_abs(w_mul(a.v[i], a.u[i])));
        w_add_to(half, w_mul(w_div(w_square(a.v[i]), a.white2), w_two_to(ULP)));
        w_add_to(half, w_abs(w_mul(a.u[i], w_mul(a.p[i], pu))));
        w_add_to(half, w_abs(w_mul(a.u[i], w_mul(a.s[i], su))));
        wide_release(mark);
    }
    *sensitivity = w_mul(w_int(2), w_mul(replicates, half));
    wide_bits = narrow;
}

static void whitened_twin(const wide *x, wide *y)
{
    wide unused;
    whitened_of(x, &y[0], &unused);
}

static void whitened_sensitivity(const wide *x, wide *sum)
{
    wide unused;
    whitened_of(x, &unused, &sum[0]);
}

/* Placement over white from 1e-6 to 1e9, and none. */
static void vectors(struct cases *c)
{
    static const double sizes[][2] = { { 1e-2, 0.0 },  { 1e-2, 1e-200 }, { 1.0, 1e-6 },
                                       { 1e-3, 1e-5 }, { 1e-2, 1e-2 },   { 0.0038, 0.009 },
                                       { 1e-3, 0.1 },  { 1e-4, 1.0 },    { 1e-6, 1.0 },
                                       { 1e-9, 1.0 } };
    static const double ratios[] = { 0.0, 1e-200, 1e-6, 0.47, 100.0 };
    static const double bands[] = { 2, 3, 10, 24, 31, 81, 401, 1024 };
    double seed = 0.0;
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++)
        for (size_t j = 0; j < sizeof ratios / sizeof *ratios; j++)
            for (size_t k = 0; k < sizeof bands / sizeof *bands; k++)
                for (int kind = 0; kind < BAND_KINDS; kind++)
                    for (int v = 0; v < VECTOR_KINDS; v++, seed += 1.0)
                        cases_add(c, (double[]){ seed, bands[k], sizes[i][0], sizes[i][1],
                                                 ratios[j], kind, v, fmod(seed, 3.0) == 1.0,
                                                 fmod(seed, 5.0) == 1.0 ? 3 : 1 });
}

/* ---- placement of replicates: seed, n, bands, first, step, white, placement, ratio, spread - */

enum { REPLICATES = 8 };

static void replicates_of(const double *x, struct spectrum *s)
{
    struct dice dice = { (uint64_t)x[0] };
    for (size_t k = 0; k < (size_t)x[1]; k++) {
        s[k] = (struct spectrum){ .first_nm = x[3], .step_nm = x[4], .n = (size_t)x[2] };
        double level = x[8] * dice_between(&dice, -1.0, 1.0);
        double slope = x[8] * dice_between(&dice, -1.0, 1.0);
        for (size_t i = 0; i < s[k].n; i++) {
            double off = level + slope * ((double)i / x[2] - 0.5);
            s[k].value[i] = 0.4 + off + 0.1 * x[8] * dice_between(&dice, -1.0, 1.0);
        }
    }
    if (x[2] > 4.0)
        s[0].value[2] = NAN;
}

static bool placement_ours(const double *x, double *y)
{
    static struct spectrum s[REPLICATES];
    struct noise population = { x[5], x[6], x[7] }, found;
    replicates_of(x, s);
    if (noise_from_replicates(&population, s, (size_t)x[1], &found) != STATUS_OK)
        return false;
    y[0] = found.placement;
    return true;
}

/* Level and slope of v, and of every band the part it has in them: as (G^T G)^-1 G^T. */
struct line_fit {
    size_t n;
    wide by_level[MOST], by_slope[MOST], level_variance, slope_variance;
};

static void line_fit_of(const struct spectrum *s, struct line_fit *f)
{
    static wide slope[MOST];
    wide ll = w_int(0), ls = w_int(0), ss = w_int(0);
    for (size_t i = 0; i < s->n; i++) {
        wide nm = w_add(w(s->first_nm), w_mul(w_int((long)i), w(s->step_nm)));
        slope[i] = w_div(w_mul(w_sqrt(w_int(3)), w_sub(nm, w_int(550))), w_int(150));
        if (isnan(s->value[i]))
            continue;
        w_add_to(ll, w_int(1));
        w_add_to(ls, slope[i]);
        w_add_to(ss, w_square(slope[i]));
    }
    wide det = w_sub(w_mul(ll, ss), w_square(ls));
    f->n = s->n;
    f->level_variance = w_div(ss, det);
    f->slope_variance = w_div(ll, det);
    for (size_t i = 0; i < s->n; i++) {
        wide measured = w_int(isnan(s->value[i]) ? 0 : 1);
        f->by_level[i] = w_mul(measured, w_div(w_sub(ss, w_mul(ls, slope[i])), det));
        f->by_slope[i] = w_mul(measured, w_div(w_sub(w_mul(ll, slope[i]), ls), det));
    }
}

/* Of all replicates: level^2 + (slope/ratio)^2, and sums of |x d/dx| of that by the values and by
 * the ratio. */
struct strays {
    wide sum, by_values, by_ratio;
};

/* Level and slope by which replicate k strays from the mean of n. */
static void stray_of(const struct line_fit *f, const struct spectrum *s, size_t n, size_t k,
                     wide *level, wide *slope)
{
    *level = w_int(0);
    *slope = w_int(0);
    for (size_t i = 0; i < f->n; i++) {
        wide mean = w_int(0);
        if (isnan(s[0].value[i]))
            continue;
        for (size_t j = 0; j < n; j++)
            w_add_to(mean, w(s[j].value[i]));
        wide off = w_sub(w(s[k].value[i]), w_div(mean, w_int((long)n)));
        w_add_to(*level, w_mul(f->by_level[i], off));
        w_add_to(*slope, w_mul(f->by_slope[i], off));
    }
}

/* ratio2 NULL: no slope. */
static struct strays strays_of(const struct line_fit *f, const struct spectrum *s, size_t n,
                               wide ratio2)
{
    struct strays r = { w_int(0), w_int(0), w_int(0) };
    wide two = w_int(2);
    for (size_t k = 0; k < n; k++) {
        wide level, slope;
        stray_of(f, s, n, k, &level, &slope);
        wide scaled = ratio2 != NULL ? w_div(slope, ratio2) : w_int(0);
        w_add_to(r.sum, w_add(w_square(level), w_mul(scaled, slope)));
        w_add_to(r.by_ratio, w_mul(two, w_mul(scaled, slope)));
        for (size_t i = 0; i < f->n; i++) {
            wide by = w_add(w_mul(f->by_level[i], level), w_mul(f->by_slope[i], scaled));
            if (!isnan(s[0].value[i]))
                w_add_to(r.by_values, w_abs(w_mul(two, w_mul(by, w(s[k].value[i])))));
        }
    }
    return r;
}

static void placement_of(const wide *x, wide *placement, wide *sensitivity)
{
    static struct spectrum s[REPLICATES];
    static struct line_fit f;
    double chosen[9];
    for (int i = 0; i < 9; i++)
        chosen[i] = w_double(x[i]);
    replicates_of(chosen, s);
    line_fit_of(&s[0], &f); /* the first has the gap */
    size_t n = (size_t)chosen[1];
    wide ratio2 = chosen[7] > 0.0 ? w_square(x[7]) : NULL, none = w_int(0);
    wide directions = w_int(ratio2 != NULL ? 2 : 1);
    wide degrees = w_mul(directions, w_int((long)n - 1)), prior = w_int(8);
    struct strays r = strays_of(&f, s, n, ratio2);
    wide part = w_add(f.level_variance, ratio2 != NULL ? w_div(f.slope_variance, ratio2) : none);
    wide white = w_mul(degrees, w_mul(w_square(x[5]), w_div(part, directions)));
    wide seen = w_max(w_sub(r.sum, white), none), known = w_mul(prior, w_square(x[6]));
    wide all = w_add(degrees, prior), root = w_sqrt(w_div(w_add(seen, known), all));
    /* Of the square; half of it, over the root, is that of the root. */
    wide by = w_mul(w_int(2), known);
    if (!w_is_zero(seen))
        by = w_add(by, w_add(w_add(r.by_values, r.by_ratio), w_mul(w_int(4), white)));
    *sensitivity = w_is_zero(root) ? none : w_div(w_div(by, all), w_mul(w_int(2), root));
    *placement = w_less(w_int(1), root) ? w_int(1) : root;
}

static void placement_twin(const wide *x, wide *y)
{
    wide unused;
    placement_of(x, &y[0], &unused);
}

static void placement_sensitivity(const wide *x, wide *sum)
{
    wide unused;
    placement_of(x, &unused, &sum[0]);
}

static void placements(struct cases *c)
{
    static const double grids[][3] = {
        { 2, 400, 300 },   { 3, 400, 10 },       { 31, 400, 10 },
        { 81, 360, 5 },    { 2, 700, 1 },        { 31, 900, 0.1 },
        { 31, 700, 1e-4 }, { 31, 700, 0x1p-20 }, { 31, 700, 0x1p-30 }
    };
    static const double ratios[] = { 0.0, 1e-3, 0.47, 100.0 };
    static const double spreads[] = { 0.0, 1e-6, 1e-3, 0.02, 0.3 };
    static const double sizes[][2] = {
        { 0.0038, 0.009 }, { 1e-9, 0.0 }, { 1e-3, 1.0 }, { 0.02, 1e-6 }
    };
    double seed = 0.0;
    for (size_t g = 0; g < sizeof grids / sizeof *grids; g++)
        for (size_t r = 0; r < sizeof ratios / sizeof *ratios; r++)
            for (size_t i = 0; i < sizeof spreads / sizeof *spreads; i++)
                for (size_t j = 0; j < sizeof sizes / sizeof *sizes; j++, seed += 1.0)
                    cases_add(c, (double[]){ seed, 2.0 + fmod(seed, 7.0), grids[g][0], grids[g][1],
                                             grids[g][2], sizes[j][0], sizes[j][1], ratios[r],
                                             spreads[i] });
}

static const struct study studies[] = {
    { "whitener, v^T C^-1 v",
      { "seed", "n", "white", "placement", "ratio", "bands", "vector", "missing", "replicates" },
      0,
      { "v^T C^-1 v" },
      64.0,
      whitened_ours,
      whitened_twin,
      vectors,
      whitened_sensitivity },
    { "noise_from_replicates",
      { "seed", "n", "bands", "first_nm", "step_nm", "white", "placement", "ratio", "spread" },
      0,
      { "placement" },
      64.0,
      placement_ours,
      placement_twin,
      placements,
      placement_sensitivity },
};

const struct study_room study_noise = { "noise of replicates (match/noise)", studies,
                                        sizeof studies / sizeof *studies };
