/* map_fit.h - the pixels of a cube's part, each to its skin: what a map shows.
 *
 * Bands of a map, in this order: for each free parameter of the fit its value ("Cm"), then for each
 * its standard error ("Cm_se"), then "rms" of what the fit leaves of R, and "flags".  Of a pixel
 * that was not fitted all but the flags are NaN. */
#ifndef SKINSPEC_CLI_MAP_FIT_H
#define SKINSPEC_CLI_MAP_FIT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/spectrum.h"
#include "base/status.h"
#include "cube/band_grid.h"
#include "match/refined_match.h"

/* A set of bits, small enough for a float to hold. */
enum map_flag {
    /* Not fitted: */
    MAP_IGNORED = 1 << 0,      /* a used band has the header's data ignore value */
    MAP_NOT_A_NUMBER = 1 << 1, /* or is NaN or infinite */
    MAP_OUT_OF_RANGE = 1 << 2, /* R <= 0, R > MAP_R_MAX, or less than the surface to take off */
    MAP_REFUSED = 1 << 3,      /* the model takes no such skin */
    /* Fitted, but: */
    MAP_NOT_CONVERGED = 1 << 4,
    MAP_RESIDUAL_TOO_LARGE = 1 << 5, /* noise and model do not explain it: perhaps no skin */
    MAP_AT_BOUND = 1 << 6,           /* << parameter (enum skin_parameter) */
};
enum { MAP_MASKED = MAP_IGNORED | MAP_NOT_A_NUMBER | MAP_OUT_OF_RANGE | MAP_REFUSED };
enum { MAP_FLAG_COUNT = 6 + SKIN_PARAMETERS };
#define MAP_R_MAX 1.5

/* "ignored" "not_a_number" ... "Cm_at_bound" ...: of bit 1 << i. */
const char *map_flag_name(size_t i);

struct map_fit_options {
    const struct model *model;
    struct refine_wish wish; /* not REFINE_NOT */
    double epidermis_mm;     /* NAN: 0.08 */
    double scale;            /* what stands for R = 1 */
    bool has_ignore;
    double ignore;
    double surface; /* to take off; NAN: the cube is SCE */
    bool intervals; /* ends of 95 % intervals as well */
};

enum { MAP_BANDS_MAX = 4 * SKIN_PARAMETERS + 2 };

struct map_fit;

/* STATUS_NO_MEMORY; else what refine_many_open() gives, *why likewise. */
enum status map_fit_open(const struct map_fit_options *options, const struct band_grid *grid,
                         struct map_fit **ret, const char **why);
void map_fit_close(struct map_fit *fit); /* takes NULL */

size_t map_fit_bands(const struct map_fit *fit);
/* "Cm", and "melanin fraction of the epidermis". */
const char *map_fit_band_name(const struct map_fit *fit, size_t band);
const char *map_fit_band_meaning(const struct map_fit *fit, size_t band);
/* What was assumed of the noise. */
const struct noise *map_fit_noise(const struct map_fit *fit);

/* Scratch for rows of `pixels` pixels (map_fit_run()), for one thread at a time. */
struct map_scratch;
enum status map_scratch_open(const struct map_fit *fit, size_t pixels, struct map_scratch **ret);
void map_scratch_close(struct map_scratch *scratch); /* takes NULL */

/* Pixels are worked on so many at a time: rows of them have room for whole groups. */
enum { MAP_FIT_GROUP = 16 };

/* n pixels: used[grid's used] and map[bands] are rows of pixels, `row` floats apart, n rounded up
 * to groups or more; what used[] has is not kept.  A pixel's answer depends on nothing but its own
 * values.  Statuses of refine_many_run(). */
enum status map_fit_run(const struct map_fit *fit, struct map_scratch *scratch, float *used,
                        size_t n, size_t row, float *map);

#endif
