/* cmd_export.c - records as a file, page after page. */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "cli/command.h"
#include "cli/member.h"
#include "cli/new_file.h"
#include "cli/options.h"
#include "cli/progress_bar.h"
#include "cli/remote.h"

enum { OPTION_FORMAT = OPTION_OWN, OPTION_OUT };

static const struct argp_option options[] = {
    { "format", OPTION_FORMAT, "csv|json|cgats", 0, "What to write (csv)", 0 },
    { "json", OPTION_JSON, NULL, 0, "The same as --format json", 0 },
    { "out", OPTION_OUT, "FILE", 0, "Where to (standard output)", 0 },
    { "force", OPTION_FORCE, NULL, 0, "Replace an existing FILE", 0 },
    { "since", OPTION_SINCE, "SEQ", 0, "Only records after this one", 0 },
    { "limit", OPTION_LIMIT, "N", 0, "The first N of them", 0 },
    OPTION_ROW_SOCKET,
    { 0 },
};

struct arguments {
    struct option_station station;
    const char *format, *out;
    bool force;
    int64_t since_seq; /* -1: not given */
    int64_t limit;     /* 0: all */
};

static const char *format_of(struct argp_state *state, const char *text)
{
    if (strcmp(text, "csv") != 0 && strcmp(text, "json") != 0 && strcmp(text, "cgats") != 0)
        argp_error(state, "--format: '%s' is none of csv, json, cgats", text);
    return text;
}

static error_t parse(int key, char *text, struct argp_state *state)
{
    struct arguments *a = state->input;
    switch (key) {
    case OPTION_FORMAT:
        a->format = format_of(state, text);
        break;
    case OPTION_JSON:
        a->format = "json";
        break;
    case OPTION_OUT:
        a->out = text;
        break;
    case OPTION_FORCE:
        a->force = true;
        break;
    case OPTION_SINCE:
        a->since_seq = option_seq(state, "since", text);
        break;
    case OPTION_LIMIT:
        a->limit = (int64_t)option_count(state, "limit", text, 1, INT32_MAX);
        break;
    case ARGP_KEY_END:
        if (a->force && a->out == NULL)
            argp_error(state, "--force goes with --out FILE");
        break;
    default:
        return option_station(key, text, state, &a->station);
    }
    return 0;
}

/* ---- pages -------------------------------------------------------------------------- */

struct page {
    int64_t since_seq; /* -1: from the first */
    int64_t until_seq; /* 0: to the newest */
    bool more;
};

/* The end of the first N: seq has no gaps, but need not begin with 1.  False: logged. */
static bool find_limit(struct remote *remote, const struct arguments *a, struct page *page)
{
    if (a->limit == 0)
        return true;
    cJSON *params = cJSON_CreateObject();
    cJSON_AddNumberToObject(params, "limit", 1);
    cJSON_AddNumberToObject(params, "since_seq", a->since_seq > 0 ? (double)a->since_seq : 0.0);
    cJSON *list = remote_ask(remote, METHOD_RECORD_LIST, params);
    const cJSON *first = cJSON_GetArrayItem(member(list, "records"), 0);
    if (first != NULL)
        page->until_seq = member_integer(first, "seq") + a->limit - 1;
    cJSON_Delete(list);
    return list != NULL;
}

static cJSON *page_params(const struct arguments *a, const struct page *page, bool first)
{
    cJSON *params = cJSON_CreateObject();
    cJSON_AddStringToObject(params, "format", a->format);
    if (page->since_seq >= 0)
        cJSON_AddNumberToObject(params, "since_seq", (double)page->since_seq);
    if (page->since_seq >= 0 && first)
        cJSON_AddBoolToObject(params, "head", true);
    if (page->until_seq > 0)
        cJSON_AddNumberToObject(params, "until_seq", (double)page->until_seq);
    return params;
}

/* At once, as long as the cause is known. */
static bool is_written(const struct arguments *a, FILE *to)
{
    if (fflush(to) == 0 && !ferror(to))
        return true;
    if (a->out != NULL)
        log_error("cannot write %s: %s", a->out, strerror(errno));
    else
        out_exit(false); /* says so */
    return false;
}

static bool write_page(struct remote *remote, const struct arguments *a, struct page *page,
                       bool first, FILE *to)
{
    cJSON *result = remote_ask(remote, METHOD_RECORD_EXPORT, page_params(a, page, first));
    if (result == NULL)
        return false;
    fputs(member_text(result, "text"), to);
    page->since_seq = member_integer(result, "next_seq");
    page->until_seq = member_integer(result, "until_seq");
    page->more = member_true(result, "more");
    cJSON_Delete(result);
    return is_written(a, to);
}

/* Until the last, or Ctrl-C. */
static bool write_pages(struct remote *remote, const struct arguments *a,
                        const struct progress *progress, FILE *to)
{
    struct page page = { a->since_seq, 0, true };
    int64_t from = a->since_seq > 0 ? a->since_seq : 0;
    bool good = find_limit(remote, a, &page), first = true;
    while (good && page.more) {
        good = write_page(remote, a, &page, first, to) &&
               progress_go_on(progress, (size_t)(page.since_seq - from),
                              (size_t)(page.until_seq - from));
        first = false;
    }
    return good;
}

static bool export(struct remote *remote, const struct arguments *a)
{
    struct new_file file = { .stream = stdout };
    struct progress_bar bar;
    if (a->out != NULL && new_file_begin(a->out, a->force, &file) != STATUS_OK)
        return false;
    struct progress progress = progress_bar_begin(&bar, "export");
    bool whole = write_pages(remote, a, &progress, file.stream);
    if (a->out != NULL)
        whole = new_file_end(&file, whole) == STATUS_OK && whole;
    progress_bar_end(&bar); /* where it was stopped, the end of the program */
    return whole;
}

int cmd_export(int argc, char **argv)
{
    static const struct argp argp = {
        options,
        parse,
        "",
        "Records of the station as a file: CSV that 'skinspec match' and spreadsheets read, JSON "
        "(the protocol's record objects), or CGATS.17 as ArgyllCMS reads it.\v"
        "A FILE appears when it is complete; nothing is left behind by Ctrl-C or an error.  "
        "Records that are stored meanwhile are not in it: --since with the last seq of one file "
        "begins the next.  Needs the right 'clinic'; docs/data.md has the columns.\n\n"
        "Examples:\n"
        "  skinspec export --out records.csv\n"
        "  skinspec export --format cgats --since 120 > new.ti3\n",
        NULL,
        NULL,
        NULL
    };
    struct arguments a = { .station = { NULL, OUT_PLAIN }, .format = "csv", .since_seq = -1 };
    struct remote *remote;
    option_parse(&argp, "export", argc, argv, &a);
    if (remote_open(a.station.socket, NULL, &remote) != STATUS_OK)
        return EXIT_FAILURE;
    bool good = export(remote, &a);
    remote_close(remote);
    return out_exit(good);
}
