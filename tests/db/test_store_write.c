/* test_store_write.c - records there and back bit for bit; groups, jobs, retries; ids and seq
 * whatever the clock does. */

#include "base/uuid.h"
#include "db/sql.h"
#include "db/store_private.h"
#include "tests/store/tools.h"
#include "tests/support/heard.h"

static char folder[FOLDER_PATH_SIZE], path[FOLDER_PATH_SIZE];
static struct store *store;
static struct store_reader *reader;
static struct store_record *record, *got;
static struct dice dice;
static int64_t now_ms;

static int64_t set_clock(void *context)
{
    return *(int64_t *)context;
}
static const struct store_clock test_clock = { set_clock, &now_ms };

void setUp(void)
{
    heard_start();
    dice = (struct dice){ 11 };
    now_ms = INT64_C(1767225600123); /* 2026-01-01T00:00:00.123Z */
    TEST_ASSERT_TRUE(folder_make(folder));
    folder_path(folder, "station.db", path);
    TRY(store_open(folder, &test_clock, &store));
    TRY(store_reader_open(folder, &reader));
    record = records_make(&dice);
    got = malloc(sizeof *got);
    TEST_ASSERT_TRUE(record != NULL && got != NULL);
    memset(got, 77, sizeof *got);
}

void tearDown(void)
{
    free(record);
    free(got);
    store_reader_close(reader);
    store_close(store);
    heard_stop();
    folder_remove(folder);
}

static void reopen(void)
{
    store_close(store);
    store = NULL;
    TRY(store_open(folder, &test_clock, &store));
}

static enum status add(void)
{
    bool known = true;
    enum status s = store_add_record(store, record, &known);
    if (s == STATUS_OK)
        TEST_ASSERT_FALSE(known);
    return s;
}

static long long count(const char *table)
{
    char sql[64];
    snprintf(sql, sizeof sql, "SELECT count(*) FROM %s", table);
    return tool_number(folder, sql);
}

/* ---- there and back ------------------------------------------------------------------------ */

static void assert_same_number(double a, double b, const char *what)
{
    if (isnan(a))
        TEST_ASSERT_TRUE_MESSAGE(isnan(b), what);
    else
        TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&a, &b, sizeof a, what);
}

static void assert_same_spectrum(const struct spectrum *a, const struct spectrum *b,
                                 const char *what)
{
    TEST_ASSERT_EQUAL_size_t_MESSAGE(a->n, b->n, what);
    if (a->n == 0)
        return;
    assert_same_number(a->first_nm, b->first_nm, what);
    assert_same_number(a->step_nm, b->step_nm, what);
    assert_same_number(a->aperture_mm, b->aperture_mm, what);
    TEST_ASSERT_EQUAL_INT_MESSAGE(a->specular, b->specular, what);
    TEST_ASSERT_EQUAL_MEMORY_MESSAGE(a->value, b->value, a->n * sizeof *a->value, what);
    TEST_ASSERT_EQUAL_MEMORY_MESSAGE(a->flag, b->flag, a->n, what);
}

static void assert_same_texts(const struct store_record *a, const struct store_record *b)
{
    TEST_ASSERT_EQUAL_STRING(a->id, b->id);
    TEST_ASSERT_EQUAL_STRING(a->taken_at, b->taken_at);
    TEST_ASSERT_EQUAL_STRING(a->uuid, b->uuid);
    TEST_ASSERT_EQUAL_STRING(a->parameters_sha256, b->parameters_sha256);
    TEST_ASSERT_EQUAL_STRING(a->operator_name, b->operator_name);
    TEST_ASSERT_EQUAL_STRING(a->instrument.driver, b->instrument.driver);
    TEST_ASSERT_EQUAL_STRING(a->instrument.maker, b->instrument.maker);
    TEST_ASSERT_EQUAL_STRING(a->instrument.model, b->instrument.model);
    TEST_ASSERT_EQUAL_STRING(a->instrument.serial, b->instrument.serial);
    TEST_ASSERT_EQUAL_STRING(a->instrument.firmware, b->instrument.firmware);
    TEST_ASSERT_EQUAL_STRING(a->ita_scheme, b->ita_scheme);
    TEST_ASSERT_EQUAL_STRING(a->illuminant, b->illuminant);
    TEST_ASSERT_EQUAL_STRING(a->observer, b->observer);
    TEST_ASSERT_EQUAL_STRING(a->calibration_id, b->calibration_id);
    TEST_ASSERT_EQUAL_STRING(a->subject, b->subject);
    TEST_ASSERT_EQUAL_STRING(a->site, b->site);
    TEST_ASSERT_EQUAL_STRING(a->corrects, b->corrects);
    TEST_ASSERT_EQUAL_STRING(a->flags, b->flags);
    TEST_ASSERT_EQUAL_STRING(a->match_json, b->match_json);
    TEST_ASSERT_EQUAL_STRING(a->refined_json, b->refined_json);
    TEST_ASSERT_EQUAL_STRING(a->table_name, b->table_name);
    TEST_ASSERT_EQUAL_STRING(a->table_sha256, b->table_sha256);
    TEST_ASSERT_EQUAL_STRING(a->method, b->method);
    TEST_ASSERT_EQUAL_STRING(a->boot_id, b->boot_id);
}

static void assert_same_record(const struct store_record *a, const struct store_record *b)
{
    assert_same_texts(a, b);
    TEST_ASSERT_EQUAL_INT64(a->seq, b->seq);
    TEST_ASSERT_EQUAL_INT64(a->boottime_ms, b->boottime_ms);
    TEST_ASSERT_EQUAL_INT64(a->fence, b->fence);
    TEST_ASSERT_EQUAL_INT64(a->owner_uid, b->owner_uid);
    TEST_ASSERT_EQUAL_INT(a->specular, b->specular);
    TEST_ASSERT_EQUAL_size_t(a->replicates, b->replicates);
    for (size_t i = 0; i < STORE_MAX_REPLICATES; i++) {
        assert_same_spectrum(&a->replicate[i], &b->replicate[i], "sce");
        assert_same_spectrum(&a->replicate_sci[i], &b->replicate_sci[i], "sci");
    }
    assert_same_spectrum(&a->spectrum, &b->spectrum, "spectrum");
    TEST_ASSERT_NULL(b->raw);
    TEST_ASSERT_EQUAL_size_t(a->raw != NULL ? a->raw_n : 0, b->raw_n);
    assert_same_number(a->raw_unit, b->raw_unit, "raw_unit");
    assert_same_number(a->surface, b->surface, "surface");
    assert_same_number(a->aperture_mm, b->aperture_mm, "aperture_mm");
    for (int i = 0; i < 3; i++) {
        assert_same_number(a->XYZ[i], b->XYZ[i], "XYZ");
        assert_same_number(a->Lab[i], b->Lab[i], "Lab");
        TEST_ASSERT_EQUAL_INT(a->sRGB[i], b->sRGB[i]);
    }
    assert_same_number(a->ITA, b->ITA, "ITA");
}

static void as_it_is(void)
{
}

/* A spectrum that a client sent: no instrument, no replicates. */
static void sent_by_a_client(void)
{
    memset(&record->instrument, 0, sizeof record->instrument);
    record->replicates = 0;
    for (int i = 0; i < STORE_MAX_REPLICATES; i++)
        record->replicate[i].n = record->replicate_sci[i].n = 0;
    record->operator_name[0] = record->site[0] = record->ita_scheme[0] = '\0';
    record->fence = 0;
}

static void without_a_match(void)
{
    record->match_json[0] = record->table_name[0] = record->table_sha256[0] = '\0';
    record->method[0] = record->uuid[0] = record->parameters_sha256[0] = '\0';
}

static void refined(void)
{
    strcpy(record->refined_json, "{\"Cm\":0.031,\"se\":{\"Cm\":0.0018}}");
}

static void sce_only(void)
{
    for (int i = 0; i < STORE_MAX_REPLICATES; i++)
        record->replicate_sci[i].n = 0;
    record->flags[0] = '\0';
}

static void sci_only(void)
{
    for (int i = 0; i < STORE_MAX_REPLICATES; i++)
        record->replicate[i].n = 0;
    record->specular = record->spectrum.specular = SPECULAR_SCI;
    record->surface = 0.04;
}

static void nothing_known(void)
{
    sent_by_a_client();
    record->specular = record->spectrum.specular = SPECULAR_UNKNOWN;
    record->aperture_mm = record->spectrum.aperture_mm = (double)NAN;
    record->ITA = record->XYZ[0] = record->Lab[2] = (double)NAN;
    record->spectrum.value[3] = (double)NAN;
}

static void flagged_bands(void)
{
    record->spectrum.flag[0] = SPECTRUM_BAND_ZEROED;
    record->replicate[2].flag[30] = 0xff;
    record->replicate_sci[1].flag[7] = 3;
}

static const int32_t raw[] = { 0, 1, -1, INT32_MAX, INT32_MIN, 65536 };

static void with_raw_integers(void)
{
    record->raw = raw;
    record->raw_n = 6;
    record->raw_unit = 1.0 / 65535.0;
}

static void as_large_as_can_be(void)
{
    record->replicates = STORE_MAX_REPLICATES;
    for (size_t i = 0; i < record->replicates; i++) {
        records_spectrum(&dice, SPECTRUM_MAX_BANDS, SPECULAR_SCE, &record->replicate[i]);
        records_spectrum(&dice, SPECTRUM_MAX_BANDS, SPECULAR_SCI, &record->replicate_sci[i]);
    }
    records_spectrum(&dice, SPECTRUM_MAX_BANDS, SPECULAR_SCE, &record->spectrum);
    memset(record->match_json, 'm', sizeof record->match_json - 1);
    memset(record->refined_json, 'r', sizeof record->refined_json - 1);
    memset(record->flags, 'f', sizeof record->flags - 1);
    memset(record->site, 's', sizeof record->site - 1);
    memset(record->operator_name, 'o', sizeof record->operator_name - 1);
}

static void asked_by_nobody_known(void)
{
    record->owner_uid = -1;
}

static void asked_by_root(void)
{
    record->owner_uid = 0;
}

static void asked_by_the_highest(void)
{
    record->owner_uid = UINT32_MAX - 1; /* uids have 32 bits, the last means none */
}

/* Text is text: none of it is SQL. */
static void with_sql_in_it(void)
{
    strcpy(record->site, "'); DROP TABLE measurement; --");
    strcpy(record->operator_name, "Robert\"); DELETE FROM audit;\n\t%s%n");
    strcpy(record->instrument.serial, "\xe2\x80\xae\x01\x7f ?1 :a @b $c");
}

static const struct shape_case {
    const char *what;
    void (*change)(void);
} shape_cases[] = {
    { "a reading", as_it_is },
    { "sent by a client", sent_by_a_client },
    { "without a match", without_a_match },
    { "refined", refined },
    { "SCE only", sce_only },
    { "SCI only", sci_only },
    { "nothing known", nothing_known },
    { "flagged bands", flagged_bands },
    { "raw integers", with_raw_integers },
    { "as large as can be", as_large_as_can_be },
    { "asked by nobody known", asked_by_nobody_known },
    { "asked by root", asked_by_root },
    { "asked by the highest uid", asked_by_the_highest },
    { "SQL in it", with_sql_in_it },
};

static void test_there_and_back(void)
{
    for (size_t i = 0; i < sizeof shape_cases / sizeof *shape_cases; i++) {
        const struct shape_case *c = &shape_cases[i];
        free(record);
        record = records_make(&dice);
        c->change();
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, add(), c->what);
        TEST_ASSERT_EQUAL_INT64_MESSAGE(i + 1, record->seq, c->what);
        TEST_ASSERT_EQUAL_STRING("2026-01-01T00:00:00.123Z", record->taken_at);
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, store_get(reader, record->id, NULL, got), c->what);
        assert_same_record(record, got);
        if (record->uuid[0] != '\0') {
            memset(got, 77, sizeof *got);
            TRY(store_get(reader, NULL, record->uuid, got));
            assert_same_record(record, got);
        }
    }
    struct store_verify_report report;
    TRY(store_verify(reader, &report));
    TEST_ASSERT_EQUAL_INT64(sizeof shape_cases / sizeof *shape_cases, report.records);
    TEST_ASSERT_EQUAL_INT(0, heard_count());
    TEST_ASSERT_EQUAL_INT(6, tool_number(folder, "SELECT length(raw)/4 FROM measurement"
                                                 " WHERE raw IS NOT NULL"));
    TEST_ASSERT_EQUAL_STRING("", store_bad_member(store));
}

/* expect: SQLite's file format: a REAL that is a whole number is kept as an integer, so that -0
 * comes back as 0; all else bit for bit.  The chain holds what comes back. */
static void test_strange_numbers(void)
{
    static const double strange[] = { -0.0,
                                      0.0,
                                      1.0,
                                      -1.0,
                                      1e300,
                                      -1e300,
                                      5e-324,
                                      1.0 / 3,
                                      1e15,
                                      9e15,
                                      9007199254740993.0,
                                      9.3e18,
                                      INFINITY,
                                      -INFINITY };
    struct store_verify_report report;
    for (size_t i = 0; i < sizeof strange / sizeof *strange; i++) {
        double x = strange[i], expect = x == 0.0 ? 0.0 : x;
        records_uuid(&dice, record->uuid);
        record->Lab[0] = record->ITA = record->aperture_mm = record->surface = x;
        record->spectrum.value[0] = x; /* in a blob: as it is */
        TRY(add());
        TRY(store_get(reader, record->id, NULL, got));
        assert_same_number(expect, got->Lab[0], "L");
        assert_same_number(expect, got->ITA, "ITA");
        assert_same_number(expect, got->aperture_mm, "aperture_mm");
        assert_same_number(expect, got->surface, "surface");
        assert_same_number(x, got->spectrum.value[0], "value");
    }
    record->boottime_ms = INT64_MIN;
    record->fence = INT64_MAX;
    records_uuid(&dice, record->uuid);
    TRY(add());
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, store_verify(reader, &report), report.what);
}

/* ---- what does not fit -------------------------------------------------------------- */

static void no_band(void)
{
    record->spectrum.n = 0;
}

static void too_many_bands(void)
{
    record->spectrum.n = SPECTRUM_MAX_BANDS + 1;
}

static void no_start(void)
{
    record->spectrum.first_nm = (double)NAN;
}

static void no_step(void)
{
    record->spectrum.step_nm = (double)INFINITY;
}

static void too_many_replicates(void)
{
    record->replicates = STORE_MAX_REPLICATES + 1;
}

static void another_grid(void)
{
    record->replicate[1].first_nm = 410.0;
}

static void another_step(void)
{
    record->replicate[2].step_nm = 5.0;
}

static void one_without_sci(void)
{
    record->replicate_sci[2].n = 0;
}

static void one_with_sce(void)
{
    record->replicate[0].n = 0;
}

static void too_much_raw(void)
{
    record->raw = raw;
    record->raw_n = 65537;
}

static void unknown_subject(void)
{
    records_uuid(&dice, record->subject);
}

static void unknown_calibration(void)
{
    records_uuid(&dice, record->calibration_id);
}

static void unknown_record(void)
{
    records_uuid(&dice, record->corrects);
}

static const struct misfit_case {
    const char *what;
    void (*change)(void);
    enum status status;
    const char *member;
} misfit_cases[] = {
    { "no band", no_band, STATUS_RANGE, "spectrum" },
    { "too many bands", too_many_bands, STATUS_RANGE, "spectrum" },
    { "no first wavelength", no_start, STATUS_RANGE, "spectrum" },
    { "no step", no_step, STATUS_RANGE, "spectrum" },
    { "too many replicates", too_many_replicates, STATUS_RANGE, "replicates" },
    { "a replicate on another grid", another_grid, STATUS_RANGE, "replicate" },
    { "a replicate of another step", another_step, STATUS_RANGE, "replicate" },
    { "a replicate without SCI", one_without_sci, STATUS_RANGE, "replicate_sci" },
    { "replicates without the first's SCE", one_with_sce, STATUS_RANGE, "replicate" },
    { "too many raw integers", too_much_raw, STATUS_RANGE, "raw" },
    { "unknown subject", unknown_subject, STATUS_NOT_FOUND, "subject" },
    { "unknown calibration", unknown_calibration, STATUS_NOT_FOUND, "calibration_id" },
    { "corrects an unknown record", unknown_record, STATUS_NOT_FOUND, "corrects" },
};

static void test_misfits(void)
{
    struct store_record *before = malloc(sizeof *before);
    TRY(add());
    TRY(store_begin(store));
    for (size_t i = 0; i < sizeof misfit_cases / sizeof *misfit_cases; i++) {
        const struct misfit_case *c = &misfit_cases[i];
        free(record);
        record = records_make(&dice);
        c->change();
        memcpy(before, record, sizeof *before);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->status, add(), c->what);
        TEST_ASSERT_EQUAL_STRING_MESSAGE(c->member, store_bad_member(store), c->what);
        TEST_ASSERT_TRUE_MESSAGE(memcmp(before, record, sizeof *before) == 0, c->what);
    }
    TRY(store_commit(store));
    free(before);
    TEST_ASSERT_EQUAL_INT(1, count("measurement"));
    TEST_ASSERT_EQUAL_INT(0, heard_count()); /* answers, no failures */
}

/* A correction is a new row; subject and calibration are referred to. */
static void test_references(void)
{
    struct store_subject subject = { .birth_year = 1990 };
    struct store_calibration calibration = { .instrument = records_instrument(), .step = "zero" };
    TRY(store_add_subject(store, &subject, "clinic"));
    TRY(store_add_calibration(store, &calibration));
    TRY(add());
    strcpy(record->corrects, record->id);
    strcpy(record->subject, subject.id);
    strcpy(record->calibration_id, calibration.id);
    records_uuid(&dice, record->uuid);
    TRY(add());
    TRY(store_get(reader, record->id, NULL, got));
    assert_same_record(record, got);
    TEST_ASSERT_TRUE(strcmp(record->corrects, record->id) < 0);
    TEST_ASSERT_TRUE(strcmp(calibration.id, record->corrects) < 0);
    TEST_ASSERT_EQUAL_INT(1, count("instrument"));
    TEST_ASSERT_EQUAL_INT(1, count("site"));
}

/* ---- retries
 * ------------------------------------------------------------------------------------- */

static void test_the_same_uuid_again(void)
{
    bool known = false;
    TRY(add());
    struct store_record *again = malloc(sizeof *again);
    memcpy(again, record, sizeof *again);
    memset(again->id, 0, sizeof again->id);
    again->seq = 0;
    again->taken_at[0] = '\0';
    again->Lab[0] = 1.0; /* measured a second time: the first is what counts */
    now_ms += 5000;
    TRY(store_add_record(store, again, &known));
    TEST_ASSERT_TRUE(known);
    TEST_ASSERT_EQUAL_STRING(record->id, again->id);
    TEST_ASSERT_EQUAL_STRING(record->taken_at, again->taken_at);
    TEST_ASSERT_EQUAL_INT64(record->seq, again->seq);
    again->parameters_sha256[0] = 'f';
    TEST_ASSERT_EQUAL_INT(STATUS_EXISTS, store_add_record(store, again, &known));
    TEST_ASSERT_EQUAL_STRING("uuid", store_bad_member(store));
    free(again);
    TEST_ASSERT_EQUAL_INT(1, count("measurement"));
    TEST_ASSERT_EQUAL_INT(1, tool_number(folder, "SELECT count(*) FROM audit"
                                                 " WHERE action = 'measurement.add'"));
    TEST_ASSERT_EQUAL_INT(0, heard_count());
}

/* Also before the first is committed, and after a restart. */
static void test_a_retry_within_the_group(void)
{
    bool known = false;
    TRY(store_begin(store));
    TRY(add());
    TRY(store_add_record(store, record, &known));
    TEST_ASSERT_TRUE(known);
    TRY(store_commit(store));
    reopen();
    known = false;
    TRY(store_add_record(store, record, &known));
    TEST_ASSERT_TRUE(known);
    TEST_ASSERT_EQUAL_INT(1, record->seq);
}

#define DAY_MS INT64_C(86400000)

/* expect: of 1 010 uuids the newest 1 000 stay whatever their age. */
static const struct prune_case {
    const char *what;
    int64_t later_ms;
    int left;
} prune_cases[] = {
    { "at once", 0, 1010 },
    { "30 days", 30 * DAY_MS, 1010 },
    { "30 days and a moment", 30 * DAY_MS + 1, 1000 },
    { "ten years", 3650 * DAY_MS, 1000 },
    { "an hour back", -3600000, 1000 },
};

static void test_prune(void)
{
    TEST_ASSERT_EQUAL_INT(STATUS_OK, store_prune(store));
    tool_add(store, 3, 1010);
    for (size_t i = 0; i < sizeof prune_cases / sizeof *prune_cases; i++) {
        const struct prune_case *c = &prune_cases[i];
        int64_t before = now_ms;
        now_ms += c->later_ms;
        TRY(store_prune(store));
        now_ms = before;
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->left, count("client_uuid"), c->what);
    }
    TEST_ASSERT_EQUAL_INT(1010, count("measurement"));
    TEST_ASSERT_EQUAL_INT(1, tool_number(folder, "SELECT min(measurement) = 11 FROM client_uuid"));
}

/* ---- the rest of what is written ---------------------------------------------------- */

static bool keep_subject(void *context, const struct store_subject *subject)
{
    struct store_subject **next = context;
    *(*next)++ = *subject;
    return true;
}

static void test_subjects(void)
{
    struct store_subject a = { .label = "P-017", .name = "Zoë Ångström", .birth_year = 1984 };
    struct store_subject b = { .birth_year = 0 }, seen[3], *next = seen;
    memset(a.notes, 'n', sizeof a.notes - 1);
    TRY(store_add_subject(store, &a, "clinic"));
    TRY(store_add_subject(store, &b, "clinic"));
    TEST_ASSERT_TRUE(uuid_is_text(a.id) && uuid_is_text(b.id) && strcmp(a.id, b.id) != 0);
    TRY(store_list_subjects(reader, "", keep_subject, &next));
    TEST_ASSERT_EQUAL_PTR(seen + 2, next);
    TEST_ASSERT_EQUAL_STRING(a.id, seen[0].id);
    TEST_ASSERT_EQUAL_STRING(a.label, seen[0].label);
    TEST_ASSERT_EQUAL_STRING(a.name, seen[0].name);
    TEST_ASSERT_EQUAL_STRING(a.notes, seen[0].notes);
    TEST_ASSERT_EQUAL_INT(1984, seen[0].birth_year);
    TEST_ASSERT_FALSE(seen[0].forgotten);
    TEST_ASSERT_EQUAL_STRING(b.id, seen[1].id);
    TEST_ASSERT_EQUAL_STRING("", seen[1].name);
    TEST_ASSERT_EQUAL_INT(0, seen[1].birth_year);
    TEST_ASSERT_FALSE(seen[1].forgotten);
}

/* The last of the step, of the same unit whatever its firmware. */
static void test_calibrations(void)
{
    struct store_calibration zero = { .instrument = records_instrument(), .step = "zero" };
    struct store_calibration white = { .instrument = records_instrument(),
                                       .step = "white",
                                       .tile = "T-9",
                                       .aperture_mm = 8.0,
                                       .operator_name = "Zoë",
                                       .boot_id = "f325439a-0fb6-4e34-92f6-680202b1ed90",
                                       .boottime_ms = 4711 };
    struct store_calibration last;
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND,
                          store_last_calibration(reader, &zero.instrument, "zero", &last));
    TRY(store_add_calibration(store, &white));
    TRY(store_add_calibration(store, &zero));
    now_ms -= 3600000;
    strcpy(white.instrument.firmware, "2.0");
    TRY(store_add_calibration(store, &white));
    TRY(store_last_calibration(reader, &zero.instrument, "white", &last));
    TEST_ASSERT_EQUAL_STRING(white.id, last.id);
    TEST_ASSERT_EQUAL_STRING("2025-12-31T23:00:00.123Z", last.taken_at);
    TEST_ASSERT_EQUAL_STRING(white.taken_at, last.taken_at);
    TEST_ASSERT_EQUAL_STRING("white", last.step);
    TEST_ASSERT_EQUAL_STRING("T-9", last.tile);
    assert_same_number(8.0, last.aperture_mm, "aperture_mm");
    TEST_ASSERT_EQUAL_STRING("Zoë", last.operator_name);
    TEST_ASSERT_EQUAL_STRING(white.boot_id, last.boot_id);
    TEST_ASSERT_EQUAL_INT64(4711, last.boottime_ms);
    TEST_ASSERT_EQUAL_STRING("2.0", last.instrument.firmware);
    TEST_ASSERT_EQUAL_STRING("S-0001", last.instrument.serial);
    strcpy(zero.instrument.serial, "S-0002");
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND,
                          store_last_calibration(reader, &zero.instrument, "zero", &last));
    TEST_ASSERT_EQUAL_INT(2, count("instrument"));
    zero.aperture_mm = (double)NAN;
    TRY(store_add_calibration(store, &zero));
    TRY(store_last_calibration(reader, &zero.instrument, "zero", &last));
    assert_same_number((double)NAN, last.aperture_mm, "aperture_mm");
}

/* ---- groups
 * ---------------------------------------------------------------------------------------- */

static void test_a_group_is_one_transaction(void)
{
    TRY(store_begin(store));
    for (int i = 0; i < 50; i++) {
        records_uuid(&dice, record->uuid);
        TRY(add());
    }
    TEST_ASSERT_EQUAL_INT(0, count("measurement"));
    TRY(store_commit(store));
    TEST_ASSERT_EQUAL_INT(50, count("measurement"));
    TRY(store_begin(store));
    records_uuid(&dice, record->uuid);
    TRY(add());
    store_rollback(store);
    TEST_ASSERT_EQUAL_INT(50, count("measurement"));
    records_uuid(&dice, record->uuid);
    TRY(add());
    TEST_ASSERT_EQUAL_INT64(51, record->seq);
}

/* Jobs that fail at each place, between jobs that do not: no gap, no trace. */
static void test_failed_jobs_leave_no_gap(void)
{
    static const char *const spoil[] = {
        "CREATE TRIGGER spoil BEFORE INSERT ON measurement BEGIN SELECT RAISE(ABORT, 'x'); END",
        "CREATE TRIGGER spoil AFTER INSERT ON match BEGIN SELECT RAISE(FAIL, 'x'); END",
        "CREATE TRIGGER spoil AFTER INSERT ON client_uuid BEGIN SELECT RAISE(ABORT, 'x'); END",
        "CREATE TRIGGER spoil AFTER INSERT ON audit BEGIN SELECT RAISE(ABORT, 'x'); END",
    };
    int64_t expected = 0;
    struct store_verify_report report;
    for (size_t i = 0; i < sizeof spoil / sizeof *spoil; i++) {
        TRY(store_begin(store));
        records_uuid(&dice, record->uuid);
        TRY(add());
        TEST_ASSERT_EQUAL_INT64(++expected, record->seq);
        TRY(sql_run(store->db, spoil[i]));
        records_uuid(&dice, record->uuid);
        heard_start();
        TEST_ASSERT_EQUAL_INT(STATUS_DB, add());
        TEST_ASSERT_EQUAL_INT(1, heard_count());
        TEST_ASSERT_MESSAGE(heard_contains("cannot keep a record: x"), heard_last());
        TRY(sql_run(store->db, "DROP TRIGGER spoil"));
        TRY(add());
        TEST_ASSERT_EQUAL_INT64(++expected, record->seq);
        TRY(store_commit(store));
    }
    TRY(store_verify(reader, &report));
    TEST_ASSERT_EQUAL_INT64(8, report.records);
    TEST_ASSERT_EQUAL_INT64(8, report.last_seq);
    TEST_ASSERT_EQUAL_INT(8, count("client_uuid"));
}

/* Without savepoints: refusals leave the group as it was; a failure half way takes it along, and
 * all of it can be done again, each on its own. */
static void test_a_group_together(void)
{
    struct store_subject subject = { .name = "Zoë" };
    struct store_verify_report report;
    TRY(store_begin_together(store));
    for (int i = 0; i < 3; i++) {
        records_uuid(&dice, record->uuid);
        TRY(add());
        TEST_ASSERT_EQUAL_INT64(i + 1, record->seq);
        records_uuid(&dice, record->uuid);
        records_uuid(&dice, record->subject);
        TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, add());
        record->subject[0] = '\0';
    }
    TEST_ASSERT_FALSE(store_must_part(store));
    TRY(store_commit(store));
    TEST_ASSERT_EQUAL_INT(3, count("measurement"));

    TRY(sql_run(store->db, "CREATE TRIGGER spoil AFTER INSERT ON audit"
                           " BEGIN SELECT RAISE(FAIL, 'x'); END"));
    TRY(store_begin_together(store));
    TEST_ASSERT_FALSE(store_must_part(store));
    TEST_ASSERT_EQUAL_INT(STATUS_DB, add());
    TEST_ASSERT_TRUE(store_must_part(store));
    TEST_ASSERT_EQUAL_INT64_MESSAGE(3, record->seq, "untouched");
    TEST_ASSERT_EQUAL_INT(STATUS_DB, store_add_subject(store, &subject, "x"));
    TEST_ASSERT_EQUAL_INT(STATUS_DB, store_commit(store));
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, heard_count(), "it is told when it fails alone");
    TRY(sql_run(store->db, "DROP TRIGGER spoil"));
    TEST_ASSERT_EQUAL_INT(3, count("measurement"));

    TRY(store_begin(store));
    TEST_ASSERT_FALSE(store_must_part(store));
    TRY(add());
    TEST_ASSERT_EQUAL_INT64(4, record->seq);
    TRY(store_commit(store));
    TRY(store_verify(reader, &report));
    TEST_ASSERT_EQUAL_INT64(4, report.records);
}

/* A failure that takes the transaction along: RAISE(ROLLBACK) does what a full disk may. */
static void test_a_group_that_is_lost(void)
{
    struct store_calibration calibration = { .instrument = records_instrument(), .step = "zero" };
    TRY(store_begin(store));
    TRY(add());
    TRY(sql_run(store->db, "CREATE TRIGGER spoil BEFORE INSERT ON calibration"
                           " BEGIN SELECT RAISE(ROLLBACK, 'x'); END"));
    TEST_ASSERT_EQUAL_INT(STATUS_DB, store_add_calibration(store, &calibration));
    TEST_ASSERT_EQUAL_STRING("", calibration.id);
    records_uuid(&dice, record->uuid);
    TEST_ASSERT_EQUAL_INT(STATUS_DB, add());
    TEST_ASSERT_EQUAL_INT(STATUS_DB, store_commit(store));
    TEST_ASSERT_EQUAL_INT(0, count("measurement"));
    TRY(add()); /* and the store goes on */
    TEST_ASSERT_EQUAL_INT64(1, record->seq);
}

/* Jobs outside a group are groups of their own, each kind. */
static void test_single_jobs_that_fail(void)
{
    struct store_subject subject = { .name = "Zoë" };
    TRY(sql_run(store->db, "CREATE TRIGGER spoil AFTER INSERT ON audit"
                           " BEGIN SELECT RAISE(ABORT, 'x'); END"));
    TEST_ASSERT_EQUAL_INT(STATUS_DB, add());
    TEST_ASSERT_EQUAL_INT(STATUS_DB, store_add_subject(store, &subject, ""));
    TEST_ASSERT_EQUAL_STRING("", subject.id);
    TEST_ASSERT_EQUAL_STRING("", record->id);
    TEST_ASSERT_EQUAL_INT(2, heard_count());
    TRY(sql_run(store->db, "DROP TRIGGER spoil"));
    TEST_ASSERT_EQUAL_INT(0, count("subject") + count("subject_person") + count("measurement"));
    TRY(store_add_subject(store, &subject, ""));
}

static void test_locked_by_another_program(void)
{
    sqlite3 *other;
    TEST_ASSERT_EQUAL_INT(SQLITE_OK, sqlite3_open(path, &other));
    TRY(sql_run(other, "BEGIN IMMEDIATE"));
    sqlite3_busy_timeout(store->db, 10);
    TEST_ASSERT_EQUAL_INT(STATUS_DB, add());
    TEST_ASSERT_TRUE(heard_contains("locked"));
    TEST_ASSERT_EQUAL_INT(STATUS_DB, store_prune(store));
    TRY(sql_run(other, "ROLLBACK"));
    sqlite3_close(other);
    TRY(add());
}

/* Files that lose their names under the service: nothing is said to be kept. */
static void test_moved_under_the_service(void)
{
    char other[FOLDER_PATH_SIZE];
    TRY(add());
    folder_path(folder, "station.db-wal", other);
    TEST_ASSERT_EQUAL_INT(0, unlink(other));
    TEST_ASSERT_EQUAL_INT(STATUS_IO, store_begin(store));
    TEST_ASSERT_TRUE(heard_contains("moved or deleted"));
    records_uuid(&dice, record->uuid);
    TEST_ASSERT_EQUAL_INT(STATUS_IO, add());
    store_reader_close(reader);
    reader = NULL;
    reopen(); /* what was acknowledged is still there */
    TEST_ASSERT_EQUAL_INT(1, count("measurement"));
    TRY(add());
    TEST_ASSERT_EQUAL_INT64(2, record->seq);
    TEST_ASSERT_EQUAL_INT(0, rename(path, folder_path(folder, "elsewhere.db", other)));
    TEST_ASSERT_EQUAL_INT(STATUS_IO, store_begin(store));
    TEST_ASSERT_EQUAL_INT(0, rename(other, path));
    TRY(store_begin(store));
    TRY(store_commit(store));
}

/* A page that turns out corrupt while writing: nothing more is written, and the next
 * start moves the file aside. */
static void test_damage_met_while_writing(void)
{
    tool_add(store, 5, 200);
    reopen(); /* all in the file, nothing in the cache */
    long long root =
        tool_number(folder, "SELECT rootpage FROM sqlite_schema WHERE name = 'measurement'");
    FILE *f = fopen(path, "r+b");
    fseek(f, (long)((root - 1) * 4096), SEEK_SET);
    for (int i = 0; i < 4096; i++)
        fputc(0xff, f);
    fclose(f);
    store_reader_close(reader);
    reader = NULL;
    sqlite3_db_release_memory(store->db);
    TRY(sql_run(store->db, "PRAGMA shrink_memory"));
    struct store_subject subject = { .name = "Zoë" };
    TRY(store_begin(store));
    TRY(store_add_subject(store, &subject, ""));
    TEST_ASSERT_EQUAL_INT(STATUS_DAMAGED, add());
    TEST_ASSERT_EQUAL_INT(STATUS_DAMAGED, store_add_subject(store, &subject, ""));
    TEST_ASSERT_EQUAL_INT(STATUS_DAMAGED, store_commit(store));
    TEST_ASSERT_EQUAL_INT(STATUS_DAMAGED, store_begin(store));
    TEST_ASSERT_EQUAL_INT(STATUS_DAMAGED, add());
    TEST_ASSERT_EQUAL_INT(1, heard_count());
    store_close(store);
    store = NULL;
    TEST_ASSERT_EQUAL_INT(STATUS_DAMAGED, store_open(folder, &test_clock, &store));
}

/* ---- the WAL
 * ---------------------------------------------------------------------------------------------- */

/* No checkpoint on the way of a commit; a reader pins the WAL, which can be seen. */
static void test_the_wal(void)
{
    sqlite3 *pin;
    int left = 77;
    int64_t before, pinned, after;
    tool_add(store, 1, 1200); /* SQLite's own would begin at 1 000 pages */
    TRY(store_wal_bytes(folder, &before));
    TEST_ASSERT_TRUE(before > INT64_C(1000) * 4096);
    TRY(tool_checkpoint(folder, &left));
    TEST_ASSERT_EQUAL_INT(0, left);
    TEST_ASSERT_EQUAL_INT(SQLITE_OK, sqlite3_open(path, &pin));
    TRY(sql_run(pin, "BEGIN; SELECT count(*) FROM measurement"));
    for (int i = 0; i < 10; i++) {
        tool_add(store, 100 + (uint64_t)i, 400);
        TRY(tool_checkpoint(folder, &left));
        TEST_ASSERT_TRUE(left > 400);
    }
    TRY(store_wal_bytes(folder, &pinned));
    TEST_ASSERT_TRUE(pinned > 16777216);
    sqlite3_close(pin);
    TRY(tool_checkpoint(folder, &left));
    TEST_ASSERT_EQUAL_INT(0, left);
    TRY(add()); /* starts the WAL from its beginning, and cuts it */
    TRY(store_wal_bytes(folder, &after));
    TEST_ASSERT_TRUE(after <= 16777216);
    TEST_ASSERT_EQUAL_INT(5201, count("measurement"));
}

/* ---- clocks
 * ---------------------------------------------------------------------------------------------------
 */

#define HOUR_MS INT64_C(3600000)

/* What the clock does between records, and whether the program starts anew. */
static const struct step_case {
    const char *what;
    int64_t step_ms; /* or, below 0, where `to` is set, the time itself */
    bool to_1970, restart;
} step_cases[] = {
    { "stands still", 0, false, false },
    { "an hour on", HOUR_MS, false, false },
    { "an hour back", -HOUR_MS, false, false },
    { "an hour back, restarted", -HOUR_MS, false, true },
    { "to 1970", 0, true, false },
    { "to 1970, restarted", 0, true, true },
    { "ten years on", 3650 * DAY_MS, false, false },
    { "ten years back", -3650 * DAY_MS, false, false },
    { "ten years back, restarted", -3650 * DAY_MS, false, true },
};

static void test_ids_rise_whatever_the_clock_does(void)
{
    char before[STORE_UUID_SIZE] = "";
    int64_t seq = 0;
    for (size_t i = 0; i < sizeof step_cases / sizeof *step_cases; i++) {
        const struct step_case *c = &step_cases[i];
        struct store_calibration calibration = { .instrument = records_instrument(),
                                                 .step = "zero" };
        now_ms = c->to_1970 ? 0 : now_ms + c->step_ms;
        if (c->restart)
            reopen();
        for (int j = 0; j < 5; j++) {
            records_uuid(&dice, record->uuid);
            TRY(add());
            TEST_ASSERT_MESSAGE(strcmp(record->id, before) > 0, c->what);
            TEST_ASSERT_EQUAL_INT64_MESSAGE(++seq, record->seq, c->what);
            memcpy(before, record->id, sizeof before);
        }
        TRY(store_add_calibration(store, &calibration));
        TEST_ASSERT_MESSAGE(strcmp(calibration.id, before) > 0, c->what);
        memcpy(before, calibration.id, sizeof before);
        if (c->to_1970) {
            TEST_ASSERT_EQUAL_STRING("1970-01-01T00:00:00.000Z", calibration.taken_at);
            now_ms = INT64_C(1767225600123);
        }
    }
    struct store_verify_report report;
    TRY(store_verify(reader, &report));
}

/* expect: date -u -d @SECONDS; RFC 3339 has years up to 9999. */
static void test_times(void)
{
    static const struct {
        int64_t ms;
        const char *text;
    } times[] = {
        { 0, "1970-01-01T00:00:00.000Z" },
        { -1, "1970-01-01T00:00:00.000Z" },
        { 951782400007, "2000-02-29T00:00:00.007Z" },
        { 1767225599999, "2025-12-31T23:59:59.999Z" },
        { INT64_MAX, "9999-12-31T23:59:59.999Z" },
    };
    char text[STORE_TIME_SIZE];
    for (size_t i = 0; i < sizeof times / sizeof *times; i++) {
        clock_text(times[i].ms, text);
        TEST_ASSERT_EQUAL_STRING(times[i].text, text);
    }
    TEST_ASSERT_TRUE(store_now_ms(NULL) > INT64_C(1700000000000));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_there_and_back);
    RUN_TEST(test_strange_numbers);
    RUN_TEST(test_misfits);
    RUN_TEST(test_references);
    RUN_TEST(test_the_same_uuid_again);
    RUN_TEST(test_a_retry_within_the_group);
    RUN_TEST(test_prune);
    RUN_TEST(test_subjects);
    RUN_TEST(test_calibrations);
    RUN_TEST(test_a_group_is_one_transaction);
    RUN_TEST(test_failed_jobs_leave_no_gap);
    RUN_TEST(test_a_group_together);
    RUN_TEST(test_a_group_that_is_lost);
    RUN_TEST(test_single_jobs_that_fail);
    RUN_TEST(test_locked_by_another_program);
    RUN_TEST(test_moved_under_the_service);
    RUN_TEST(test_damage_met_while_writing);
    RUN_TEST(test_the_wal);
    RUN_TEST(test_ids_rise_whatever_the_clock_does);
    RUN_TEST(test_times);
    return UNITY_END();
}
