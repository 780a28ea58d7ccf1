/* tiny_font.h - letters of 5 by 7 dots, for labels in pictures. */
#ifndef SKINSPEC_CUBE_TINY_FONT_H
#define SKINSPEC_CUBE_TINY_FONT_H

#include <stdbool.h>
#include <stddef.h>

enum { TINY_FONT_WIDTH = 5, TINY_FONT_HEIGHT = 7, TINY_FONT_ADVANCE = 6 };

/* Dots that a text takes in width, without the gap after the last letter. */
size_t tiny_font_width(const char *text);

/* Whether a text has a dot at x from its left and y from its top; beyond it, none.  Printable
 * ASCII; letters that the font lacks are blank. */
bool tiny_font_dot(const char *text, size_t x, size_t y);

#endif
