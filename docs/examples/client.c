/* client.c - measure once at a skinspec station, with plain sockets and cJSON:
 *   cc client.c $(pkg-config --cflags --libs libcjson) -o client && ./client [SOCKET]
 *
 * One JSON object per line both ways; docs/protocol.md has all of it.  client.py is the same. */
#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

static int station;        /* the connection */
static FILE *from_station; /* the same, line by line */

static void fail(const char *what)
{
    fprintf(stderr, "client: %s\n", what);
    exit(1);
}

static const char *text(const cJSON *object, const char *name)
{
    const char *value = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(object, name));
    return value != NULL ? value : "?";
}

static double number(const cJSON *object, const char *name)
{
    return cJSON_GetNumberValue(cJSON_GetObjectItemCaseSensitive(object, name)); /* or NAN */
}

static void connect_to(const char *path)
{
    struct sockaddr_un address = { .sun_family = AF_UNIX };
    station = socket(AF_UNIX, SOCK_STREAM, 0);
    if (strlen(path) >= sizeof address.sun_path)
        fail("the socket's path is too long");
    memcpy(address.sun_path, path, strlen(path));
    if (station < 0 || connect(station, (struct sockaddr *)&address, sizeof address) != 0)
        fail("no station answers; is skinspecd running, and are you in the group skinspec?");
    from_station = fdopen(station, "r");
    if (from_station == NULL)
        fail("not enough memory");
}

/* The next line of the station. */
static cJSON *receive(void)
{
    char *line = NULL;
    size_t size = 0;
    if (getline(&line, &size, from_station) < 0)
        fail("the station closed the connection");
    cJSON *message = cJSON_Parse(line);
    free(line);
    if (message == NULL)
        fail("not enough memory, or no JSON");
    return message;
}

/* Send a request and wait for its reply; the result.  params is taken. */
static cJSON *call(const char *method, cJSON *params)
{
    static int last_id;
    cJSON *request = cJSON_CreateObject(), *reply = NULL, *error;
    cJSON_AddStringToObject(request, "jsonrpc", "2.0");
    cJSON_AddNumberToObject(request, "id", ++last_id);
    cJSON_AddStringToObject(request, "method", method);
    cJSON_AddItemToObject(request, "params", params);
    char *line = cJSON_PrintUnformatted(request);
    if (line == NULL)
        fail("not enough memory");
    dprintf(station, "%s\n", line);
    cJSON_free(line);
    cJSON_Delete(request);
    do { /* events have no id; hello is the first line */
        cJSON_Delete(reply);
        reply = receive();
        error = cJSON_GetObjectItemCaseSensitive(reply, "error");
    } while (error == NULL && (int)number(reply, "id") != last_id);
    if (error != NULL) {
        const cJSON *data = cJSON_GetObjectItemCaseSensitive(error, "data");
        fprintf(stderr, "client: %s: %s\n%s\n", method, text(error, "message"), text(data, "hint"));
        exit(1);
    }
    cJSON *result = cJSON_DetachItemFromObjectCaseSensitive(reply, "result");
    cJSON_Delete(reply);
    return result;
}

static cJSON *with_lease(const char *lease)
{
    cJSON *params = cJSON_CreateObject();
    cJSON_AddStringToObject(params, "lease", lease);
    return params;
}

/* Zero, then white.  A program for people would wait here until the thing is in place. */
static void calibrate(const cJSON *instrument, const char *lease)
{
    const cJSON *step;
    cJSON_ArrayForEach(step, cJSON_GetObjectItemCaseSensitive(instrument, "calibration"))
    {
        if (!cJSON_IsTrue(cJSON_GetObjectItemCaseSensitive(step, "due")))
            continue;
        printf("%s: %s\n", text(step, "step"), text(step, "place"));
        cJSON *params = with_lease(lease);
        cJSON_AddStringToObject(params, "step", text(step, "step"));
        cJSON_Delete(call("instrument.calibrate", params));
    }
}

/* A uuid of our own makes a retry safe: the same request again gives the same record. */
static cJSON *measure(const char *lease)
{
    char uuid[40] = "";
    FILE *random = fopen("/proc/sys/kernel/random/uuid", "r");
    if (random == NULL || fgets(uuid, 37, random) == NULL)
        fail("no random numbers");
    fclose(random);
    cJSON *params = with_lease(lease);
    cJSON_AddStringToObject(params, "uuid", uuid);
    cJSON_AddStringToObject(params, "specular", "sce");
    cJSON_AddNumberToObject(params, "replicates", 3);
    cJSON_AddStringToObject(params, "pace", "auto");
    return call("measure.start", params);
}

static void show(const cJSON *record)
{
    const cJSON *Lab = cJSON_GetObjectItemCaseSensitive(record, "Lab");
    const cJSON *match = cJSON_GetObjectItemCaseSensitive(record, "match");
    printf("record %s\n", text(record, "id"));
    if (cJSON_GetArraySize(Lab) == 3)
        printf("L* %.2f  a* %.2f  b* %.2f  ITA %.1f degrees\n",
               cJSON_GetNumberValue(cJSON_GetArrayItem(Lab, 0)),
               cJSON_GetNumberValue(cJSON_GetArrayItem(Lab, 1)),
               cJSON_GetNumberValue(cJSON_GetArrayItem(Lab, 2)), number(record, "ITA"));
    if (match != NULL)
        printf("Cm %.4f  Bm %.2f  Ch %.4f\n", number(match, "Cm"), number(match, "Bm"),
               number(match, "Ch"));
}

int main(int argc, char **argv)
{
    const char *path = argc > 1 ? argv[1] : getenv("SKINSPEC_SOCKET");
    connect_to(path != NULL ? path : "/run/skinspec/skinspecd.sock");

    cJSON *params = cJSON_CreateObject();
    cJSON_AddNumberToObject(params, "major", 1);
    cJSON_AddStringToObject(params, "client", "client.c");
    cJSON_Delete(call("session.open", params));

    cJSON *list = call("instrument.list", cJSON_CreateObject());
    const cJSON *instrument =
        cJSON_GetArrayItem(cJSON_GetObjectItemCaseSensitive(list, "instruments"), 0);
    if (instrument == NULL)
        fail("the station has no instrument; start skinspecd with --instrument");
    printf("%s: %s\n", text(instrument, "instrument"), text(instrument, "state"));

    params = cJSON_CreateObject();
    cJSON_AddStringToObject(params, "instrument", text(instrument, "instrument"));
    cJSON_AddNumberToObject(params, "ttl_ms", 60000);
    cJSON_AddBoolToObject(params, "wait", 1);
    cJSON *taken = call("instrument.acquire", params);
    const char *lease = text(taken, "lease");

    calibrate(instrument, lease);
    cJSON *record = measure(lease);
    show(record);
    cJSON_Delete(call("instrument.release", with_lease(lease)));

    cJSON_Delete(record);
    cJSON_Delete(taken);
    cJSON_Delete(list);
    fclose(from_station);
    return 0;
}
