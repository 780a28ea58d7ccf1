/* handheld.h - the optics and the body that the simulated handhelds share: a port with a slider,
 * a lamp, a battery, a zero and a white calibration for each port, and shots.
 *
 * A shot is s = truth + noise; what is told is (s - zero) / (white - zero) * standard, by what
 * lay under the port when each was calibrated: with white and black swapped it is
 * nonsense, as in life.  By default the instrument notices that (`careful`). */
#ifndef SKINSPEC_TESTS_SIM_HANDHELD_H
#define SKINSPEC_TESTS_SIM_HANDHELD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "tests/sim/under_port.h"

enum { HANDHELD_BANDS = 39, HANDHELD_PORTS = 2 };
enum { SCI, SCE, HANDHELD_MODES };

enum handheld_lamp { LAMP_OK, LAMP_WEAK, LAMP_DEAD };

struct handheld {
    size_t bands;
    double first_nm, step_nm;
    enum under_port under;
    double lightness; /* of skin */
    double noise;     /* standard deviation of one flash, reflectance */
    double seed;
    bool careful; /* a calibration on what cannot be is refused */
    bool helped;  /* somebody places what a calibration wants, and takes it away after */
    bool two_ports;

    unsigned port; /* 0 small, 1 large */
    enum handheld_lamp lamp;
    unsigned battery; /* 0 good, 1 low, 2 too low to measure */
    unsigned shots;
    long counted; /* shots of what lies there, since "count shots" */
    struct {
        bool zeroed, white[HANDHELD_MODES], user[HANDHELD_MODES];
        double zero[HANDHELD_MODES][HANDHELD_BANDS], full[HANDHELD_MODES][HANDHELD_BANDS];
        double standard[HANDHELD_MODES][HANDHELD_BANDS]; /* what `full` was taken to be */
    } calibration[HANDHELD_PORTS];
};

typedef double handheld_spectra[HANDHELD_MODES][HANDHELD_BANDS];

/* What is under the port now.  False where it is careful and something else lies there. */
bool handheld_zero(struct handheld *h);
/* standard: the data of the plate, or the user's own; modes: bits 1 << SCI, 1 << SCE. */
bool handheld_white(struct handheld *h, handheld_spectra standard, bool user, unsigned modes);
void handheld_forget(struct handheld *h); /* calibrations of every port */

/* Whether all these modes are calibrated through this port, to the user's standard or the plate. */
bool handheld_calibrated(const struct handheld *h, unsigned modes, bool user);

/* As the instrument would tell it; averages >= 1 flashes. */
void handheld_shoot(struct handheld *h, unsigned averages, handheld_spectra R);

/* The true reflectance of what is under the port, and of anything in each band. */
void handheld_spectrum_of(const struct handheld *h, enum under_port what, handheld_spectra R);
double handheld_truth(const struct handheld *h, double nm, bool sci);

/* "place WHAT", "slide 1|2" (1 the small port), "battery 0|1|2", "charge" (battery 0),
 * "lamp ok|weak|dead", "lightness X", "count shots" from 0, whoever triggers them, "expect shots
 * N"; false for any other. */
bool handheld_act(struct handheld *h, const char *action);

/* Of a text "name X": its X, where X is min..max; false else. */
bool handheld_argument(const char *action, const char *name, long min, long max, long *ret);

#endif
