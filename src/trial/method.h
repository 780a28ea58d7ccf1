/* method.h - the ways from a spectrum to a skin that are tried against each other, and one of
 * them carried out. */
#ifndef SKINSPEC_TRIAL_METHOD_H
#define SKINSPEC_TRIAL_METHOD_H

#include <stdbool.h>
#include <stddef.h>

#include "base/spectrum.h"
#include "base/status.h"
#include "match/match.h"
#include "match/refine.h"
#include "match/refine_many.h"
#include "match/refined_match.h"
#include "match/table.h"

enum trial_kernel {
    TRIAL_QUICK, /* as the program does it: optics/quick.h with the processor's vectors */
    TRIAL_PLAIN, /* the model's own formulas in plain double precision */
};

struct trial_method {
    const struct model *model;
    size_t rows;             /* of its table; 0: none, the closed form */
    size_t size;             /* about as many: the table is of trial_grid(size) */
    enum match_by by;        /* MATCH_SPECTRUM where rows is 0 */
    enum refine_kind refine; /* REFINE_NOT: the row, or the closed form, is the answer */
    bool interval;           /* and a second solution: what a scene that wants them gets */
    bool batch;              /* many spectra at a time: match/refine_many.h */
    enum trial_kernel kernel;
};

/* "two-layer nearest of 50400 by spectrum", "two-layer fit from the closed form, intervals". */
enum { TRIAL_NAME_SIZE = 96 };
const char *trial_method_name(const struct trial_method *m, char text[TRIAL_NAME_SIZE]);

/* The methods of a run: n of them into methods[], at most TRIAL_METHODS_MAX.  quick: tables of
 * 10 and 50 thousand rows, and what takes milliseconds only once. */
enum { TRIAL_METHODS_MAX = 128, TRIAL_SIZES_MAX = 8 };
size_t trial_methods(bool quick, struct trial_method methods[TRIAL_METHODS_MAX]);

/* A grid of about that many rows: the default one, every axis longer or shorter by as much; the
 * default itself counts as 50 000. */
struct grid trial_grid(size_t size);

/* One method made ready.  It is only read when run: many threads may. */
struct trial_ready {
    struct trial_method method;
    struct model plain; /* the model without quick formulas, for TRIAL_PLAIN */
    const struct table *table;
    struct matcher matcher;
    struct refiner *refiner;
    struct refine_many *many; /* for a batch, beside the refiner */
    struct fit fit;
    struct noise noise;
    struct trial_closed_form *closed_form;
    double bytes; /* that making it ready took */
};

/* table: of the method's model and rows, NULL where it takes none; it and *ret must stay where
 * they are.  Statuses of matcher_open(), refiner_open(). */
enum status trial_ready_init(const struct trial_method *method, const struct table *table,
                             struct trial_ready *ret);
void trial_ready_done(struct trial_ready *ready); /* takes a zeroed one */

struct trial_answer {
    struct tissue skin; /* what it says */
    bool has_row;       /* it is a row: */
    size_t row;         /* from 0 */
    size_t evaluations; /* spectra of the model, whatever for; 0 where nothing was fitted */
};

/* Statuses of matcher_match() and refiner_run(). */
enum status trial_run(const struct trial_ready *ready, const struct spectrum *measured,
                      struct trial_answer *ret);

/* A batch: rows of TRIAL_BANDS values, n of them; values, standard errors, chi^2 and flags are
 * computed, and forgotten.  STATUS_NO_MEMORY; statuses of refine_many_run(). */
enum status trial_run_batch(const struct trial_ready *ready, const double *rows, size_t n);

/* Bytes that the process has from malloc() now. */
double trial_bytes_in_use(void);

#endif
