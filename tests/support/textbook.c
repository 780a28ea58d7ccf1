/* textbook.c - see textbook.h; slow and plain on purpose. */
#include "tests/support/textbook.h"

#include <math.h>

static const double pi = 3.14159265358979323846;

static double sin_deg(double x)
{
    return sin(x * pi / 180.0);
}

static double cos_deg(double x)
{
    return cos(x * pi / 180.0);
}

static double hue(double a, double b)
{
    double h = atan2(b, a) * 180.0 / pi;
    return h < 0.0 ? h + 360.0 : h;
}

double textbook_de2000(const double p[3], const double q[3])
{
    double C1 = sqrt(p[1] * p[1] + p[2] * p[2]), C2 = sqrt(q[1] * q[1] + q[2] * q[2]);
    double C7 = pow((C1 + C2) / 2.0, 7.0);
    double G = 0.5 * (1.0 - sqrt(C7 / (C7 + pow(25.0, 7.0))));
    double a1 = (1.0 + G) * p[1], a2 = (1.0 + G) * q[1];
    C1 = sqrt(a1 * a1 + p[2] * p[2]);
    C2 = sqrt(a2 * a2 + q[2] * q[2]);
    double h1 = hue(a1, p[2]), h2 = hue(a2, q[2]);

    double dh = 0.0, H = h1 + h2;
    if (C1 * C2 != 0.0) {
        dh = h2 - h1;
        if (dh > 180.0)
            dh -= 360.0;
        else if (dh < -180.0)
            dh += 360.0;
        if (fabs(h1 - h2) <= 180.0)
            H = (h1 + h2) / 2.0;
        else
            H = (h1 + h2 < 360.0 ? h1 + h2 + 360.0 : h1 + h2 - 360.0) / 2.0;
    }
    double dL = q[0] - p[0], dC = C2 - C1, dH = 2.0 * sqrt(C1 * C2) * sin_deg(dh / 2.0);
    double L = (p[0] + q[0]) / 2.0, C = (C1 + C2) / 2.0;
    double T = 1.0 - 0.17 * cos_deg(H - 30.0) + 0.24 * cos_deg(2.0 * H) +
               0.32 * cos_deg(3.0 * H + 6.0) - 0.20 * cos_deg(4.0 * H - 63.0);
    double S_L = 1.0 + 0.015 * pow(L - 50.0, 2.0) / sqrt(20.0 + pow(L - 50.0, 2.0));
    double S_C = 1.0 + 0.045 * C, S_H = 1.0 + 0.015 * C * T;
    double R_C = 2.0 * sqrt(pow(C, 7.0) / (pow(C, 7.0) + pow(25.0, 7.0)));
    double R_T = -sin_deg(60.0 * exp(-pow((H - 275.0) / 25.0, 2.0))) * R_C;
    return sqrt(pow(dL / S_L, 2.0) + pow(dC / S_C, 2.0) + pow(dH / S_H, 2.0) +
                R_T * (dC / S_C) * (dH / S_H));
}

double textbook_code(double linear)
{
    if (linear < 0.0)
        return -textbook_code(-linear);
    return 255.0 * (linear <= 0.0031308 ? 12.92 * linear : 1.055 * pow(linear, 1.0 / 2.4) - 0.055);
}

double textbook_rms(const struct spectrum *s, double first_nm, double step_nm, size_t n,
                    const float *row, size_t *bands)
{
    double sum = 0.0;
    size_t common = 0;
    for (size_t i = 0; i < s->n; i++) {
        for (size_t j = 0; j < n; j++) {
            double nm = s->first_nm + (double)i * s->step_nm;
            double row_nm = first_nm + (double)j * step_nm;
            if (fabs(nm - row_nm) > 1e-6 || isnan(s->value[i]))
                continue;
            sum += pow(s->value[i] - (double)row[j], 2.0);
            common++;
        }
    }
    if (bands != NULL)
        *bands = common;
    return common > 0 ? sqrt(sum / (double)common) : (double)NAN;
}
