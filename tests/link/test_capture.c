/* test_capture.c - what is written is read back, and what is no capture is refused by line. */
#define _DEFAULT_SOURCE /* syscall() */
#include "drivers/link/capture.h"

#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include "tests/support/folder.h"
#include "tests/support/heard.h"
#include "unity.h"

static char folder[FOLDER_PATH_SIZE], path[FOLDER_PATH_SIZE];

void setUp(void)
{
    TEST_ASSERT_TRUE(folder_make(folder));
    folder_path(folder, "a.capture", path);
    heard_start();
}

void tearDown(void)
{
    heard_stop();
    folder_remove(folder);
}

static struct capture *create(void)
{
    struct capture *capture = NULL;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, capture_create(path, "km_ascii", &capture));
    return capture;
}

static struct capture_file reread(void)
{
    struct capture_file file = { 0, NULL, 0 };
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, capture_read(path, &file), heard_last());
    return file;
}

static char *text_of_file(void)
{
    size_t size;
    char *text = (char *)file_bytes(path, &size);
    TEST_ASSERT_NOT_NULL(text);
    return text;
}

/* ---- there and back ----------------------------------------------------------------- */

static void test_every_kind_of_line(void)
{
    static const struct {
        enum capture_kind kind;
        const char *text;
    } expected[] = {
        { CAPTURE_DRIVER, "km_ascii" },  { CAPTURE_OPEN, "serial" },
        { CAPTURE_CALL, "measure" },     { CAPTURE_ASKED, "{\"n\": 1}" },
        { CAPTURE_CLOCK, "1763803801" }, { CAPTURE_SILENCE, NULL },
        { CAPTURE_FAILED, "gone" },
    };
    struct capture *capture = create();
    capture_note(capture, "model: %s", "two\nlines");
    capture_event(capture, "open serial");
    capture_call(capture, "measure");
    capture_asked(capture, "{\"n\":\n1}"); /* still one line, and the same JSON */
    capture_clock(capture, 1763803801);
    capture_bytes(capture, '~', 0x81, NULL, 0);
    capture_event(capture, "! gone");
    TEST_ASSERT_EQUAL_INT(STATUS_OK, capture_close(capture));

    struct capture_file file = reread();
    TEST_ASSERT_EQUAL_UINT(sizeof expected / sizeof *expected, file.n);
    double before_s = 0.0;
    for (size_t i = 0; i < file.n; i++) {
        TEST_ASSERT_EQUAL_INT(expected[i].kind, file.lines[i].kind);
        if (expected[i].text != NULL)
            TEST_ASSERT_EQUAL_STRING(expected[i].text, file.lines[i].text);
        TEST_ASSERT_TRUE(file.lines[i].at_s >= before_s && file.lines[i].at_s < 60.0);
        before_s = file.lines[i].at_s;
    }
    TEST_ASSERT_EQUAL_HEX8(0x81, file.lines[5].channel);
    TEST_ASSERT_EQUAL_UINT(5, file.lines[1].line); /* behind the head, driver and note */
    capture_free(&file);
    TEST_ASSERT_NULL(file.lines);
}

static void test_head_of_the_file(void)
{
    time_t before = time(NULL);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, capture_close(create()));
    struct stat is;
    TEST_ASSERT_EQUAL_INT(0, stat(path, &is));
    TEST_ASSERT_EQUAL_HEX(0600, is.st_mode & 0777);
    char *text = text_of_file();
    TEST_ASSERT_EQUAL_STRING_LEN("# skinspec capture 1\n# date: 20", text, 31);
    TEST_ASSERT_NOT_NULL(strstr(text, "by: skinspec "));
    TEST_ASSERT_NOT_NULL(strstr(text, " driver km_ascii\n"));
    free(text);
    struct capture_file file = reread();
    TEST_ASSERT_TRUE(file.realtime_s >= before && file.realtime_s <= time(NULL));
    capture_free(&file);
}

static void test_times_are_those_that_passed(void)
{
    struct capture *capture = create();
    nanosleep(&(struct timespec){ .tv_nsec = 50000000 }, NULL);
    capture_call(capture, "measure");
    TEST_ASSERT_EQUAL_INT(STATUS_OK, capture_close(capture));
    struct capture_file file = reread();
    TEST_ASSERT_TRUE(file.lines[1].at_s - file.lines[0].at_s >= 0.049);
    TEST_ASSERT_TRUE(file.lines[1].at_s < 5.0);
    capture_free(&file);
}

static void assert_came_back(const uint8_t *bytes, size_t n)
{
    struct capture *capture = create();
    capture_bytes(capture, '>', 0x01, bytes, n);
    capture_bytes(capture, '<', 0xff, bytes, n);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, capture_close(capture));
    struct capture_file file = reread();
    TEST_ASSERT_EQUAL_UINT(3, file.n);
    for (size_t i = 1; i < 3; i++) {
        const struct capture_line *line = &file.lines[i];
        TEST_ASSERT_EQUAL_INT(i == 1 ? CAPTURE_SENT : CAPTURE_CAME, line->kind);
        TEST_ASSERT_EQUAL_HEX8(i == 1 ? 0x01 : 0xff, line->channel);
        TEST_ASSERT_EQUAL_UINT(n, line->n);
        if (n > 0)
            TEST_ASSERT_EQUAL_MEMORY(bytes, line->bytes, n);
    }
    capture_free(&file);
    unlink(path);
}

static void test_every_byte(void)
{
    uint8_t all[256];
    for (int i = 0; i < 256; i++)
        all[i] = (uint8_t)i;
    assert_came_back(all, sizeof all);
    for (int i = 0; i < 256; i++) {
        const uint8_t around[] = { all[i], 'x', all[i], all[i] };
        assert_came_back(all + i, 1);
        assert_came_back(around, sizeof around);
    }
    assert_came_back(NULL, 0);
}

static void test_long_transfers(void)
{
    static uint8_t bytes[300000];
    static const size_t n[] = { 63, 64, 65, 4097, 300000 };
    for (int text = 0; text < 2; text++)
        for (size_t i = 0; i < sizeof n / sizeof *n; i++) {
            for (size_t k = 0; k < n[i]; k++)
                bytes[k] = (uint8_t)(text ? ' ' + k % 95 : k * 7);
            assert_came_back(bytes, n[i]);
        }
}

static void test_how_bytes_are_written(void)
{
    static uint8_t binary[65];
    struct capture *capture = create();
    capture_bytes(capture, '>', 0, "MES,1\r\n", 7);
    capture_bytes(capture, '<', 0x81, "\\ \x80", 3);
    capture_bytes(capture, '<', 0x81, ":1 ", 3);
    capture_bytes(capture, '<', 0x82, binary, sizeof binary);
    capture_bytes(capture, '<', 0x82, NULL, 0);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, capture_close(capture));
    char *text = text_of_file();
    TEST_ASSERT_NOT_NULL(strstr(text, " > 00 MES,1\\r\\n\n"));
    TEST_ASSERT_NOT_NULL(strstr(text, " < 81 \\\\ \\x80\n"));
    TEST_ASSERT_NOT_NULL(strstr(text, " < 81 \\x3a1\\x20\n"));
    TEST_ASSERT_NOT_NULL(strstr(text, " < 82 :000000"));
    TEST_ASSERT_NOT_NULL(strstr(text, " < 82\n"));
    free(text);
}

/* The page of capture.h itself. */
static void test_example_of_the_header(void)
{
    static const char example[] = "# skinspec capture 1\n"
                                  "# model: Konica Minolta CM-700d      firmware: 1.04\n"
                                  "# date: 2026-11-22T09:30:00Z         by: a wire simulator\n"
                                  "0.000000 driver km_ascii\n"
                                  "0.000100 = measure\n"
                                  "\n"
                                  "0.000200 > 00 MES,1\\r\\n\n"
                                  "0.004300 < 00 OK00\\r\\n\n"
                                  "0.504400 ~ 00\n"
                                  "0.504500 ! gone\n";
    TEST_ASSERT_TRUE(file_write(path, example, strlen(example)));
    struct capture_file file = reread();
    TEST_ASSERT_EQUAL_UINT(6, file.n);
    TEST_ASSERT_EQUAL_INT64(1795339800, file.realtime_s); /* date -d 2026-11-22T09:30Z +%s */
    TEST_ASSERT_EQUAL_UINT(7, file.lines[2].line);
    TEST_ASSERT_EQUAL_DOUBLE(0.0002, file.lines[2].at_s);
    TEST_ASSERT_EQUAL_UINT(7, file.lines[2].n);
    TEST_ASSERT_EQUAL_MEMORY("MES,1\r\n", file.lines[2].bytes, 7);
    capture_free(&file);
}

/* ---- what is no capture ------------------------------------------------------------- */

#define HEAD "# skinspec capture 1\n"

static void test_bad_files(void)
{
    static const struct {
        const char *text;
        enum status s;
        unsigned line;
        const char *why;
    } cases[] = {
        { "", STATUS_FORMAT, 1, "empty" },
        { "id,400,410\n", STATUS_FORMAT, 1, "no capture" },
        { "# skinspec capture 2\n", STATUS_VERSION, 1, "another version" },
        { HEAD "what\n", STATUS_FORMAT, 2, "neither" },
        { HEAD "x = measure\n", STATUS_FORMAT, 2, "time in seconds" },
        { HEAD "-1.0 = measure\n", STATUS_FORMAT, 2, "time in seconds" },
        { HEAD "nan = measure\n", STATUS_FORMAT, 2, "time in seconds" },
        { HEAD "1e300 = measure\n", STATUS_FORMAT, 2, "time in seconds" },
        { HEAD "0.1 ? measure\n", STATUS_FORMAT, 2, "one of driver" },
        { HEAD "0.1 = \n", STATUS_FORMAT, 2, "name is missing" },
        { HEAD "0.1 =\n", STATUS_FORMAT, 2, "one of driver" },
        { HEAD "# a note\n0.1 = m\n0.2 > 0 A\n", STATUS_FORMAT, 4, "two hex digits" },
        { HEAD "0.2 > g0 A\n", STATUS_FORMAT, 2, "two hex digits" },
        { HEAD "0.2 > 001 A\n", STATUS_FORMAT, 2, "two hex digits" },
        { HEAD "0.2 > 00 A\\q\n", STATUS_FORMAT, 2, "printable ASCII" },
        { HEAD "0.2 > 00 A\\x4\n", STATUS_FORMAT, 2, "printable ASCII" },
        { HEAD "0.2 > 00 A\\\n", STATUS_FORMAT, 2, "printable ASCII" },
        { HEAD "0.2 > 00 A\tB\n", STATUS_FORMAT, 2, "printable ASCII" },
        { HEAD "0.2 > 00 \xc3\xa4\n", STATUS_FORMAT, 2, "printable ASCII" },
        { HEAD "0.2 > 00 :\n", STATUS_FORMAT, 2, "no hex" },
        { HEAD "0.2 > 00 :012\n", STATUS_FORMAT, 2, "pairs" },
        { HEAD "0.2 > 00 :01 2\n", STATUS_FORMAT, 2, "pairs" },
        { HEAD "0.2 ~ 00 A\n", STATUS_FORMAT, 2, "no bytes" },
        { HEAD "0.2 ! exploded\n", STATUS_FORMAT, 2, "how the link failed" },
        { HEAD "0.2 ! ok\n", STATUS_FORMAT, 2, "how the link failed" },
        { HEAD "0.2 clock noon\n", STATUS_FORMAT, 2, "seconds since 1970" },
        { HEAD "# date: 22.11.2026\n", STATUS_FORMAT, 2, "date" },
        { HEAD "# date: 2026-11-22T09:30\n", STATUS_FORMAT, 2, "date" },
        { HEAD "# date: 2026-11-22T24:30:00Z\n", STATUS_FORMAT, 2, "date" },
        { HEAD "# date: 2026-13-22T09:30:00Z\n", STATUS_FORMAT, 2, "date" },
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct capture_file file = { 7, NULL, 7 };
        char place[FOLDER_PATH_SIZE + 16];
        TEST_ASSERT_TRUE(file_write(path, cases[i].text, strlen(cases[i].text)));
        heard_start();
        TEST_ASSERT_EQUAL_INT_MESSAGE(cases[i].s, capture_read(path, &file), cases[i].text);
        snprintf(place, sizeof place, "%s:%u: ", path, cases[i].line);
        TEST_ASSERT_EQUAL_INT_MESSAGE(1, heard_count(), cases[i].text);
        TEST_ASSERT_TRUE_MESSAGE(heard_contains(place), heard_last());
        TEST_ASSERT_TRUE_MESSAGE(heard_contains(cases[i].why), heard_last());
        TEST_ASSERT_EQUAL_UINT(7, file.n); /* untouched */
    }
}

static void test_a_nul_and_no_file(void)
{
    struct capture_file file;
    TEST_ASSERT_TRUE(file_write(path, HEAD "0.1 = a\0b\n", strlen(HEAD) + 10));
    TEST_ASSERT_EQUAL_INT(STATUS_FORMAT, capture_read(path, &file));
    unlink(path);
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, capture_read(path, &file));
    TEST_ASSERT_EQUAL_INT(STATUS_IO, capture_read(folder, &file));
}

static void test_what_a_crash_left(void)
{
    static const char torn[] = HEAD "0.1 = measure\n0.2 > 00 ME";
    TEST_ASSERT_TRUE(file_write(path, torn, strlen(torn)));
    struct capture_file file = reread();
    TEST_ASSERT_EQUAL_UINT(1, file.n);
    TEST_ASSERT_TRUE(heard_contains(":3: "));
    capture_free(&file);
}

/* ---- writing that fails ------------------------------------------------------------- */

static void test_never_over_a_file(void)
{
    struct capture *capture = NULL;
    TEST_ASSERT_TRUE(file_write(path, "mine", 4));
    TEST_ASSERT_EQUAL_INT(STATUS_EXISTS, capture_create(path, "d", &capture));
    TEST_ASSERT_NULL(capture);
    TEST_ASSERT_EQUAL_INT(STATUS_IO, capture_create("/nonexistent/a", "d", &capture));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, capture_close(NULL));
}

enum { PATIENCE_MS = 20000 };

/* A limit on the size of files stands for a full disk. */
static void test_full_disk_leaves_whole_lines(void)
{
    struct rlimit before, small = { 300, 300 };
    struct capture *capture = create();
    TEST_ASSERT_EQUAL_INT(0, getrlimit(RLIMIT_FSIZE, &before));
    small.rlim_max = before.rlim_max;
    TEST_ASSERT_EQUAL_INT(0, setrlimit(RLIMIT_FSIZE, &small));
    for (int i = 0; i < 20; i++)
        capture_call(capture, "a call of some length");
    TEST_ASSERT_FALSE(capture_flush(capture, PATIENCE_MS));
    TEST_ASSERT_EQUAL_INT(0, setrlimit(RLIMIT_FSIZE, &before));
    capture_call(capture, "there would be room for this");
    TEST_ASSERT_EQUAL_INT(STATUS_IO, capture_close(capture));
    TEST_ASSERT_EQUAL_INT(1, heard_count());
    TEST_ASSERT_TRUE(heard_contains("not whole"));
    char *text = text_of_file();
    TEST_ASSERT_EQUAL_CHAR('\n', text[strlen(text) - 1]);
    TEST_ASSERT_NULL(strstr(text, "room for this"));
    free(text);
    struct capture_file file = reread();
    TEST_ASSERT_TRUE(file.n > 2 && file.n < 20);
    capture_free(&file);
}

/* ---- a disk that takes its time ----------------------------------------------------- */

/* Stands before libc's: the file's writes, which alone hang, begin with a time. */
static atomic_bool hangs, hung;

ssize_t write(int fd, const void *bytes, size_t n)
{
    while (atomic_load(&hangs) && fd > STDERR_FILENO && n > 0) {
        atomic_store(&hung, true);
        nanosleep(&(struct timespec){ .tv_nsec = 1000000 }, NULL);
    }
    return syscall(SYS_write, fd, bytes, n);
}

static double now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec * 1e3 + (double)now.tv_nsec / 1e6;
}

/* A capture whose disk has just stopped taking anything. */
static struct capture *create_on_a_disk_that_hangs(void)
{
    struct capture *capture = create();
    atomic_store(&hung, false);
    atomic_store(&hangs, true);
    capture_call(capture, "before");
    while (!atomic_load(&hung))
        nanosleep(&(struct timespec){ .tv_nsec = 1000000 }, NULL);
    return capture;
}

enum { SAID = 2000 };

static void test_nobody_waits_for_the_disk(void)
{
    struct capture *capture = create_on_a_disk_that_hangs();
    double began_ms = now_ms();
    for (int i = 0; i < SAID / 2; i++) {
        char what[32];
        snprintf(what, sizeof what, "n {\"n\":%d}", i);
        capture_bytes(capture, '>', 0, what, strlen(what));
        capture_asked(capture, what);
    }
    double took_ms = now_ms() - began_ms;
    printf("a line: %.4f ms, while the disk hangs\n", took_ms / SAID);
    TEST_ASSERT_TRUE(took_ms < SAID); /* 1 ms each, of which a loaded machine needs a hundredth */
    TEST_ASSERT_FALSE(capture_flush(capture, 20));
    atomic_store(&hangs, false);
    TEST_ASSERT_TRUE(capture_flush(capture, PATIENCE_MS));
    struct capture_file file = reread(); /* before it is closed */
    TEST_ASSERT_EQUAL_UINT(2 + SAID, file.n);
    for (unsigned i = 0; i < SAID; i++) {
        char what[32];
        const struct capture_line *line = &file.lines[2 + i];
        snprintf(what, sizeof what, "n {\"n\":%u}", i / 2);
        TEST_ASSERT_EQUAL_INT(i % 2 == 0 ? CAPTURE_SENT : CAPTURE_ASKED, line->kind);
        TEST_ASSERT_EQUAL_MEMORY(what, i % 2 == 0 ? (char *)line->bytes : line->text, strlen(what));
        TEST_ASSERT_TRUE(line->at_s >= file.lines[1 + i].at_s);
    }
    capture_free(&file);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, capture_close(capture));
    TEST_ASSERT_EQUAL_INT(0, heard_count());
}

/* expect: capture.h, 16 MiB */
static void test_a_disk_that_does_not_come_back(void)
{
    enum { LONG = 1 << 20, FIT = 15, ALL = 20 };
    char *what = malloc(LONG + 1);
    TEST_ASSERT_NOT_NULL(what);
    memset(what, 'x', LONG);
    what[LONG] = '\0';
    struct capture *capture = create_on_a_disk_that_hangs();
    for (int i = 0; i < ALL; i++) {
        TEST_ASSERT_EQUAL_INT(i <= FIT ? 0 : 1, heard_count());
        capture_asked(capture, what);
    }
    TEST_ASSERT_TRUE(heard_contains("the disk takes too long"));
    capture_call(capture, "there would be room for this");
    atomic_store(&hangs, false);
    TEST_ASSERT_EQUAL_INT(STATUS_IO, capture_close(capture));
    TEST_ASSERT_EQUAL_INT(1, heard_count());
    struct capture_file file = reread(); /* what came before the hole, whole */
    TEST_ASSERT_EQUAL_UINT(2 + FIT, file.n);
    TEST_ASSERT_EQUAL_STRING(what, file.lines[1 + FIT].text);
    capture_free(&file);
    free(what);
}

/* ---- threads ------------------------------------------------------------------------ */

enum { THREADS = 4, LINES = 500 };

static void *write_many(void *of)
{
    for (int i = 0; i < LINES; i++)
        capture_bytes(of, '<', 0, "some bytes of a line\r\n", 22);
    return NULL;
}

static void test_lines_of_threads_are_whole(void)
{
    pthread_t threads[THREADS];
    struct capture *capture = create();
    for (int i = 0; i < THREADS; i++)
        TEST_ASSERT_EQUAL_INT(0, pthread_create(&threads[i], NULL, write_many, capture));
    for (int i = 0; i < THREADS; i++)
        pthread_join(threads[i], NULL);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, capture_close(capture));
    struct capture_file file = reread();
    TEST_ASSERT_EQUAL_UINT(1 + THREADS * LINES, file.n);
    for (size_t i = 1; i < file.n; i++) {
        TEST_ASSERT_EQUAL_UINT(22, file.lines[i].n);
        TEST_ASSERT_TRUE(file.lines[i].at_s >= file.lines[i - 1].at_s);
    }
    capture_free(&file);
}

int main(void)
{
    signal(SIGXFSZ, SIG_IGN);
    UNITY_BEGIN();
    RUN_TEST(test_every_kind_of_line);
    RUN_TEST(test_head_of_the_file);
    RUN_TEST(test_times_are_those_that_passed);
    RUN_TEST(test_every_byte);
    RUN_TEST(test_long_transfers);
    RUN_TEST(test_how_bytes_are_written);
    RUN_TEST(test_example_of_the_header);
    RUN_TEST(test_bad_files);
    RUN_TEST(test_a_nul_and_no_file);
    RUN_TEST(test_what_a_crash_left);
    RUN_TEST(test_never_over_a_file);
    RUN_TEST(test_full_disk_leaves_whole_lines);
    RUN_TEST(test_nobody_waits_for_the_disk);
    RUN_TEST(test_a_disk_that_does_not_come_back);
    RUN_TEST(test_lines_of_threads_are_whole);
    return UNITY_END();
}
