/* rooms.h - the studies of each room. */
#ifndef SKINSPEC_TESTS_STABILITY_ROOMS_H
#define SKINSPEC_TESTS_STABILITY_ROOMS_H

#include "tests/stability/study.h"

extern const struct study_room study_dipole, study_layers, study_skin, study_xyz, study_colour,
    study_match, study_noise, study_fit;

#endif
