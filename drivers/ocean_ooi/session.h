/* session.h - the conversation with the spectrometer: a question and its answer, frames that are
 * fresh, and the way back into step.
 *
 * Out of step is whoever was cancelled, timed out or got what is no answer: something may
 * still be on its way.  The next call then waits for what is pending, drains the
 * endpoints, initialises (01) and sets lamp line and integration time anew; and the two
 * after it look whether something late came after all.
 *
 * After a spectrum was delivered a USB2000+ takes up to two more by itself, and hands them out
 * before anything new.  So two frames are thrown away whenever what they see has changed:
 * the integration time, or the scene, which changes between any two calls. */
#ifndef SKINSPEC_DRIVERS_OCEAN_OOI_SESSION_H
#define SKINSPEC_DRIVERS_OCEAN_OOI_SESSION_H

#include "drivers/call.h"
#include "drivers/link/link.h"
#include "drivers/ocean_ooi/ocean_ooi_wire.h"

enum { OOI_STALE_FRAMES = 2 };

struct ooi_session {
    struct call call;
    struct link *link;
    const struct ooi_model *model;
    int reply_timeout_ms; /* of a reply; a spectrum has twice the integration time more */
    bool high_speed;
    uint32_t integration_us; /* as it was read back; 0: not known yet */

    uint32_t earlier_us; /* longest time of an exposure that may still run from before */

    bool out_of_step;
    unsigned looks;           /* calls that still look for what comes late */
    int64_t pending_until_ms; /* a spectrum was asked for and may come until then */
    uint8_t bytes[OOI_MAX_FRAME / OOI_PACKET * OOI_PACKET + 2 * OOI_PACKET];
};

/* A function of the driver begins: link_begin(), and back into step where need be. */
enum driver_result ooi_begin(struct ooi_session *session, const char *call,
                             struct driver_error *error);

/* 01, the lamp line on, and the integration time of before (if any) set again. */
enum driver_result ooi_restart(struct ooi_session *session, struct driver_error *error);

enum driver_result ooi_get_status(struct ooi_session *session, struct ooi_status *ret,
                                  struct driver_error *error);
enum driver_result ooi_get_slot(struct ooi_session *session, uint8_t slot, char text[OOI_SLOT_TEXT],
                                struct driver_error *error);
enum driver_result ooi_get_level(struct ooi_session *session, uint16_t *ret,
                                 struct driver_error *error);
enum driver_result ooi_get_register(struct ooi_session *session, uint8_t reg, uint16_t *ret,
                                    struct driver_error *error);
enum driver_result ooi_get_temperature(struct ooi_session *session, double *celsius,
                                       struct driver_error *error);

/* Set and read back.  The instrument ignores in silence what it cannot do: DRIVER_PROTOCOL where
 * it kept another time, further off than one of its steps. */
enum driver_result ooi_set_integration(struct ooi_session *session, double us,
                                       struct driver_error *error);

/* Frames of a scene that may have changed since the last: counts[model->pixels] of the next that
 * is fresh, after throwing away `stale` others.  A frame of the wrong length or without its
 * sync byte is thrown away, the session brought back into step, and all is tried once more
 * (with two stale frames), then DRIVER_PROTOCOL. */
enum driver_result ooi_take_frame(struct ooi_session *session, size_t stale, uint16_t *counts,
                                  struct driver_error *error);

#endif
