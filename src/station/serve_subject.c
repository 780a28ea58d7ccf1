/* serve_subject.c - subject.add, subject.list, subject.forget. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "json/give.h"
#include "station/params.h"
#include "station/reading.h"
#include "station/serve.h"
#include "station/station_store.h"
#include "station/strict_json.h"
#include "station/ticket.h"

enum { LIST_LIMIT = 100 };

/* ---- written ------------------------------------------------------------------------ */

struct subject_write {
    struct write_job write;
    struct station *station;
    struct ticket ticket;
    struct store_subject subject;
};

static void copy_member(const cJSON *object, const char *name, char *into, size_t size)
{
    const char *text = cJSON_GetStringValue(strict_json_member(object, name));
    snprintf(into, size, "%s", text != NULL ? text : "");
}

static void written(struct job *job)
{
    struct subject_write *w = (struct subject_write *)job;
    struct station *station = w->station;
    station_note_write(station, w->write.status);
    if (w->write.status == STATUS_OK) {
        cJSON *result = cJSON_CreateObject();
        cJSON_AddStringToObject(result, "id", w->subject.id);
        if (w->write.kind == WRITE_FORGET)
            cJSON_AddBoolToObject(result, "erased", w->write.erased);
        station_answer(station, &w->ticket, result);
    } else {
        struct refusal refusal = station_store_refusal(station, w->write.status, "subject");
        station_refuse(station, &w->ticket, &refusal);
    }
    free(w);
}

/* NULL, and the ticket refused, where nothing can be written. */
static struct subject_write *make_write(struct station *station, const struct client *client,
                                        const struct request *request, enum write_kind kind)
{
    struct ticket ticket = ticket_of(client, request);
    if (!station_can_write(station, &ticket))
        return NULL;
    struct subject_write *w = calloc(1, sizeof *w);
    if (w == NULL) {
        station_refuse_for(station, &ticket, REASON_NO_MEMORY, NULL);
        return NULL;
    }
    w->write.job.done = written;
    w->write.kind = kind;
    w->write.subject = &w->subject;
    w->station = station;
    w->ticket = ticket;
    client_who(client, w->write.who, sizeof w->write.who);
    return w;
}

void serve_subject_add(struct station *station, struct client *client, struct request *request)
{
    struct subject_write *w = make_write(station, client, request, WRITE_SUBJECT);
    if (w == NULL)
        return;
    const cJSON *person = strict_json_member(request->params, "person");
    const cJSON *year = strict_json_member(person, "birth_year");
    struct store_subject *subject = &w->subject;
    params_copy(request, "label", subject->label, sizeof subject->label);
    copy_member(person, "name", subject->name, sizeof subject->name);
    copy_member(person, "notes", subject->notes, sizeof subject->notes);
    subject->birth_year = year != NULL ? (int)year->valuedouble : 0;
    writer_ask(station->writer, &w->write);
}

void serve_subject_forget(struct station *station, struct client *client, struct request *request)
{
    struct subject_write *w = make_write(station, client, request, WRITE_FORGET);
    if (w == NULL)
        return;
    params_copy(request, "id", w->subject.id, sizeof w->subject.id);
    writer_ask(station->writer, &w->write);
}

/* ---- listed ------------------------------------------------------------------------- */

struct subjects {
    char after[STORE_UUID_SIZE], next[STORE_UUID_SIZE];
    size_t limit, n;
    size_t bytes; /* of the line so far, at most */
    bool more;
    cJSON *list;
};

static void add_known(cJSON *object, const char *name, const char *text)
{
    if (*text != '\0')
        cJSON_AddStringToObject(object, name, text);
}

static cJSON *subject_json(const struct store_subject *subject)
{
    cJSON *object = cJSON_CreateObject();
    cJSON_AddStringToObject(object, "id", subject->id);
    add_known(object, "label", subject->label);
    if (subject->name[0] != '\0' || subject->notes[0] != '\0' || subject->birth_year != 0) {
        cJSON *person = cJSON_AddObjectToObject(object, "person");
        add_known(person, "name", subject->name);
        if (subject->birth_year != 0)
            cJSON_AddNumberToObject(person, "birth_year", subject->birth_year);
        add_known(person, "notes", subject->notes);
    }
    cJSON_AddBoolToObject(object, "forgotten", subject->forgotten);
    return object;
}

/* What it may take as text: a character becomes six where it has to be escaped. */
static size_t most_bytes(const struct store_subject *subject)
{
    return 256 + 6 * (strlen(subject->label) + strlen(subject->name) + strlen(subject->notes));
}

static bool add_subject(void *context, const struct store_subject *subject)
{
    struct subjects *subjects = context;
    subjects->bytes += most_bytes(subject);
    if (subjects->n == subjects->limit ||
        (subjects->n > 0 && subjects->bytes > PROTOCOL_MAX_LINE - 1024)) {
        subjects->more = true;
        return false;
    }
    json_give_item(subjects->list, subject_json(subject));
    snprintf(subjects->next, sizeof subjects->next, "%s", subject->id);
    subjects->n++;
    return true;
}

static cJSON *read_subjects(struct reading *reading, struct worker *worker, struct refusal *refusal)
{
    struct subjects *subjects = reading->own;
    struct store_reader *reader = reading_store(worker, refusal);
    if (reader == NULL)
        return NULL;
    cJSON *result = cJSON_CreateObject();
    subjects->list = cJSON_AddArrayToObject(result, "subjects");
    enum status s = store_list_subjects(reader, subjects->after, add_subject, subjects);
    if (s == STATUS_OK) {
        if (subjects->more)
            cJSON_AddStringToObject(result, "next", subjects->next);
        return result;
    }
    if (s == STATUS_NOT_FOUND)
        refusal_set(refusal, REASON_SUBJECT_UNKNOWN, NULL);
    else
        reading_failed(worker, s, refusal);
    cJSON_Delete(result);
    return NULL;
}

void serve_subject_list(struct station *station, struct client *client, struct request *request)
{
    struct reading *reading = reading_make(station, client, request, sizeof(struct subjects));
    if (reading == NULL)
        return;
    struct subjects *subjects = reading->own;
    params_copy(request, "after", subjects->after, sizeof subjects->after);
    subjects->limit = (size_t)params_integer(request, "limit", LIST_LIMIT);
    reading->read = read_subjects;
    reading_ask(reading, station->reader);
}
