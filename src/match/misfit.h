/* misfit.h - chi^2 of a skin against the replicates of one site, as match/least_squares.h
 * asks for it.
 *
 * The free parameters of a fit lie one after the other in a vector; one that each replicate
 * has for itself takes as many places as there are replicates. */
#ifndef SKINSPEC_MATCH_MISFIT_H
#define SKINSPEC_MATCH_MISFIT_H

#include <stdbool.h>
#include <stddef.h>

#include "match/fit.h"
#include "match/least_squares.h"
#include "match/noise.h"
#include "optics/chromophores.h"
#include "optics/quick.h"

/* Rows of bands that begin with a line of the cache are read and written by whole lines. */
enum { MISFIT_ALIGNED = 64 };

struct misfit_scratch {
    _Alignas(MISFIT_ALIGNED) double model[QUICK_SCRATCH(SPECTRUM_MAX_BANDS)];
    _Alignas(MISFIT_ALIGNED) double R[SPECTRUM_MAX_BANDS];
    /* Rows QUICK_STRIDE(bands) apart. */
    _Alignas(MISFIT_ALIGNED) double J[SKIN_PARAMETERS * SPECTRUM_MAX_BANDS];
    double x[LEAST_SQUARES_MAX]; /* where both were last computed for misfit_evaluate() */
    size_t spectra, derivatives; /* computed since misfit_layout(): R, and rows of J */
};

struct misfit {
    const struct fit *fit;
    const struct quick *quick; /* of the fit's model and refractive index */
    const struct chromophores *chromophores;
    size_t groups; /* spectra compared: one, the mean, or each replicate with its own parameters */
    const double *measured[LEAST_SQUARES_MAX]; /* [groups][bands] */
    const double *weight;                      /* [bands] 1, or 0: not measured */
    bool whole;                                /* every weight is 1 */
    struct whitener whitener;
    double scatter;  /* chi^2 of the replicates about their mean, where that is compared */
    unsigned wanted; /* derivatives: a bit for each free parameter */
    size_t rows;     /* of them */
    size_t n;        /* parameters in the vector */
    size_t first[SKIN_PARAMETERS], places[SKIN_PARAMETERS]; /* of each in the vector */
    double lo[LEAST_SQUARES_MAX], hi[LEAST_SQUARES_MAX];
    /* For intervals: the mean of one parameter's places drawn to a value, as by a prior. */
    struct {
        enum skin_parameter parameter;
        double mean, sd; /* sd INFINITY: not drawn */
    } tie;
    struct misfit_scratch *scratch;
};

/* Where each parameter stands in the vector, its bounds, and no tie; fit, groups and scratch are
 * set. STATUS_UNSUPPORTED where there is no room for as many. */
enum status misfit_layout(struct misfit *m);

/* The seven values that group g has at x, and the mean of all groups. */
void misfit_values(const struct misfit *m, const double *x, size_t g,
                   double value[SKIN_PARAMETERS]);
double misfit_mean(const struct misfit *m, const double *x, enum skin_parameter i);

/* The vector for a skin: each place of a parameter has its value. */
void misfit_vector(const struct misfit *m, const double value[SKIN_PARAMETERS], double *x);

/* struct least_squares.evaluate; context is the misfit. */
void misfit_evaluate(void *misfit, const double *x, struct normal *ret);

/* One step from a start that may be far off, to where a fit better begins.  The logarithm of R
 * against the root of an amount is nearly straight, so it goes further than a step by R against
 * the amount itself would; where it ends chi^2 is not looked at.  x stays where the model takes
 * no such skin. */
void misfit_approach(const struct misfit *m, double *x);

/* The problem of finding its minimum. */
struct least_squares misfit_problem(struct misfit *m, double tolerance, size_t steps);

/* The reflectance at x into fitted[chromophores->n] by R and its derivatives where
 * misfit_evaluate() was last, which is good to the square of the way from there; a band that
 * was not measured is NAN.  False, and nothing is set, where several groups are compared. */
bool misfit_follow(const struct misfit *m, const double *x, double *fitted);

/* Chi^2 at x alone, and the mean of the groups' reflectances into fitted[chromophores->n].
 * INFINITY where the model takes no such skin. */
double misfit_chi_square(const struct misfit *m, const double *x, double *fitted);

#endif
