/* instrument.c - choose, acquire, release. */
#include "cli/instrument.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "cli/member.h"
#include "cli/options.h"

/* ---- choosing ----------------------------------------------------------------------- */

static void log_names(const char *what, const cJSON *instruments)
{
    char names[512] = "";
    const cJSON *one;
    cJSON_ArrayForEach(one, instruments)
    {
        size_t used = strlen(names);
        snprintf(names + used, sizeof names - used, "%s%s", used > 0 ? ", " : "",
                 member_text(one, "instrument"));
    }
    log_error("%s: %s", what, *names != '\0' ? names : "none; skinspecd --instrument gives it one");
}

static cJSON *find(const cJSON *instruments, const char *name)
{
    cJSON *one;
    cJSON_ArrayForEach(one, instruments)
    {
        if (name == NULL || strcmp(member_text(one, "instrument"), name) == 0)
            return one;
    }
    return NULL;
}

cJSON *instrument_choose(struct remote *remote, const char *name, int *exit_status)
{
    char what[256];
    *exit_status = EXIT_FAILURE;
    cJSON *list = remote_ask(remote, METHOD_INSTRUMENT_LIST, NULL), *chosen = NULL;
    if (list == NULL)
        return NULL;
    const cJSON *instruments = member(list, "instruments");
    if (name == NULL && cJSON_GetArraySize(instruments) > 1) {
        log_names("say which one by --instrument NAME; the station has", instruments);
        *exit_status = EXIT_USAGE;
    } else if ((chosen = find(instruments, name)) == NULL) {
        snprintf(what, sizeof what, "there is no instrument%s%.63s%s; the station has",
                 name != NULL ? " '" : "", name != NULL ? name : "", name != NULL ? "'" : "");
        log_names(what, instruments);
    } else {
        chosen = cJSON_Duplicate(chosen, true);
        if (chosen == NULL)
            out_of_memory();
    }
    cJSON_Delete(list);
    return chosen;
}

/* ---- the lease ---------------------------------------------------------------------- */

/* Of an event lease/queued about this connection. */
static void tell_place(const struct remote *remote, const struct answer *event, const char *name)
{
    const cJSON *data = member(event->params, "data");
    if (strcmp(member_text(event->params, "topic"), "lease") == 0 &&
        strcmp(member_text(event->params, "type"), "queued") == 0 &&
        member_integer(data, "connection") == member_integer(remote_session(remote), "connection"))
        log_info("%s is in use; waiting, place %.0f in the queue", name,
                 member_number(data, "position"));
}

/* The reply to the request, telling of the queue meanwhile. */
static bool wait_in_queue(struct remote *remote, int64_t id, const char *name, struct answer *ret)
{
    const struct remote_watch watch = { -1, -1, -1 };
    while (remote_next(remote, &watch, ret) == REMOTE_LINE) {
        if (ret->method == NULL && ret->id.integer == id)
            return true;
        if (ret->method != NULL)
            tell_place(remote, ret, name);
        remote_done(ret);
    }
    return false;
}

bool instrument_acquire(struct remote *remote, const char *name, bool wait)
{
    struct answer answer;
    int64_t id;
    cJSON *params = cJSON_CreateObject();
    cJSON_AddStringToObject(params, "instrument", name);
    cJSON_AddNumberToObject(params, "ttl_ms", REMOTE_LEASE_MS);
    cJSON_AddBoolToObject(params, "wait", wait);
    if (remote_send(remote, METHOD_INSTRUMENT_ACQUIRE, params, &id) != STATUS_OK ||
        !wait_in_queue(remote, id, name, &answer))
        return false;
    bool held = answer.result != NULL;
    if (held)
        remote_hold(remote, member_text(answer.result, "lease"),
                    member_number(answer.result, "expires_in_ms"));
    else
        remote_complain(&answer);
    if (remote_reason(&answer) == REASON_INSTRUMENT_BUSY)
        log_info("with --wait this waits until it is free");
    remote_done(&answer);
    return held;
}

void instrument_release(struct remote *remote)
{
    if (!remote_holds(remote))
        return;
    cJSON *params = remote_lease_params(remote);
    remote_hold(remote, NULL, 0.0);
    cJSON_Delete(remote_ask(remote, METHOD_INSTRUMENT_RELEASE, params));
}
