/* export.h - records as the text of a file, a page at a time; the pages joined are one file.
 *
 *   csv     one row a record: what identifies it, colour, match, then the spectrum by
 *           wavelength (360..740 nm by 10), empty where not measured.  RFC 4180.
 *           `skinspec match` reads it: it wants 400..700 nm without a gap, so only these
 *           columns are named by the wavelength alone, the others nm360, nm710.  Text that a
 *           spreadsheet would run as a formula begins with an apostrophe
 *   json    an array of the protocol's record objects
 *   cgats   CGATS.17 in the SPECT form of ArgyllCMS: SPEC_400 .. SPEC_700 by 10 in percent,
 *           XYZ, LAB; records that lack one of those bands or a colour are left out, and the
 *           head says how many
 *
 * docs/data.md has the columns. */
#ifndef SKINSPEC_STATION_EXPORT_H
#define SKINSPEC_STATION_EXPORT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/status.h"
#include "db/store.h"

enum export_format { EXPORT_CSV, EXPORT_JSON, EXPORT_CGATS };
/* "csv", "json", "cgats"; else STATUS_NOT_FOUND. */
enum status export_format_parse(const char *text, enum export_format *ret);

enum { EXPORT_PAGE_BYTES = 512 * 1024 };

struct export_request {
    enum export_format format;
    bool first;        /* with the head of the file */
    int64_t since_seq; /* only records above */
    int64_t until_seq; /* and up to this; 0: up to the newest now */
    size_t limit;      /* records at most in this page, those left out included; 1 or more */
    size_t bytes;      /* of text at most; 0: EXPORT_PAGE_BYTES */
};

struct export_page {
    char *text; /* UTF-8, a NUL follows; free() */
    size_t n;
    int64_t next_seq;  /* since_seq of the next page */
    int64_t until_seq; /* as asked, or the newest at the call: the next pages need the same,
                          so that the count in the head of a CGATS file holds */
    bool more;         /* else the tail of the file is in this page */
};

/* A page is longer than asked only where it holds a single record or none.  Cells of a match
 * that cannot be read stay empty.  Statuses of the store and of wire_record();
 * STATUS_NO_MEMORY; *ret untouched then. */
enum status export_page(struct store_reader *reader, const struct export_request *request,
                        struct export_page *ret);

#endif
