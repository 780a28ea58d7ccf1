/* status.h - what a function that can fail returns.
 *
 * One meaning each; values are appended, never renumbered (they reach logs and
 * the wire by name).  Outputs stay untouched unless STATUS_OK is returned. */
#ifndef SKINSPEC_BASE_STATUS_H
#define SKINSPEC_BASE_STATUS_H

enum status {
    STATUS_OK = 0,
    STATUS_RANGE = -1,        /* outside the documented range, or not finite */
    STATUS_TIMEOUT = -2,      /* the instrument stayed silent */
    STATUS_DB = -3,           /* SQLite failed for a reason of its own */
    STATUS_NO_MEMORY = -4,    /* an allocation failed */
    STATUS_IO = -5,           /* the operating system refused a read or a write */
    STATUS_FORMAT = -6,       /* text or file that is not in the expected form */
    STATUS_VERSION = -7,      /* made by another version of this program */
    STATUS_DAMAGED = -8,      /* a hash does not match what it covers */
    STATUS_EXISTS = -9,       /* would overwrite something */
    STATUS_NOT_FOUND = -10,   /* no such file, table or name */
    STATUS_CANCELLED = -11,   /* stopped on request */
    STATUS_UNSUPPORTED = -12, /* right question, but this model or table has no answer */
    STATUS_FULL = -13,        /* no room on the disk */
    STATUS_READ_ONLY = -14    /* the file system or the folder cannot be written */
};

/* Stable token for logs and the wire, "range" for STATUS_RANGE.  Never NULL;
 * "unknown" for a value that is none of the above. */
const char *status_name(enum status s);

/* Sentence fragment for people, no full stop.  Never NULL. */
const char *status_text(enum status s);

#endif
