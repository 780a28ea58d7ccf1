/* main.c - `skinspec COMMAND`: the table of commands and their help. */
#include <argp.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/log.h"
#include "base/version.h"
#include "cli/command.h"
#include "cli/options.h"
#include "cli/out.h"

const char *argp_program_version = "skinspec " SKINSPEC_VERSION;

static const struct command {
    const char *name, *arguments, *summary;
    int (*run)(int argc, char **argv);
} commands[] = {
    { "demo", "[FILE]", "one reading, one answer, for a person", cmd_demo },
    { "convert", "FILE", "spectra -> XYZ, L*a*b*, LCh, sRGB, ITA", cmd_convert },
    { "match", "FILE [--table T]", "spectra -> Cm, Bm, Ch", cmd_match },
    { "map", "CUBE.hdr", "a hyperspectral cube -> maps of Cm, Bm, Ch", cmd_map },
    { "table", "build|info|verify", "make, describe and check precomputed tables", cmd_table },
    { "reflectance", "--model M --cm X --bm X --ch X", "a skin -> its spectrum", cmd_reflectance },
    { "coefficients", "--cm X --bm X --ch X", "a skin -> absorption and scattering",
      cmd_coefficients },
    { "dipole", "--sigma-a X --sigma-s-prime X", "a medium -> its diffuse reflectance",
      cmd_dipole },
    { "table2", "", "the paper's Table 2, recomputed beside the print", cmd_table2 },
    { "bench", "[--quick]", "error against run time of every method", cmd_bench },
    { "measure", "[--site TEXT]...", "a reading through the station", cmd_measure },
    { "calibrate", "", "zero and white, step by step", cmd_calibrate },
    { "check", "[--tile NAME]", "has an instrument drifted? against a check tile", cmd_check },
    { "devices", "", "the station's instruments and what they need", cmd_devices },
    { "status", "", "how the station is", cmd_status },
    { "watch", "[--topics A,B]", "the station's events as they come", cmd_watch },
    { "history", "[ID]", "its records", cmd_history },
    { "export", "[--out FILE]", "its records as CSV, JSON or CGATS", cmd_export },
    { "doctor", "[--instrument D:A]", "what is plugged in, and what is wrong with it", cmd_doctor },
    { "replay", "FILE", "a captured session again, and what differs", cmd_replay },
    { "store", "verify|subjects|...", "its store: check it, people in it", cmd_store },
};

enum { COMMANDS = sizeof commands / sizeof *commands };

static void print_help(FILE *stream)
{
    fputs("Usage: skinspec COMMAND [OPTION...]\n"
          "Skin colour from a reflectance spectrum: melanin (Cm), its blend (Bm), blood (Ch).\n\n",
          stream);
    for (size_t i = 0; i < COMMANDS; i++)
        fprintf(stream, "  %-12s %-31s %s\n", commands[i].name, commands[i].arguments,
                commands[i].summary);
    fputs("\n"
          "  skinspec COMMAND --help   what a command takes, with examples\n"
          "  skinspec --version\n\n"
          "Begin with 'skinspec demo', or 'skinspec convert FILE' on spectra of your own: CSV\n"
          "with a header as id,400,410,...,700 and reflectance 0..1 below it.  '-' reads\n"
          "standard input.  Those from 'measure' on talk to the station's daemon, skinspecd.\n"
          "Exit status: 0 done, 1 failed, 2 usage.\n",
          stream);
}

static int no_such_command(const char *name)
{
    log_error("there is no command '%s'; 'skinspec --help' lists them", name);
    return EXIT_USAGE;
}

/* argp ends the program after --help without a look at whether it could be written. */
static void check_output(void)
{
    if (out_exit(true) != EXIT_SUCCESS)
        _exit(EXIT_FAILURE);
}

int main(int argc, char **argv)
{
    argp_err_exit_status = EXIT_USAGE;
    atexit(check_output);
    signal(SIGXFSZ, SIG_IGN); /* a file too large is then an error that can be told */
    if (argc < 2) {
        print_help(stderr);
        return EXIT_USAGE;
    }
    const char *name = argv[1];
    if (strcmp(name, "help") == 0 && argc == 3) { /* `help match`: `match --help` */
        static char help[] = "--help";
        name = argv[1] = argv[2];
        argv[2] = help;
    } else if (strcmp(name, "--help") == 0 || strcmp(name, "-?") == 0 ||
               strcmp(name, "help") == 0) {
        print_help(stdout);
        return EXIT_SUCCESS;
    }
    if (strcmp(name, "--version") == 0 || strcmp(name, "-V") == 0) {
        puts(argp_program_version);
        return EXIT_SUCCESS;
    }
    for (size_t i = 0; i < COMMANDS; i++)
        if (strcmp(commands[i].name, name) == 0)
            return commands[i].run(argc - 1, argv + 1);
    return no_such_command(name);
}
