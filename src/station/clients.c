/* clients.c - accepting, limits, reading in turns, sending without waiting. */
#define _GNU_SOURCE /* accept4() */
#include "station/clients.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/log.h"

enum { ACCEPT_AT_ONCE = 16, ACCEPT_REST_MS = 100 };

struct clients {
    struct clients_settings settings;
    sd_event_source *listener, *rested, *reaper, *ready;
    int epoll_fd; /* of all clients: readable where one of them is ready */
    int spare_fd; /* given up for a moment, to refuse a client when there are no more */
    uint64_t next;
    size_t places; /* one more than the limit, for root */
    struct clients_counts counts;
    struct client *place[];
};

static int open_spare(void)
{
    return open("/dev/null", O_RDONLY | O_CLOEXEC);
}

/* ---- going -------------------------------------------------------------------------- */

static void drop(struct client *client)
{
    if (client->doomed)
        return;
    client->doomed = true;
    (void)epoll_ctl(client->of->epoll_fd, EPOLL_CTL_DEL, client->connection.fd, NULL);
    client->again = sd_event_source_disable_unref(client->again);
    client->deadline = sd_event_source_disable_unref(client->deadline);
    sd_event_source_set_enabled(client->of->reaper, SD_EVENT_ONESHOT);
}

static void remove_client(struct clients *clients, size_t i)
{
    struct client *client = clients->place[i];
    clients->settings.gone(clients->settings.context, client);
    clients->place[i] = NULL;
    clients->counts.now--;
    connection_done(&client->connection);
    free(client);
}

static void reap(struct clients *clients)
{
    for (size_t i = 0; i < clients->places; i++)
        if (clients->place[i] != NULL && clients->place[i]->doomed)
            remove_client(clients, i);
}

static int on_reap(sd_event_source *source, void *userdata)
{
    (void)source;
    reap(userdata);
    return 0;
}

/* ---- sending ------------------------------------------------------------------------ */

static int on_again(sd_event_source *source, void *userdata);

/* The lines that wait have their turn behind all that is pending.  The source is made anew each
 * time: one that is only switched on again has been pending since it was made, as sd-event
 * counts, and would come before everybody. */
static void set_again(struct client *client, bool on)
{
    if (!on)
        client->again = sd_event_source_disable_unref(client->again);
    else if (client->again == NULL &&
             sd_event_add_defer(client->of->settings.event, &client->again, on_again, client) < 0)
        drop(client);
}

static bool watch_for(struct client *client, int operation, uint32_t events)
{
    struct epoll_event event = { .events = events, .data.u64 = client->number };
    if (operation == EPOLL_CTL_MOD && client->watched == events)
        return true;
    client->watched = events;
    return epoll_ctl(client->of->epoll_fd, operation, client->connection.fd, &event) == 0;
}

/* Watch for what is wanted now: room to send, more to read, the time of an idle reader. */
static void watch(struct client *client)
{
    size_t unsent = connection_unsent(&client->connection);
    bool reads = !client->leaving && !client->said_all && unsent < CLIENTS_UNSENT_PAUSE;
    bool is_done = client->leaving || (client->said_all && client->open_requests == 0);
    if (client->doomed)
        return;
    if (is_done && unsent == 0) {
        drop(client);
        return;
    }
    if (!watch_for(client, EPOLL_CTL_MOD,
                   (reads && !client->connection.has_line ? EPOLLIN : 0) |
                       (unsent > 0 ? EPOLLOUT : 0))) {
        drop(client);
        return;
    }
    if (unsent > 0) {
        uint64_t at_us = (uint64_t)connection_deadline_ms(&client->connection) * 1000;
        sd_event_source_set_time(client->deadline, at_us);
    }
    sd_event_source_set_enabled(client->deadline, unsent > 0 ? SD_EVENT_ONESHOT : SD_EVENT_OFF);
    set_again(client, reads && client->connection.has_line);
}

void client_send(struct client *client, const struct line *line)
{
    if (client->doomed)
        return;
    enum status s = connection_send(&client->connection, line->text, line->n, clock_monotonic_ms());
    if (s == STATUS_RANGE) {
        log_warning("station: client '%s' of user %u does not read; dropped", client->name,
                    (unsigned)client->peer.uid);
        client->of->counts.dropped++;
    }
    if (s != STATUS_OK)
        drop(client);
    else if (connection_unsent(&client->connection) > 0 || client->said_all)
        watch(client);
}

void client_leave(struct client *client)
{
    client->leaving = true;
    watch(client);
}

void client_end_turn(struct client *client)
{
    client->turn_over = true;
}

/* ---- reading ------------------------------------------------------------------------ */

static bool on_line(void *context, char *line, size_t n)
{
    struct client *client = context;
    struct clients *clients = client->of;
    if (n > 0) /* an empty line is nothing */
        clients->settings.line(clients->settings.context, client, line, n);
    return !client->doomed && !client->leaving && !client->turn_over;
}

static void refuse_long_line(struct client *client)
{
    const struct request_id none = { .kind = REQUEST_ID_NONE };
    struct refusal refusal;
    struct line line;
    refusal_set(&refusal, REASON_LINE_TOO_LONG, NULL);
    if (protocol_refuse(client->of->settings.protocol, &none, &refusal, &line) == STATUS_OK) {
        client_send(client, &line);
        free(line.text);
    }
    client->leaving = true;
}

static void read_some(struct client *client)
{
    client->turn_over = false;
    enum status s = connection_read(&client->connection, CLIENTS_LINES_AT_ONCE, on_line, client);
    if (s == STATUS_RANGE)
        refuse_long_line(client);
    else if (s == STATUS_NOT_FOUND)
        client->said_all = true; /* one that is gone altogether shows as EPOLLHUP next */
    else if (s == STATUS_IO)
        drop(client);
    watch(client);
}

static void take_events(struct client *client, uint32_t events)
{
    bool readable = (events & EPOLLIN) != 0; /* what was said before a hang-up still counts */
    bool gone = !readable && (events & (EPOLLHUP | EPOLLERR)) != 0;
    if ((events & EPOLLOUT) != 0 &&
        connection_flush(&client->connection, clock_monotonic_ms()) != STATUS_OK)
        gone = true;
    if (gone)
        drop(client);
    else if (readable)
        read_some(client);
    else
        watch(client);
}

/* A round.  Who is ready beyond it has the next one: the kernel takes them in turns.  All of
 * them by one source: sd-event looks around in full, one epoll_wait() and three clocks, before
 * each source that it serves. */
static int on_ready(sd_event_source *source, int fd, uint32_t events, void *userdata)
{
    struct clients *clients = userdata;
    struct epoll_event ready[CLIENTS_AT_ONCE];
    (void)source;
    (void)events;
    int n = epoll_wait(fd, ready, CLIENTS_AT_ONCE, 0);
    for (int i = 0; i < n; i++) {
        struct client *client = clients_find(clients, ready[i].data.u64);
        if (client != NULL) /* one before it may have had it dropped */
            take_events(client, ready[i].events);
    }
    return 0;
}

static int on_again(sd_event_source *source, void *userdata)
{
    struct client *client = userdata;
    (void)source;
    client->again = sd_event_source_disable_unref(client->again);
    read_some(client);
    return 0;
}

static int on_deadline(sd_event_source *source, uint64_t at_us, void *userdata)
{
    struct client *client = userdata;
    (void)source;
    (void)at_us;
    if (clock_monotonic_ms() < connection_deadline_ms(&client->connection)) {
        watch(client);
        return 0;
    }
    log_warning("station: client '%s' of user %u has not read for %d s; dropped", client->name,
                (unsigned)client->peer.uid, CONNECTION_UNSENT_MS / 1000);
    client->of->counts.dropped++;
    drop(client);
    return 0;
}

/* ---- letting in --------------------------------------------------------------------- */

/* The reason why not; REASONS where there is none. */
static enum reason why_not(const struct clients *clients, const struct peer *peer)
{
    size_t all = 0, of_user = 0, of_process = 0;
    for (size_t i = 0; i < clients->places; i++) {
        const struct client *c = clients->place[i];
        if (c == NULL || c->doomed)
            continue;
        all++;
        of_user += c->peer.uid == peer->uid;
        of_process += c->peer.pid == peer->pid;
    }
    if (all >= clients->settings.max + (peer->uid == 0))
        return REASON_TOO_MANY_CLIENTS;
    if (of_user >= clients->settings.max_per_user + (peer->uid == 0))
        return REASON_TOO_MANY_FOR_USER;
    return of_process >= clients->settings.max_per_process ? REASON_TOO_MANY_FOR_PROCESS : REASONS;
}

/* One line into a socket that is still empty, and that is all. */
static void turn_away(struct clients *clients, int fd, enum reason reason)
{
    const struct request_id none = { .kind = REQUEST_ID_NONE };
    struct refusal refusal;
    struct line line;
    clients->counts.refused++;
    refusal_set(&refusal, reason, NULL);
    if (protocol_refuse(clients->settings.protocol, &none, &refusal, &line) == STATUS_OK) {
        line.text[line.n] = '\n'; /* in the place of the NUL */
        (void)send(fd, line.text, line.n + 1, MSG_DONTWAIT | MSG_NOSIGNAL);
        free(line.text);
    }
    close(fd);
}

static bool add_sources(struct client *client, sd_event *event)
{
    return watch_for(client, EPOLL_CTL_ADD, EPOLLIN) &&
           sd_event_add_time(event, &client->deadline, CLOCK_MONOTONIC, UINT64_MAX, 0, on_deadline,
                             client) >= 0 &&
           sd_event_source_set_enabled(client->deadline, SD_EVENT_OFF) >= 0;
}

static struct client **free_place(struct clients *clients)
{
    for (size_t i = 0; i < clients->places; i++)
        if (clients->place[i] == NULL)
            return &clients->place[i];
    return NULL;
}

static void let_in(struct clients *clients, int fd, const struct peer *peer)
{
    struct client **place = free_place(clients), *client = calloc(1, sizeof *client);
    if (place == NULL || client == NULL || connection_init(&client->connection, fd) != STATUS_OK) {
        free(client);
        turn_away(clients, fd, place == NULL ? REASON_TOO_MANY_CLIENTS : REASON_NO_MEMORY);
        return;
    }
    client->of = clients;
    client->peer = *peer;
    client->number = ++clients->next * clients->places + (size_t)(place - clients->place);
    *place = client;
    clients->counts.now++;
    clients->counts.accepted++;
    if (!add_sources(client, clients->settings.event) ||
        !clients->settings.greet(clients->settings.context, client))
        drop(client);
}

/* The listener stays readable and nobody can be taken from it: look again later, for the
 * descriptors may be another's, and no client of ours has to go before there are some. */
static void rest(struct clients *clients)
{
    sd_event_source_set_enabled(clients->listener, SD_EVENT_OFF);
    sd_event_source_set_time(clients->rested,
                             (uint64_t)(clock_monotonic_ms() + ACCEPT_REST_MS) * 1000);
    sd_event_source_set_enabled(clients->rested, SD_EVENT_ONESHOT);
}

static int on_rested(sd_event_source *source, uint64_t at_us, void *userdata)
{
    struct clients *clients = userdata;
    (void)source;
    (void)at_us;
    sd_event_source_set_enabled(clients->listener, SD_EVENT_ON);
    return 0;
}

/* Without a descriptor left: take it with the spare one, to say so. */
static void accept_to_refuse(struct clients *clients, int listener)
{
    if (clients->spare_fd >= 0)
        close(clients->spare_fd);
    int fd = accept4(listener, NULL, NULL, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (fd >= 0)
        turn_away(clients, fd, REASON_TOO_MANY_CLIENTS);
    else
        rest(clients);
    clients->spare_fd = open_spare();
}

static int on_accept(sd_event_source *source, int listener, uint32_t events, void *userdata)
{
    struct clients *clients = userdata;
    (void)source;
    (void)events;
    reap(clients); /* their places may be wanted */
    for (int i = 0; i < ACCEPT_AT_ONCE; i++) {
        struct peer peer;
        int fd = accept4(listener, NULL, NULL, SOCK_CLOEXEC | SOCK_NONBLOCK);
        if (fd < 0 && (errno == EMFILE || errno == ENFILE))
            accept_to_refuse(clients, listener);
        if (fd < 0)
            return 0; /* nobody more, or one that gave up: the loop comes again */
        if (!rights_of_peer(&clients->settings.rights, fd, &peer)) {
            close(fd);
            continue;
        }
        enum reason reason = why_not(clients, &peer);
        if (reason != REASONS)
            turn_away(clients, fd, reason);
        else
            let_in(clients, fd, &peer);
    }
    return 0;
}

/* ---- all of them -------------------------------------------------------------------- */

enum status clients_open(const struct clients_settings *settings, struct clients **ret)
{
    size_t places = settings->max + 1; /* root's */
    struct clients *clients = calloc(1, sizeof *clients + places * sizeof(struct client *));
    if (clients == NULL)
        return STATUS_NO_MEMORY;
    clients->settings = *settings;
    clients->places = places;
    clients->spare_fd = open_spare();
    clients->epoll_fd = epoll_create1(EPOLL_CLOEXEC);
    if (clients->epoll_fd < 0 ||
        sd_event_add_io(settings->event, &clients->ready, clients->epoll_fd, EPOLLIN, on_ready,
                        clients) < 0 ||
        sd_event_add_defer(settings->event, &clients->reaper, on_reap, clients) < 0 ||
        sd_event_source_set_enabled(clients->reaper, SD_EVENT_OFF) < 0 ||
        sd_event_add_time(settings->event, &clients->rested, CLOCK_MONOTONIC, UINT64_MAX, 0,
                          on_rested, clients) < 0 ||
        sd_event_source_set_enabled(clients->rested, SD_EVENT_OFF) < 0 ||
        sd_event_add_io(settings->event, &clients->listener, settings->listener_fd, EPOLLIN,
                        on_accept, clients) < 0) {
        clients_close(clients);
        return STATUS_NO_MEMORY;
    }
    *ret = clients;
    return STATUS_OK;
}

void clients_stop_accepting(struct clients *clients)
{
    clients->listener = sd_event_source_disable_unref(clients->listener);
    clients->rested = sd_event_source_disable_unref(clients->rested);
}

void clients_close(struct clients *clients)
{
    if (clients == NULL)
        return;
    clients_stop_accepting(clients);
    for (size_t i = 0; i < clients->places; i++) {
        if (clients->place[i] == NULL)
            continue;
        drop(clients->place[i]);
        remove_client(clients, i);
    }
    sd_event_source_disable_unref(clients->reaper);
    sd_event_source_disable_unref(clients->ready);
    if (clients->epoll_fd >= 0)
        close(clients->epoll_fd);
    if (clients->spare_fd >= 0)
        close(clients->spare_fd);
    free(clients);
}

struct client *clients_find(struct clients *clients, uint64_t number)
{
    struct client *client = clients->place[number % clients->places];
    return client != NULL && client->number == number && !client->doomed ? client : NULL;
}

struct clients_counts clients_count(const struct clients *clients)
{
    return clients->counts;
}

void clients_each(struct clients *clients, clients_visit *visit, void *context)
{
    for (size_t i = 0; i < clients->places; i++)
        if (clients->place[i] != NULL && !clients->place[i]->doomed)
            visit(context, clients->place[i]);
}

void client_who(const struct client *client, char *text, size_t size)
{
    const char *name = client->operator_name;
    snprintf(text, size, "%s%suid %u", name, *name != '\0' ? ", " : "", (unsigned)client->peer.uid);
}
