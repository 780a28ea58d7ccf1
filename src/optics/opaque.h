/* opaque.h - an epidermis that lets next to nothing through: the two-layer model without its
 * dermis, and a proven bound on what that leaves out.
 *
 * The reflectance of optics/two_layer.c for x = sigma_t1' d, y = k1 d, E = e^-(x+y), g = e^-2y,
 * w = sigma_s'/(sigma_t' + k) and u = k/(3 sigma_t') of either layer, rho = (u1 - u2)/(u1 + u2),
 * and b as there (0 <= b <= e^-y e^-min(x,y)) is, numerator and denominator over u1 + u2,
 *
 *        R         w1 (1 - E) + rho sigma_s1' d b + (1 + rho) w2 E
 *     ------  =  --------------------------------------------------
 *     1 - Rs        (1 + 2A u1) + rho g (1 - 2A u1)
 *
 * for 6 x u1 = 2y, 2y c = a - b, 2y p = 1 - g and sigma_s1' d a = w1 (1 - E).  An epidermis without
 * an end (rho = 0, w2 = w1) has R1/(1 - Rs) = w1/S, S = 1 + 2A u1.  Their difference,
 *
 *     S [rho sigma_s1' d b + (1 + rho) w2 E - w1 E] - rho w1 g (1 - 2A u1)
 *     -------------------------------------------------------------------- ,
 *                     S [S + rho g (1 - 2A u1)]
 *
 * is bounded whatever the dermis, as |rho| <= 1, 0 <= w1, w2 <= 1 and |1 - 2A u1| <= S:
 *
 *     |R - R1| <= (1 - Rs) [sigma_s1' d b + 2 E + w1 g] / (S (1 - g)).
 *
 * It falls as sigma_a of the epidermis rises: x and y rise, so E, g and b fall, w1 falls, and S and
 * 1 - g rise.  So the least absorbing skin of a range has the largest bound. */
#ifndef SKINSPEC_OPTICS_OPAQUE_H
#define SKINSPEC_OPTICS_OPAQUE_H

#include "base/status.h"
#include "optics/model.h"

/* R1 and its derivatives, those by the dermis and by the thickness 0; like a model of
 * optics/model.h, but in no list: it holds where the bound below is small.  Its slope by the
 * epidermis's sigma_a is -INFINITY where that absorbs nothing. */
extern const struct model opaque_model;
enum status opaque_reflectance(const struct medium *m, double *R);
enum status opaque_slopes(const struct medium *m, double *R, const struct slopes *dR);

/* The bound, a band: most[m->n], INFINITY where nothing absorbs.  The dermis is not looked at.
 * STATUS_RANGE as two_layer_reflectance(), most untouched. */
enum status opaque_bound(const struct medium *m, double *most);

/* Root mean square over bands of the largest bound that a skin with at least lightest->Cm, and Bm
 * from lightest->Bm to Bm_hi, can have: melanin takes the lesser of both ends.  All else as in
 * *lightest.  STATUS_RANGE as tissue_check(), chromophores_init() and above. */
enum status opaque_most(const struct tissue *lightest, double Bm_hi, double first_nm,
                        double step_nm, size_t n, double *ret);

#endif
