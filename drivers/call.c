/* call.c - an eventfd beside the instrument's own descriptor in one poll(). */
#include "drivers/call.h"

#include <limits.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <time.h>
#include <unistd.h>

bool call_init(struct call *call)
{
    call->cancelled_fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    return call->cancelled_fd >= 0;
}

void call_done(struct call *call)
{
    close(call->cancelled_fd);
}

void call_begin(struct call *call)
{
    eventfd_t left_over; /* by a cancellation after the last call */
    (void)eventfd_read(call->cancelled_fd, &left_over);
}

void call_cancel(struct call *call)
{
    (void)eventfd_write(call->cancelled_fd, 1);
}

int64_t call_now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

enum call_end_of_wait call_wait(struct call *call, int fd, int64_t deadline_ms)
{
    struct pollfd on[2] = {
        { .fd = call->cancelled_fd, .events = POLLIN },
        { .fd = fd, .events = POLLIN }, /* poll() passes over -1 */
    };
    for (;;) {
        int64_t left = deadline_ms - call_now_ms();
        int ready = poll(on, 2, left <= 0 ? 0 : left > INT_MAX ? INT_MAX : (int)left);
        if (ready > 0)
            return on[0].revents != 0 ? CALL_CANCELLED : CALL_READABLE;
        if (left <= 0)
            return CALL_DEADLINE;
        /* Otherwise a signal came, or poll() was a millisecond early: look again. */
    }
}
