/* replay_script.h - what a capture of skinspecd --record says was asked, as steps to do again.
 *
 * src/station/asked.h has the lines.  A capture with several connections (the instrument was
 * unplugged, or the station started again) has as many parts: a replay begins anew with each. */
#ifndef SKINSPEC_CLI_REPLAY_SCRIPT_H
#define SKINSPEC_CLI_REPLAY_SCRIPT_H

#include <cjson/cJSON.h>
#include <stddef.h>

#include "base/status.h"

enum replay_kind {
    REPLAY_CONFIGURE,
    REPLAY_CALIBRATE,
    REPLAY_MEASURE,
    REPLAY_NEXT,
    REPLAY_BUTTON,
    REPLAY_REFUSED, /* what came of one of the first three: from here on */
    REPLAY_CANCELLED,
    REPLAY_RECORD,
    REPLAY_STATION, /* how the station was set; not a step */
};

struct replay_step {
    enum replay_kind kind;
    unsigned line; /* of the capture; 0: made here */
    cJSON *what;
};

struct replay_part {
    unsigned first_line, end_line; /* of the capture, from its `open` on */
    struct replay_step *steps;
    size_t n;
};

struct replay_script {
    char *path, *driver;
    cJSON *station;        /* NULL: not said */
    unsigned header_lines; /* those before the first part */
    struct replay_part *parts;
    size_t n;
};

/* Parts in which nothing was asked are left out; each but the first begins with the last
 * configure before it, as the station does.  Logged with file:line: STATUS_NOT_FOUND, STATUS_IO,
 * STATUS_VERSION, STATUS_NO_MEMORY; STATUS_FORMAT for what is no capture, or one in which nothing
 * was asked. */
enum status replay_script_read(const char *path, struct replay_script *ret);
void replay_script_free(struct replay_script *script);

/* Part i as a capture of its own.  STATUS_IO, logged. */
enum status replay_script_write(const struct replay_script *script, size_t i, const char *to);

#endif
