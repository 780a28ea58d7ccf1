/* faults.c - read faults, and count down to them. */
#include "tests/sim/faults.h"

#include <stdlib.h>
#include <string.h>

static const struct {
    const char *name;
    enum fault_kind kind;
    enum fault_place place;
    int least, most; /* arguments */
    long min, max;   /* of the first */
} kinds[] = {
    { "silence", FAULT_SILENCE, FAULT_AT_REPLY, 0, 0, 0, 0 },
    { "late", FAULT_LATE, FAULT_AT_REPLY, 0, 0, 0, 0 },
    { "delay", FAULT_DELAY, FAULT_AT_REPLY, 1, 1, 0, 1000000 },
    { "slow", FAULT_SLOW, FAULT_AT_REPLY, 1, 1, 0, 1000000 },
    { "truncated", FAULT_TRUNCATED, FAULT_AT_REPLY, 1, 1, -4000, 4000 },
    { "longer", FAULT_LONGER, FAULT_AT_REPLY, 1, 1, 0, 4000 },
    { "twice", FAULT_TWICE, FAULT_AT_REPLY, 0, 0, 0, 0 },
    { "garbage", FAULT_GARBAGE, FAULT_AT_REPLY, 1, 1, 0, 4000 },
    { "xor", FAULT_XOR, FAULT_AT_REPLY, 2, 2, -4000, 4000 },
    { "replace", FAULT_REPLACE, FAULT_AT_REPLY, 2, 2, -4000, 4000 },
    { "reply", FAULT_REPLY, FAULT_AT_REPLY, 1, 1, 0, 0 },
    { "prober", FAULT_PROBER, FAULT_AT_COMMAND, 0, 0, 0, 0 },
    { "bands", FAULT_BANDS, FAULT_AT_SPECTRUM, 1, 1, 0, 64 },
    { "zero", FAULT_ZERO, FAULT_AT_SPECTRUM, 0, 0, 0, 0 },
    { "over", FAULT_OVER, FAULT_AT_SPECTRUM, 0, 0, 0, 0 },
    { "negative", FAULT_NEGATIVE, FAULT_AT_SPECTRUM, 0, 0, 0, 0 },
    { "text", FAULT_TEXT, FAULT_AT_SPECTRUM, 0, 0, 0, 0 },
    { "swapped", FAULT_SWAPPED, FAULT_AT_SPECTRUM, 0, 0, 0, 0 },
    { "battery_dies", FAULT_BATTERY_DIES, FAULT_AT_SHOT, 0, 1, 0, 1000000 },
    { "calibration_lost", FAULT_CALIBRATION_LOST, FAULT_AT_SHOT, 0, 0, 0, 0 },
    { "lamp", FAULT_LAMP, FAULT_AT_SHOT, 0, 0, 0, 0 },
};

enum { WORDS = 5, TEXT_SIZE = 128 };

static int split(char *text, char *word[WORDS])
{
    int n = 0;
    for (char *rest, *w = strtok_r(text, " ", &rest); w != NULL; w = strtok_r(NULL, " ", &rest)) {
        if (n == WORDS)
            return -1;
        word[n++] = w;
    }
    return n;
}

static bool whole(const char *word, long *ret)
{
    char *end;
    *ret = strtol(word, &end, 0);
    return *word != '\0' && *end == '\0';
}

/* "on N" or "from N" at the end; takes the words away. */
static bool read_when(char **word, int *words, struct fault *f)
{
    f->on = 1;
    if (*words < 3)
        return true;
    f->stays = strcmp(word[*words - 2], "from") == 0;
    if (!f->stays && strcmp(word[*words - 2], "on") != 0)
        return true;
    *words -= 2;
    return whole(word[*words + 1], &f->on) && f->on >= 1;
}

static bool read_fault(char **word, int words, struct fault *f)
{
    if (words < 1 || !read_when(word, &words, f))
        return false;
    size_t k = 0;
    while (k < sizeof kinds / sizeof *kinds && strcmp(kinds[k].name, word[0]) != 0)
        k++;
    if (k == sizeof kinds / sizeof *kinds || words - 1 < kinds[k].least ||
        words - 1 > kinds[k].most)
        return false;
    f->kind = kinds[k].kind;
    f->place = kinds[k].place;
    f->a = f->kind == FAULT_BATTERY_DIES ? -1 : 0;
    if (f->kind == FAULT_REPLY) {
        size_t n = strlen(word[1]);
        if (n >= sizeof f->text)
            return false;
        memcpy(f->text, word[1], n + 1);
        return true;
    }
    if (words > 1 && (!whole(word[1], &f->a) || f->a < kinds[k].min || f->a > kinds[k].max))
        return false;
    return words < 3 || (whole(word[2], &f->b) && f->b >= 0 && f->b <= 255);
}

bool faults_add(struct faults *faults, const char *text)
{
    char copy[TEXT_SIZE], *word[WORDS];
    struct fault f = { .kind = FAULT_NONE };
    if (strcmp(text, "none") == 0) {
        faults->n = 0;
        return true;
    }
    if (strlen(text) >= sizeof copy || faults->n == FAULTS_MAX)
        return false;
    memcpy(copy, text, strlen(text) + 1);
    if (!read_fault(word, split(copy, word), &f))
        return false;
    faults->list[faults->n++] = f;
    return true;
}

static void forget(struct faults *faults, size_t i)
{
    faults->n--;
    for (; i < faults->n; i++)
        faults->list[i] = faults->list[i + 1];
}

struct fault faults_next(struct faults *faults, enum fault_place place)
{
    struct fault found = { .kind = FAULT_NONE };
    size_t i = 0;
    while (i < faults->n) {
        struct fault *f = &faults->list[i];
        bool here = f->place == place;
        if (here && f->on > 1) {
            f->on--;
        } else if (here && found.kind == FAULT_NONE) {
            found = *f;
            if (!f->stays) {
                forget(faults, i);
                continue;
            }
        }
        i++; /* of two at once the second comes with the next */
    }
    return found;
}
