/* sim_options.h - "key=value,key=value" as every simulator takes it. */
#ifndef SKINSPEC_TESTS_SIM_SIM_OPTIONS_H
#define SKINSPEC_TESTS_SIM_SIM_OPTIONS_H

#include <stdbool.h>
#include <stddef.h>

enum { SIM_OPTION_SIZE = 64 };

/* Where a value goes: number, or text of SIM_OPTION_SIZE. */
struct sim_option {
    const char *key; /* NULL ends the list */
    double *number;
    double min, max;
    char *text;
};

/* Fill in what is given; the rest stays.  false, and why on stderr after the kind's name, for a key
 * not in the list or a value that does not fit. */
bool sim_options_read(const char *kind, const char *options, const struct sim_option *list);

/* The value of one key, cut to size; false where it is not given. */
bool sim_options_value(const char *options, const char *key, char *value, size_t size);

#endif
