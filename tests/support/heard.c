/* heard.c - a log sink with a memory of one message. */
#include "tests/support/heard.h"

#include <stdio.h>
#include <string.h>

#include "base/log.h"

static struct {
    int count;
    char last[1024];
} heard;

static void hear(enum log_level level, const char *text, void *context)
{
    (void)level;
    (void)context;
    heard.count++;
    snprintf(heard.last, sizeof heard.last, "%s", text);
}

void heard_start(void)
{
    heard.count = 0;
    heard.last[0] = '\0';
    log_set_sink(hear, NULL);
}

void heard_stop(void)
{
    log_set_sink(NULL, NULL);
}

int heard_count(void)
{
    return heard.count;
}

const char *heard_last(void)
{
    return heard.last;
}

bool heard_contains(const char *part)
{
    return strstr(heard.last, part) != NULL;
}
