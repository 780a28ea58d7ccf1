/* errors.h - how far a method's answers are from the skins that were there. */
#ifndef SKINSPEC_TRIAL_ERRORS_H
#define SKINSPEC_TRIAL_ERRORS_H

#include "base/status.h"
#include "trial/method.h"
#include "trial/skins.h"

struct trial_errors {
    double rmse[3]; /* of Cm, Bm, Ch; NAN where it was held, or nothing was measured */
    /* The skin found - the skin that was there, spectra without noise by the set's model: mean
     * dE00, and mean over skins of rms over bands; NAN for a model without spectra. */
    double dE00, rms_R;
    /* The largest of rmse[] over what noise alone allows, trial_limit(), to three digits; NAN where
     * unknown. */
    double times;
    bool front; /* nothing tried is both quicker and better by `times` */
};

/* Nothing measured. */
struct trial_errors trial_errors_none(void);

/* Told now and then that so much of the work is done; anything but STATUS_OK ends it. */
struct trial_watch {
    enum status (*done)(void *context, double share);
    void *context;
};

/* Over all skins of a set, on `threads` threads; the same for any number of them.  Statuses of
 * trial_run(), STATUS_NO_MEMORY; that of the watch. */
enum status trial_errors_of(const struct trial_ready *ready, const struct trial_skins *skins,
                            const struct trial_spectra *set, unsigned threads,
                            const struct trial_watch *watch, struct trial_errors *ret);

/* The Cramer-Rao bound of Cm, Bm, Ch by a model with derivatives: root mean square over the
 * skins of the standard errors at the truth, TRIAL_NOISE; no estimate that is right on average
 * does better, but bounds on the parameters may.  Statuses of refiner_open() and _run(). */
enum status trial_limit(const struct trial_skins *skins, const struct trial_spectra *set,
                        double ret[3]);

/* times, from the rest and a limit (NAN: unknown), to three digits: what differs by less is as
 * good. */
double trial_times(const double rmse[3], const double limit[3]);

#endif
