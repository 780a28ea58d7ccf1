/* km_line.h - what Konica Minolta's handhelds share on the line: fields with commas, OKnn and ERnn,
 * and the ways a spectrum can be told wrongly. */
#ifndef SKINSPEC_TESTS_SIM_KM_LINE_H
#define SKINSPEC_TESTS_SIM_KM_LINE_H

#include "tests/sim/handheld.h"
#include "tests/sim/serial_end.h"

enum { KM_FIELDS = 48 };

/* Take a line apart in place; the number of fields, more than KM_FIELDS as KM_FIELDS + 1. */
size_t km_line_split(char *line, char *field[KM_FIELDS]);

/* A field as a whole number, blanks around it and leading zeros allowed; false outside min..max. */
bool km_line_number(const char *field, long min, long max, long *ret);

/* The code of a success: 0, or 2, 3, 4, 9 by lamp, battery and range. */
int km_line_ok(const struct handheld *h, bool over_range);

/* What is told for a band where all is well or by this fault, as a fraction. */
double km_line_told(const struct fault *f, handheld_spectra R, int mode, size_t band);

#endif
