/* prompt.c - lines of standard input. */
#include "cli/prompt.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <unistd.h>

#include "base/log.h"
#include "cli/options.h"

bool prompt_is_possible(void)
{
    return isatty(STDIN_FILENO) == 1;
}

void prompt_forget(void)
{
    tcflush(STDIN_FILENO, TCIFLUSH); /* refused where it is no terminal: a pipe is kept */
}

enum prompt_line prompt_read(struct prompt *prompt)
{
    char c;
    if (read(STDIN_FILENO, &c, 1) != 1)
        return PROMPT_END;
    if (c == '\n') {
        prompt->text[prompt->n] = '\0';
        prompt->n = 0;
        return PROMPT_ENTER;
    }
    if (prompt->n + 1 < sizeof prompt->text)
        prompt->text[prompt->n++] = c;
    return PROMPT_PARTIAL;
}

int prompt_refuses(const char *question)
{
    struct prompt prompt = { .n = 0 };
    enum prompt_line line;
    if (!prompt_is_possible()) {
        log_error("standard input is no terminal, so nobody can be asked: --yes says yes");
        return EXIT_USAGE;
    }
    prompt_forget();
    fprintf(stderr, "%s [yes/no] ", question);
    do
        line = prompt_read(&prompt);
    while (line == PROMPT_PARTIAL);
    if (line == PROMPT_ENTER && strcmp(prompt.text, "yes") == 0)
        return EXIT_SUCCESS;
    log_error("nothing was done");
    return EXIT_FAILURE;
}
