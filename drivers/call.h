/* call.h - the call in progress: waiting with a deadline, and being cancelled.
 *
 * Every driver keeps one per instrument.  Its functions start with call_begin(), all
 * their waiting goes through call_wait(), and its cancel() is call_cancel().  A
 * cancellation between calls is forgotten when the next begins: it reaches the call
 * in progress and no other.  Only wait_button() starts with call_begin_waiting(), which
 * forgets nothing.  The call that notices a cancellation uses it up. */
#ifndef SKINSPEC_DRIVERS_CALL_H
#define SKINSPEC_DRIVERS_CALL_H

#include <poll.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct call {
    int cancelled_fd; /* an eventfd: readable while a cancellation has not been noticed */
    bool cancelled;   /* this call has noticed one; the calling thread's own */
};

/* false where the system has no descriptor left; there is nothing to give back then. */
bool call_init(struct call *call);
void call_done(struct call *call);

void call_begin(struct call *call);
void call_begin_waiting(struct call *call);
void call_cancel(struct call *call); /* from any thread */

/* Milliseconds of CLOCK_MONOTONIC, in which deadlines are given. */
int64_t call_now_ms(void);

/* Wait until the deadline (one in the past: just look), until fd has something to
 * read or is closed at its other end (-1: no fd), or until cancelled, which the rest
 * of the call stays. */
enum call_end_of_wait { CALL_DEADLINE, CALL_READABLE, CALL_CANCELLED };
enum call_end_of_wait call_wait(struct call *call, int fd, int64_t deadline_ms);

/* The same for n <= CALL_MAX_FDS descriptors, each with the events of poll() that it is waited
 * for.  Their revents are filled where it returns CALL_READABLE. */
enum { CALL_MAX_FDS = 15 };
enum call_end_of_wait call_wait_any(struct call *call, struct pollfd *fds, size_t n,
                                    int64_t deadline_ms);

#endif
