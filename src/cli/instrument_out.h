/* instrument_out.h - instruments as a table for a person, on standard output. */
#ifndef SKINSPEC_CLI_INSTRUMENT_OUT_H
#define SKINSPEC_CLI_INSTRUMENT_OUT_H

#include <cjson/cJSON.h>

/* One line each below a head; under it what is wrong or due, and what to do. */
void instrument_out(const cJSON *instruments);

#endif
