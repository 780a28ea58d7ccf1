/* conversation.h - an open instrument and how it is asked; of interest to xrite_rci alone.
 *
 * There is no checksum, so what can be asked again is asked until two answers agree, at most
 * three times, and a command whose answer came damaged is sent again.  An answer of another
 * kind than was asked for is nobody's, and passed over. */
#ifndef SKINSPEC_DRIVERS_XRITE_RCI_CONVERSATION_H
#define SKINSPEC_DRIVERS_XRITE_RCI_CONVERSATION_H

#include "drivers/link/line.h"
#include "drivers/xrite_rci/xrite_rci_wire.h"

enum { RCI_READINGS = 3 };

struct rci_spectra {
    int32_t sci[RCI_BANDS], sce[RCI_BANDS];
};

struct instrument {
    struct call call;
    struct link *link;
    struct line_reader reader;
    struct driver_identity identity;
    char identity_line[LINE_MAX_BYTES]; /* the answer to 00SN; "" before it came */
    struct driver_setup setup;
    bool due[DRIVER_CALIBRATIONS];

    int reply_timeout_ms;
    int shot_timeout_ms;  /* of driver_options; 0 */
    int64_t call_ends_ms; /* open() takes no longer; INT64_MAX */
    int64_t job_ends_ms;  /* a shot may go on until then */
    bool out_of_step;     /* an answer may still come to a question of an earlier call */
    bool has_error;       /* that it will answer with until CE */
    unsigned bare_ends;   /* answers in a row that ended with CR alone */

    struct rci_press {
        bool armed;    /* 01XD was sent, and its answer did not come */
        bool pressed;  /* and nobody was told yet */
        bool ready;    /* told; its reading may be fetched */
        int64_t at_ms; /* INT64_MIN: while nobody waited */
    } press;

    bool has_last; /* SCE of the last shot: a new one differs */
    int32_t last_sce[RCI_BANDS];

    char line[2 * RCI_READINGS][LINE_MAX_BYTES]; /* answers that are compared */
};

/* ---- a call's beginning and end ----------------------------------------------------- */

/* link_begin(), into step if we are not, and what came unasked is heard. */
enum driver_result rci_begin(struct instrument *in, const char *call, struct driver_error *error);
/* For wait_button: a cancellation before it counts. */
enum driver_result rci_begin_waiting(struct instrument *in, const char *call,
                                     struct driver_error *error);
/* Notes whether an answer may still come, and returns r. */
enum driver_result rci_end(struct instrument *in, enum driver_result r);

/* ---- asking ------------------------------------------------------------------------- */

int64_t rci_deadline(const struct instrument *in, int64_t job_ms); /* with the reply timeout */

enum driver_result rci_send(struct instrument *in, const char *command, struct driver_error *error);

/* An answer of this kind, or one that is an error; `line` is where the reply points.
 * DRIVER_PROTOCOL for bytes that are none; DRIVER_GONE where the line's settings are lost. */
enum driver_result rci_await(struct instrument *in, enum rci_kind kind, int64_t deadline_ms,
                             char line[LINE_MAX_BYTES], struct rci_reply *ret,
                             struct driver_error *error);
enum driver_result rci_ask(struct instrument *in, const char *command, enum rci_kind kind,
                           int64_t deadline_ms, char line[LINE_MAX_BYTES], struct rci_reply *ret,
                           struct driver_error *error);

/* Two answers that agree, of at most three. */
enum driver_result rci_confirm(struct instrument *in, const char *command, enum rci_kind kind,
                               struct rci_reply *ret, struct driver_error *error);
/* The same; an error is one, but for "busy", which is waited out until the deadline. */
enum driver_result rci_query(struct instrument *in, const char *command, enum rci_kind kind,
                             int64_t deadline_ms, struct rci_reply *ret,
                             struct driver_error *error);

/* A setting: sent again once where the answer is damaged or the instrument did not understand. */
enum driver_result rci_command(struct instrument *in, const char *command,
                               struct driver_error *error);

/* CE: what waits for the operator is ended, an error is forgotten, a shot is waited for.
 * Before each action. */
enum driver_result rci_clear(struct instrument *in, struct driver_error *error);

/* DRIVER_OK where it says that it is done, else the error that its status means; calibrations
 * become due where it says so. */
enum driver_result rci_judge(struct instrument *in, const struct rci_reply *reply,
                             struct driver_error *error);
enum rci_reaction rci_reaction_to(const struct rci_reply *reply);

/* Throw away what comes until it is quiet. */
enum driver_result rci_settle(struct instrument *in, struct driver_error *error);

/* The second between commands that an instrument wants that is busy. */
enum driver_result rci_pause(struct instrument *in, int64_t deadline_ms,
                             struct driver_error *error);

/* ---- shots (shot.c) ----------------------------------------------------------------- */

/* Flash, and what it gave. */
enum driver_result rci_shoot(struct instrument *in, struct rci_spectra *ret,
                             struct driver_error *error);
/* SCE of the shot before this conversation, so that it is not taken for one of ours. */
enum driver_result rci_note_last(struct instrument *in, struct driver_error *error);

/* ---- presses (press.c) -------------------------------------------------------------- */

/* A line came that nobody asked for. */
void rci_note_unasked(struct instrument *in, const struct rci_reply *reply);
void rci_forget_press(struct instrument *in);
/* Whether the shot of a press is to be fetched rather than made. */
bool rci_take_press(struct instrument *in);

/* ---- functions of the driver -------------------------------------------------------- */

enum driver_result rci_measure(struct instrument *in, struct driver_reading *ret,
                               struct driver_error *error);
enum driver_result rci_wait_button(struct instrument *in, int timeout_ms, bool *pressed,
                                   struct driver_error *error);
enum driver_result rci_stored_count(struct instrument *in, size_t *ret, struct driver_error *error);
enum driver_result rci_stored_read(struct instrument *in, size_t i, struct driver_reading *ret,
                                   struct driver_error *error);

#endif
