/* trial_out.h - what `skinspec bench` measured, as JSON. */
#ifndef SKINSPEC_CLI_TRIAL_OUT_H
#define SKINSPEC_CLI_TRIAL_OUT_H

#include "trial/trial.h"

/* One object on standard output: machine, skins, seed, rounds, noise; inversion[], bounds[],
 * forward[].  Members that mean nothing there, or were not measured, are left out. */
void trial_out_json(const struct trial *trial, const char *machine);

#endif
