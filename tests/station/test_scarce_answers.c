/* test_scarce_answers.c - every allocation of a whole station fails once in turn, and from each on
 * all: each request is answered, by its result or by an error that says so, or its client is let
 * go; nothing is half done, and afterwards the same request succeeds.
 *
 * Whoever answers: what is an answer, a result or an event is judged by the protocol's
 * description, so a member that is missing is seen. */
#include <stdlib.h>

#include "json/memory.h"
#include "station/station_store.h"
#include "tests/station/scarce_tools.h"
#include "tests/station/station_tools.h"
#include "tests/support/no_memory.h"

/* What has to be so before a request is tried. */
enum need {
    NEED_NOTHING,
    NEED_NO_SESSION,
    NEED_FREE,       /* nobody holds the instrument */
    NEED_LEASE,      /* the visitor does */
    NEED_CALIBRATED, /* and it is ready to measure */
    NEED_WAITING     /* and a measurement waits for its second shot */
};

static const struct act {
    const char *method, *params;
    enum need need;
    const char *reason; /* of the refusal with enough memory; NULL: a result */
} scenes[] = {
    { "session.open", "{\"major\":1,\"client\":\"test\"}", NEED_NO_SESSION, NULL },
    { "session.close", "{}", NEED_LEASE, NULL },
    { "rpc.describe", "{}", NEED_NOTHING, NULL },
    { "status.get", "{}", NEED_NOTHING, NULL },
    { "metrics.get", "{}", NEED_NOTHING, NULL },
    { "instrument.list", "{}", NEED_LEASE, NULL },
    { "instrument.acquire", "{\"instrument\":\"simulated\",\"ttl_ms\":60000,\"wait\":false}",
      NEED_FREE, NULL },
    { "instrument.renew", "{\"lease\":\"@L\",\"ttl_ms\":60000}", NEED_LEASE, NULL },
    { "instrument.release", "{\"lease\":\"@L\"}", NEED_LEASE, NULL },
    { "instrument.configure", "{\"lease\":\"@L\",\"grid\":0}", NEED_LEASE, NULL },
    { "instrument.calibrate", "{\"lease\":\"@L\",\"step\":\"zero\"}", NEED_LEASE, NULL },
    { "instrument.calibrate", "{\"lease\":\"@L\",\"step\":\"white\"}", NEED_CALIBRATED, NULL },
    { "measure.start",
      "{\"lease\":\"@L\",\"uuid\":\"@U\",\"specular\":\"sce\",\"replicates\":2,\"pace\":\"auto\","
      "\"site\":\"forearm\",\"subject\":\"@S\",\"corrects\":\"@R\"}",
      NEED_CALIBRATED, NULL },
    { "measure.start",
      "{\"lease\":\"@L\",\"uuid\":\"@V\",\"specular\":\"sce\",\"replicates\":2,\"pace\":\"auto\"}",
      NEED_CALIBRATED, NULL }, /* there already */
    { "measure.next", "{\"lease\":\"@L\",\"uuid\":\"@W\"}", NEED_WAITING, NULL },
    { "measure.cancel", "{\"lease\":\"@L\",\"uuid\":\"@W\"}", NEED_WAITING, NULL },
    { "match.spectrum", "{\"spectrum\":@P,\"specular\":\"sce\",\"store\":false}", NEED_NOTHING,
      NULL },
    { "match.spectrum",
      "{\"spectrum\":@P,\"specular\":\"sce\",\"store\":true,\"scene\":{\"want\":[\"lab\","
      "\"nearest\",\"refined\",\"interval\"],\"k\":2}}",
      NEED_NOTHING, NULL },
    { "match.spectrum",
      "{\"spectrum\":@P,\"specular\":\"sce\",\"store\":false,\"scene\":{\"want\":[\"rgb\"]}}",
      NEED_NOTHING, NULL },
    { "match.spectrum",
      "{\"spectrum\":@P,\"specular\":\"sci\",\"surface\":0.02,\"k\":5,\"store\":false,\"by\":"
      "\"spectrum\"}",
      NEED_NOTHING, NULL },
    { "match.spectrum",
      "{\"spectrum\":@P,\"specular\":\"sce\",\"store\":true,\"uuid\":\"@U\",\"k\":3,"
      "\"site\":\"forehead\"}",
      NEED_NOTHING, NULL },
    { "match.spectrum", "{\"spectrum\":@P,\"specular\":\"sce\",\"store\":true,\"uuid\":\"@M\"}",
      NEED_NOTHING, NULL }, /* there already */
    { "record.get", "{\"id\":\"@R\"}", NEED_NOTHING, NULL },
    { "record.get", "{\"id\":\"@U\"}", NEED_NOTHING, "record_unknown" },
    { "record.list", "{\"limit\":3}", NEED_NOTHING, NULL },
    { "record.export", "{\"format\":\"csv\",\"limit\":2}", NEED_NOTHING, NULL },
    { "record.export", "{\"format\":\"json\",\"limit\":2}", NEED_NOTHING, NULL },
    { "record.export", "{\"format\":\"cgats\",\"limit\":2}", NEED_NOTHING, NULL },
    { "record.recompute", "{\"id\":\"@R\"}", NEED_NOTHING, NULL },
    { "subject.add",
      "{\"label\":\"a\",\"person\":{\"name\":\"Zo\\u00eb\",\"birth_year\":1990,\"notes\":\"n\"}}",
      NEED_NOTHING, NULL },
    { "subject.list", "{\"limit\":3}", NEED_NOTHING, NULL },
    { "subject.forget", "{\"id\":\"@U\"}", NEED_NOTHING, "subject_unknown" },
    { "site.list", "{}", NEED_NOTHING, NULL },
    { "table.list", "{}", NEED_NOTHING, NULL },
    { "table.info", "{}", NEED_NOTHING, NULL },
    { "table.info", "{\"table\":\"none\"}", NEED_NOTHING, "table_unknown" },
    { "events.subscribe", "{\"topics\":[\"store\",\"measurement\"]}", NEED_NOTHING, NULL },
    { "events.subscribe", "{\"topics\":[\"store\"],\"since_seq\":@E}", NEED_NOTHING, NULL },
    { "events.subscribe", "{\"topics\":[\"lease\"],\"since_seq\":0}", NEED_NOTHING, NULL },
    { "store.verify", "{}", NEED_NOTHING, NULL },
    { "store.begin_anew", "{}", NEED_NOTHING, "store_not_damaged" },
};

enum { TEXT = 2048 };

static struct visitor visitor, hearer;
static char lease[64], record[UUID_TEXT_SIZE], subject[UUID_TEXT_SIZE];
static char used_uuid[UUID_TEXT_SIZE], matched_uuid[UUID_TEXT_SIZE], waiting_uuid[UUID_TEXT_SIZE];
static char spectrum[512];

void setUp(void)
{
    heard_start();
    TEST_ASSERT_TRUE(folder_make(folder));
    set_settings();
    make_table();
    visitor.fd = hearer.fd = -1;
    lease[0] = '\0';
}

void tearDown(void)
{
    (void)scarce_end();
    visitor_leave(&visitor);
    visitor_leave(&hearer);
    if (station.event != NULL)
        close_station();
    folder_remove(folder);
    heard_stop();
}

/* ---- requests ----------------------------------------------------------------------- */

static const char *placeholder(char letter)
{
    static char fresh[UUID_TEXT_SIZE], number[32];
    switch (letter) {
    case 'L':
        return lease;
    case 'R':
        return record;
    case 'S':
        return subject;
    case 'V':
        return used_uuid;
    case 'M':
        return matched_uuid;
    case 'W':
        return waiting_uuid;
    case 'P':
        return spectrum;
    case 'E': /* the last few are told again */
        snprintf(number, sizeof number, "%lld", (long long)(station.events.last_seq - 5));
        return number;
    default:
        TEST_ASSERT_EQUAL_INT(STATUS_OK, uuid4_make(fresh));
        return fresh;
    }
}

static const char *filled(const char *params)
{
    static char text[TEXT];
    size_t n = 0;
    for (; *params != '\0'; params++) {
        const char *value = *params == '@' ? placeholder(*++params) : NULL;
        if (value == NULL)
            text[n++] = *params;
        else
            n += (size_t)snprintf(text + n, sizeof text - n, "%s", value);
        TEST_ASSERT_LESS_THAN_size_t(sizeof text - 1, n);
    }
    text[n] = '\0';
    return text;
}

static void must(const char *method, const char *params)
{
    enum outcome outcome = visitor_ask(&visitor, method, filled(params));
    TEST_ASSERT_EQUAL_INT_MESSAGE(OUTCOME_RESULT, outcome, visitor.answer);
}

/* ---- before a request --------------------------------------------------------------- */

static bool bench_is_at_rest(void)
{
    const struct bench *bench = station.benches[0];
    return bench->run == NULL && !bench->at_work;
}

static bool run_waits(void)
{
    const struct run *run = station.benches[0]->run;
    return run != NULL && run->phase == RUN_WAITING;
}

static bool instrument_is_free(void)
{
    return station.benches[0]->lease.holder == 0;
}

static void need_lease(void)
{
    if (instrument_is_free() || lease[0] == '\0') {
        TEST_ASSERT_TRUE(comes(instrument_is_free));
        must("instrument.acquire",
             "{\"instrument\":\"simulated\",\"ttl_ms\":600000,\"wait\":false}");
        copy_text(lease, sizeof lease, visitor_text(&visitor, "lease"));
    }
}

static void need_calibrated(void)
{
    if (bench_calibration(station.benches[0]).good)
        return;
    must("instrument.calibrate", "{\"lease\":\"@L\",\"step\":\"zero\"}");
    must("instrument.calibrate", "{\"lease\":\"@L\",\"step\":\"white\"}");
}

static void need_waiting(void)
{
    copy_text(waiting_uuid, sizeof waiting_uuid, placeholder('U'));
    (void)visitor_say(&visitor, "measure.start",
                      filled("{\"lease\":\"@L\",\"uuid\":\"@W\",\"specular\":\"sce\","
                             "\"replicates\":2,\"pace\":\"prompt\"}"));
    TEST_ASSERT_TRUE(comes(run_waits));
}

static void prepare(enum need need)
{
    if (visitor.fd < 0 || need == NEED_NO_SESSION) {
        visitor_leave(&visitor);
        TEST_ASSERT_TRUE(comes(instrument_is_free));
        lease[0] = '\0';
        if (need == NEED_NO_SESSION)
            TEST_ASSERT_TRUE(visitor_come(&visitor));
        else
            visitor_open_session(&visitor);
    }
    if (hearer.fd < 0) {
        visitor_open_session(&hearer);
        enum outcome outcome =
            visitor_ask(&hearer, "events.subscribe",
                        "{\"topics\":[\"instrument\",\"calibration\",\"lease\",\"measurement\","
                        "\"store\"]}");
        TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT, outcome);
    }
    if (need == NEED_FREE && !instrument_is_free())
        must("instrument.release", "{\"lease\":\"@L\"}");
    if (need >= NEED_LEASE)
        need_lease();
    if (need >= NEED_CALIBRATED)
        need_calibrated();
    if (need >= NEED_WAITING)
        need_waiting();
}

/* ---- after it ----------------------------------------------------------------------- */

static void fail(const struct act *scene, long given, const char *what, const char *more)
{
    char text[TEXT];
    snprintf(text, sizeof text, "%s %s, after %ld: %s: %.1000s", scene->method, scene->params,
             given, what, more);
    TEST_FAIL_MESSAGE(text);
}

static bool is_event_good(const struct answer *answer, struct schema_error *error)
{
    enum event_topic topic;
    const char *name = cJSON_GetStringValue(strict_json_member(answer->params, "topic"));
    const char *type = cJSON_GetStringValue(strict_json_member(answer->params, "type"));
    return protocol_check_notification(station.protocol, NOTIFICATION_EVENT, answer->params,
                                       error) &&
           event_topic_parse(name, &topic) == STATUS_OK &&
           protocol_check_event(station.protocol, topic, type,
                                strict_json_member(answer->params, "data"), error);
}

static void check_line(const struct act *scene, long given, const char *line, size_t n)
{
    struct answer answer;
    struct schema_error error = { .path = "" };
    if (protocol_read_answer(line, n, &answer) != STATUS_OK) {
        fail(scene, given, "no line of the protocol", line);
        return;
    }
    bool good = true;
    if (answer.method != NULL && strcmp(answer.method, "event") == 0)
        good = is_event_good(&answer, &error);
    else if (answer.method != NULL && strcmp(answer.method, "events_lost") == 0)
        good = protocol_check_notification(station.protocol, NOTIFICATION_EVENTS_LOST,
                                           answer.params, &error);
    cJSON_Delete(answer.tree);
    if (!good)
        fail(scene, given, error.what, line);
}

static void check_lines(const struct act *scene, long given, struct visitor *v)
{
    const char *line;
    size_t n;
    visitor_read(v);
    v->looked = 0;
    while ((line = visitor_line(v, &n)) != NULL)
        check_line(scene, given, line, n);
    v->used = v->looked = 0;
}

static enum method method_of(const char *name)
{
    int i = 0;
    while (i < METHODS && strcmp(method_name((enum method)i), name) != 0)
        i++;
    return (enum method)i;
}

static void check_result(const struct act *scene, long given)
{
    struct answer answer;
    struct schema_error error = { .path = "" };
    bool good = protocol_read_answer(visitor.answer, strlen(visitor.answer), &answer) == STATUS_OK;
    if (good) {
        good = protocol_check_result(station.protocol, method_of(scene->method), answer.result,
                                     &error);
        cJSON_Delete(answer.tree);
    }
    if (!good)
        fail(scene, given, error.what, visitor.answer);
}

/* Is this what may become of it? */
static void check_outcome(const struct act *scene, long given, enum outcome outcome, bool scarce)
{
    const char *reason = visitor_text(&visitor, "reason");
    if (outcome == OUTCOME_SILENCE)
        fail(scene, given, "no answer", "");
    else if (outcome == OUTCOME_CLOSED && !scarce)
        fail(scene, given, "hung up", "");
    else if (outcome == OUTCOME_RESULT)
        check_result(scene, given);
    else if (outcome == OUTCOME_ERROR && strcmp(reason, "no_memory") == 0 && scarce)
        return;
    else if (outcome == OUTCOME_ERROR &&
             (scene->reason == NULL || strcmp(reason, scene->reason) != 0))
        fail(scene, given, "refused", visitor.answer);
}

static bool store_is_ok(void)
{
    return station.store.state == STORE_OK && !station.store.trying;
}

/* What runs is ended, and what was shown of the store is shown again. */
static void settle(const struct act *scene, long given)
{
    if (run_waits() && visitor.fd >= 0)
        (void)visitor_ask(&visitor, "measure.cancel", filled("{\"lease\":\"@L\",\"uuid\":\"@W\"}"));
    if (strcmp(scene->method, "session.close") == 0)
        visitor_leave(&visitor);
    if (visitor.fd < 0 && !comes(instrument_is_free))
        fail(scene, given, "the lease outlives its client", "");
    if (!comes(bench_is_at_rest))
        fail(scene, given, "the instrument stays at work", "");
    check_lines(scene, given, &visitor);
    check_lines(scene, given, &hearer);
    station_try_store(&station); /* as housekeeping does every few seconds */
    if (!comes(store_is_ok))
        fail(scene, given, "the store is not what it was", station.store.error);
}

static void note_lease(const struct act *scene, enum outcome outcome)
{
    if (strcmp(scene->method, "instrument.acquire") == 0 && outcome == OUTCOME_RESULT)
        copy_text(lease, sizeof lease, visitor_text(&visitor, "lease"));
}

/* One try; false: nothing was refused. */
static bool try(const struct act *scene, enum scarcity scarcity, long given)
{
    prepare(scene->need);
    const char *params = filled(scene->params);
    visitor_forget(&visitor);
    visitor.answer[0] = '\0';
    scarce_begin(scarcity, given);
    enum outcome outcome = visitor_ask(&visitor, scene->method, params);
    bool scarce = scarce_end();
    check_outcome(scene, given, outcome, scarce);
    note_lease(scene, outcome);
    settle(scene, given);
    return scarce;
}

/* The same where SQLite alone is short: what cannot be read or kept is not, and says so. */
static bool try_store(const struct act *scene, long given)
{
    prepare(scene->need);
    const char *params = filled(scene->params);
    visitor_forget(&visitor);
    visitor.answer[0] = '\0';
    no_memory_after(given);
    enum outcome outcome = visitor_ask(&visitor, scene->method, params);
    bool scarce = no_memory_met();
    no_memory_after(-1);
    TEST_ASSERT_NOT_EQUAL_INT(
        OUTCOME_CLOSED, strcmp(scene->method, "session.close") == 0 ? OUTCOME_RESULT : outcome);
    check_outcome(scene, given, outcome, scarce);
    note_lease(scene, outcome);
    settle(scene, given);
    return scarce;
}

/* ---- the tests ---------------------------------------------------------------------- */

static void make_spectrum(void)
{
    size_t n = (size_t)snprintf(spectrum, sizeof spectrum,
                                "{\"first_nm\":400,\"step_nm\":10,\"values\":[");
    for (int i = 0; i < 31; i++)
        n += (size_t)snprintf(spectrum + n, sizeof spectrum - n, "%s%.2f", i > 0 ? "," : "",
                              0.1 + 0.01 * i);
    snprintf(spectrum + n, sizeof spectrum - n, "]}");
}

static void begin_with_records(void)
{
    begin_station();
    make_spectrum();
    prepare(NEED_CALIBRATED);
    must("subject.add", "{\"label\":\"of the records\"}");
    copy_text(subject, sizeof subject, visitor_text(&visitor, "id"));
    copy_text(used_uuid, sizeof used_uuid, placeholder('U'));
    copy_text(matched_uuid, sizeof matched_uuid, placeholder('U'));
    must("measure.start", "{\"lease\":\"@L\",\"uuid\":\"@V\",\"specular\":\"sce\","
                          "\"replicates\":2,\"pace\":\"auto\"}");
    copy_text(record, sizeof record, visitor_text(&visitor, "id"));
    must("match.spectrum", "{\"spectrum\":@P,\"specular\":\"sce\",\"store\":true,\"uuid\":\"@M\"}");
}

static void fails_in_turn(enum scarcity scarcity)
{
    begin_with_records();
    for (size_t i = 0; i < sizeof scenes / sizeof *scenes; i++) {
        long given = 0;
        while (try(&scenes[i], scarcity, given))
            given++;
        TEST_ASSERT_GREATER_THAN_MESSAGE(3, given, scenes[i].method);
    }
}

/* Each of the first, then every second, every third, ... */
static void test_store_from_each_on(void)
{
    long most = 0;
    begin_with_records();
    for (size_t i = 0; i < sizeof scenes / sizeof *scenes; i++) {
        long given = 0;
        while (try_store(&scenes[i], given))
            given += 1 + given / 40;
        most = given > most ? given : most;
    }
    TEST_ASSERT_GREATER_THAN(200, most);
}

static void test_each_once(void)
{
    fails_in_turn(SCARCE_ONE);
}

static void test_all_from_each_on(void)
{
    fails_in_turn(SCARCE_ALL);
}

int main(void)
{
    json_memory_watch();
    if (!no_memory_install())
        return EXIT_FAILURE;
    UNITY_BEGIN();
    RUN_TEST(test_each_once);
    RUN_TEST(test_all_from_each_on);
    RUN_TEST(test_store_from_each_on);
    return UNITY_END();
}
