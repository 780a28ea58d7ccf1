/* check_out.h - checks of check tiles, and what was set of them, for a person. */
#ifndef SKINSPEC_CLI_CHECK_OUT_H
#define SKINSPEC_CLI_CHECK_OUT_H

#include <cjson/cJSON.h>

void check_out(const cJSON *check);      /* a result of check.take */
void check_out_tile(const cJSON *tile);  /* of check.set */
void check_out_head(void);               /* a table of checks: its head, */
void check_out_line(const cJSON *check); /* and a line of it */

#endif
