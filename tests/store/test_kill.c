/* test_kill.c - a writer killed at random moments, again and again: every record that it
 * acknowledged is there, whole, once; nothing is there in part.
 *
 *     test_kill [ROUNDS [SEED]]      50 rounds where not told
 *
 * The writer is a process of its own.  After each commit it writes what it committed
 * to a pipe, as a daemon would answer; a record counts as acknowledged when the pipe has
 * it.  Beside the groups it checkpoints from another thread, prunes and forgets. */
#define _DEFAULT_SOURCE /* usleep */
#include <pthread.h>
#include <signal.h>
#include <sys/wait.h>
#include <time.h>

#include "db/sql.h"
#include "tests/store/tools.h"
#include "tests/support/heard.h"

enum { ROUNDS = 50, FRESH_AFTER = 10, GROUP_MAX = 12, ACKNOWLEDGED_MAX = 1 << 20 };

static long rounds = ROUNDS;
static uint64_t seed = 1;
static char folder[FOLDER_PATH_SIZE];

/* What one record is known by; small enough for a pipe to take it whole. */
struct acknowledged {
    int64_t seq;
    char id[STORE_UUID_SIZE], uuid[STORE_UUID_SIZE];
    double L;
};

static struct acknowledged *known;
static size_t known_n;

void setUp(void)
{
    known = calloc(ACKNOWLEDGED_MAX, sizeof *known);
    TEST_ASSERT_NOT_NULL(known);
    TEST_ASSERT_TRUE(folder_make(folder));
}

void tearDown(void)
{
    free(known);
    folder_remove(folder);
}

/* ---- the writer --------------------------------------------------------------------------- */

static void *checkpoints(void *context)
{
    struct store_keeper *keeper;
    int left;
    (void)context;
    if (store_keeper_open(folder, &keeper) != STATUS_OK)
        _exit(3);
    for (;;) {
        (void)store_keeper_checkpoint(keeper, &left);
        usleep(3000);
    }
    return NULL;
}

static void must(bool good)
{
    if (!good)
        _exit(3);
}

/* One group of up to GROUP_MAX records, some of which are refused. */
static void write_group(struct store *store, struct store_record *record, struct dice *dice,
                        int pipe_end)
{
    struct acknowledged done[GROUP_MAX];
    size_t n = 0;
    must(store_begin(store) == STATUS_OK);
    for (size_t i = 1 + dice_below(dice, GROUP_MAX); i > 0; i--) {
        bool again;
        records_uuid(dice, record->uuid);
        record->Lab[0] = dice_between(dice, 5.0, 70.0);
        strcpy(record->corrects, dice_below(dice, 8) == 0 ? "nothing" : "");
        enum status s = store_add_record(store, record, &again);
        must(s == (record->corrects[0] != '\0' ? STATUS_NOT_FOUND : STATUS_OK));
        if (s != STATUS_OK)
            continue;
        done[n].seq = record->seq;
        done[n].L = record->Lab[0];
        memcpy(done[n].id, record->id, sizeof done[n].id);
        memcpy(done[n].uuid, record->uuid, sizeof done[n].uuid);
        n++;
    }
    must(store_commit(store) == STATUS_OK);
    for (size_t i = 0; i < n; i++)
        must(write(pipe_end, &done[i], sizeof done[i]) == (ssize_t)sizeof done[i]);
}

static void write_rest(struct store *store, struct dice *dice)
{
    struct store_subject subject = { .name = "Zoë" };
    struct store_calibration calibration = { .instrument = records_instrument(), .step = "zero" };
    bool erased;
    switch (dice_below(dice, 4)) {
    case 0:
        must(store_add_calibration(store, &calibration) == STATUS_OK);
        break;
    case 1:
        must(store_add_subject(store, &subject, "x") == STATUS_OK);
        must(store_forget_subject(store, subject.id, "x", &erased) == STATUS_OK);
        break;
    case 2:
        must(store_prune(store) == STATUS_OK);
        break;
    default:
        must(store_finish_erasing(store, &erased) == STATUS_OK);
        break;
    }
}

static void be_the_writer(uint64_t own_seed, int pipe_end)
{
    struct dice dice = { own_seed };
    struct store *store = NULL;
    pthread_t thread;
    struct store_record *record = records_make(&dice);
    must(record != NULL);
    must(store_open(folder, NULL, &store) == STATUS_OK);
    must(pthread_create(&thread, NULL, checkpoints, NULL) == 0);
    for (;;) {
        write_group(store, record, &dice, pipe_end);
        if (dice_below(&dice, 10) == 0)
            write_rest(store, &dice);
    }
}

/* ---- the judge ------------------------------------------------------------------------------ */

static void sleep_us(size_t us)
{
    struct timespec t = { (time_t)(us / 1000000), (long)(us % 1000000) * 1000 };
    nanosleep(&t, NULL);
}

/* Kill it after so long, and take from the pipe all that it acknowledged.  A pipe holds
 * 64 KiB; the thread here empties it while the writer runs. */
struct drain {
    int end;
};

static void *drain(void *context)
{
    const struct drain *d = context;
    while (known_n < ACKNOWLEDGED_MAX &&
           read(d->end, &known[known_n], sizeof *known) == (ssize_t)sizeof *known)
        known_n++;
    return NULL;
}

static void run_and_kill(uint64_t own_seed, size_t us)
{
    int ends[2], ended = 0;
    pthread_t thread;
    TEST_ASSERT_EQUAL_INT(0, pipe(ends));
    fflush(NULL);
    pid_t child = fork();
    TEST_ASSERT_TRUE(child >= 0);
    if (child == 0) {
        close(ends[0]);
        be_the_writer(own_seed, ends[1]);
    }
    close(ends[1]);
    struct drain d = { ends[0] };
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, drain, &d));
    sleep_us(us);
    kill(child, SIGKILL);
    TEST_ASSERT_EQUAL_INT(child, waitpid(child, &ended, 0));
    TEST_ASSERT_EQUAL_INT(0, pthread_join(thread, NULL));
    close(ends[0]);
    TEST_ASSERT_TRUE_MESSAGE(WIFSIGNALED(ended) && WTERMSIG(ended) == SIGKILL,
                             "the writer ended by itself");
}

struct judged {
    size_t next; /* of known[] */
    int64_t last;
};

/* Records come in order of seq, and so do acknowledgements. */
static bool judge(void *context, const struct store_record *r)
{
    struct judged *j = context;
    TEST_ASSERT_EQUAL_INT64(j->last + 1, r->seq);
    j->last = r->seq;
    TEST_ASSERT_TRUE(r->match_json[0] == '{' && r->replicate[2].n == 31);
    if (j->next == known_n || known[j->next].seq != r->seq)
        return true; /* committed, and killed before it could say so */
    TEST_ASSERT_EQUAL_STRING(known[j->next].id, r->id);
    TEST_ASSERT_EQUAL_STRING(known[j->next].uuid, r->uuid);
    TEST_ASSERT_EQUAL_MEMORY(&known[j->next].L, &r->Lab[0], sizeof(double));
    j->next++;
    return true;
}

static void check_all(void)
{
    struct store *store;
    struct store_reader *reader;
    struct store_verify_report report;
    struct judged judged = { 0 };
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, store_open(folder, NULL, &store), heard_last());
    TRY(store_reader_open(folder, &reader));
    TRY(store_list(reader, &tool_all, judge, &judged));
    TEST_ASSERT_EQUAL_size_t_MESSAGE(known_n, judged.next, "an acknowledged record is missing");
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, store_verify(reader, &report), report.what);
    TEST_ASSERT_EQUAL_INT64(judged.last, report.records);
    store_reader_close(reader);
    store_close(store);
}

static void test_killed_at_random_moments(void)
{
    struct dice dice = { seed };
    size_t acknowledged = 0, rounds_with_records = 0;
    heard_start();
    for (long i = 0; i < rounds; i++) {
        size_t before = known_n;
        run_and_kill(dice_bits(&dice), dice_below(&dice, 250000));
        rounds_with_records += known_n > before;
        check_all();
        if (i % FRESH_AFTER == FRESH_AFTER - 1) {
            acknowledged += known_n;
            known_n = 0;
            folder_remove(folder);
            TEST_ASSERT_TRUE(folder_make(folder));
        }
    }
    heard_stop();
    printf("%ld rounds, %zu with records, %zu records acknowledged and found\n", rounds,
           rounds_with_records, acknowledged + known_n);
    TEST_ASSERT_TRUE((long)rounds_with_records >= rounds / 10);
}

int main(int argc, char **argv)
{
    if (argc > 1)
        rounds = atol(argv[1]);
    if (argc > 2)
        seed = strtoull(argv[2], NULL, 10);
    UNITY_BEGIN();
    RUN_TEST(test_killed_at_random_moments);
    return UNITY_END();
}
