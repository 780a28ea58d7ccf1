/* subcommand.h - commands of a command: `skinspec store verify`. */
#ifndef SKINSPEC_CLI_SUBCOMMAND_H
#define SKINSPEC_CLI_SUBCOMMAND_H

#include <stddef.h>

struct subcommand {
    const char *name, *summary;
    int (*run)(int argc, char **argv); /* argv[0] is the name */
};

/* Run the one that argv[1] names.  Otherwise their list, under `about` (lines, or ""): after
 * --help on standard output, else on standard error with exit status 2. */
int subcommand_run(int argc, char **argv, const char *command, const char *about,
                   const struct subcommand *subcommands, size_t n);

#endif
