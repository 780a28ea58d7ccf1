/* print.h - a cJSON value as one line of text.
 *
 * Unlike cJSON_PrintUnformatted(): numbers are the fewest digits, up to 17, that read
 * back as the same double (cJSON may lose the last bit, and integers above 2^50 their
 * last digit), in every locale; one that is not finite is refused, not made null; and
 * the text has a limit. */
#ifndef SKINSPEC_JSON_PRINT_H
#define SKINSPEC_JSON_PRINT_H

#include <cjson/cJSON.h>
#include <stddef.h>

#include "base/status.h"

/* *ret: NUL-terminated, of *length bytes (may be NULL), to be freed by free().  What
 * cJSON_CreateRaw() holds is printed as it is.  STATUS_RANGE where the text would be longer than
 * `limit` bytes; STATUS_FORMAT for a number that is not finite; STATUS_NO_MEMORY,
 * which a NULL value counts as: it was not made. */
enum status json_print(const cJSON *value, size_t limit, char **ret, size_t *length);

#endif
