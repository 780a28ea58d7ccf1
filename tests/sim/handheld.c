/* handheld.c - light out, light back. */
#include "tests/sim/handheld.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "tests/support/dice.h"

static double gauss(struct dice *d)
{
    double sum = 0.0;
    for (int i = 0; i < 12; i++) /* variance 1, near enough normal, and never far out */
        sum += dice_between(d, -0.5, 0.5);
    return sum;
}

double handheld_truth(const struct handheld *h, double nm, bool sci)
{
    return under_port_truth(h->under, h->lightness, nm, sci);
}

static double band_nm(const struct handheld *h, size_t band)
{
    return h->first_nm + (double)band * h->step_nm;
}

void handheld_spectrum_of(const struct handheld *h, enum under_port what, handheld_spectra R)
{
    for (int mode = 0; mode < HANDHELD_MODES; mode++)
        for (size_t b = 0; b < h->bands; b++)
            R[mode][b] = under_port_truth(what, h->lightness, band_nm(h, b), mode == SCI);
}

static void flash(struct handheld *h, unsigned averages, handheld_spectra s)
{
    struct dice d = { (uint64_t)h->seed * 1000003u + h->shots++ };
    for (int mode = 0; mode < HANDHELD_MODES; mode++)
        for (size_t b = 0; b < h->bands; b++)
            s[mode][b] = handheld_truth(h, band_nm(h, b), mode == SCI) +
                         h->noise * gauss(&d) / sqrt((double)averages);
}

/* Calibrations flash several times. */
enum { CALIBRATION_FLASHES = 16 };

static void flash_on(struct handheld *h, enum under_port wanted, handheld_spectra s)
{
    enum under_port before = h->under;
    if (h->helped)
        h->under = wanted;
    flash(h, CALIBRATION_FLASHES, s);
    h->under = before;
}

bool handheld_zero(struct handheld *h)
{
    handheld_spectra s;
    flash_on(h, UNDER_BLACK, s);
    if (h->careful && s[SCE][h->bands / 2] > 0.05)
        return false;
    memset(&h->calibration[h->port], 0, sizeof h->calibration[h->port]);
    h->calibration[h->port].zeroed = true;
    memcpy(h->calibration[h->port].zero, s, sizeof s);
    return true;
}

bool handheld_white(struct handheld *h, handheld_spectra standard, bool user, unsigned modes)
{
    handheld_spectra s;
    flash_on(h, user ? UNDER_USER : UNDER_WHITE, s);
    double should_be = standard[SCE][h->bands / 2];
    if (h->careful && fabs(s[SCE][h->bands / 2] / should_be - 1.0) > 0.1)
        return false;
    for (int mode = 0; mode < HANDHELD_MODES; mode++) {
        if ((modes & 1u << mode) == 0)
            continue;
        h->calibration[h->port].white[mode] = true;
        h->calibration[h->port].user[mode] = user;
        memcpy(h->calibration[h->port].full[mode], s[mode], sizeof s[mode]);
        memcpy(h->calibration[h->port].standard[mode], standard[mode], sizeof standard[mode]);
    }
    return true;
}

bool handheld_calibrated(const struct handheld *h, unsigned modes, bool user)
{
    for (int mode = 0; mode < HANDHELD_MODES; mode++)
        if ((modes & 1u << mode) != 0 &&
            (!h->calibration[h->port].white[mode] || h->calibration[h->port].user[mode] != user))
            return false;
    return h->calibration[h->port].zeroed;
}

void handheld_forget(struct handheld *h)
{
    memset(h->calibration, 0, sizeof h->calibration);
}

void handheld_shoot(struct handheld *h, unsigned averages, handheld_spectra R)
{
    handheld_spectra s;
    flash(h, averages, s);
    h->counted++;
    for (int mode = 0; mode < HANDHELD_MODES; mode++)
        for (size_t b = 0; b < h->bands; b++) {
            double zero = h->calibration[h->port].zero[mode][b];
            double full = h->calibration[h->port].full[mode][b];
            /* A mode without a white calibration is not asked for; swapped ones may meet. */
            double span = fabs(full - zero) < 1e-6 ? 1e-6 : full - zero;
            R[mode][b] = (s[mode][b] - zero) / span * h->calibration[h->port].standard[mode][b];
        }
}

bool handheld_argument(const char *action, const char *name, long min, long max, long *ret)
{
    size_t n = strlen(name);
    char *end;
    if (strncmp(action, name, n) != 0 || action[n] != ' ')
        return false;
    long x = strtol(action + n + 1, &end, 10);
    if (end == action + n + 1 || *end != '\0' || x < min || x > max)
        return false;
    *ret = x;
    return true;
}

bool handheld_act(struct handheld *h, const char *action)
{
    static const char *const lamps[] = { "lamp ok", "lamp weak", "lamp dead" };
    long x;
    if (strncmp(action, "place ", 6) == 0)
        return under_port_find(action + 6, &h->under);
    if (h->two_ports && handheld_argument(action, "slide", 1, 2, &x)) {
        h->port = (unsigned)x - 1;
        return true;
    }
    if (handheld_argument(action, "battery", 0, 2, &x)) {
        h->battery = (unsigned)x;
        return true;
    }
    if (strcmp(action, "count shots") == 0) {
        h->counted = 0;
        return true;
    }
    if (handheld_argument(action, "expect shots", 0, 1000000, &x))
        return h->counted == x;
    if (strcmp(action, "charge") == 0) {
        h->battery = 0;
        return true;
    }
    if (handheld_argument(action, "lightness", 1, 80, &x)) {
        h->lightness = (double)x;
        return true;
    }
    for (int i = 0; i < 3; i++)
        if (strcmp(action, lamps[i]) == 0) {
            h->lamp = (enum handheld_lamp)i;
            return true;
        }
    return false;
}
