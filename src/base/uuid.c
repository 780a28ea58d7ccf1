/* uuid.c - see uuid.h; a version 7 id is one counter of 122 bits that jumps ahead
 * with the clock ([R9562] section 6.2, method 2: monotonic random). */
#include "base/uuid.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

#define MS_MAX ((UINT64_C(1) << 48) - 1)
#define HI_MAX ((UINT64_C(1) << 12) - 1)
#define LO_MAX ((UINT64_C(1) << 62) - 1)

bool uuid_is_text(const char *text)
{
    for (int i = 0; i < UUID_TEXT_SIZE - 1; i++) {
        bool dash = i == 8 || i == 13 || i == 18 || i == 23;
        if (dash ? text[i] != '-' : !isxdigit((unsigned char)text[i]))
            return false; /* the closing 0 is neither */
    }
    return text[UUID_TEXT_SIZE - 1] == '\0';
}

/* Up to 256 bytes come whole or not at all. */
static enum status draw(uint64_t *word, size_t words)
{
    ssize_t n = getrandom(word, words * sizeof *word, 0);
    return n == (ssize_t)(words * sizeof *word) ? STATUS_OK : STATUS_IO;
}

static enum status draw_two(struct uuid7 *u, uint64_t ret[2])
{
    enum status s = u->words >= 2 ? STATUS_OK : draw(u->word, UUID7_WORDS);
    if (s != STATUS_OK)
        return s;
    u->words = u->words >= 2 ? u->words - 2 : UUID7_WORDS - 2;
    for (size_t i = 0; i < 2; i++) {
        ret[i] = u->word[u->words + i];
        u->word[u->words + i] = 0; /* no id tells of those before it, nor of those to come */
    }
    return STATUS_OK;
}

/* 48 bits, version and 12 bits, variant and 62 bits. */
static void format(unsigned version, const struct uuid7 *u, char text[UUID_TEXT_SIZE])
{
    uint64_t last = UINT64_C(2) << 62 | u->lo;
    snprintf(text, UUID_TEXT_SIZE, "%08lx-%04lx-%01x%03lx-%04lx-%012lx",
             (unsigned long)(u->ms >> 16 & UINT32_MAX), (unsigned long)(u->ms & 0xffff),
             version & 0xfu, (unsigned long)(u->hi & HI_MAX), (unsigned long)(last >> 48),
             (unsigned long)(last & MS_MAX));
}

enum status uuid4_make(char text[UUID_TEXT_SIZE])
{
    uint64_t word[2];
    enum status s = draw(word, 2);
    if (s != STATUS_OK)
        return s;
    struct uuid7 u = { .ms = word[0] & MS_MAX, .hi = word[0] >> 52, .lo = word[1] & LO_MAX };
    format(4, &u, text);
    return STATUS_OK;
}

static void set(struct uuid7 *u, uint64_t ms, uint64_t hi, uint64_t lo)
{
    u->ms = ms;
    u->hi = hi;
    u->lo = lo;
}

/* Carry over what the step did not leave room for. */
static void advance(struct uuid7 *u, uint64_t step)
{
    u->lo += step;
    if (u->lo <= LO_MAX)
        return;
    u->lo &= LO_MAX;
    if (++u->hi <= HI_MAX)
        return;
    u->hi = 0;
    u->ms++;
}

enum status uuid7_make(struct uuid7 *last, int64_t realtime_ms, char text[UUID_TEXT_SIZE])
{
    uint64_t word[2], now = realtime_ms > 0 ? (uint64_t)realtime_ms : 0;
    enum status s = draw_two(last, word);
    if (s != STATUS_OK)
        return s;
    if (now > last->ms && now <= MS_MAX)
        set(last, now, word[0] & HI_MAX, word[1] & LO_MAX);
    else
        advance(last, 1 + (word[0] & UINT32_MAX)); /* not to be guessed from the one before */
    format(7, last, text);
    return STATUS_OK;
}

static bool is_after(const struct uuid7 *a, const struct uuid7 *b)
{
    if (a->ms != b->ms)
        return a->ms > b->ms;
    return a->hi != b->hi ? a->hi > b->hi : a->lo > b->lo;
}

enum status uuid7_continue(struct uuid7 *last, const char *text)
{
    char digits[33];
    int n = 0;
    if (!uuid_is_text(text))
        return STATUS_FORMAT;
    for (const char *p = text; *p != '\0'; p++)
        if (*p != '-')
            digits[n++] = *p;
    digits[n] = '\0';
    uint64_t low = strtoull(digits + 16, NULL, 16);
    digits[16] = '\0';
    uint64_t high = strtoull(digits, NULL, 16);
    struct uuid7 u = { .ms = high >> 16, .hi = high & HI_MAX, .lo = low & LO_MAX };
    if (is_after(&u, last))
        set(last, u.ms, u.hi, u.lo);
    return STATUS_OK;
}
