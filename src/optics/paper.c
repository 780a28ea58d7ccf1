/* paper.c - coefficients as colours, then Eq. 9 per channel. */
#include "optics/paper.h"

#include <math.h>

#include "optics/dipole.h"

/* Each chromophore's coefficients over 380..740 nm by 10 (mm^-1; blood is
 * epsilon/1000) as a linear colour: s M diag(Xw, 1, Zw) XYZ with equal-energy
 * XYZ divided by the sum of ybar, s = 1.01468, Xw = 0.950844, Zw = 1.08845, M the
 * sRGB matrix with entries as 3.2410 -1.5374 -0.4986.  Made by
 * tests/reference/paper_constants.py from CIE 1931 functions, unrounded. */
static const double eumelanin[3] = { 24.23577298476, 51.09420167173, 103.92814137612 };
static const double pheomelanin[3] = { 8.53105606770, 28.68573967648, 79.76086457641 };
static const double base[3] = { 0.02242746617, 0.04626873616, 0.13536756601 };
static const double oxy[3] = { 7.91817658989, 26.97342444302, 129.60233280121 };
static const double deoxy[3] = { 21.48488343511, 20.62771392261, 222.96143095639 };
static const double scattering[3] = { 4.55420533884, 6.22089362088, 9.75595232572 };

/* The transfer curve with the paper's constants; its argument is in percent. */
static double coded(double percent)
{
    double x = percent / 100.0;
    return x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1.0 / 2.4) - 0.055;
}

enum status paper_coefficients(const struct tissue *t, double sigma_a[3], double sigma_s_prime[3])
{
    if (tissue_check(t) != STATUS_OK)
        return STATUS_RANGE;
    for (int i = 0; i < 3; i++) {
        double melanin = t->Bm * eumelanin[i] + (1.0 - t->Bm) * pheomelanin[i];
        double blood = t->gamma * oxy[i] + (1.0 - t->gamma) * deoxy[i];
        /* Both layers summed, so the base comes in twice. */
        double sum = t->Cm * melanin + t->Ch * blood + (2.0 - t->Cm - t->Ch) * base[i];
        sigma_a[i] = coded(sum);
        sigma_s_prime[i] = coded(scattering[i]);
    }
    return STATUS_OK;
}

enum status paper_rgb(const struct tissue *t, double rgb[3])
{
    double sigma_a[3], sigma_s_prime[3];
    struct dipole d[3];
    if (paper_coefficients(t, sigma_a, sigma_s_prime) != STATUS_OK)
        return STATUS_RANGE;
    for (int i = 0; i < 3; i++)
        if (dipole_init(sigma_a[i], sigma_s_prime[i], t->eta, &d[i]) != STATUS_OK)
            return STATUS_RANGE;
    for (int i = 0; i < 3; i++)
        rgb[i] = dipole_total(&d[i]);
    return STATUS_OK;
}
