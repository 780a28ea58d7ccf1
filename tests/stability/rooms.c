/* rooms.c - all studies, in the order they are printed. */
#include "tests/stability/rooms.h"

const struct study_room *const study_rooms[] = { &study_dipole, &study_layers, &study_skin,
                                                 &study_xyz,    &study_colour, &study_match,
                                                 &study_noise,  &study_fit };
const size_t study_room_count = sizeof study_rooms / sizeof *study_rooms;
