/* dispatch.c - may it be asked, and who serves it. */
#include "station/dispatch.h"

#include "json/memory.h"
#include "station/params.h"
#include "station/serve.h"
#include "station/ticket.h"

static serve *const serves[METHODS] = {
    [METHOD_SESSION_OPEN] = serve_session_open,
    [METHOD_SESSION_CLOSE] = serve_session_close,
    [METHOD_INSTRUMENT_LIST] = serve_instrument_list,
    [METHOD_INSTRUMENT_ACQUIRE] = serve_instrument_acquire,
    [METHOD_INSTRUMENT_WITHDRAW] = serve_instrument_withdraw,
    [METHOD_INSTRUMENT_RENEW] = serve_instrument_renew,
    [METHOD_INSTRUMENT_RELEASE] = serve_instrument_release,
    [METHOD_INSTRUMENT_CONFIGURE] = serve_instrument_configure,
    [METHOD_INSTRUMENT_CALIBRATE] = serve_instrument_calibrate,
    [METHOD_MEASURE_START] = serve_measure_start,
    [METHOD_MEASURE_NEXT] = serve_measure_next,
    [METHOD_MEASURE_CANCEL] = serve_measure_cancel,
    [METHOD_CHECK_TAKE] = serve_check_take,
    [METHOD_CHECK_SET] = serve_check_set,
    [METHOD_CHECK_LIST] = serve_check_list,
    [METHOD_MATCH_SPECTRUM] = serve_match_spectrum,
    [METHOD_RECORD_GET] = serve_record_get,
    [METHOD_RECORD_LIST] = serve_record_list,
    [METHOD_RECORD_EXPORT] = serve_record_export,
    [METHOD_RECORD_RECOMPUTE] = serve_record_recompute,
    [METHOD_SUBJECT_ADD] = serve_subject_add,
    [METHOD_SUBJECT_LIST] = serve_subject_list,
    [METHOD_SUBJECT_FORGET] = serve_subject_forget,
    [METHOD_SITE_LIST] = serve_site_list,
    [METHOD_TABLE_LIST] = serve_table_list,
    [METHOD_TABLE_INFO] = serve_table_info,
    [METHOD_STATUS_GET] = serve_status_get,
    [METHOD_METRICS_GET] = serve_metrics_get,
    [METHOD_RPC_DESCRIBE] = serve_rpc_describe,
    [METHOD_EVENTS_SUBSCRIBE] = serve_events_subscribe,
    [METHOD_STORE_VERIFY] = serve_store_verify,
    [METHOD_STORE_BEGIN_ANEW] = serve_store_begin_anew,
};

void dispatch(struct station *station, struct client *client, struct request *request)
{
    serves[request->method](station, client, request);
}

/* REASONS where nothing speaks against it. */
static enum reason why_not(const struct station *station, const struct client *client,
                           const struct request *request)
{
    if (station->stopping)
        return REASON_SHUTTING_DOWN;
    if (request->needs_session && !client->session)
        return REASON_SESSION_NEEDED;
    if (!client->peer.may || client->peer.right < request->right)
        return REASON_RIGHT_NEEDED;
    return client->open_requests >= STATION_OPEN_REQUESTS ? REASON_TOO_MANY_REQUESTS : REASONS;
}

void station_line(void *context, struct client *client, const char *line, size_t n)
{
    struct station *station = context;
    struct request request;
    struct refusal refusal;
    json_memory_begin();
    bool good = protocol_read(station->protocol, line, n, &request, &refusal);
    struct ticket ticket = ticket_of(client, &request);
    enum reason reason = good ? why_not(station, client, &request) : REASONS;
    client->open_requests++; /* the answer takes it back */
    if (!good) {
        station_refuse(station, &ticket, &refusal);
        return;
    }
    station->counters.requests[request.method]++;
    params_lower_uuids(&request);
    if (reason != REASONS)
        station_refuse_for(station, &ticket, reason, NULL);
    else
        dispatch(station, client, &request);
    request_done(&request);
}
