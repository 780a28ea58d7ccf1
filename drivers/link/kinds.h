/* kinds.h - the links that link_open() chooses from; for link.c and its tests. */
#ifndef SKINSPEC_DRIVERS_LINK_KINDS_H
#define SKINSPEC_DRIVERS_LINK_KINDS_H

#include "drivers/link/capture.h"
#include "drivers/link/link.h"

/* wanted->address is a path, wanted->serial is set. */
enum driver_result link_open_serial(const struct link_wanted *wanted, struct link **ret,
                                    struct driver_error *error);

/* wanted->address is "usb" or "usb:...", wanted->usb is set. */
enum driver_result link_open_usb(const struct link_wanted *wanted, struct link **ret,
                                 struct driver_error *error);

/* A capture instead of an instrument.  The calls of a capture are its segments, from one
 * `= CALL` to the next; what is before the first belongs to a driver that begins none.
 *
 *   begin(CALL)       the next segment of that call which was not used yet, from here on: what
 *                     lies between is left out
 *   begin("status")   the station asks when it likes: the next unused one before the next other
 *                     call, else the last one before that again, else the first of all
 *   begin("wait...")  the unused ones that brought bytes, before the next other call, one after
 *                     the other: a station cuts its waits as it likes, and one that had no time for
 *                     what it finds leaves it to the next.  After them nothing comes until
 *                     the deadline; what is sent then is answered as it was last in a wait before
 *                     the next other call, or in vain
 *
 * In a wait `~` is passed over by what is sent, a question that is not asked yet is silence, and
 * `! cancelled` is nothing.  Neither of the last two moves "here".  A driver whose call was cut
 * short begins the next with the way back into step, between `= way back` and the call's name again
 * (LINK_WAY_BACK); where a replay's was not, all that is passed over, and so is what came before
 * the first bytes that are sent in a segment; in a wait these bytes may stand anywhere.  Within a
 * segment what is sent must be what the capture has, from the first on, and on its channel, else
 * DRIVER_PROTOCOL naming file and line; what came comes at once, `~` is DRIVER_TIMEOUT at once and
 * `!` that result.  A new link begins anew.
 */
enum driver_result link_open_replay(const char *path, const struct link_wanted *wanted,
                                    struct link **ret, struct driver_error *error);

/* inner, which the new link owns, with every byte written to capture, which outlives it.
 * On failure inner is closed. */
enum driver_result link_record(struct link *inner, struct capture *capture, struct link **ret,
                               struct driver_error *error);

/* For links that can do no better: receive until nothing came for quiet_ms. */
enum driver_result link_drain_by_receiving(struct link *link, uint8_t channel, int quiet_ms,
                                           int64_t deadline_ms, struct driver_error *error);

/* How a wait for permission of a device goes: EACCES and EPERM are asked again every
 * LINK_PERMISSION_STEP_MS for LINK_PERMISSION_MS, as udev may not have set the mode yet. */
enum { LINK_PERMISSION_MS = 2000, LINK_PERMISSION_STEP_MS = 100 };

/* DRIVER_OK: try again.  began_ms: of the first try. */
enum driver_result link_wait_for_permission(const struct link_wanted *wanted, int64_t began_ms,
                                            struct driver_error *error);

#endif
