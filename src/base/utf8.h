/* utf8.h - is it text? */
#ifndef SKINSPEC_BASE_UTF8_H
#define SKINSPEC_BASE_UTF8_H

#include <stdbool.h>
#include <stddef.h>

/* Well-formed UTF-8 after RFC 3629: no overlong forms, no surrogates. */
bool utf8_is_valid(const char *text);

/* The same of n bytes, of which any may be NUL. */
bool utf8_is_valid_n(const char *text, size_t n);

/* Text from elsewhere that is to be shown: where it is not valid, every byte that is not
 * ASCII becomes '?'. */
void utf8_make_plain(char *text);

#endif
