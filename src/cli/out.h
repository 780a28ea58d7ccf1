/* out.h - results on standard output, or in memory on their way there: JSON, one object a line, or
 * CSV.
 * Numbers do not depend on the locale; a failed write is noticed at the end. */
#ifndef SKINSPEC_CLI_OUT_H
#define SKINSPEC_CLI_OUT_H

#include <cjson/cJSON.h>
#include <stdbool.h>
#include <stddef.h>

#include "base/spectrum.h"
#include "base/status.h"
#include "cli/text.h"

enum out_format {
    OUT_PLAIN,  /* CSV, or what a person reads */
    OUT_JSON,   /* one array */
    OUT_NDJSON, /* one object a line */
};

struct out {
    enum out_format format;
    size_t objects;
    size_t fields;     /* in the CSV row begun */
    struct text *into; /* NULL: standard output */
};

void out_begin(struct out *out, enum out_format format);

/* The same into memory, to be continued there or elsewhere: after so many objects, and without what
 * opens the array. */
void out_begin_part(struct out *out, enum out_format format, size_t objects, struct text *into);

/* What is left to do where memory is wanting: say so and end the program. */
void out_of_memory(void) __attribute__((noreturn));

/* Print an object and delete it.  NULL (no memory for it) ends the program. */
void out_object(struct out *out, cJSON *object);

/* The same, but where the format is plain by print(). */
void out_item(struct out *out, cJSON *object, void (*print)(const cJSON *object));

/* One object on a line, or the objects of an array; deleted. */
void out_one(cJSON *object);
void out_all(enum out_format format, cJSON *array);

/* One CSV field; out_row() ends the row.  Numbers as the fewest digits that tell
 * `digits` significant ones; NAN as nothing. */
void out_text(struct out *out, const char *text);
void out_number(struct out *out, double x, int digits);
void out_row(struct out *out);

/* Close the array, flush, and say so where not all could be written: STATUS_IO. */
enum status out_end(struct out *out);

/* The exit status of a command that did what it should or not: flushes standard output,
 * which makes a failure of it, said once, where not all could be written. */
int out_exit(bool done);

/* Numbers as json/print.h prints them, exactly.  Where x is not finite an array
 * holds null and a member is left out. */
cJSON *out_numbers(const double *x, size_t n);
void out_member(cJSON *object, const char *name, double x);

#endif
