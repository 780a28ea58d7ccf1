/* substitution.c - a least-squares line, and one division a band. */
#include "drivers/ocean_ooi/substitution.h"

#include <math.h>
#include <stdbool.h>

/* Wavelength of a band as -1 .. 1. */
static double place(size_t band)
{
    return ((double)band - (OOI_BANDS - 1) / 2.0) / ((OOI_BANDS - 1) / 2.0);
}

void ooi_substitution_correct(const struct ooi_substitution *s, const double rstd[OOI_BANDS],
                              double R[OOI_BANDS])
{
    for (size_t b = 0; b < OOI_BANDS; b++)
        R[b] = R[b] / (1.0 - s->k[b] * rstd[b] + s->k[b] * R[b]);
}

static double residual(const struct ooi_substitution *s, size_t n, double (*measured)[OOI_BANDS],
                       double (*certified)[OOI_BANDS], const double rstd[OOI_BANDS])
{
    double sum = 0.0;
    for (size_t i = 0; i < n; i++) {
        double R[OOI_BANDS];
        for (size_t b = 0; b < OOI_BANDS; b++)
            R[b] = measured[i][b];
        ooi_substitution_correct(s, rstd, R);
        for (size_t b = 0; b < OOI_BANDS; b++)
            sum += (R[b] - certified[i][b]) * (R[b] - certified[i][b]);
    }
    return sqrt(sum / (double)(n * OOI_BANDS));
}

enum status ooi_substitution_fit(size_t n, double (*measured)[OOI_BANDS],
                                 double (*certified)[OOI_BANDS], const double rstd[OOI_BANDS],
                                 struct ooi_substitution *ret)
{
    /* Normal equations of y = (k0 + k1 place) x. */
    double a00 = 0.0, a01 = 0.0, a11 = 0.0, b0 = 0.0, b1 = 0.0;
    enum status s = STATUS_OK;
    for (size_t i = 0; i < n; i++)
        for (size_t b = 0; b < OOI_BANDS; b++) {
            double u = place(b), x = certified[i][b] * (measured[i][b] - rstd[b]);
            double y = measured[i][b] - certified[i][b];
            a00 += x * x;
            a01 += x * x * u;
            a11 += x * x * u * u;
            b0 += x * y;
            b1 += x * y * u;
        }
    double determinant = a00 * a11 - a01 * a01;
    bool determined = determinant > 1e-6; /* a grey 0.1 below the tile at 0.3 gives 1e-3 */
    double k0 = determined ? (b0 * a11 - b1 * a01) / determinant : 0.0;
    double k1 = determined ? (b1 * a00 - b0 * a01) / determinant : 0.0;
    for (size_t b = 0; b < OOI_BANDS; b++) {
        ret->k[b] = k0 + k1 * place(b);
        /* 0 may come out as a little less. */
        if (!(ret->k[b] >= -0.01 && ret->k[b] <= OOI_SUBSTITUTION_MAX_K))
            s = STATUS_RANGE;
    }
    ret->residual = residual(ret, n, measured, certified, rstd);
    if (!determined || !(ret->residual <= OOI_SUBSTITUTION_MAX_RESIDUAL))
        s = STATUS_RANGE;
    return s;
}
