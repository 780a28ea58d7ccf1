/* monte_carlo_walk.c - free paths, scattering, the surfaces, and how a walk ends. */
#include "optics/monte_carlo_walk.h"

#include <math.h>

#include "base/units.h"

#define SMALL 0.1 /* of what entered: below it a walk lives on by chance */
#define SURVIVAL 0.3
#define FIRST_THINNING 4096 /* scatterings until half of the walks end, then four times as many */
#define LAST_SCATTERING (1 << 20) /* then the rest is counted by diffusion */
#define SPLIT_BOUNCES 4           /* on one path, between two surfaces; then chance decides */
#define DRAWS_BITS 23             /* 3 random numbers a scattering at most, 2^20 scatterings */

/* ---- random numbers ----------------------------------------------------------------- */

/* Steele, Lea, Flood, Fast Splittable Pseudorandom Number Generators, 2014: the n-th number is
 * a mixing of n steps of the golden ratio, so any photon's can be had without those before. */
#define GOLDEN 0x9e3779b97f4a7c15u

struct dice {
    uint64_t at;
};

uint64_t monte_carlo_mix(uint64_t z)
{
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

static inline uint64_t draw(struct dice *dice)
{
    dice->at += GOLDEN;
    return monte_carlo_mix(dice->at);
}

/* Above 0, to 1. */
static inline double uniform(struct dice *dice)
{
    return (double)((draw(dice) >> 11) + 1) * 0x1p-53;
}

/* -1 to 1. */
static inline double cosine(struct dice *dice)
{
    return (double)(draw(dice) >> 11) * 0x1p-52 - 1.0;
}

/* Chances of another kind than path and direction do not move the dice on: a neighbouring
 * medium, in which they fall at another time, then has the same walk. */
enum { SURVIVING, THINNING, LEAVING };

static inline double aside(const struct dice *dice, int kind)
{
    uint64_t salt = 0xd1b54a32d192ed03u * (uint64_t)(kind + 1);
    return (double)((monte_carlo_mix(dice->at ^ salt) >> 11) + 1) * 0x1p-53;
}

/* ---- a photon on its way ------------------------------------------------------------ */

struct photon {
    const struct monte_carlo_stack *stack;
    struct dice dice;
    double z, mu, weight;
    bool counting;
    double scattered[MONTE_CARLO_MAX_LAYERS], gone[MONTE_CARLO_MAX_LAYERS];
};

static inline void score(const struct photon *p, double *where, double weight,
                         struct monte_carlo_score *s)
{
    *where += weight;
    if (!p->counting || where == &s->T) /* slopes are those of R */
        return;
    for (size_t k = 0; k < p->stack->n; k++) {
        s->scattered[k] += weight * p->scattered[k];
        s->gone[k] += weight * p->gone[k];
    }
}

/* Path between two depths, shared out to the layers.  An endless layer needs none. */
static inline void go(struct photon *p, double to, double path)
{
    if (p->counting) {
        double low = fmin(p->z, to), high = fmax(p->z, to), begin = 0.0;
        double per_depth = high > low ? path / (high - low) : 0.0;
        for (size_t k = 0; k < p->stack->n && p->stack->end[k] < INFINITY; k++) {
            double end = p->stack->end[k];
            double depth = fmin(high, end) - fmax(low, begin);
            if (depth > 0.0)
                p->gone[k] += depth * per_depth;
            else if (low == high && low >= begin && low < end)
                p->gone[k] += path; /* straight sideways */
            begin = end;
        }
    }
    p->z = to;
}

/* Fresnel from inside, unpolarised; 1 where nothing leaves. */
static inline double inside_reflectance(double eta, double mu)
{
    double mu_out2 = eta * eta * (mu * mu) - (eta * eta - 1.0);
    if (mu_out2 <= 0.0)
        return 1.0;
    double mu_out = sqrt(mu_out2);
    double perpendicular = (eta * mu - mu_out) / (eta * mu + mu_out);
    double parallel = (mu - eta * mu_out) / (mu + eta * mu_out);
    return 0.5 * (perpendicular * perpendicular + parallel * parallel);
}

/* To and fro between two surfaces, at one of which it stands: where and whether it leaves is
 * drawn at once, as a thin slab may be crossed any number of times on one path.  True where it
 * is still inside when the path ends. */
static bool bounce(struct photon *p, double path, double r, struct monte_carlo_score *s)
{
    const struct monte_carlo_stack *stack = p->stack;
    double bottom = stack->end[stack->n - 1], slant = fabs(p->mu), crossing = bottom / slant;
    double crossings = floor(path / crossing);
    double u = aside(&p->dice, LEAVING);
    double reflections = r < 1.0 ? floor(log(u) / log(r)) : INFINITY;
    bool leaves = reflections <= crossings;
    double times = leaves ? reflections : crossings, begin = 0.0;
    for (size_t k = 0; k < stack->n && p->counting; k++) {
        p->gone[k] += times * ((stack->end[k] - begin) / slant);
        begin = stack->end[k];
    }
    bool at_top = (p->z == 0.0) == (fmod(times, 2.0) == 0.0);
    if (leaves) {
        score(p, at_top ? &s->R : &s->T, p->weight, s);
        return false;
    }
    double rest = fmax(0.0, path - crossings * crossing);
    p->mu = at_top ? slant : -slant;
    p->z = at_top ? 0.0 : bottom;
    go(p, at_top ? fmin(rest * slant, bottom) : fmax(0.0, bottom - rest * slant), rest);
    return true;
}

/* One free path, by way of the surfaces it meets.  False where nothing is left inside. */
static inline bool travel(struct photon *p, double path, struct monte_carlo_score *s)
{
    const struct monte_carlo_stack *stack = p->stack;
    double bottom = stack->end[stack->n - 1];
    for (int bounces = 0;; bounces++) {
        double to = p->z + p->mu * path;
        if (to >= 0.0 && to <= bottom) {
            go(p, to, path);
            return true;
        }
        double face = to < 0.0 ? 0.0 : bottom, used = (face - p->z) / p->mu;
        go(p, face, used);
        path = fmax(0.0, path - used);
        double r = inside_reflectance(stack->eta, fabs(p->mu));
        if (bounces == SPLIT_BOUNCES)
            return bounce(p, path, r, s);
        score(p, to < 0.0 ? &s->R : &s->T, p->weight * (1.0 - r), s);
        p->weight *= r;
        p->mu = -p->mu;
        if (p->weight <= 0.0)
            return false;
    }
}

/* Henyey and Greenstein, Astrophys. J. 93, 70 (1941), as Witt, Astrophys. J. Suppl. 35, 1 (1977)
 * samples it. */
static void scatter(struct photon *p, double g)
{
    if (g == 0.0) {
        p->mu = cosine(&p->dice);
        return;
    }
    double root = (1.0 - g * g) / (1.0 + g * cosine(&p->dice));
    double turn = (1.0 + g * g - root * root) / (2.0 * g);
    double across = sqrt(fmax(0.0, (1.0 - turn * turn) * (1.0 - p->mu * p->mu)));
    double mu = p->mu * turn + across * cos(UNITS_PI * cosine(&p->dice));
    p->mu = fmax(-1.0, fmin(1.0, mu));
}

/* Lives on by that chance, with as much more weight. */
static inline bool survives(struct photon *p, int kind, double chance)
{
    if (aside(&p->dice, kind) > chance)
        return false;
    p->weight /= chance;
    return true;
}

/* Diffusion from a depth of an endless layer: e^(-k z)/(1 + 2A u), with like scattering even. */
static double escaping(const struct photon *p, size_t k)
{
    const struct monte_carlo_stack *stack = p->stack;
    double turned = 1.0 - stack->albedo[k] * stack->g[k]; /* σ't/σt */
    double decay = sqrt(3.0 * stack->absorbed[k] * turned);
    return exp(-decay * p->z) / (1.0 + stack->losing_no_more * decay / (3.0 * turned));
}

static inline void walk(struct photon *p, struct monte_carlo_score *s)
{
    const struct monte_carlo_stack *stack = p->stack;
    int thinning = FIRST_THINNING;
    for (int scatterings = 1; travel(p, -log(uniform(&p->dice)), s); scatterings++) {
        size_t k = 0;
        while (k + 1 < stack->n && p->z > stack->end[k])
            k++;
        p->weight *= stack->albedo[k];
        p->scattered[k] += 1.0;
        if (p->weight < SMALL * stack->entering && !survives(p, SURVIVING, SURVIVAL))
            return;
        if (scatterings == thinning) {
            thinning *= 4;
            if (scatterings == LAST_SCATTERING) {
                double out = p->weight * escaping(p, k);
                s->left += out;
                score(p, &s->R, out, s);
                return;
            }
            if (!survives(p, THINNING, 0.5))
                return;
        }
        scatter(p, stack->g[k]);
    }
}

void monte_carlo_walk(const struct monte_carlo_stack *stack, uint64_t key, uint64_t photon,
                      bool counting, struct monte_carlo_score *ret)
{
    struct photon p = { .stack = stack,
                        .dice = { key + (photon << DRAWS_BITS) * GOLDEN },
                        .mu = 1.0,
                        .weight = stack->entering,
                        .counting = counting };
    *ret = (struct monte_carlo_score){ 0 };
    walk(&p, ret);
}
