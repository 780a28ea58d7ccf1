/* log.c - one line per message, to standard error or to a sink. */
#include "base/log.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

/* Set once by main() before threads start; only read after. */
static struct {
    const char *name;
    enum log_level level;
    log_sink *sink;
    void *context;
} log_state = { "skinspec", LOG_INFO, NULL, NULL };

void log_set_name(const char *name)
{
    log_state.name = name;
}

void log_set_level(enum log_level level)
{
    log_state.level = level;
}

void log_set_sink(log_sink *sink, void *context)
{
    log_state.sink = sink;
    log_state.context = context;
}

__attribute__((format(printf, 2, 0))) static void emit(enum log_level level, const char *format,
                                                       va_list args)
{
    char text[1024];
    if (level > log_state.level)
        return;
    if (vsnprintf(text, sizeof text, format, args) < 0)
        return;
    if (log_state.sink != NULL)
        log_state.sink(level, text, log_state.context);
    else
        fprintf(stderr, "%s: %s%s\n", log_state.name, level == LOG_WARNING ? "warning: " : "",
                text);
}

#define LOG_FUNCTION(verb, level) \
    void log_##verb(const char *format, ...) \
    { \
        va_list args; \
        va_start(args, format); \
        emit(level, format, args); \
        va_end(args); \
    }

LOG_FUNCTION(error, LOG_ERROR)
LOG_FUNCTION(warning, LOG_WARNING)
LOG_FUNCTION(info, LOG_INFO)
LOG_FUNCTION(debug, LOG_DEBUG)
