/* km_ascii_wire.h - Konica Minolta's ASCII commands: bytes <-> values, pure.
 *
 * A question is a mnemonic and fields between commas, CR LF; the answer one line (CM-2600d: MES
 * more), `OKnn` or `ERnn` and fields between commas, CR LF.  No checksum: every reader here
 * takes the number of fields, digits and ranges strictly, and whoever asks reads twice.
 *
 *              CM-700d                     CM-2600d, CM-2500d
 *   line       115200 8N1 (CDC-ACM,        9600 8N1 RTS/CTS
 *              Bluetooth)
 *   identity   IDR  OK00,0100,104,12345678,0,400,700,10
 *                                          OK00,03,104,1234567,0,360,740,10
 *   state      STR  OK00,1,0,3,4000,12,2,0,0
 *                   1 = flash ready        OK00,0,0,2,1700,12,2      0 = flash ready
 *   settings   CPS,2,3,00,01,01            CPS,0,1
 *              area 1 SAV 2 MAV, specular  area 0 MAV 1 SAV, mode 1: SCI and SCE, UV in
 *              3 both, delay, averages
 *   zero       ZRC                         UZC
 *   white      CAL; USC the user's plate   CAL
 *   a shot     MES,1  OK00; then STR       MES   OK00,v1..v39 (SCI)
 *              answers ER35 while it                OK00,v1..v39 (SCE)
 *              lasts
 *   spectrum   MDR,1 SCI, MDR,2 SCE        in the answer to MES
 *              OK00,2012,...               OK00,20.12,... or OK00,02012,...
 *              0.01 %                      percent with a dot, 0.01 % without
 *   button     SWS,1; RDR,k                SWE; MES's lines unasked
 *
 * From two programs for each family: a MATLAB class that cites the maker's "Communication
 * Specifications" 1.33 and a German colour software for the CM-700d, the latter and color4j for
 * the CM-2600d.  Not seen on hardware.
 *
 * Never sent, because they write what cannot be had again: CDS, UCS (plate data), SDD, SAD
 * (stored samples), WMS. */
#ifndef SKINSPEC_DRIVERS_KM_ASCII_WIRE_H
#define SKINSPEC_DRIVERS_KM_ASCII_WIRE_H

#include "drivers/link/link.h"
#include "drivers/reading.h"

/* ---- a line ------------------------------------------------------------------------- */

enum { KM_MAX_FIELDS = 128, KM_COMMAND_SIZE = 40 };

struct km_reply {
    bool ok;       /* OKnn, not ERnn */
    unsigned code; /* nn */
    size_t fields; /* behind the status */
    struct km_field {
        const char *at; /* into the line */
        size_t n;
    } field[KM_MAX_FIELDS];
};

/* False for what is no answer: other than OK or ER and two digits, then nothing or a comma. */
bool km_read_reply(const char *line, struct km_reply *ret);

/* Decimal digits only, at most 9 of them and at most `most`. */
bool km_read_unsigned(struct km_field field, unsigned most, unsigned *ret);

/* reading_plain_text() of a field. */
void km_read_text(struct km_field field, char *ret, size_t size);

/* ---- codes -------------------------------------------------------------------------- */

/* What the conversation does about an answer, beside telling. */
enum km_reaction {
    KM_TELL,
    KM_WAIT,   /* not yet: ask again */
    KM_RESEND, /* not understood: send once more */
    KM_EMPTY,  /* there is none */
    KM_MOVE,   /* the slider stands elsewhere */
};

struct km_code {
    bool ok;
    unsigned number;
    enum driver_result result;
    unsigned warnings; /* bits of enum driver_warning */
    enum km_reaction reaction;
    const char *text; /* what is wrong and what to do */
};

/* ---- dialects ----------------------------------------------------------------------- */

struct km_state {
    bool flash_ready, recalibrate;
    bool due[DRIVER_CALIBRATIONS]; /* without the user's plate */
    bool user_due;                 /* the white step with the user's plate */
    unsigned voltage;              /* 0 normal, 1 low, 2 too low */
    unsigned samples;
};

struct km_settings {
    unsigned area;
    unsigned delay_ds, averages; /* 0.1 s; CM-700d only, else 0 and 1 */
};

/* Where the spectra of a shot come from. */
enum km_mes { KM_MES_THEN_MDR, KM_MES_ANSWERS };

struct km_model {
    const char *id; /* field 1 of IDR; NULL ends the list */
    const char *name;
};

struct km_dialect {
    const struct km_model *models;
    struct link_serial serial;
    const struct km_code *codes; /* ends with text NULL */

    const char *zero, *white, *white_user; /* commands; NULL: cannot */
    const char *button_on;
    enum km_mes mes;
    unsigned area[2]; /* as CPS counts: medium (8 mm), small (3 mm) */
    unsigned max_averages;
    int max_delay_ms;
    bool has_clock, has_plate_id, has_samples;
    bool dots;       /* values may have a dot */
    double raw_unit; /* reflectance of one count, as km_read_spectrum() counts */
    size_t state_fields, settings_fields;
    bool (*read_state)(const struct km_reply *reply, struct km_state *ret);
    bool (*read_settings)(const struct km_reply *reply, struct km_settings *ret);
    void (*write_settings)(const struct km_settings *settings, char ret[KM_COMMAND_SIZE]);
};

extern const struct km_dialect km_cm700d, km_cm2600d;

/* NULL for a code that is not in the instrument's table. */
const struct km_code *km_find_code(const struct km_dialect *dialect, const struct km_reply *reply);

/* ---- identity ----------------------------------------------------------------------- */

enum { KM_IDENTITY_FIELDS = 7 };

/* The dialect of what answered IDR, and *ret filled from it; NULL where it is no such answer
 * or another model, with *ret's model all that was understood ("" if nothing). */
const struct km_dialect *km_read_identity(const struct km_reply *reply,
                                          struct driver_identity *ret);

/* ---- spectra ------------------------------------------------------------------------ */

/* n values from field `first` on to the last; counts of dialect->raw_unit.  DOUBT_NONE,
 * DOUBT_WRONG_COUNT, or DOUBT_NO_NUMBER, also for some values with a dot and some without. */
enum doubt km_read_spectrum(const struct km_dialect *dialect, const struct km_reply *reply,
                            size_t first, size_t n, int32_t *raw);

/* ---- clock -------------------------------------------------------------------------- */

/* `DTS,2026,11,22,09,30,00`, UTC. */
void km_write_clock(int64_t realtime_s, char ret[KM_COMMAND_SIZE]);

#endif
