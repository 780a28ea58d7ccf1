/* asked.c - requests and records as lines of a capture. */
#include "station/asked.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "drivers/link/capture.h"
#include "json/give.h"
#include "json/print.h"
#include "station/wire.h"

enum { MAX_LINE = 8 << 20 }; /* 32 shots of 256 bands, SCE and SCI */

/* ---- lines -------------------------------------------------------------------------- */

/* Deletes what it writes. */
static void put(struct capture *capture, const char *word, cJSON *what)
{
    char *text = NULL, *line = NULL;
    size_t n = 0, room;
    if (json_print(what, MAX_LINE, &text, &n) == STATUS_OK)
        line = malloc(room = strlen(word) + n + 2);
    if (line != NULL) {
        snprintf(line, room, "%s %s", word, text);
        capture_asked(capture, line);
    } else {
        log_error("station: no memory for a line '@ %s' of the capture: it cannot be replayed",
                  word);
    }
    free(line);
    free(text);
    cJSON_Delete(what);
}

static cJSON *parts(const cJSON *of, const char *const *names, size_t n)
{
    cJSON *some = cJSON_CreateObject();
    for (size_t i = 0; i < n; i++) {
        const cJSON *value = cJSON_GetObjectItemCaseSensitive(of, names[i]);
        if (value != NULL)
            json_give_member(some, names[i], cJSON_Duplicate(value, true));
    }
    return some;
}

/* ---- its life ----------------------------------------------------------------------- */

/* "tile=/home/ada/tile.csv,port_mm=8" -> "tile=tile.csv,port_mm=8": a folder may be named after a
 * person. */
static void leave_folders_out(char *options)
{
    char *to = options, *value = options;
    for (const char *from = options; *from != '\0'; from++) {
        if (*from == '/') {
            to = value;
            continue;
        }
        *to++ = *from;
        if (*from == '=' || *from == ',')
            value = to;
    }
    *to = '\0';
}

static cJSON *circumstances(const struct settings *settings)
{
    cJSON *it = cJSON_CreateObject();
    const char *instrument = settings->instruments_n > 0 ? settings->instruments[0] : "";
    const char *options = strchr(instrument, ',');
    cJSON_AddStringToObject(it, "table", settings->table);
    cJSON_AddStringToObject(it, "calibration_policy",
                            settings->calibration_blocks ? "block" : "warn");
    char *kept = options != NULL ? strdup(options + 1) : NULL;
    if (kept != NULL) {
        leave_folders_out(kept);
        cJSON_AddStringToObject(it, "options", kept);
    }
    free(kept);
    return it;
}

enum status asked_open(struct station *station)
{
    const struct settings *settings = station->settings;
    if (settings->record == NULL)
        return STATUS_OK;
    enum status s =
        capture_create(settings->record, settings->recorded->name, &station->recording.capture);
    if (s == STATUS_OK)
        put(station->recording.capture, "station", circumstances(settings));
    return s;
}

void asked_close(struct station *station)
{
    (void)capture_close(station->recording.capture); /* logged */
    station->recording = (struct recording){ 0 };
}

void asked_flush(struct station *station, int within_ms)
{
    if (station->recording.capture != NULL)
        (void)capture_flush(station->recording.capture, within_ms);
}

/* A note is one line of words: what an instrument says of itself was made plain before. */
void asked_identity(const struct bench *bench)
{
    const struct driver_identity *is = &bench->identity;
    if (bench->capture != NULL)
        capture_note(bench->capture, "model: %s %s      firmware: %s      serial: %s", is->maker,
                     is->model, is->firmware, is->serial);
}

/* ---- asked -------------------------------------------------------------------------- */

void asked_configure(const struct bench *bench, const struct request *request)
{
    if (bench->capture == NULL)
        return;
    cJSON *how = cJSON_Duplicate(request->params, true);
    cJSON_DeleteItemFromObjectCaseSensitive(how, "lease");
    put(bench->capture, "configure", how);
}

static void put_text(const struct bench *bench, const char *word, const char *name,
                     const char *text)
{
    cJSON *it = cJSON_CreateObject();
    cJSON_AddStringToObject(it, name, text);
    put(bench->capture, word, it);
}

void asked_calibrate(const struct bench *bench, enum driver_calibration step)
{
    if (bench->capture != NULL)
        put_text(bench, "calibrate", "step", driver_calibration_name(step));
}

void asked_measure(const struct bench *bench, const struct request *request)
{
    static const char *const how[] = { "specular", "surface", "replicates", "pace", "table", "by",
                                       "refine",   "noise",   "placement",  "fix",  "scene" };
    if (bench->capture != NULL)
        put(bench->capture, "measure", parts(request->params, how, sizeof how / sizeof *how));
}

void asked_next(const struct bench *bench)
{
    if (bench->capture != NULL)
        put(bench->capture, "next", cJSON_CreateObject());
}

void asked_button(const struct bench *bench)
{
    if (bench->capture != NULL)
        put(bench->capture, "button", cJSON_CreateObject());
}

/* ---- what came of it ---------------------------------------------------------------- */

void asked_refused(const struct bench *bench, const char *of, const struct refusal *refusal)
{
    if (bench->capture == NULL)
        return;
    cJSON *it = cJSON_CreateObject();
    cJSON_AddStringToObject(it, "of", of);
    cJSON_AddStringToObject(it, "reason", reason_name(refusal->reason));
    put(bench->capture, "refused", it);
}

void asked_cancelled(const struct bench *bench, const char *cause)
{
    if (bench->capture != NULL)
        put_text(bench, "cancelled", "cause", cause);
}

void asked_record(const struct bench *bench, const struct store_record *record)
{
    static const char *const what[] = { "specular",       "aperture_mm", "surface",    "replicates",
                                        "replicates_sci", "spectrum",    "XYZ",        "Lab",
                                        "sRGB",           "ITA",         "illuminant", "observer",
                                        "flags",          "match" };
    cJSON *whole = NULL;
    if (bench->capture == NULL)
        return;
    if (wire_record(record, &whole) != STATUS_OK) {
        put(bench->capture, "record", NULL); /* logged there */
        return;
    }
    cJSON *it = parts(whole, what, sizeof what / sizeof *what);
    cJSON_Delete(whole);
    put(bench->capture, "record", it);
}
