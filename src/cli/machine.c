/* machine.c - processor, cores, vectors, compiler, load, day. */
#define _DEFAULT_SOURCE /* getloadavg() */
#include "cli/machine.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/parallel.h"
#include "optics/quick.h"

enum { LINE_SIZE = 4096, NAME_SIZE = 48 };

#ifdef __clang__
#define COMPILER "clang " __clang_version__
#else
#define COMPILER "gcc " __VERSION__
#endif

/* The value of a line "key : value" of the processor that the first such line tells of. */
static void take(const char *line, const char *key, char *ret, size_t size)
{
    size_t n = strlen(key);
    if (ret[0] != '\0' || strncmp(line, key, n) != 0 || (line[n] != '\t' && line[n] != ' '))
        return;
    const char *value = strchr(line, ':');
    if (value == NULL)
        return;
    value += strspn(value, ": \t");
    snprintf(ret, size, "%.*s", (int)strcspn(value, "@\n"), value);
}

/* "Intel(R) Xeon(R) Processor" becomes "Intel Xeon Processor"; what means something in XML or
 * Markdown goes too. */
static void without_marks(char *name)
{
    static const char *const marks[] = { "(R)", "(TM)", "(r)", "(tm)" };
    for (size_t i = 0; i < sizeof marks / sizeof *marks; i++)
        for (char *at = strstr(name, marks[i]); at != NULL; at = strstr(name, marks[i]))
            memmove(at, at + strlen(marks[i]), strlen(at + strlen(marks[i])) + 1);
    for (char *at = strpbrk(name, "<>&|*_`\""); at != NULL; at = strpbrk(at, "<>&|*_`\""))
        *at = ' ';
    for (size_t n = strlen(name); n > 0 && name[n - 1] == ' '; n--)
        name[n - 1] = '\0';
}

static const char *vectors(void)
{
    return quick_has(QUICK_AVX512) ? "AVX-512" : quick_has(QUICK_AVX2) ? "AVX2" : "no AVX2";
}

const char *machine_text(char text[MACHINE_TEXT_SIZE])
{
    char line[LINE_SIZE], name[NAME_SIZE] = "", family[16] = "", model[16] = "";
    char day[CLOCK_TEXT_SIZE];
    double load = 0.0;
    unsigned cores = parallel_cores();
    FILE *f = fopen("/proc/cpuinfo", "r");
    while (f != NULL && fgets(line, sizeof line, f) != NULL) {
        take(line, "model name", name, sizeof name);
        take(line, "cpu family", family, sizeof family);
        take(line, "model", model, sizeof model);
    }
    if (f != NULL)
        fclose(f);
    without_marks(name);
    (void)getloadavg(&load, 1);
    clock_text(clock_realtime_ms(), day);
    snprintf(text, MACHINE_TEXT_SIZE,
             "%s (family %s, model %s), %u core%s, %s; %s; load %.1f; %.10s",
             name[0] != '\0' ? name : "a processor that does not say its name",
             family[0] != '\0' ? family : "-", model[0] != '\0' ? model : "-", cores,
             cores == 1 ? "" : "s", vectors(), COMPILER, load, day);
    return text;
}
