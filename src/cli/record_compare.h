/* record_compare.h - a record of now beside the one of a capture, bit for bit: numbers are
 * compared as the text that reads back to the same double. */
#ifndef SKINSPEC_CLI_RECORD_COMPARE_H
#define SKINSPEC_CLI_RECORD_COMPARE_H

#include <cjson/cJSON.h>

/* An array of {"member","captured","here"}, empty where all is the same; "captured" or "here" is
 * absent where the member is.  member: "spectrum.values[3]".
 *
 * Looked at is what the captured record has (src/station/asked.h).  Where the tables differ
 * ("match.table_sha256") the rest of the match is not compared.  The flags calibration_old and
 * lease_expired are left out: they tell of hours that a replay does not take. */
cJSON *record_compare(const cJSON *captured, const cJSON *here);

#endif
