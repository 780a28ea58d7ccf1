/* refined_out.h - the refined skin for a person, on standard output. */
#ifndef SKINSPEC_CLI_REFINED_OUT_H
#define SKINSPEC_CLI_REFINED_OUT_H

#include <cjson/cJSON.h>

#include "station/wire.h"

/* Each parameter with the interval that holds it 95 times in 100, how well the skin fits, the
 * noise that was assumed, the row it began with, a second solution; then what to beware of.
 * `match` is the object that *m was read from. */
void refined_out_page(const cJSON *match, const struct wire_match *m);

/* "Cm 0.0310 (0.0280 .. 0.0350)  Bm ..." without a line feed, and the same with what to beware of
 * behind. */
void refined_out_skin(const struct refined_match *match);
void refined_out_line(const cJSON *match, const struct refined_match *refined);

#endif
