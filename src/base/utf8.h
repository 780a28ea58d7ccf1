/* utf8.h - is it text? */
#ifndef SKINSPEC_BASE_UTF8_H
#define SKINSPEC_BASE_UTF8_H

#include <stdbool.h>

/* Well-formed UTF-8 after RFC 3629: no overlong forms, no surrogates. */
bool utf8_is_valid(const char *text);

#endif
