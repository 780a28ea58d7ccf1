/* text.h - text that grows, for what is printed later or elsewhere. */
#ifndef SKINSPEC_CLI_TEXT_H
#define SKINSPEC_CLI_TEXT_H

#include <stddef.h>

struct text { /* zeroed: empty */
    char *bytes;
    size_t n, capacity;
};

/* Where memory is wanting the program ends, saying so. */
void text_add(struct text *text, const char *bytes, size_t n);
void text_done(struct text *text);

#endif
