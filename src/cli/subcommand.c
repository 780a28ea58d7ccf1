/* subcommand.c - find it, or list them. */
#include "cli/subcommand.h"

#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include "base/log.h"
#include "cli/options.h"
#include "cli/out.h"

static void list(FILE *stream, const char *command, const char *about,
                 const struct subcommand *subcommands, size_t n)
{
    int width = 0;
    for (size_t i = 0; i < n; i++) {
        int length = (int)strlen(subcommands[i].name);
        width = length > width ? length : width;
    }
    fprintf(stream, "Usage: skinspec %s COMMAND [OPTION...]\n%s", command, about);
    for (size_t i = 0; i < n; i++)
        fprintf(stream, "  %-*s %s\n", width, subcommands[i].name, subcommands[i].summary);
    fprintf(stream, "'skinspec %s COMMAND --help' tells more.\n", command);
}

int subcommand_run(int argc, char **argv, const char *command, const char *about,
                   const struct subcommand *subcommands, size_t n)
{
    bool help = argc > 1 && strcmp(argv[1], "--help") == 0;
    for (size_t i = 0; argc > 1 && i < n; i++)
        if (strcmp(argv[1], subcommands[i].name) == 0)
            return subcommands[i].run(argc - 1, argv + 1);
    if (!help && argc > 1)
        log_error("there is no '%s %s'", command, argv[1]);
    list(help ? stdout : stderr, command, about, subcommands, n);
    return help ? out_exit(true) : EXIT_USAGE;
}
