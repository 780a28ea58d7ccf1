/* stop.c - signals blocked, and read from a descriptor. */
#include "cli/stop.h"

#include <errno.h>
#include <string.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include "base/log.h"

enum status stop_begin(struct stop *stop)
{
    static const int signals[] = { SIGINT, SIGTERM, SIGHUP };
    sigset_t mask;
    sigemptyset(&mask);
    for (size_t i = 0; i < sizeof signals / sizeof *signals; i++) {
        struct sigaction action;
        if (sigaction(signals[i], NULL, &action) == 0 && action.sa_handler != SIG_IGN)
            sigaddset(&mask, signals[i]);
    }
    int fd = signalfd(-1, &mask, SFD_NONBLOCK | SFD_CLOEXEC);
    if (fd < 0) {
        log_error("cannot wait for signals: %s", strerror(errno));
        return STATUS_IO;
    }
    *stop = (struct stop){ .fd = fd };
    sigprocmask(SIG_BLOCK, &mask, &stop->before);
    return STATUS_OK;
}

void stop_take(struct stop *stop)
{
    struct signalfd_siginfo info;
    if (read(stop->fd, &info, sizeof info) == (ssize_t)sizeof info)
        stop->signal = (int)info.ssi_signo;
}

void stop_end(struct stop *stop)
{
    sigprocmask(SIG_SETMASK, &stop->before, NULL);
    close(stop->fd);
}

void stop_as_asked(const struct stop *stop)
{
    if (stop->signal != 0)
        raise(stop->signal);
}
