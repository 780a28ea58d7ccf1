/* serve.h - one function per method of the protocol; dispatch.c finds them by the method. */
#ifndef SKINSPEC_STATION_SERVE_H
#define SKINSPEC_STATION_SERVE_H

#include "station/station.h"

/* The request is as the description says, the client may ask it, and a session is open where it
 * needs one.  The request is freed by the caller, unless station_park() took it. */
typedef void serve(struct station *station, struct client *client, struct request *request);

serve serve_session_open, serve_session_close; /* serve_session.c */
serve serve_events_subscribe;
serve serve_instrument_list, serve_instrument_configure, serve_instrument_calibrate;
serve serve_instrument_acquire, serve_instrument_withdraw;
serve serve_instrument_renew, serve_instrument_release;
serve serve_measure_start, serve_measure_next, serve_measure_cancel; /* serve_measure.c */
serve serve_check_take, serve_check_set;                             /* serve_check.c */
serve serve_check_list;                                              /* serve_check_list.c */
serve serve_match_spectrum;                                          /* serve_match.c */
serve serve_record_get, serve_record_list, serve_record_export, serve_record_recompute;
serve serve_subject_add, serve_subject_list, serve_subject_forget; /* serve_subject.c */
serve serve_site_list;
serve serve_table_list, serve_table_info;   /* serve_table.c */
serve serve_status_get, serve_rpc_describe; /* serve_status.c */
serve serve_metrics_get;
serve serve_store_verify, serve_store_begin_anew; /* serve_store.c */

cJSON *status_json(struct station *station);

#endif
