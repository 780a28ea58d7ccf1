/* option_refine.h - --refine, --noise, --placement and --fix: what is asked beside the nearest
 * row. */
#ifndef SKINSPEC_CLI_OPTION_REFINE_H
#define SKINSPEC_CLI_OPTION_REFINE_H

#include <argp.h>

#include "match/refined_match.h"

/* Keys beyond those of a command's own. */
enum {
    OPTION_REFINE = 0x300,
    OPTION_NOISE,
    OPTION_PLACEMENT,
    OPTION_FIX,
};

#define OPTION_TEXT_OF(number) #number
#define OPTION_TEXT(number) OPTION_TEXT_OF(number)
#define NOISE_WHITE_TEXT OPTION_TEXT(NOISE_DEFAULT_WHITE)

/* clang-format off */
#define OPTION_ROWS_REFINE(placement_default) \
    { "refine", OPTION_REFINE, "three|skin", OPTION_ARG_OPTIONAL, \
      "Fit the skin between the rows too, and say how sure that is: Cm, Bm, Ch (three), or for " \
      "measured skin Cm, Ch, oxygen saturation and scattering (skin)", 0 }, \
    { "noise", OPTION_NOISE, "S", 0, \
      "With --refine: standard deviation of each band by itself (three: " NOISE_WHITE_TEXT ")", 0 }, \
    { "placement", OPTION_PLACEMENT, "P", 0, \
      "With --refine: size of the noise that bands share, from putting the probe down again (" \
      placement_default "; 0 beside --noise)", 0 }, \
    { "fix", OPTION_FIX, "NAME=X", 0, \
      "With --refine: hold Cm, Bm, Ch, SO2, epidermis_mm, scattering_a or scattering_b at X; may " \
      "be given again", 0 }
/* clang-format on */

/* Take an option into *wish, which was refine_wish_none() before.  False where the key is none of
 * them.  Ends the program with EXIT_USAGE where the text is not what it wants. */
bool option_refine(int key, const char *text, struct argp_state *state, struct refine_wish *wish);

/* At the end: what goes with --refine alone. */
void option_refine_check(struct argp_state *state, const struct refine_wish *wish);

#endif
