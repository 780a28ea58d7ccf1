/* test_writer.c - group commit: what is done is on the disk, each job on its own. */
#include "station/writer.h"

#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "tests/store/tools.h"
#include "tests/support/heard.h"

static char folder[FOLDER_PATH_SIZE];
static struct store_claim *claim;
static struct inbox inbox;
static struct writer *writer;
static struct dice dice;
static size_t done_n;

void setUp(void)
{
    dice = (struct dice){ 20260722 };
    done_n = 0;
    TEST_ASSERT_TRUE(folder_make(folder));
    TRY(store_claim(folder, &claim));
    TRY(inbox_init(&inbox));
    TRY(writer_open(claim, &inbox, &writer));
}

void tearDown(void)
{
    writer_stop(writer);
    writer_close(writer);
    inbox_done(&inbox);
    store_claim_release(claim);
    folder_remove(folder);
}

static void count(struct job *job)
{
    (void)job;
    done_n++;
}

static void drain_until(size_t n)
{
    writer_hand_over(writer);
    while (done_n < n) {
        struct pollfd p = { .fd = inbox.fd, .events = POLLIN };
        TEST_ASSERT_EQUAL_INT_MESSAGE(1, poll(&p, 1, 10000), "the writer does not answer");
        inbox_drain(&inbox);
    }
}

static struct write_job record_job(void)
{
    struct write_job job = { .job.done = count, .kind = WRITE_RECORD };
    job.record = records_make(&dice);
    TEST_ASSERT_NOT_NULL(job.record);
    return job;
}

static int64_t newest(void)
{
    struct store_reader *reader;
    int64_t seq;
    TRY(store_reader_open(folder, &reader));
    TRY(store_newest(reader, &seq));
    store_reader_close(reader);
    return seq;
}

/* ---- records ------------------------------------------------------------------------ */

enum { MANY = 40 };

/* Some refused in between: the others are kept, without a gap. */
static void test_each_job_on_its_own(void)
{
    static struct write_job job[MANY];
    int64_t kept = 0;
    for (size_t i = 0; i < MANY; i++) {
        job[i] = record_job();
        if (i % 7 == 3)
            strcpy(job[i].record->subject, "00000000-0000-4000-8000-000000000000");
        writer_ask(writer, &job[i]);
    }
    drain_until(MANY);
    for (size_t i = 0; i < MANY; i++) {
        if (i % 7 == 3) {
            TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, job[i].status);
            TEST_ASSERT_EQUAL_STRING("subject", job[i].bad_member);
        } else {
            TEST_ASSERT_EQUAL_INT(STATUS_OK, job[i].status);
            TEST_ASSERT_EQUAL_INT64(++kept, job[i].record->seq);
        }
        free(job[i].record);
    }
    TEST_ASSERT_EQUAL_INT64(kept, newest());
    struct writer_counts counts = writer_count(writer);
    TEST_ASSERT_TRUE(counts.jobs == MANY && counts.groups >= 1 && counts.groups <= MANY);
}

/* What is asked waits to be handed over, and is then one group. */
static void test_handed_over_at_once(void)
{
    static struct write_job job[MANY];
    struct pollfd early = { .fd = inbox.fd, .events = POLLIN };
    for (size_t i = 0; i < MANY; i++) {
        job[i] = record_job();
        writer_ask(writer, &job[i]);
    }
    TEST_ASSERT_EQUAL_INT(0, poll(&early, 1, 50));
    drain_until(MANY);
    for (size_t i = 0; i < MANY; i++) {
        TEST_ASSERT_EQUAL_INT(STATUS_OK, job[i].status);
        TEST_ASSERT_EQUAL_INT64_MESSAGE((int64_t)i + 1, job[i].record->seq, "in their order");
        free(job[i].record);
    }
    struct writer_counts counts = writer_count(writer);
    TEST_ASSERT_TRUE(counts.jobs == MANY && counts.groups == 1);
    writer_hand_over(writer); /* nothing */
    writer_hand_over(NULL);
    TEST_ASSERT_EQUAL_INT(0, poll(&early, 1, 10));
}

/* Some fail after their first row: the group is done again, and the others are kept, without
 * a gap, as they are where nothing fails. */
static void test_failing_half_way(void)
{
    static struct write_job job[MANY];
    struct write_job before = record_job();
    struct store_verify_report report;
    struct store_reader *reader;
    int64_t kept = 1;
    writer_ask(writer, &before);
    drain_until(1);
    TEST_ASSERT_TRUE(tool_edit(folder, "CREATE TRIGGER spoil BEFORE INSERT ON client_uuid"
                                       " WHEN new.uuid LIKE 'bad%'"
                                       " BEGIN SELECT RAISE(ABORT, 'bad'); END"));
    for (size_t i = 0; i < MANY; i++) {
        job[i] = record_job();
        if (i % 7 == 3)
            memcpy(job[i].record->uuid, "bad", 3);
        writer_ask(writer, &job[i]);
    }
    heard_start();
    drain_until(1 + MANY);
    heard_stop();
    TEST_ASSERT_EQUAL_INT_MESSAGE((MANY + 3) / 7, heard_count(), "each failure once");
    for (size_t i = 0; i < MANY; i++) {
        TEST_ASSERT_EQUAL_INT(i % 7 == 3 ? STATUS_DB : STATUS_OK, job[i].status);
        if (i % 7 != 3)
            TEST_ASSERT_EQUAL_INT64(++kept, job[i].record->seq);
        free(job[i].record);
    }
    free(before.record);
    TRY(store_reader_open(folder, &reader));
    TRY(store_verify(reader, &report));
    store_reader_close(reader);
    TEST_ASSERT_EQUAL_INT64(kept, report.records);
    TEST_ASSERT_EQUAL_INT64(kept, report.last_seq);
}

static void test_retry_is_known(void)
{
    struct write_job first = record_job(), again = record_job(), other = record_job();
    strcpy(again.record->uuid, first.record->uuid);
    strcpy(again.record->parameters_sha256, first.record->parameters_sha256);
    strcpy(other.record->uuid, first.record->uuid);
    writer_ask(writer, &first);
    writer_ask(writer, &again);
    writer_ask(writer, &other);
    drain_until(3);
    TEST_ASSERT_TRUE(first.status == STATUS_OK && !first.known);
    TEST_ASSERT_TRUE(again.status == STATUS_OK && again.known);
    TEST_ASSERT_EQUAL_STRING(first.record->id, again.record->id);
    TEST_ASSERT_EQUAL_INT(STATUS_EXISTS, other.status);
    TEST_ASSERT_EQUAL_INT64(1, newest());
    free(first.record);
    free(again.record);
    free(other.record);
}

/* ---- the other kinds ---------------------------------------------------------------- */

static void test_opening_tells_the_id(void)
{
    struct write_job before = { .job.done = count, .kind = WRITE_OPEN }, after = before;
    writer_ask(writer, &before);
    writer_ask(writer, &after);
    drain_until(2);
    TEST_ASSERT_TRUE(before.status == STATUS_OK && after.status == STATUS_OK);
    TEST_ASSERT_EQUAL_size_t(36, strlen(before.opened.station_id));
    TEST_ASSERT_EQUAL_STRING(before.opened.station_id, after.opened.station_id);
}

/* Above what was reserved, what is on record, and what the caller has given out. */
static void test_fences_are_reserved(void)
{
    struct write_job none = { .job.done = count, .kind = WRITE_FENCES, .fences.n = 10 };
    struct write_job record = record_job(), above_record = none, above_all = none, upkeep = none;
    struct writer_counts counts;
    record.record->fence = 41;
    above_all.fences.above = 99;
    writer_ask(writer, &none);
    writer_ask(writer, &record);
    writer_ask(writer, &above_record);
    writer_ask(writer, &above_all);
    writer_ask(writer, &upkeep);
    drain_until(5);
    TEST_ASSERT_EQUAL_INT64(1, none.fences.first);
    TEST_ASSERT_EQUAL_INT64(42, above_record.fences.first);
    TEST_ASSERT_EQUAL_INT64(41, above_record.fences.above);
    TEST_ASSERT_EQUAL_INT64(100, above_all.fences.first);
    TEST_ASSERT_EQUAL_INT64(110, upkeep.fences.first);
    counts = writer_count(writer);
    TEST_ASSERT_EQUAL_UINT64(1, counts.jobs);
    free(record.record);
}

static void test_subjects_and_calibrations(void)
{
    struct store_subject subject = { .name = "Ada" }, nobody = { .id = "no-such" };
    struct write_job job[] = {
        { .kind = WRITE_SUBJECT, .subject = &subject, .who = "Jo, uid 0" },
        { .kind = WRITE_CALIBRATION,
          .calibration = { .instrument = records_instrument(), .step = "white" } },
        { .kind = WRITE_FINISH_ERASING },
        { .kind = WRITE_PRUNE },
        { .kind = WRITE_FORGET, .subject = &subject, .who = "Jo" },
        { .kind = WRITE_FORGET, .subject = &nobody },
        { .kind = WRITE_BEGIN_ANEW },
    };
    enum { JOBS = sizeof job / sizeof *job };
    for (size_t i = 0; i < JOBS; i++) {
        job[i].job.done = count;
        writer_ask(writer, &job[i]);
        drain_until(i + 1);
    }
    for (size_t i = 0; i < 5; i++)
        TEST_ASSERT_EQUAL_INT(STATUS_OK, job[i].status);
    TEST_ASSERT_TRUE(job[2].erased && job[4].erased);
    TEST_ASSERT_EQUAL_size_t(36, strlen(job[1].calibration.id));
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, job[5].status);
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_NOT_FOUND, job[6].status, "a sound store");
    TEST_ASSERT_EQUAL_size_t_MESSAGE(36, strlen(job[6].opened.station_id), "which is told of");
}

/* The station's own jobs, asked for while nobody wants anything. */
static void test_upkeep_does_not_count(void)
{
    static const enum write_kind kinds[] = { WRITE_OPEN, WRITE_OPEN, WRITE_FINISH_ERASING,
                                             WRITE_PRUNE, WRITE_RESTART_WAL };
    enum { KINDS = sizeof kinds / sizeof *kinds };
    struct store_subject somebody = { .label = "Ada" };
    struct write_job job[KINDS];
    struct write_job add = { .kind = WRITE_SUBJECT, .job.done = count, .subject = &somebody };
    for (size_t i = 0; i < KINDS; i++) {
        job[i] = (struct write_job){ .kind = kinds[i], .job.done = count };
        writer_ask(writer, &job[i]);
        drain_until(i + 1);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, job[i].status);
    }
    struct writer_counts counts = writer_look(writer);
    TEST_ASSERT_TRUE(counts.groups == 0 && counts.jobs == 0);
    writer_ask(writer, &add);
    drain_until(KINDS + 1);
    int64_t bytes;
    TRY(store_wal_bytes(folder, &bytes));
    counts = writer_count(writer);
    TEST_ASSERT_TRUE(counts.groups == 1 && counts.jobs == 1);
    TEST_ASSERT_TRUE(bytes > 0 && counts.wal_bytes == bytes);
    TEST_ASSERT_EQUAL_INT64(0, writer_look(writer).longest_us);
}

/* ---- when it cannot ----------------------------------------------------------------- */

static void test_damaged_until_begun_anew(void)
{
    char path[FOLDER_PATH_SIZE];
    struct write_job record = record_job(), refused, anew, after;
    writer_ask(writer, &record);
    drain_until(1);
    writer_stop(writer);
    writer_close(writer);
    TEST_ASSERT_EQUAL_INT(0, truncate(folder_path(folder, "station.db", path), 5000));
    TRY(writer_open(claim, &inbox, &writer));
    refused = after = record;
    anew = (struct write_job){ .job.done = count, .kind = WRITE_BEGIN_ANEW };
    heard_start();
    writer_ask(writer, &refused);
    drain_until(2);
    writer_ask(writer, &anew);
    drain_until(3);
    writer_ask(writer, &after);
    drain_until(4);
    heard_stop();
    TEST_ASSERT_EQUAL_INT(STATUS_DAMAGED, refused.status);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, anew.status);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, after.status);
    free(record.record);
}

static enum status ask_alone(enum write_kind kind, bool *moved)
{
    struct store_subject somebody = { .label = "Ada" };
    struct write_job job = { .kind = kind, .job.done = count };
    if (kind == WRITE_SUBJECT)
        job.subject = &somebody;
    writer_ask(writer, &job);
    drain_until(done_n + 1);
    *moved = job.moved;
    return job.status;
}

/* What may pass is tried again with the next job. */
static void test_opening_is_tried_again(void)
{
    char path[FOLDER_PATH_SIZE];
    bool moved;
    TEST_ASSERT_EQUAL_INT(0, mkdir(folder_path(folder, "station.db", path), 0700));
    heard_start();
    TEST_ASSERT_EQUAL_INT(STATUS_IO, ask_alone(WRITE_OPEN, &moved));
    TEST_ASSERT_EQUAL_INT(STATUS_IO, ask_alone(WRITE_SUBJECT, &moved));
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_IO, ask_alone(WRITE_BEGIN_ANEW, &moved), "no damage");
    heard_stop();
    TEST_ASSERT_FALSE(moved);
    TEST_ASSERT_EQUAL_INT(0, rmdir(path));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, ask_alone(WRITE_SUBJECT, &moved));
}

/* No empty file is made in its place, and nothing is lost when it comes back. */
static void test_moved_is_not_begun_anew(void)
{
    char path[FOLDER_PATH_SIZE], elsewhere[FOLDER_PATH_SIZE];
    bool moved;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, ask_alone(WRITE_SUBJECT, &moved));
    folder_path(folder, "station.db", path);
    TEST_ASSERT_EQUAL_INT(0, rename(path, folder_path(folder, "elsewhere", elsewhere)));
    heard_start();
    TEST_ASSERT_EQUAL_INT(STATUS_IO, ask_alone(WRITE_OPEN, &moved));
    TEST_ASSERT_TRUE(moved);
    TEST_ASSERT_EQUAL_INT(STATUS_IO, ask_alone(WRITE_BEGIN_ANEW, &moved));
    TEST_ASSERT_TRUE(moved);
    heard_stop();
    TEST_ASSERT_EQUAL_INT(-1, access(path, F_OK));
    TEST_ASSERT_EQUAL_INT(0, rename(elsewhere, path));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, ask_alone(WRITE_OPEN, &moved));
    TEST_ASSERT_FALSE(moved);
}

static void test_stopped_writer_cancels(void)
{
    struct write_job before = record_job(), after = record_job();
    writer_ask(writer, &before);
    writer_stop(writer);
    writer_ask(writer, &after);
    drain_until(2);
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, before.status, "asked before: written");
    TEST_ASSERT_EQUAL_INT(STATUS_CANCELLED, after.status);
    TEST_ASSERT_EQUAL_INT64(1, newest());
    free(before.record);
    free(after.record);
    writer_close(writer);
    TRY(writer_open(claim, &inbox, &writer)); /* for tearDown() */
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_each_job_on_its_own);
    RUN_TEST(test_handed_over_at_once);
    RUN_TEST(test_failing_half_way);
    RUN_TEST(test_retry_is_known);
    RUN_TEST(test_opening_tells_the_id);
    RUN_TEST(test_fences_are_reserved);
    RUN_TEST(test_subjects_and_calibrations);
    RUN_TEST(test_upkeep_does_not_count);
    RUN_TEST(test_damaged_until_begun_anew);
    RUN_TEST(test_opening_is_tried_again);
    RUN_TEST(test_moved_is_not_begun_anew);
    RUN_TEST(test_stopped_writer_cancels);
    return UNITY_END();
}
