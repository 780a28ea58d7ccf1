/* refined_match.h - the nearest row, and from there the skin between the rows: what is asked,
 * and the answer to it.
 *
 * A wish names the fit, what is known of the noise and what is to be held; the table brings the
 * model, its light, and the rows to begin with.  The same for the command line, for the
 * station, and when a record is computed again. */
#ifndef SKINSPEC_MATCH_REFINED_MATCH_H
#define SKINSPEC_MATCH_REFINED_MATCH_H

#include <stdbool.h>
#include <stddef.h>

#include "base/spectrum.h"
#include "base/status.h"
#include "match/match.h"
#include "match/refine.h"

enum refine_kind {
    REFINE_NOT,   /* the nearest row is the answer */
    REFINE_THREE, /* Cm, Bm, Ch; the rest as the table has it: fit_three() */
    REFINE_SKIN,  /* measured skin: match/skin_fit.h */
};
enum { REFINE_KINDS = 3 };

/* "three" and "skin"; "" for REFINE_NOT.  Any other text is STATUS_NOT_FOUND. */
const char *refine_kind_name(enum refine_kind kind);
enum status refine_kind_parse(const char *text, enum refine_kind *ret);

struct refine_wish {
    enum refine_kind kind;
    double white; /* standard deviation of each band by itself; NAN: that of an instrument */
    double
        placement; /* size of what bands share; NAN: 0 where white is given, else what the
                    * replicates show, shrunk to the population's.  The skin fit lets the skin
                    * itself differ from placement to placement, unless one of the two is given */
    double fix[SKIN_PARAMETERS]; /* held at; NAN: as the fit has it */
};

/* REFINE_NOT, and all else NAN. */
struct refine_wish refine_wish_none(void);

/* The fit for a table's recipe, under the table's light.  STATUS_RANGE for a fixed value outside
 * the bounds of its parameter, or of a parameter that the fit does not have; else as
 * fit_check().  *why (may be NULL) then says what to do, as in fit_check(). */
enum status refine_wish_fit(const struct refine_wish *wish, const struct recipe *recipe,
                            struct fit *ret, const char **why);

/* Where the size of the placement noise comes from. */
enum noise_source { NOISE_STATED, NOISE_POPULATION, NOISE_REPLICATES };
enum { NOISE_SOURCES = 3 };
const char *noise_source_name(enum noise_source source); /* "stated" "population" "replicates" */

/* Statuses of match/noise.h. */
enum status refine_wish_noise(const struct refine_wish *wish, const struct spectrum *replicate,
                              size_t n, struct noise *ret, enum noise_source *source);

/* The search gives this many rows to begin with, whatever else is asked for. */
enum { REFINE_STARTS = 3 };

struct refined_match {
    struct match nearest;
    struct refine_wish wish;
    struct refined refined;
    enum noise_source source;
    double Lab[3]; /* of the fitted skin on the measured bands, table's light; NAN without colour */
};

/* The rows found as starts of a fit: their Cm, Bm, Ch, all else as the fit has it. */
void refined_match_starts(const struct table *table, const struct nearest_hit *hits, size_t n,
                          const struct fit *fit, double (*starts)[SKIN_PARAMETERS]);

/* L*a*b* of the fitted skin on the measured bands under the table's light; NAN where they give
 * none. */
void refined_match_colour(const struct table *table, const struct spectrum *mean,
                          const struct refined *refined, double Lab[3]);

/* Match `mean` and fit the replicates (n of them; the mean is theirs) from the rows found on.
 * hits[] has room for max(k, REFINE_STARTS).  The refiner was opened for refine_wish_fit() and
 * the bands of the spectra.  STATUS_UNSUPPORTED, before anything is matched, for a refiner of
 * another model than the table's; else statuses of matcher_match() and of refiner_run(), *why
 * likewise (NULL where the match was refused).  *ret is then untouched. */
enum status refined_match(const struct matcher *matcher, const struct refiner *refiner,
                          const struct refine_wish *wish, const struct spectrum *replicate,
                          size_t n, const struct spectrum *mean, size_t k, struct nearest_hit *hits,
                          struct refined_match *ret, const char **why);

#endif
