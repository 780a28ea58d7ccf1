/* ocean_detector.h - when the detector exposes, and what it has counted then.
 *
 * A USB2000+ takes up to two spectra ahead after one was fetched (model->kept); they wait, and
 * answer the next requests.  A USB4000 idles in cycles, and the one that runs when it is asked
 * is the one that it gives.  Both take nothing new while a spectrum waits to be fetched.  Thus
 * each spectrum has the light of the time it was exposed in, shared out by time where
 * something changed meanwhile. */
#ifndef SKINSPEC_TESTS_SIM_OCEAN_DETECTOR_H
#define SKINSPEC_TESTS_SIM_OCEAN_DETECTOR_H

#include "tests/sim/ocean_model.h"
#include "tests/sim/ocean_scene.h"

enum { OCEAN_KEPT = 2 };

struct ocean_exposure {
    int64_t start_us, end_us, lit_until_us;
    uint32_t integration_us;
    double light[OCEAN_MAX_PIXELS]; /* counts of 65536 */
};

/* What it is made with. */
struct ocean_detector_options {
    double delays, noise, drift, temperature;
    uint64_t seed;
    unsigned level;  /* of saturation; 0: full scale */
    bool always_lit; /* the lamp has no line */
};

struct ocean_detector {
    const struct ocean_model *model;
    struct ocean_detector_options options;
    double linearity[OCEAN_LINEARITY];
    double nm[OCEAN_MAX_PIXELS];
    uint64_t random;

    struct ocean_scene scene;
    double pixel_light[OCEAN_MAX_PIXELS]; /* of the scene, in a microsecond */
    bool lamp_line, lamp_broken;
    int64_t lit_since_us; /* INT64_MAX: not yet */

    uint32_t integration_us;
    bool powered;
    unsigned trigger;

    unsigned asked; /* requests that wait */
    bool held;      /* a spectrum waits to be fetched */
    bool ahead;     /* one was fetched since it was initialised */
    bool running;
    struct ocean_exposure now;
    struct ocean_exposure kept[OCEAN_KEPT];
    size_t n_kept;

    unsigned taken, unasked; /* since it was made or reset */
};

void ocean_detector_init(struct ocean_detector *detector, const struct ocean_model *model,
                         const struct ocean_detector_options *options,
                         const struct ocean_scene *scene);

/* As after power on; the scene stays. */
void ocean_detector_reset(struct ocean_detector *detector);

/* Command 01: nothing runs, nothing is asked for. */
void ocean_detector_stop(struct ocean_detector *detector);

/* Let time pass, up to the next spectrum that answers a request: true, and it is *ret, ready at
 * *at_us, and held until ocean_detector_fetched().  To be called until it is false, before
 * anything is changed. */
bool ocean_detector_pass(struct ocean_detector *detector, int64_t now_us,
                         struct ocean_exposure *ret, int64_t *at_us);
void ocean_detector_fetched(struct ocean_detector *detector);

/* After a change of the scene. */
void ocean_detector_look(struct ocean_detector *detector);

/* Counts of pixel i as they are sent, before the XOR; throws the dice of the noise. */
unsigned ocean_detector_count(struct ocean_detector *detector,
                              const struct ocean_exposure *exposure, size_t i);

/* Light of pixel i in counts of the model's scale, by the scene that is. */
double ocean_detector_light(const struct ocean_detector *detector, size_t i,
                            uint32_t integration_us);

#endif
