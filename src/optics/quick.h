/* quick.h - R and its derivatives by a skin's parameters over the bands of one spectrum, as fast
 * as the machine's vectors allow: for inversion, which wants them some thousand times a second.
 *
 * The same models as optics/half_space.h, optics/two_layer.h and optics/opaque.h by formulas
 * without branches. In the range below R and the derivatives are within 1e-12 of the plain ones, on
 * human skin 1e-14 and 5e-13 (that by the thickness, which passes through 0, of R over the
 * thickness). A spectrum with a band beyond it, and a model without quick formulas, takes
 * model_slopes(). Products and sums are fused (optics/quick_exp.h) where the processor can, as all
 * with AVX2 do; the same bits with any of their vectors, and within 2e-13 of them without:
 * docs/decisions/0012 and 0015.
 *
 *   two-layer    k1 d from 1/128, k1/sigma_t1' from 1/64, sigma_t1' d up to 150,
 *                sigma_s1'/sigma_t1' from 1/64 where scattering_a or _b is wanted
 *   half-space   sigma_a/sigma_t' from 1e-10, eta up to 3.7
 *   epidermis    (optics/opaque.h) k1/sigma_t1' from 1/64
 *   transport-N  as optics/transport_lanes.h has it: bands beyond its range alone are the plain
 *                model's; slopes are within what it states */
#ifndef SKINSPEC_OPTICS_QUICK_H
#define SKINSPEC_OPTICS_QUICK_H

#include <stdbool.h>
#include <stddef.h>

#include "base/status.h"
#include "optics/model.h"
#include "optics/transport_lanes.h"

/* A row of n bands takes so many doubles: whole vectors.  What is past n is 0. */
#define QUICK_STRIDE(n) (((n) + CHROMOPHORES_LANES - 1) / CHROMOPHORES_LANES * CHROMOPHORES_LANES)

/* Doubles of scratch for n bands. */
#define QUICK_SCRATCH(n) (9 * QUICK_STRIDE(n) + MODEL_SLOPES_SCRATCH(n) + TISSUE_PARAMETERS * (n))

/* Bit of a parameter in a set of wanted ones. */
#define QUICK_WANT(parameter) (1u << (parameter))
#define QUICK_WANT_ALL ((1u << TISSUE_PARAMETERS) - 1u)

enum quick_vectors { QUICK_PLAIN, QUICK_AVX2, QUICK_AVX512, QUICK_VECTORS };
bool quick_has(enum quick_vectors v);

/* What skins of one refractive index have in common, made once for many of them. */
struct quick {
    const struct model *model;
    const struct chromophores *c;
    double eta;
    bool formulas;      /* there are quick ones; else all is model_slopes()'s */
    double A, entering; /* of the surface: optics/dipole.h; the share that is not mirrored */
    enum quick_vectors vectors; /* the last that the processor has */
    bool by_lanes;              /* all is optics/transport_lanes.h's */
    struct transport_lanes lanes;
};

/* The model and the chromophores are used as long as *ret is. */
void quick_init(const struct model *model, const struct chromophores *c, double eta,
                struct quick *ret);

/* R[QUICK_STRIDE(c->n)] and, for every parameter p in wanted, J[p * QUICK_STRIDE(c->n) + band];
 * other rows are untouched; wanted may be 0, J then NULL.  t->eta is q's.  Statuses are
 * model_slopes()'s. */
enum status quick_skin(const struct quick *q, const struct tissue *t, unsigned wanted,
                       double *scratch, double *R, double *J);

/* Both in one, for one skin. */
enum status quick_slopes(const struct model *model, const struct tissue *t,
                         const struct chromophores *c, unsigned wanted, double *scratch, double *R,
                         double *J);

/* The same by given vectors, for tests and measurements. */
enum status quick_slopes_by(enum quick_vectors v, const struct model *model, const struct tissue *t,
                            const struct chromophores *c, unsigned wanted, double *scratch,
                            double *R, double *J);

#endif
