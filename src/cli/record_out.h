/* record_out.h - a record of the station for a person, on standard output. */
#ifndef SKINSPEC_CLI_RECORD_OUT_H
#define SKINSPEC_CLI_RECORD_OUT_H

#include <cjson/cJSON.h>

#include "base/status.h"

/* Everything: who, when, with what; the spectrum drawn; colour, skin, and each flag with
 * its meaning.  STATUS_FORMAT, logged, for an object that is no record. */
enum status record_out(const cJSON *record);

/* The same as a line below a head. */
void record_out_head(void);
void record_out_line(const cJSON *record);

/* The lines about a match: skin, distance, table. */
void record_out_match(const cJSON *match);

/* Tokens with a blank between; "" for none. */
enum { RECORD_FLAGS_SIZE = 512 };
const char *record_out_flags(const cJSON *flags, char text[RECORD_FLAGS_SIZE]);

#endif
