/* conversation.c - ask, let time pass, hear. */
#include "tests/support/conversation.h"

#include <stdlib.h>
#include <string.h>

#include "unity.h"

void conversation_begin(struct conversation *c, const struct sim_kind *kind, const char *options)
{
    c->kind = kind;
    c->sim = kind->make(options);
    c->now_us = 1000000;
    c->n = 0;
    TEST_ASSERT_NOT_NULL_MESSAGE(c->sim, options);
}

void conversation_end(struct conversation *c)
{
    c->kind->free(c->sim);
    c->sim = NULL;
}

const char *conversation_hear(struct conversation *c, double seconds)
{
    int64_t until_us = c->now_us + (int64_t)(seconds * 1e6);
    for (c->n = 0;;) {
        int64_t due_us;
        ssize_t n = c->kind->give(c->sim, 0, (uint8_t *)c->text + c->n, sizeof c->text - 1 - c->n,
                                  c->now_us, &due_us);
        TEST_ASSERT_TRUE(n >= 0);
        c->n += (size_t)n;
        if (n > 0)
            continue;
        if (due_us > until_us)
            break;
        TEST_ASSERT_TRUE_MESSAGE(due_us > c->now_us, "due by now, and yet nothing came");
        c->now_us = due_us;
    }
    c->now_us = until_us;
    for (size_t i = 0; i < c->n; i++)
        c->text[i] = c->text[i] == '\0' ? ' ' : c->text[i];
    c->text[c->n] = '\0';
    return c->text;
}

const char *conversation_ask(struct conversation *c, const char *bytes, double seconds)
{
    TEST_ASSERT_EQUAL_INT(
        0, c->kind->take(c->sim, 0, (const uint8_t *)bytes, strlen(bytes), c->now_us));
    return conversation_hear(c, seconds);
}

void conversation_act(struct conversation *c, const char *action)
{
    TEST_ASSERT_TRUE_MESSAGE(c->kind->act(c->sim, action, c->now_us), action);
}

static const char *field_at(const struct conversation *c, size_t i, const char *between)
{
    const char *at = c->text;
    for (; i > 0 && *at != '\0'; i--) {
        at += strcspn(at, between);
        at += *at != '\0';
    }
    return at;
}

double conversation_number(const struct conversation *c, size_t i, const char *between)
{
    char *end;
    const char *at = field_at(c, i, between);
    double x = strtod(at, &end);
    TEST_ASSERT_TRUE_MESSAGE(end != at, c->text);
    return x;
}

size_t conversation_fields(const struct conversation *c, const char *between)
{
    size_t n = 1;
    for (const char *at = c->text + strcspn(c->text, between); *at != '\0';
         at += strcspn(at, between)) {
        at++;
        n++;
    }
    return n;
}
