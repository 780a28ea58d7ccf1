/* prompt.h - what a person answers on standard input, a line at a time.
 *
 * Bytes are read one by one and never beyond the line's end, so that waiting for the
 * descriptor tells whether there is another line. */
#ifndef SKINSPEC_CLI_PROMPT_H
#define SKINSPEC_CLI_PROMPT_H

#include <stdbool.h>
#include <stddef.h>

enum { PROMPT_SIZE = 256 };

struct prompt {
    char text[PROMPT_SIZE]; /* the line without its end, cut where it is too long */
    size_t n;
};

enum prompt_line { PROMPT_PARTIAL, PROMPT_ENTER, PROMPT_END };

/* Whether somebody can be asked: standard input is a terminal. */
bool prompt_is_possible(void);

/* Drop what was typed at the terminal before it was asked for. */
void prompt_forget(void);

/* One byte of standard input, which is readable.  PROMPT_END: there is no more. */
enum prompt_line prompt_read(struct prompt *prompt);

/* Ask on standard error: EXIT_SUCCESS where the answer is "yes"; else, logged, EXIT_FAILURE,
 * or EXIT_USAGE where nobody can be asked (and --yes was not given). */
int prompt_refuses(const char *question);

#endif
