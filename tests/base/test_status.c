/* test_status.c - every status has a name and a text of its own. */
#include "base/status.h"

#include <ctype.h>
#include <string.h>

#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

/* expect: the enum's identifiers in lower case, by the rule in status.h; the
 * numbers are part of the contract and never change. */
static const struct status_case {
    enum status status;
    int number;
    const char *name;
} status_cases[] = {
    { STATUS_OK, 0, "ok" },
    { STATUS_RANGE, -1, "range" },
    { STATUS_TIMEOUT, -2, "timeout" },
    { STATUS_DB, -3, "db" },
    { STATUS_NO_MEMORY, -4, "no_memory" },
    { STATUS_IO, -5, "io" },
    { STATUS_FORMAT, -6, "format" },
    { STATUS_VERSION, -7, "version" },
    { STATUS_DAMAGED, -8, "damaged" },
    { STATUS_EXISTS, -9, "exists" },
    { STATUS_NOT_FOUND, -10, "not_found" },
    { STATUS_CANCELLED, -11, "cancelled" },
    { STATUS_UNSUPPORTED, -12, "unsupported" },
    { STATUS_FULL, -13, "full" },
    { STATUS_READ_ONLY, -14, "read_only" },
};
enum { STATUS_CASES = sizeof status_cases / sizeof *status_cases };

static void test_names_and_numbers(void)
{
    for (size_t i = 0; i < STATUS_CASES; i++) {
        const struct status_case *c = &status_cases[i];
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->number, (int)c->status, c->name);
        TEST_ASSERT_EQUAL_STRING(c->name, status_name(c->status));
    }
}

/* Property: whoever reads a name or a text can tell which status it was. */
static void test_names_and_texts_are_unique(void)
{
    for (size_t i = 0; i < STATUS_CASES; i++) {
        for (size_t k = 0; k < i; k++) {
            enum status a = status_cases[i].status, b = status_cases[k].status;
            TEST_ASSERT_MESSAGE(strcmp(status_name(a), status_name(b)) != 0, status_name(a));
            TEST_ASSERT_MESSAGE(strcmp(status_text(a), status_text(b)) != 0, status_name(a));
        }
    }
}

/* Names go over the wire as one token; texts are fragments of a sentence. */
static void test_names_are_tokens_and_texts_fragments(void)
{
    for (size_t i = 0; i < STATUS_CASES; i++) {
        const char *name = status_name(status_cases[i].status);
        const char *text = status_text(status_cases[i].status);
        for (const char *c = name; *c != '\0'; c++)
            TEST_ASSERT_MESSAGE(islower((unsigned char)*c) || *c == '_', name);
        TEST_ASSERT_MESSAGE(strlen(text) > 0, name);
        TEST_ASSERT_MESSAGE(text[strlen(text) - 1] != '.', name);
        TEST_ASSERT_MESSAGE(strcmp(text, "unknown status") != 0, name);
    }
}

/* Values that are none of the enum's, as a newer peer may send them.  A status
 * appended after STATUS_READ_ONLY makes this fail: give it a row above. */
static void test_values_outside(void)
{
    static const int outside[] = { 1, STATUS_READ_ONLY - 1, -1000, 12345 };
    for (size_t i = 0; i < sizeof outside / sizeof *outside; i++) {
        TEST_ASSERT_EQUAL_STRING("unknown", status_name((enum status)outside[i]));
        TEST_ASSERT_EQUAL_STRING("unknown status", status_text((enum status)outside[i]));
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_names_and_numbers);
    RUN_TEST(test_names_and_texts_are_unique);
    RUN_TEST(test_names_are_tokens_and_texts_fragments);
    RUN_TEST(test_values_outside);
    return UNITY_END();
}
