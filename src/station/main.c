/* main.c - skinspecd: options, signals, and the loop. */
#define _DEFAULT_SOURCE /* initgroups() */
#include <errno.h>
#include <grp.h>
#include <pwd.h>
#include <signal.h>
#include <sqlite3.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/signalfd.h>
#include <sys/stat.h>
#include <systemd/sd-daemon.h>
#include <systemd/sd-event.h>
#include <unistd.h>

#include "base/log.h"
#include "json/blocks.h"
#include "json/memory.h"
#include "station/housekeeping.h"
#include "station/listener.h"
#include "station/settings.h"
#include "station/station.h"

enum { STOP_WITHIN_MS = 1000, STOP_LOOK_MS = 10 };

/* ---- who it runs as ----------------------------------------------------------------- */

/* Never stay root because an account is missing. */
static enum status become(const char *name)
{
    errno = 0;
    const struct passwd *user = getpwnam(name);
    if (user == NULL) {
        log_error("station: there is no account '%s' to run as%s%s; make it, or leave out --user",
                  name, errno != 0 ? ": " : "", errno != 0 ? strerror(errno) : "");
        return STATUS_NOT_FOUND;
    }
    if (user->pw_uid == getuid() && user->pw_uid == geteuid())
        return STATUS_OK;
    if (initgroups(user->pw_name, user->pw_gid) == 0 && setgid(user->pw_gid) == 0 &&
        setuid(user->pw_uid) == 0)
        return STATUS_OK;
    log_error("station: cannot become '%s': %s", name, strerror(errno));
    return STATUS_IO;
}

/* ---- starting and stopping ---------------------------------------------------------- */

struct running {
    struct station station;
    sd_event_source *stop_timer;
    uint64_t stop_by_us;
    bool stopping;
};

static int look_whether_quiet(sd_event_source *source, uint64_t now_us, void *userdata)
{
    struct running *running = userdata;
    if (station_is_quiet(&running->station) || now_us >= running->stop_by_us)
        return sd_event_exit(running->station.event, 0);
    sd_event_source_set_time(source, now_us + STOP_LOOK_MS * UINT64_C(1000));
    return sd_event_source_set_enabled(source, SD_EVENT_ONESHOT);
}

static int on_signal(sd_event_source *source, const struct signalfd_siginfo *info, void *userdata)
{
    struct running *running = userdata;
    uint64_t now_us;
    (void)source;
    if (running->stopping)
        return 0;
    log_info("station: %s: finishing what is acknowledged", strsignal((int)info->ssi_signo));
    sd_notify(0, "STOPPING=1");
    running->stopping = true;
    station_stop(&running->station);
    sd_event_now(running->station.event, CLOCK_MONOTONIC, &now_us);
    running->stop_by_us = now_us + STOP_WITHIN_MS * UINT64_C(1000);
    sd_event_source_set_time(running->stop_timer, now_us);
    if (sd_event_source_set_enabled(running->stop_timer, SD_EVENT_ONESHOT) < 0)
        sd_event_exit(running->station.event, 0);
    return 0;
}

static void on_store_opened(struct station *station, bool hopeless)
{
    if (hopeless) { /* logged by the store; nothing was touched */
        sd_event_exit(station->event, EXIT_FAILURE);
        return;
    }
    sd_notify(0, "READY=1\nSTATUS=Serving");
    log_info("station: ready");
}

/* Signals come through the loop; all threads inherit the mask. */
static enum status take_signals(struct running *running)
{
    static const int signals[] = { SIGTERM, SIGINT, SIGHUP };
    sigset_t mask;
    signal(SIGPIPE, SIG_IGN);
    signal(SIGXFSZ, SIG_IGN); /* a file too large is then an error that can be told */
    sigemptyset(&mask);
    for (size_t i = 0; i < sizeof signals / sizeof *signals; i++)
        sigaddset(&mask, signals[i]);
    if (sigprocmask(SIG_BLOCK, &mask, NULL) != 0)
        return STATUS_IO;
    /* Made now: there may be no descriptor left when it is wanted. */
    if (sd_event_add_time(running->station.event, &running->stop_timer, CLOCK_MONOTONIC, UINT64_MAX,
                          1000, look_whether_quiet, running) < 0 ||
        sd_event_source_set_enabled(running->stop_timer, SD_EVENT_OFF) < 0)
        return STATUS_NO_MEMORY;
    for (size_t i = 0; i < sizeof signals / sizeof *signals; i++)
        if (sd_event_add_signal(running->station.event, NULL, signals[i], on_signal, running) < 0)
            return STATUS_NO_MEMORY;
    return STATUS_OK;
}

static int serve(struct running *running, struct listener *listener)
{
    struct station *station = &running->station;
    int exit_status = EXIT_FAILURE;
    enum status s = take_signals(running); /* before any thread is started */
    if (s == STATUS_OK)
        s = station_open(station);
    if (s == STATUS_OK)
        s = listener_open(station->settings->socket, listener);
    if (s == STATUS_OK)
        s = station_listen(station, listener->fd);
    if (s == STATUS_OK)
        s = housekeeping_start(station);
    if (s == STATUS_NO_MEMORY)
        log_error("station: %s", status_text(s));
    if (s == STATUS_OK && sd_event_set_watchdog(station->event, true) >= 0)
        exit_status = sd_event_loop(station->event);
    listener_close(listener);
    station_close(station);
    housekeeping_stop(station->housekeeping);
    return exit_status < 0 ? EXIT_FAILURE : exit_status;
}

int main(int argc, char **argv)
{
    static struct settings settings;
    static struct running running;
    struct listener listener = { .fd = -1 };
    log_set_name("skinspecd");
    settings_read(argc, argv, &settings);
    if (settings.verbose)
        log_set_level(LOG_DEBUG);
    if (settings.user != NULL && become(settings.user) != STATUS_OK)
        return EXIT_FAILURE;
    json_memory_watch();
    sqlite3_config(SQLITE_CONFIG_MEMSTATUS, 0); /* its own count of memory costs a tenth */
    umask(0077);                                /* health data are for this account alone */
    json_keep_blocks();                         /* before there are threads */
    running.station.settings = &settings;
    running.station.store_opened = on_store_opened;
    if (sd_event_default(&running.station.event) < 0) {
        log_error("station: cannot make an event loop");
        return EXIT_FAILURE;
    }
    int exit_status = serve(&running, &listener);
    sd_event_unref(running.station.event);
    json_keep_no_blocks();
    log_info("station: ended");
    return exit_status;
}
