/* match_fits.h - a fit for each grid of bands that comes along, made once and used by all threads.
 */
#ifndef SKINSPEC_CLI_MATCH_FITS_H
#define SKINSPEC_CLI_MATCH_FITS_H

#include "match/refined_match.h"

enum { MATCH_FITS_MAX = 16 };

struct match_fits;

/* NULL: no memory.  Table and wish outlive it. */
struct match_fits *match_fits_open(const struct refine_wish *wish, const struct table *table);
void match_fits_close(struct match_fits *fits); /* takes NULL */

/* The fit for the bands of a spectrum.  Statuses of refine_wish_fit() and refiner_open(), *why
 * likewise; STATUS_UNSUPPORTED for a grid too many. */
enum status match_fits_find(struct match_fits *fits, const struct spectrum *bands,
                            const struct refiner **ret, const char **why);

#endif
