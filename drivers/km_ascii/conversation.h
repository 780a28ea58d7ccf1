/* conversation.h - an open instrument and how it is asked; of interest to km_ascii alone.
 *
 * There is no checksum, so what can be asked again is asked until two answers agree, at most
 * three times (km_ask_twice), and what cannot is sent again where the answer came damaged
 * (km_command).  An answer is known by its number of fields: a line that has another is
 * passed over. */
#ifndef SKINSPEC_DRIVERS_KM_ASCII_CONVERSATION_H
#define SKINSPEC_DRIVERS_KM_ASCII_CONVERSATION_H

#include "drivers/km_ascii/km_ascii_wire.h"
#include "drivers/link/line.h"

/* ---- the instrument ----------------------------------------------------------------- */

struct km_spectra {
    int32_t sci[KM_MAX_FIELDS], sce[KM_MAX_FIELDS]; /* counts of the dialect's raw_unit */
    unsigned warnings;
};

enum {
    KM_READINGS = 3,
    KM_CHARGING_MS = 20000, /* until the flash is ready again */
};

struct instrument {
    struct call call;
    struct link *link;
    struct line_reader reader;
    const struct km_dialect *dialect; /* NULL until IDR was answered */
    struct driver_identity identity;
    char identity_line[LINE_MAX_BYTES]; /* the answer to IDR, by which we get back into step */
    unsigned area[2];                   /* of the identity's apertures, as CPS counts */
    struct driver_setup setup;
    struct km_settings settings; /* as sent */
    unsigned voltage;            /* as STR said last */

    int reply_timeout_ms;
    int shot_timeout_ms;  /* of driver_options; 0 */
    int64_t call_ends_ms; /* open() takes no longer; INT64_MAX */
    int64_t job_ends_ms;  /* a shot or calibration may go on until then */
    bool out_of_step;     /* an answer may still come to a question of an earlier call */
    bool poll_unanswered; /* the last RDR of a wait was */
    unsigned strays;      /* lines that were no answer to what was asked */

    struct km_press {
        bool pressed;      /* and nobody was told yet */
        bool listens;      /* a wait that has asked nothing since */
        bool ready;        /* told; its reading may be fetched */
        bool has_spectra;  /* its reading, in `spectra` */
        int64_t since_ms;  /* it came after that */
        int64_t looked_ms; /* when there was none, last */
        bool has_last;     /* RDR,1 as it was last, in last_sci */
        int32_t last_sci[KM_MAX_FIELDS];
        char last[LINE_MAX_BYTES];  /* CM-2600d: SCE of the last shot, which may come twice */
        char first[LINE_MAX_BYTES]; /* CM-2600d: SCI, SCE is to come; "" */
        struct km_spectra spectra;
    } press;

    char line[KM_READINGS][LINE_MAX_BYTES]; /* answers that are compared; a reply points there */
};

/* ---- a call's beginning and end ----------------------------------------------------- */

/* link_begin(), then into step if we are not. */
enum driver_result km_begin(struct instrument *in, const char *call, struct driver_error *error);
/* For wait_button: a cancellation before it counts. */
enum driver_result km_begin_waiting(struct instrument *in, const char *call,
                                    struct driver_error *error);
/* Notes whether an answer may still come, and returns r. */
enum driver_result km_end(struct instrument *in, enum driver_result r);

/* ---- asking ------------------------------------------------------------------------- */

/* One question and its one answer: OKnn with so many fields, or ERnn.  `line` is where the reply
 * points.  DRIVER_PROTOCOL for bytes that are none. */
enum driver_result km_ask(struct instrument *in, const char *question, size_t fields,
                          int timeout_ms, char line[LINE_MAX_BYTES], struct km_reply *ret,
                          struct driver_error *error);
/* As km_ask(), without sending. */
enum driver_result km_await(struct instrument *in, size_t fields, int timeout_ms,
                            char line[LINE_MAX_BYTES], struct km_reply *ret,
                            struct driver_error *error);

/* Two answers that agree, of at most three. */
enum driver_result km_ask_twice(struct instrument *in, const char *question, size_t fields,
                                struct km_reply *ret, struct driver_error *error);

/* The same, with the first answer in line[0] already if `first`. */
enum driver_result km_confirm(struct instrument *in, const char *question, size_t fields,
                              bool first, struct km_reply *ret, struct driver_error *error);

/* The same, and ERnn is an error as its code says; those that mean "not yet" are waited out until
 * the deadline. */
enum driver_result km_query(struct instrument *in, const char *question, size_t fields,
                            int64_t deadline_ms, struct km_reply *ret, struct driver_error *error);
enum driver_result km_query_state(struct instrument *in, int64_t deadline_ms, struct km_state *ret,
                                  struct driver_error *error);

/* A command that is answered by its status alone: sent again once where the answer is damaged or
 * the instrument did not understand.  It takes job_ms, and may be refused as too early
 * for wait_ms. */
enum driver_result km_command(struct instrument *in, const char *command, int job_ms, int wait_ms,
                              struct driver_error *error);

/* The error that a code means. */
enum driver_result km_fail(const struct instrument *in, const struct km_reply *reply,
                           struct driver_error *error);
enum km_reaction km_reaction_to(const struct instrument *in, const struct km_reply *reply);
unsigned km_warnings_of(const struct instrument *in, const struct km_reply *reply);

/* Throw away what comes until it is quiet. */
enum driver_result km_settle(struct instrument *in, struct driver_error *error);

/* A pause between two questions that grows from 1 ms; *pause_ms begins as 0. */
enum driver_result km_pause(struct instrument *in, int *pause_ms, int64_t deadline_ms,
                            struct driver_error *error);

int64_t km_deadline(const struct instrument *in, int64_t job_ms); /* with the reply timeout */

/* ---- settings (settings.c) ---------------------------------------------------------- */

/* The area where the slider stands at opening is aperture 0 of the identity. */
void km_take_areas(struct instrument *in, unsigned area);
struct km_settings km_settings_for(const struct instrument *in, const struct driver_setup *setup);

enum driver_result km_query_settings(struct instrument *in, struct km_settings *ret,
                                     struct driver_error *error);
/* Sends them and sees that they are so; DRIVER_REFUSED where the slider has to be moved. */
enum driver_result km_set(struct instrument *in, const struct km_settings *settings,
                          struct driver_error *error);
enum driver_result km_set_user_calibration(struct instrument *in, bool on,
                                           struct driver_error *error);

/* Whether what was set still holds; it is set again where it does not, and an area that differs is
 * DRIVER_REFUSED. */
enum driver_result km_check_settings(struct instrument *in, struct driver_error *error);

/* ---- shots (shot.c) ----------------------------------------------------------------- */

/* The spectrum that answers a question, read twice (`first`: the first answer is in line[0]).
 * *confirmed: both times; else the instrument gave it once only. */
enum driver_result km_read_one(struct instrument *in, const char *question, bool first,
                               int32_t *raw, unsigned *warnings, bool *confirmed,
                               struct driver_error *error);
/* Both, by "MDR,1" and "MDR,2" or the like, plausible. */
enum driver_result km_read_both(struct instrument *in, const char *command, struct km_spectra *ret,
                                struct driver_error *error);
/* Both out of two lines of a CM-2600d. */
enum doubt km_read_lines(const struct instrument *in, const struct km_reply *sci,
                         const struct km_reply *sce, struct km_spectra *ret);

/* ---- presses (press.c) -------------------------------------------------------------- */

/* A line that came unasked: half of a CM-2600d's shot by the button, or noise. */
void km_note_stray(struct instrument *in, const char *line, const struct km_reply *reply);
void km_forget_press(struct instrument *in);
/* What the button gives so far, so that only a later press counts. */
enum driver_result km_note_button(struct instrument *in, struct driver_error *error);
/* The reading that a press made, if that was just now. */
bool km_take_press(struct instrument *in, struct km_spectra *ret);

/* ---- functions of the driver -------------------------------------------------------- */

enum driver_result km_open(const struct driver_options *options, struct instrument **ret,
                           struct driver_identity *identity, struct driver_error *error);
void km_close(struct instrument *in); /* takes NULL */

enum driver_result km_measure(struct instrument *in, struct driver_reading *ret,
                              struct driver_error *error);
enum driver_result km_wait_button(struct instrument *in, int timeout_ms, bool *pressed,
                                  struct driver_error *error);
enum driver_result km_stored_count(struct instrument *in, size_t *ret, struct driver_error *error);
enum driver_result km_stored_read(struct instrument *in, size_t i, struct driver_reading *ret,
                                  struct driver_error *error);

#endif
