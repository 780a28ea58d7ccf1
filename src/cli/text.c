/* text.c - a buffer that doubles. */
#include "cli/text.h"

#include <stdlib.h>
#include <string.h>

#include "cli/out.h"

void text_add(struct text *text, const char *bytes, size_t n)
{
    if (n > text->capacity - text->n) {
        size_t capacity = 2 * (text->n + n) + 256;
        char *grown = realloc(text->bytes, capacity);
        if (grown == NULL)
            out_of_memory();
        text->bytes = grown;
        text->capacity = capacity;
    }
    memcpy(text->bytes + text->n, bytes, n);
    text->n += n;
}

void text_done(struct text *text)
{
    free(text->bytes);
    *text = (struct text){ 0 };
}
