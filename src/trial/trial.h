/* trial.h - every method on the same skins in one run: error, time and memory.
 *
 *   set        spectra made by                     what it tells
 *   own        the method's own model, and noise   what noise does: the truth is known
 *   transport  transport-32, and the same noise    what the model's own error does besides
 * Errors are of all skins, on all cores.  Times are of one thread, one spectrum after the other,
 * half of them of either set, the methods in turns over the rounds (trial/timing.h); of tables
 * and what belongs to them as much stays in the caches as the method leaves there. */
#ifndef SKINSPEC_TRIAL_TRIAL_H
#define SKINSPEC_TRIAL_TRIAL_H

#include "base/progress.h"
#include "trial/errors.h"
#include "trial/forward.h"
#include "trial/method.h"
#include "trial/skins.h"

struct trial_options {
    bool quick; /* the shorter list of methods */
    size_t skins;
    uint64_t seed;
    unsigned threads; /* for what is not timed */
    const struct progress *progress;
    /* What is being done, for a progress bar; NULL: nobody asks. */
    void (*now)(void *context, const char *what);
    void *context;
};

enum {
    TRIAL_SKINS = 2000,
    TRIAL_SKINS_QUICK = 500,
    TRIAL_SKINS_MIN = 20,
    TRIAL_SKINS_MAX = 100000
};

struct trial_result {
    struct trial_method method;
    double us, us_p95; /* a spectrum; of a batch its share */
    size_t timed;      /* spectra that were timed, each as often as there were rounds */
    struct trial_errors own, transport;
    double bytes; /* table and index, or what the fit keeps, as malloc() counts */
};

/* What noise alone allows by one model: trial_limit(). */
struct trial_bound {
    const struct model *model;
    double sd[3];
};

struct trial {
    size_t skins, rounds;
    uint64_t seed;
    size_t results, forwards, bounds;
    struct trial_result result[TRIAL_METHODS_MAX];
    struct trial_forward forward[TRIAL_FORWARD_MAX];
    struct trial_bound bound[MODEL_COUNT];
};

/* Takes memory for all tables at a time: 1.5 GB, or quick 60 MB.  STATUS_NO_MEMORY,
 * STATUS_CANCELLED; *ret is then of no meaning. */
enum status trial_do(const struct trial_options *options, struct trial *ret);

/* The bound by that model; NULL where none was computed. */
const struct trial_bound *trial_bound_of(const struct trial *trial, const struct model *model);

/* The model whose bound the set `transport` is held against. */
extern const char trial_bound_of_transport[];

#endif
