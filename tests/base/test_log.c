/* test_log.c - levels, the sink, and what standard error shows. */
#include "base/log.h"

#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>
#include <wchar.h>

#include "unity.h"

enum { HEARD_MAX = 8, TEXT_MAX = 2048 };

static struct heard {
    int n;
    enum log_level level[HEARD_MAX];
    char text[HEARD_MAX][TEXT_MAX];
} heard;

static void hear(enum log_level level, const char *text, void *context)
{
    struct heard *h = context;
    if (h->n == HEARD_MAX)
        return;
    h->level[h->n] = level;
    snprintf(h->text[h->n], TEXT_MAX, "%s", text);
    h->n++;
}

void setUp(void)
{
    heard = (struct heard){ .n = 0 };
    log_set_sink(hear, &heard);
    log_set_level(LOG_INFO);
    log_set_name("skinspec");
}

void tearDown(void)
{
    log_set_sink(NULL, NULL);
}

static void say_one_of_each(void)
{
    log_error("error %d", 1);
    log_warning("warning %d", 2);
    log_info("info %d", 3);
    log_debug("debug %d", 4);
}

/* expect: "messages above this level are dropped", log.h; levels in rising order. */
static const struct level_case {
    const char *what;
    enum log_level level;
    int heard;
} level_cases[] = {
    { "errors only", LOG_ERROR, 1 },
    { "warnings too", LOG_WARNING, 2 },
    { "as at the start", LOG_INFO, 3 },
    { "everything", LOG_DEBUG, 4 },
};

static void test_levels(void)
{
    static const char *const texts[] = { "error 1", "warning 2", "info 3", "debug 4" };
    static const enum log_level levels[] = { LOG_ERROR, LOG_WARNING, LOG_INFO, LOG_DEBUG };
    for (size_t i = 0; i < sizeof level_cases / sizeof *level_cases; i++) {
        const struct level_case *c = &level_cases[i];
        heard.n = 0;
        log_set_level(c->level);
        say_one_of_each();
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->heard, heard.n, c->what);
        for (int k = 0; k < heard.n; k++) {
            TEST_ASSERT_EQUAL_STRING_MESSAGE(texts[k], heard.text[k], c->what);
            TEST_ASSERT_EQUAL_INT_MESSAGE(levels[k], heard.level[k], c->what);
        }
    }
}

/* A message longer than the buffer arrives cut, and ended. */
static void test_long_message_is_cut(void)
{
    char text[TEXT_MAX];
    memset(text, 'x', sizeof text);
    text[sizeof text - 1] = '\0';
    log_error("%s", text);
    TEST_ASSERT_EQUAL_INT(1, heard.n);
    TEST_ASSERT_EQUAL_size_t(1023, strlen(heard.text[0]));
}

/* A wide character that the C locale cannot write makes printf fail: the message
 * is dropped, nothing else happens. */
static void test_message_that_cannot_be_formatted(void)
{
    log_error("%ls", L"\u2603");
    TEST_ASSERT_EQUAL_INT(0, heard.n);
}

/* What arrives at standard error while say() runs. */
static void capture(void (*say)(void), char *text, size_t size)
{
    FILE *f = tmpfile();
    TEST_ASSERT_NOT_NULL(f);
    fflush(stderr);
    int saved = dup(STDERR_FILENO);
    dup2(fileno(f), STDERR_FILENO);
    say();
    fflush(stderr);
    dup2(saved, STDERR_FILENO);
    close(saved);
    rewind(f);
    size_t n = fread(text, 1, size - 1, f);
    text[n] = '\0';
    fclose(f);
}

/* expect: name and text on a line; a warning says that it is one (log.h). */
static void test_standard_error(void)
{
    char text[256];
    log_set_sink(NULL, NULL);
    capture(say_one_of_each, text, sizeof text);
    TEST_ASSERT_EQUAL_STRING("skinspec: error 1\nskinspec: warning: warning 2\nskinspec: info 3\n",
                             text);
    log_set_name("station");
    log_set_level(LOG_ERROR);
    capture(say_one_of_each, text, sizeof text);
    TEST_ASSERT_EQUAL_STRING("station: error 1\n", text);
}

/* With a sink, standard error stays silent. */
static void test_sink_replaces_standard_error(void)
{
    char text[256];
    capture(say_one_of_each, text, sizeof text);
    TEST_ASSERT_EQUAL_STRING("", text);
    TEST_ASSERT_EQUAL_INT(3, heard.n);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_levels);
    RUN_TEST(test_long_message_is_cut);
    RUN_TEST(test_message_that_cannot_be_formatted);
    RUN_TEST(test_standard_error);
    RUN_TEST(test_sink_replaces_standard_error);
    return UNITY_END();
}
