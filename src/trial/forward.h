/* forward.h - the models themselves: how long a spectrum takes, and how far it is from
 * transport-32. */
#ifndef SKINSPEC_TRIAL_FORWARD_H
#define SKINSPEC_TRIAL_FORWARD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "optics/quick.h"
#include "trial/skins.h"
#include "trial/timing.h"

enum trial_forward_kind {
    TRIAL_FORWARD_MODEL, /* model_reflectance(); paper: its R, G, B */
    /* optics/quick.h, R alone, by the vectors named; transport eight bands side by side */
    TRIAL_FORWARD_QUICK,
    TRIAL_FORWARD_SLOPES,      /* model_slopes() */
    TRIAL_FORWARD_QUICK_SLOPES /* optics/quick.h, R and what a fit of Cm, Bm, Ch wants */
};

struct trial_forward {
    const struct model *model;
    enum trial_forward_kind kind;
    enum quick_vectors vectors;
    uint64_t photons; /* of monte-carlo, each band; else 0 */
    int streams;      /* of transport, where no model has them; else 0 */
    double us, us_p95;
    size_t timed;
    /* Against transport-32, transport-32 itself against 64 streams; NAN for the paper: root mean
     * square and largest over skins and bands, mean dE00 under D65, 10 degrees. */
    double rms_R, worst_R, dE00;
    size_t compared; /* skins */
    bool front;
};

enum { TRIAL_FORWARD_NAME_SIZE = 64, TRIAL_FORWARD_MAX = 40 };
const char *trial_forward_name(const struct trial_forward *f, char text[TRIAL_FORWARD_NAME_SIZE]);

/* What this processor can do of them; their number. */
size_t trial_forward_list(bool quick, struct trial_forward ret[TRIAL_FORWARD_MAX]);

/* One of them made ready to be timed. */
struct trial_forward_ready {
    struct trial_forward forward;
    const struct trial_skins *skins;
    struct chromophores chromophores;
    struct quick quick; /* of models of streams alone */
    size_t items;
};
enum status trial_forward_ready_init(const struct trial_forward *forward,
                                     const struct trial_skins *skins,
                                     struct trial_forward_ready *ret);

/* The spectrum of skin `item` into R, QUICK_STRIDE(TRIAL_BANDS) doubles; 3 of the paper's. */
enum status trial_forward_run(const struct trial_forward_ready *ready, size_t item, double *R);

/* The same, forgotten: a trial_work of a struct trial_forward_ready. */
enum status trial_forward_work(const void *ready, size_t item);

/* rms_R, worst_R, dE00 and compared of *f; truth is by transport-32. */
enum status trial_forward_errors(const struct trial_forward_ready *ready,
                                 const struct trial_spectra *truth, unsigned threads,
                                 struct trial_forward *f);

#endif
