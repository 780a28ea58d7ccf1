/* log.h - messages for the person or the journal that runs the program.
 *
 * optics, colour and match never log: they return a status.  Whoever knows the
 * cause logs it, once.  Safe from several threads: one message is one write. */
#ifndef SKINSPEC_BASE_LOG_H
#define SKINSPEC_BASE_LOG_H

enum log_level { LOG_ERROR, LOG_WARNING, LOG_INFO, LOG_DEBUG };

/* Name before every message ("skinspec: ..."); the string must outlive its use. */
void log_set_name(const char *name);

/* Messages above this level are dropped; LOG_INFO at the start. */
void log_set_level(enum log_level level);

/* Where messages go instead of standard error; NULL restores that.  The sink
 * gets the text without name and newline. */
typedef void log_sink(enum log_level level, const char *text, void *context);
void log_set_sink(log_sink *sink, void *context);

void log_error(const char *format, ...) __attribute__((format(printf, 1, 2)));
void log_warning(const char *format, ...) __attribute__((format(printf, 1, 2)));
void log_info(const char *format, ...) __attribute__((format(printf, 1, 2)));
void log_debug(const char *format, ...) __attribute__((format(printf, 1, 2)));

#endif
