/* transport.c - one wavelength of a two-layer skin with 8 streams: the model transport-8 beside its
 * plain twin, adding and doubling (tests/support/doubling.h); and both by lanes of bands
 * (optics/transport_lanes.h), R alone, with slopes, and of layers that are there already.
 *
 *     transport [SKINS] [ROUNDS]
 *
 * Skins of 31 bands, 400..700 nm; rounds by turns on one core, medians.  The twin's thinnest layer
 * is 1/8 of the grazing cosine, where it is about 1e-3 of R off: what a user would choose who wants
 * speed. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "optics/chromophores.h"
#include "optics/transport.h"
#include "optics/transport_lanes.h"
#include "tests/bench/rounds.h"
#include "tests/support/dice.h"
#include "tests/support/doubling.h"

enum { BANDS = 31, MOST_ROUNDS = 101 };
#define THINNESS 1.0
#define BAR 4.0

static struct tissue skin(struct dice *dice)
{
    return tissue_of(exp(dice_between(dice, log(0.005), log(0.2))), dice_between(dice, 0.0, 1.0),
                     exp(dice_between(dice, log(0.001), log(0.1))));
}

static double by_model(const struct medium *m, double *R)
{
    double began = now_us();
    if (transport_8_reflectance(m, R) != STATUS_OK)
        exit(EXIT_FAILURE);
    return now_us() - began;
}

static double by_twin(const struct medium *m, double *R)
{
    double began = now_us();
    struct streams s;
    if (streams_init(8, m->eta, &s) != STATUS_OK)
        exit(EXIT_FAILURE);
    for (size_t i = 0; i < m->n; i++) {
        double sa1 = m->sigma_a_epidermis[i], ss1 = m->sigma_s_prime_epidermis[i];
        double sa2 = m->sigma_a_dermis[i], ss2 = m->sigma_s_prime_dermis[i];
        R[i] = doubling_two_layers(&s, ss1 / (sa1 + ss1), (sa1 + ss1) * m->epidermis_mm,
                                   ss2 / (sa2 + ss2), THINNESS);
    }
    return now_us() - began;
}

/* ---- by lanes ---------------------------------------------------------------------- */

enum way { PLAIN_R, LANES_R, PLAIN_SLOPES, LANES_SLOPES, LANES_JOIN, WAYS };
static const char *const way_name[WAYS] = { "R", "R by lanes", "R and slopes",
                                            "R and slopes by lanes", "R of layers made before" };

static double by_way(enum way way, const struct transport_lanes *t, const struct medium *m)
{
    double R[BANDS], rows[SLOPES_SCRATCH(BANDS)], eight[VECTORS_LANES];
    static double top[TRANSPORT_LANES_EPIDERMIS(8)], under[TRANSPORT_LANES_DERMIS(8)];
    struct slopes dR = slopes_in(rows, BANDS);
    enum status s = STATUS_OK;
    if (way == LANES_JOIN) {
        (void)transport_lanes_epidermis(t, m->sigma_a_epidermis, m->sigma_s_prime_epidermis,
                                        m->epidermis_mm, top);
        (void)transport_lanes_dermis(t, m->sigma_a_dermis, m->sigma_s_prime_dermis, under);
    }
    double began = now_us();
    if (way == PLAIN_R)
        s = transport_reflectance(8, m, R);
    else if (way == LANES_R)
        s = transport_lanes_reflectance(t, m, R);
    else if (way == PLAIN_SLOPES)
        s = transport_slopes(8, m, R, &dR);
    else if (way == LANES_SLOPES)
        s = transport_lanes_slopes(t, m, R, &dR);
    else
        for (size_t at = 0; at < BANDS; at += VECTORS_LANES)
            transport_lanes_join(t, top, under, eight);
    if (s != STATUS_OK)
        exit(EXIT_FAILURE);
    return now_us() - began;
}

static void show_lanes(size_t skins, size_t rounds, const struct chromophores *c)
{
    static double us[WAYS][MOST_ROUNDS];
    double scratch[MEDIUM_SCRATCH(BANDS)];
    struct transport_lanes t;
    for (size_t r = 0; r < rounds; r++) {
        struct dice dice = { 8 };
        for (size_t i = 0; i < skins; i++) {
            struct tissue one = skin(&dice);
            struct medium m;
            if (tissue_medium(&one, c, scratch, &m) != STATUS_OK ||
                transport_lanes_init(8, m.eta, &t) != STATUS_OK)
                exit(EXIT_FAILURE);
            for (enum way way = PLAIN_R; way < WAYS; way++)
                us[way][r] += by_way(way, &t, &m) / (double)(skins * BANDS);
        }
    }
    for (enum way way = PLAIN_R; way < WAYS; way++)
        printf("  %-24s %.3f us a wavelength\n", way_name[way], median(us[way], rounds));
}

int main(int argc, char **argv)
{
    size_t skins = argc > 1 ? strtoul(argv[1], NULL, 10) : 100;
    size_t rounds = argc > 2 ? strtoul(argv[2], NULL, 10) : 11;
    static struct chromophores c;
    static double model_us[MOST_ROUNDS], twin_us[MOST_ROUNDS];
    double worst = 0.0, scratch[MEDIUM_SCRATCH(BANDS)], R[BANDS], S[BANDS];
    if (skins < 1 || rounds < 1 || rounds > MOST_ROUNDS ||
        chromophores_init(400.0, 10.0, BANDS, &c) != STATUS_OK)
        return EXIT_FAILURE;
    for (size_t r = 0; r < rounds; r++) {
        struct dice dice = { 8 };
        for (size_t i = 0; i < skins; i++) {
            struct tissue t = skin(&dice);
            struct medium m;
            if (tissue_medium(&t, &c, scratch, &m) != STATUS_OK)
                return EXIT_FAILURE;
            model_us[r] += by_model(&m, R);
            twin_us[r] += by_twin(&m, S);
            for (size_t b = 0; b < BANDS; b++)
                worst = fmax(worst, fabs(R[b] - S[b]));
        }
        model_us[r] /= (double)(skins * BANDS);
        twin_us[r] /= (double)(skins * BANDS);
    }
    double model = median(model_us, rounds), twin = median(twin_us, rounds);
    printf(
        "  transport-8 %.2f us a wavelength, its plain twin %.2f us: %.1f times (bar: %.0f) %s\n",
        model, twin, twin / model, BAR, twin / model >= BAR ? "met" : "MISSED");
    printf("  at most %.1e of R apart\n", worst);
    show_lanes(skins, rounds, &c);
    return worst < 5e-3 ? EXIT_SUCCESS : EXIT_FAILURE;
}
