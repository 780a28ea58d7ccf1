/* parking.c - a list, served again as a whole. */
#include "station/parking.h"

#include <stdlib.h>

#include "station/dispatch.h"
#include "station/station.h"
#include "station/ticket.h"

struct parked {
    struct parked *next;
    uint64_t client;
    struct request request;
};

void station_park(struct station *station, const struct client *client, struct request *request)
{
    struct parked **end = &station->parked, *parked = malloc(sizeof *parked);
    if (parked == NULL) {
        struct ticket ticket = ticket_of(client, request);
        station_refuse_for(station, &ticket, REASON_NO_MEMORY, NULL);
        return;
    }
    *parked = (struct parked){ .client = client->number, .request = *request };
    request->tree = NULL; /* ours now */
    while (*end != NULL)
        end = &(*end)->next;
    *end = parked;
}

static void unpark(struct station *station, struct parked *parked, bool serve_it)
{
    struct client *client = clients_find(station->clients, parked->client);
    if (client != NULL && serve_it) {
        dispatch(station, client, &parked->request);
    } else if (client != NULL) {
        struct ticket ticket = ticket_of(client, &parked->request);
        station_refuse_for(station, &ticket, REASON_SHUTTING_DOWN, NULL);
    }
    request_done(&parked->request);
    free(parked);
}

static void unpark_all(struct station *station, bool serve_them)
{
    struct parked *list = station->parked;
    station->parked = NULL; /* one that still has to wait parks again */
    while (list != NULL) {
        struct parked *next = list->next;
        unpark(station, list, serve_them);
        list = next;
    }
}

static int on_unpark(sd_event_source *source, void *userdata)
{
    (void)source;
    unpark_all(userdata, true);
    return 0;
}

/* Soon: whoever says so may be in the middle of something. */
void station_serve_parked(struct station *station)
{
    if (station->parked != NULL)
        sd_event_source_set_enabled(station->unpark, SD_EVENT_ONESHOT);
}

enum status parking_open(struct station *station)
{
    return sd_event_add_defer(station->event, &station->unpark, on_unpark, station) < 0
               ? STATUS_NO_MEMORY
               : STATUS_OK;
}

void parking_close(struct station *station)
{
    sd_event_source_disable_unref(station->unpark);
}

void parking_send_away(struct station *station)
{
    unpark_all(station, false);
}
