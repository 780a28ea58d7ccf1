/* transport.c - from coefficients to albedo and optical depth and back again. */
#include "optics/transport.h"

#include <math.h>
#include <stdbool.h>

#include "optics/albedo_chain.h"
#include "optics/dipole.h"
#include "optics/layers.h"

_Static_assert((int)TRANSPORT_STREAMS_MAX == STREAMS_MAX, "one limit");
_Static_assert((int)TRANSPORT_LAYERS_MAX == LAYERS_MAX, "one limit");

static void lay(const struct streams *s, double sigma_a, double sigma_s_prime, double mm,
                struct layer *ret)
{
    double sigma_t = sigma_a + sigma_s_prime;
    ret->tau = sigma_t * mm;
    modes_init(s, sigma_s_prime / sigma_t, sigma_a / sigma_t, &ret->modes);
}

/* ---- epidermis over dermis ------------------------------------------------------- */

/* The slopes of band i. */
static void chain(const struct streams *s, const struct layers *l, const struct medium *m, size_t i,
                  const struct slopes *dR)
{
    const struct layer *epidermis = &l->layer[0], *dermis = &l->layer[1];
    struct medium one = { 1,
                          m->epidermis_mm,
                          m->eta,
                          m->sigma_a_epidermis + i,
                          m->sigma_a_dermis + i,
                          m->sigma_s_prime_epidermis + i,
                          m->sigma_s_prime_dermis + i };
    struct slopes by = { .sigma_a_epidermis = dR->sigma_a_epidermis + i,
                         .sigma_a_dermis = dR->sigma_a_dermis + i,
                         .sigma_s_prime_epidermis = dR->sigma_s_prime_epidermis + i,
                         .sigma_s_prime_dermis = dR->sigma_s_prime_dermis + i,
                         .epidermis_mm = dR->epidermis_mm + i };
    albedo_chain(&one, layers_slope_albedo(s, epidermis), layers_slope_albedo(s, dermis),
                 layers_at_bottom(s, epidermis), &by);
}

static enum status bands(int streams, const struct medium *m, double *R, const struct slopes *dR)
{
    struct streams s;
    struct layers l;
    if (medium_check(m) != STATUS_OK || streams_init(streams, m->eta, &s) != STATUS_OK)
        return STATUS_RANGE;
    l.count = 2;
    for (size_t i = 0; i < m->n; i++) {
        lay(&s, m->sigma_a_epidermis[i], m->sigma_s_prime_epidermis[i], m->epidermis_mm,
            &l.layer[0]);
        lay(&s, m->sigma_a_dermis[i], m->sigma_s_prime_dermis[i], INFINITY, &l.layer[1]);
        layers_solve(&s, &l);
        /* Where nothing absorbs rounding alone may carry it past what entered. */
        R[i] = fmin(layers_reflectance(&s, &l), s.entering);
        if (dR != NULL)
            chain(&s, &l, m, i, dR);
    }
    return STATUS_OK;
}

enum status transport_reflectance(int streams, const struct medium *m, double *R)
{
    return bands(streams, m, R, NULL);
}

enum status transport_slopes(int streams, const struct medium *m, double *R,
                             const struct slopes *dR)
{
    return bands(streams, m, R, dR);
}

#define MODEL(N) \
    enum status transport_##N##_reflectance(const struct medium *m, double *R) \
    { \
        return bands(N, m, R, NULL); \
    } \
    enum status transport_##N##_slopes(const struct medium *m, double *R, const struct slopes *dR) \
    { \
        return bands(N, m, R, dR); \
    }

MODEL(4)
MODEL(8)
MODEL(16)
MODEL(32)

/* ---- any layers ------------------------------------------------------------------ */

static enum status check_layers(const struct transport_layer *layers, size_t count)
{
    if (count < 1 || count > LAYERS_MAX)
        return STATUS_RANGE;
    for (size_t i = 0; i < count; i++) {
        double mm = layers[i].thickness_mm;
        bool endless = i + 1 == count && isinf(mm) && mm > 0.0;
        if (!dipole_accepts(layers[i].sigma_a, layers[i].sigma_s_prime) ||
            !(endless || (mm >= 0.0 && mm <= TISSUE_EPIDERMIS_MM_MAX)))
            return STATUS_RANGE;
    }
    return STATUS_OK;
}

/* Between two surfaces light that is totally reflected is caught until something in the layers ends
 * it.  Where they are thinner than rounding nothing would; 1e-13 changes no flux by more. */
static void keep_some_thickness(struct layers *l)
{
    double tau = 0.0;
    for (int i = 0; i < l->count; i++)
        tau += l->layer[i].tau;
    if (tau < 1e-13)
        l->layer[0].tau += 1e-13;
}

enum status transport_stack(int streams, double eta, const struct transport_layer *layers,
                            size_t count, struct transport_flux *ret)
{
    struct streams s;
    struct layers l;
    if (check_layers(layers, count) != STATUS_OK || streams_init(streams, eta, &s) != STATUS_OK)
        return STATUS_RANGE;
    l.count = (int)count;
    for (size_t i = 0; i < count; i++)
        lay(&s, layers[i].sigma_a, layers[i].sigma_s_prime, layers[i].thickness_mm, &l.layer[i]);
    if (eta > 1.0)
        keep_some_thickness(&l);
    layers_solve(&s, &l);
    ret->R_diffuse = fmin(layers_reflectance(&s, &l), s.entering);
    ret->R_total = ret->R_diffuse + (1.0 - s.entering);
    ret->T_total = layers_transmittance(&s, &l);
    return STATUS_OK;
}
