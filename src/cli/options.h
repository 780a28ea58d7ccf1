/* options.h - what the commands' argp parsers share. */
#ifndef SKINSPEC_CLI_OPTIONS_H
#define SKINSPEC_CLI_OPTIONS_H

#include <argp.h>
#include <stdbool.h>
#include <stdint.h>

#include "base/spectrum.h"
#include "cli/out.h"
#include "colour/cie_tables.h"
#include "optics/model.h"
#include "optics/tissue.h"

/* Keys of long options without a letter; a command's own begin at OPTION_OWN. */
enum {
    OPTION_JSON = 0x100,
    OPTION_NDJSON,
    OPTION_ILLUMINANT,
    OPTION_OBSERVER,
    OPTION_STRICT,
    OPTION_THREADS,
    OPTION_CM,
    OPTION_BM,
    OPTION_CH,
    OPTION_EPIDERMIS_MM,
    OPTION_GAMMA,
    OPTION_ETA,
    OPTION_BANDS,
    OPTION_SOCKET,
    OPTION_INSTRUMENT,
    OPTION_SINCE,
    OPTION_LIMIT,
    OPTION_YES,
    OPTION_FORCE,
    OPTION_OWN = 0x200
};

enum { EXIT_USAGE = 2 };

/* Each ends the program with EXIT_USAGE and a message that names the option where
 * the text is not what it wants. */
double option_number(struct argp_state *state, const char *option, const char *text, double low,
                     double high);
size_t option_count(struct argp_state *state, const char *option, const char *text, size_t low,
                    size_t high);
enum illuminant option_illuminant(struct argp_state *state, const char *text);
enum observer option_observer(struct argp_state *state, const char *text);
const struct model *option_model(struct argp_state *state, const char *text);

/* --json and --ndjson; false where the key is neither. */
bool option_format(int key, enum out_format *format);

/* The one FILE a command takes. */
void option_file(struct argp_state *state, const char *text, const char **path);

struct option_bands {
    double first_nm, step_nm;
    size_t n;
};
struct option_bands option_bands(struct argp_state *state, const char *text);

/* Rows of an argp option table.  clang-format would scatter them. */
/* clang-format off */
#define OPTION_ROWS_JSON \
    { "json", OPTION_JSON, NULL, 0, "Print one JSON array", 0 }, \
    { "ndjson", OPTION_NDJSON, NULL, 0, "Print one JSON object a line", 0 }
#define OPTION_ROWS_SKIN \
    { "cm", OPTION_CM, "X", 0, "Melanin fraction of the epidermis, 0..1", 0 }, \
    { "bm", OPTION_BM, "X", 0, "Eumelanin share of the melanin, 0..1", 0 }, \
    { "ch", OPTION_CH, "X", 0, "Blood fraction of the dermis, 0..1", 0 }
#define OPTION_ROW_GAMMA \
    { "gamma", OPTION_GAMMA, "X", 0, "Oxygenated share of the blood, 0..1 (0.75)", 0 }
#define OPTION_ROWS_TISSUE \
    { "epidermis-mm", OPTION_EPIDERMIS_MM, "D", 0, "Thickness of the epidermis (0.08)", 0 }, \
    OPTION_ROW_GAMMA
#define OPTION_ROW_ETA \
    { "eta", OPTION_ETA, "N", 0, "Refractive index, skin over air (1.4)", 0 }
#define OPTION_ROW_BANDS \
    { "bands", OPTION_BANDS, "LO:HI:STEP", 0, "Wavelengths in nm (380:740:10)", 0 }
#define OPTION_ROW_SOCKET \
    { "socket", OPTION_SOCKET, "PATH", 0, "Where the station listens (SKINSPEC_SOCKET)", 0 }
#define OPTION_ROW_INSTRUMENT \
    { "instrument", OPTION_INSTRUMENT, "NAME", 0, "As 'skinspec devices' says (the only one)", 0 }
#define OPTION_ROWS_JSON_ONE \
    { "json", OPTION_JSON, NULL, 0, "Print a JSON object", 0 }, \
    { "ndjson", OPTION_NDJSON, NULL, 0, "The same", 0 }
/* clang-format on */

/* A skin as options: --cm --bm --ch --epidermis-mm --gamma --eta.
 * Take a skin's option into *t and the bits of what was given into *given (bit
 * key - OPTION_CM).  False where the key is none of them. */
bool option_skin(int key, const char *text, struct argp_state *state, struct tissue *t,
                 unsigned *given);

/* What a command takes that prints one skin at some bands. */
struct option_skin_bands {
    struct tissue tissue;
    unsigned given;
    struct option_bands bands;
    enum out_format format;
};
struct option_skin_bands option_skin_bands_default(void);

/* A whole parser for it: no further argument, and --cm, --bm and --ch must be given. */
error_t option_parse_skin_bands(int key, char *text, struct argp_state *state,
                                struct option_skin_bands *a);

/* What every command takes that talks to the station: --socket, --json and --ndjson. */
struct option_station {
    const char *socket; /* NULL: not given */
    enum out_format format;
};

/* Returns as an argp parser does; an argument that the command did not take before is a usage
 * error.  The second is a whole parser, its input a struct option_station. */
error_t option_station(int key, char *text, struct argp_state *state,
                       struct option_station *station);
error_t option_parse_station(int key, char *text, struct argp_state *state);

/* End with EXIT_USAGE, saying which option the text is no uuid for. */
const char *option_uuid(struct argp_state *state, const char *option, const char *text);

/* Number of a record or an event, 0 .. 2^53 - 1. */
int64_t option_seq(struct argp_state *state, const char *option, const char *text);

/* An argument that the command does not take. */
void option_unexpected(struct argp_state *state, const char *text);

/* Run a command's parser under the name "skinspec COMMAND". */
void option_parse(const struct argp *argp, const char *command, int argc, char **argv, void *input);

#endif
