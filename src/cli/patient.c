/* patient.c - waiting for the station and for Ctrl-C. */
#include "cli/patient.h"

#include <string.h>

#include "base/clock.h"
#include "base/log.h"
#include "cli/member.h"

enum { LOOK_MS = 50, LIST_MS = 10000 };

bool patient_ask(struct remote *remote, struct stop *stop, enum method method, cJSON *params,
                 int timeout_ms, struct answer *ret)
{
    const struct remote_watch watch = { -1, stop->fd, timeout_ms };
    int64_t id;
    if (remote_send(remote, method, params, &id) != STATUS_OK)
        return false;
    for (;;) {
        enum remote_news news = remote_next(remote, &watch, ret);
        if (news == REMOTE_STOP)
            stop_take(stop);
        if (news == REMOTE_SILENT)
            log_error("%s: no answer within %d s", method_name(method), timeout_ms / 1000);
        if (news != REMOTE_LINE)
            return false;
        if (ret->method == NULL && ret->id.integer == id)
            return true;
        remote_done(ret);
    }
}

bool patient_wait(struct remote *remote, struct stop *stop, int ms)
{
    int64_t until_ms = clock_monotonic_ms() + ms, left_ms;
    struct answer answer;
    while ((left_ms = until_ms - clock_monotonic_ms()) > 0) {
        const struct remote_watch watch = { -1, stop->fd, (int)left_ms };
        enum remote_news news = remote_next(remote, &watch, &answer);
        if (news == REMOTE_STOP)
            stop_take(stop);
        if (news == REMOTE_LINE)
            remote_done(&answer);
        else
            return news == REMOTE_SILENT;
    }
    return true;
}

cJSON *patient_instrument(struct remote *remote, struct stop *stop, int timeout_ms)
{
    int64_t until_ms = clock_monotonic_ms() + timeout_ms;
    struct answer answer;
    do {
        if (!patient_ask(remote, stop, METHOD_INSTRUMENT_LIST, NULL, LIST_MS, &answer))
            return NULL;
        const cJSON *first = cJSON_GetArrayItem(member(answer.result, "instruments"), 0);
        if (first != NULL && strcmp(member_text(first, "state"), "opening") != 0) {
            cJSON *found = cJSON_Duplicate(first, true);
            remote_done(&answer);
            return found;
        }
        remote_done(&answer);
        if (!patient_wait(remote, stop, LOOK_MS))
            return NULL;
    } while (clock_monotonic_ms() < until_ms);
    log_error("the instrument was not opened within %d s", timeout_ms / 1000);
    return NULL;
}
