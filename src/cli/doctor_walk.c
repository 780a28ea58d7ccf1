/* doctor_walk.c - identity, status, calibrations, shots, button, cable, questions. */
#include "cli/doctor_walk.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/log.h"
#include "base/uuid.h"
#include "cli/doctor_point.h"
#include "cli/instrument.h"
#include "cli/member.h"
#include "cli/out.h"
#include "cli/patient.h"
#include "cli/prompt.h"
#include "json/give.h"

enum {
    OPEN_MS = 60000,
    STEP_MS = 300000, /* the slowest instrument's own limit is 240 s */
    PERSON_MS = 60000,
    BUTTON_MS = 30000,
    SHOTS = 3,
    NOTE_SIZE = 512,
};

struct walk {
    struct remote *remote;
    struct stop *stop;
    const char *driver;
    cJSON *notes;
    cJSON *instrument; /* as it was when it was opened */
    bool ended;        /* nobody is asked any more */
};

/* ---- notes -------------------------------------------------------------------------- */

static void keep(struct walk *w, const char *step, const char *text)
{
    cJSON *one = cJSON_CreateObject();
    cJSON_AddStringToObject(one, "step", step);
    cJSON_AddStringToObject(one, "outcome", text);
    if (one == NULL)
        out_of_memory();
    json_give_item(w->notes, one);
}

/* Kept and told. */
static void note(struct walk *w, const char *step, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

static void note(struct walk *w, const char *step, const char *format, ...)
{
    char text[NOTE_SIZE];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    keep(w, step, text);
    fprintf(stderr, "  %s\n", text);
}

/* ---- asking ------------------------------------------------------------------------- */

/* A line of the person; false: there is none, and the walk has ended. */
static bool read_answer(struct walk *w, char answer[PROMPT_SIZE])
{
    const struct remote_watch watch = { STDIN_FILENO, w->stop->fd, -1 };
    struct prompt prompt = { .n = 0 };
    struct answer line;
    for (;;) {
        enum remote_news news = remote_next(w->remote, &watch, &line);
        if (news == REMOTE_LINE) {
            remote_done(&line);
            continue;
        }
        enum prompt_line typed = news == REMOTE_INPUT ? prompt_read(&prompt) : PROMPT_END;
        if (typed == PROMPT_ENTER) {
            snprintf(answer, PROMPT_SIZE, "%s", prompt.text);
            return true;
        }
        if (typed == PROMPT_END) {
            if (news == REMOTE_STOP)
                stop_take(w->stop);
            w->ended = true;
            return false;
        }
    }
}

/* True: do it. */
static bool goes_on(struct walk *w, const char *step, const char *what)
{
    char answer[PROMPT_SIZE];
    if (w->ended)
        return false;
    prompt_forget();
    fprintf(stderr, "%s: %s\n  Enter: done, go on; s: skip; q: end here > ", step, what);
    if (!read_answer(w, answer))
        return false;
    w->ended = strcmp(answer, "q") == 0;
    if (strcmp(answer, "s") == 0)
        note(w, step, "skipped");
    return !w->ended && strcmp(answer, "s") != 0;
}

/* ---- talking to it ------------------------------------------------------------------ */

/* The reply to a request of the lease's holder; false: noted under this word, or the end. */
static bool ask(struct walk *w, const char *step, const char *word, enum method method,
                cJSON *params, struct answer *ret)
{
    if (!patient_ask(w->remote, w->stop, method, params, STEP_MS, ret)) {
        note(w, step, "failed: the station gave no answer");
        w->ended = true;
        return false;
    }
    if (ret->error == NULL)
        return true;
    const cJSON *data = member(ret->error, "data");
    const char *code = member_text(data, "device_code");
    note(w, step, "%s: %s (%s%s%s)", word, member_text(ret->error, "message"),
         member_text(data, "reason"), *code != '\0' ? " " : "", code);
    remote_done(ret);
    return false;
}

static bool wait_for(struct walk *w, const char *topic, const char *type, int timeout_ms)
{
    int64_t until_ms = clock_monotonic_ms() + timeout_ms, left_ms;
    struct answer line;
    while ((left_ms = until_ms - clock_monotonic_ms()) > 0) {
        const struct remote_watch watch = { -1, w->stop->fd, (int)left_ms };
        enum remote_news news = remote_next(w->remote, &watch, &line);
        if (news == REMOTE_SILENT)
            return false;
        if (news != REMOTE_LINE) {
            if (news == REMOTE_STOP)
                stop_take(w->stop);
            w->ended = true;
            return false;
        }
        bool came = strcmp(member_text(line.params, "topic"), topic) == 0 &&
                    strcmp(member_text(line.params, "type"), type) == 0;
        remote_done(&line);
        if (came)
            return true;
    }
    return false;
}

static bool measure(struct walk *w, const char *step, const char *word, int shots)
{
    char uuid[UUID_TEXT_SIZE];
    struct answer answer;
    if (uuid4_make(uuid) != STATUS_OK) {
        note(w, step, "failed: the system has no random numbers");
        return false;
    }
    cJSON *params = remote_lease_params(w->remote);
    cJSON_AddStringToObject(params, "uuid", uuid);
    cJSON_AddStringToObject(params, "specular", "sce");
    cJSON_AddNumberToObject(params, "replicates", shots);
    cJSON_AddStringToObject(params, "pace", "auto");
    if (!ask(w, step, word, METHOD_MEASURE_START, params, &answer))
        return false;
    const cJSON *Lab = member(answer.result, "Lab");
    note(w, step, "done: L* %.2f  a* %.2f  b* %.2f",
         cJSON_GetNumberValue(cJSON_GetArrayItem(Lab, 0)),
         cJSON_GetNumberValue(cJSON_GetArrayItem(Lab, 1)),
         cJSON_GetNumberValue(cJSON_GetArrayItem(Lab, 2)));
    remote_done(&answer);
    return true;
}

/* ---- the steps ---------------------------------------------------------------------- */

static void add(char *text, size_t size, const cJSON *instrument, const char *name)
{
    const char *value = member_text(instrument, name);
    size_t n = strlen(text);
    if (*value != '\0')
        snprintf(text + n, size - n, "%s%s %s", n > 0 ? ", " : "", name, value);
}

static void tell_identity(struct walk *w)
{
    static const char *const names[] = { "maker",      "model",    "serial", "firmware",
                                         "white_tile", "geometry", "state" };
    char text[NOTE_SIZE] = "";
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        add(text, sizeof text, w->instrument, names[i]);
    fputs("identity:\n", stderr);
    note(w, "identity", "%s", text);
    double battery = member_number(w->instrument, "battery_percent");
    fputs("status:\n", stderr);
    if (battery >= 0.0)
        note(w, "status", "battery %.0f %%, %s", battery,
             member_true(w->instrument, "charging") ? "charging" : "ready");
    else
        note(w, "status", "no battery is told");
}

static const char *place_of(const cJSON *instrument, const char *step)
{
    const cJSON *one;
    cJSON_ArrayForEach(one, member(instrument, "calibration"))
    {
        if (strcmp(member_text(one, "step"), step) == 0)
            return member_text(one, "place");
    }
    return "";
}

static void calibrate(struct walk *w, const char *step)
{
    char name[NOTE_SIZE], what[NOTE_SIZE];
    struct answer answer;
    cJSON *now = w->ended ? NULL : patient_instrument(w->remote, w->stop, OPEN_MS);
    const char *place = place_of(now, step);
    snprintf(name, sizeof name, "calibrate %s", step);
    snprintf(what, sizeof what, "%s", *place != '\0' ? place : "place what it wants");
    cJSON_Delete(now);
    if (!goes_on(w, name, what))
        return;
    cJSON *params = remote_lease_params(w->remote);
    cJSON_AddStringToObject(params, "step", step);
    if (ask(w, name, "failed", METHOD_INSTRUMENT_CALIBRATE, params, &answer)) {
        note(w, name, "done");
        remote_done(&answer);
    }
}

static void try_button(struct walk *w)
{
    if (!member_true(w->instrument, "has_button")) {
        if (!w->ended)
            note(w, "button", "the driver knows of none");
        return;
    }
    if (!goes_on(w, "button", "Enter, then press the instrument's own button within 30 s"))
        return;
    if (wait_for(w, "instrument", "button", BUTTON_MS))
        note(w, "button", "the press was seen");
    else if (!w->ended)
        note(w, "button", "failed: no press was seen within 30 s");
}

static void try_cable(struct walk *w)
{
    if (!goes_on(w, "cable", "Enter, then pull the cable out, wait 5 s, and plug it in again"))
        return;
    if (!wait_for(w, "instrument", "gone", PERSON_MS)) {
        if (!w->ended)
            note(w, "cable", "failed: its going was not seen within 60 s");
        return;
    }
    note(w, "cable", "gone");
    if (wait_for(w, "instrument", "connected", PERSON_MS))
        note(w, "cable", "back");
    else if (!w->ended)
        note(w, "cable", "failed: it did not come back within 60 s");
}

static void put_question(struct walk *w, const struct doctor_point *point)
{
    char answer[PROMPT_SIZE], text[NOTE_SIZE];
    if (w->ended || (point->before != NULL && !goes_on(w, point->name, point->before)))
        return;
    if (point->shot)
        (void)measure(w, point->name, "refused", 1); /* which may be what is to be known */
    if (w->ended)
        return;
    prompt_forget();
    fprintf(stderr, "%s: %s\n  (Enter alone: not known; no names of people) > ", point->name,
            point->question);
    if (!read_answer(w, answer))
        return;
    snprintf(text, sizeof text, "%s -> %s", point->question,
             *answer != '\0' ? answer : "not known");
    keep(w, point->name, text);
}

/* ---- all ---------------------------------------------------------------------------- */

static bool take_instrument(struct walk *w)
{
    w->instrument = patient_instrument(w->remote, w->stop, OPEN_MS);
    if (w->instrument == NULL)
        return false;
    fputs("open:\n", stderr);
    if (member(w->instrument, "error") != NULL) {
        note(w, "open", "failed: %s", member_text(w->instrument, "error"));
        return false;
    }
    note(w, "open", "done");
    return instrument_acquire(w->remote, member_text(w->instrument, "instrument"), false);
}

static void lead(struct walk *w)
{
    const struct doctor_point *point;
    tell_identity(w);
    calibrate(w, "zero");
    calibrate(w, "white");
    if (goes_on(w, "three shots", "put the port flat on skin (a palm is good) and keep it there"))
        (void)measure(w, "three shots", "failed", SHOTS);
    try_button(w);
    for (size_t i = 0; (point = doctor_point(w->driver, i)) != NULL; i++)
        put_question(w, point);
    try_cable(w); /* last: its calibration is due afterwards */
}

bool doctor_walk(struct remote *remote, struct stop *stop, const char *driver, cJSON *notes)
{
    struct walk w = { .remote = remote, .stop = stop, .driver = driver, .notes = notes };
    cJSON *subscribed = remote_subscribe(remote, 1u << EVENT_INSTRUMENT, -1);
    bool good = subscribed != NULL && take_instrument(&w);
    if (good)
        lead(&w);
    cJSON_Delete(subscribed);
    cJSON_Delete(w.instrument);
    return good && !w.ended;
}
