/* ticket.h - what a request leaves behind until it is answered, and the answers.
 *
 * The client may have gone by then: the answer goes nowhere then. */
#ifndef SKINSPEC_STATION_TICKET_H
#define SKINSPEC_STATION_TICKET_H

#include "station/clients.h"
#include "station/protocol.h"

struct station;

struct ticket {
    uint64_t client;
    struct request_id id;
    enum method method;
};

struct ticket ticket_of(const struct client *client, const struct request *request);

/* Each ticket is answered once.  The result is given away; NULL: no memory. */
void station_answer(struct station *station, const struct ticket *ticket, cJSON *result);
void station_answer_text(struct station *station, const struct ticket *ticket,
                         const char *result); /* JSON already */
void station_answer_line(struct station *station, const struct ticket *ticket, struct line *line);
void station_refuse(struct station *station, const struct ticket *ticket,
                    const struct refusal *refusal);
void station_refuse_for(struct station *station, const struct ticket *ticket, enum reason reason,
                        const char *format, ...) __attribute__((format(printf, 4, 5)));

#endif
