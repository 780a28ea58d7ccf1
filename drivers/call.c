/* call.c - an eventfd beside the instrument's own descriptors in one poll(). */
#include "drivers/call.h"

#include <assert.h>
#include <limits.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "base/clock.h"

bool call_init(struct call *call)
{
    call->cancelled_fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    call->cancelled = false;
    return call->cancelled_fd >= 0;
}

void call_done(struct call *call)
{
    close(call->cancelled_fd);
}

static void forget_cancellations(struct call *call)
{
    eventfd_t count;
    (void)eventfd_read(call->cancelled_fd, &count); /* fails where there were none */
}

void call_begin(struct call *call)
{
    forget_cancellations(call); /* those after the last call */
    call->cancelled = false;
}

void call_begin_waiting(struct call *call)
{
    call->cancelled = false;
}

void call_cancel(struct call *call)
{
    (void)eventfd_write(call->cancelled_fd, 1);
}

int64_t call_now_ms(void)
{
    return clock_monotonic_ms();
}

enum call_end_of_wait call_wait_any(struct call *call, struct pollfd *fds, size_t n,
                                    int64_t deadline_ms)
{
    struct pollfd on[1 + CALL_MAX_FDS] = { { .fd = call->cancelled_fd, .events = POLLIN } };
    assert(n <= CALL_MAX_FDS);
    memcpy(on + 1, fds, n * sizeof *fds);
    while (!call->cancelled) {
        int64_t left = deadline_ms - call_now_ms();
        int ready = poll(on, (nfds_t)(n + 1), left <= 0 ? 0 : left > INT_MAX ? INT_MAX : (int)left);
        if (ready > 0 && on[0].revents == 0) {
            memcpy(fds, on + 1, n * sizeof *fds);
            return CALL_READABLE;
        }
        if (ready <= 0 && left <= 0)
            return CALL_DEADLINE;
        if (ready > 0) {
            call->cancelled = true;
            forget_cancellations(call); /* this call has it: no later one */
        }
        /* Otherwise a signal came, or poll() was a millisecond early: look again. */
    }
    return CALL_CANCELLED;
}

enum call_end_of_wait call_wait(struct call *call, int fd, int64_t deadline_ms)
{
    struct pollfd on = { .fd = fd, .events = POLLIN }; /* poll() passes over -1 */
    return call_wait_any(call, &on, 1, deadline_ms);
}
