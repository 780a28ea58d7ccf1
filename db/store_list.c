/* store_list.c - records, subjects and sites, one row at a time: nothing is held while a
 * callback runs. */
#include "db/store.h"

#include <stdlib.h>

#include "db/store_private.h"

/* The statement for what is asked, with all bound but since. */
static enum status prepare_query(struct store_reader *reader, const struct store_query *query,
                                 sqlite3_stmt **ret)
{
    static const enum reader_query which[2][2] = { { QUERY_NEXT, QUERY_NEXT_OF_OWNER },
                                                   { QUERY_NEXT_OF_SUBJECT, QUERY_NEXT_OF_BOTH } };
    int64_t until = query->until_seq;
    enum status s = until == 0 ? store_newest(reader, &until) : STATUS_OK;
    if (s != STATUS_OK)
        return s;
    sqlite3_stmt *select = reader->query[which[query->subject != NULL][query->owner_uid >= 0]];
    sqlite3_bind_int64(select, 2, until);
    if (query->subject != NULL)
        store_text_bind(select, 3, query->subject);
    if (query->owner_uid >= 0)
        sqlite3_bind_int64(select, 4, query->owner_uid);
    *ret = select;
    return STATUS_OK;
}

enum status store_list(struct store_reader *reader, const struct store_query *query,
                       store_visit *visit, void *context)
{
    sqlite3_stmt *select;
    struct store_record *record = malloc(sizeof *record);
    if (record == NULL)
        return STATUS_NO_MEMORY;
    enum status s = prepare_query(reader, query, &select);
    for (int64_t since = query->since_seq; s == STATUS_OK;) {
        sqlite3_bind_int64(select, 1, since);
        s = store_reader_record(reader, select, record);
        if (s != STATUS_OK || !visit(context, record))
            break;
        since = record->seq;
    }
    free(record);
    return s == STATUS_NOT_FOUND ? STATUS_OK : s;
}

static int64_t read_subject(sqlite3_stmt *query, struct store_subject *ret)
{
    store_text_read(query, 1, ret->id, sizeof ret->id);
    store_text_read(query, 2, ret->label, sizeof ret->label);
    store_text_read(query, 3, ret->name, sizeof ret->name);
    ret->birth_year = sqlite3_column_int(query, 4);
    store_text_read(query, 5, ret->notes, sizeof ret->notes);
    ret->forgotten = sqlite3_column_int(query, 6) != 0;
    return sqlite3_column_int64(query, 0);
}

/* Where a subject stands in the order; 0 for "". */
static enum status find_subject(struct store_reader *reader, const char *id, int64_t *ret)
{
    sqlite3_stmt *query = reader->query[QUERY_SUBJECT_ROW];
    *ret = 0;
    if (*id == '\0')
        return STATUS_OK;
    store_text_bind(query, 1, id);
    enum status s = store_reader_step(reader, query);
    if (s == STATUS_OK)
        *ret = sqlite3_column_int64(query, 0);
    sqlite3_reset(query);
    return s;
}

enum status store_list_subjects(struct store_reader *reader, const char *after_id,
                                store_visit_subject *visit, void *context)
{
    sqlite3_stmt *query = reader->query[QUERY_SUBJECT];
    struct store_subject subject = { .birth_year = 0 };
    int64_t since;
    enum status s = find_subject(reader, after_id, &since);
    if (s != STATUS_OK)
        return s;
    while (s == STATUS_OK) {
        sqlite3_bind_int64(query, 1, since);
        s = store_reader_step(reader, query);
        if (s == STATUS_OK)
            since = read_subject(query, &subject);
        sqlite3_reset(query);
        if (s == STATUS_OK && !visit(context, &subject))
            break;
    }
    return s == STATUS_NOT_FOUND ? STATUS_OK : s;
}

enum status store_list_sites(struct store_reader *reader, store_visit_text *visit, void *context)
{
    sqlite3_stmt *query = reader->query[QUERY_SITE];
    char name[STORE_TEXT_SIZE];
    enum status s = STATUS_OK;
    for (int64_t since = 0; s == STATUS_OK;) {
        sqlite3_bind_int64(query, 1, since);
        s = store_reader_step(reader, query);
        if (s == STATUS_OK) {
            since = sqlite3_column_int64(query, 0);
            store_text_read(query, 1, name, sizeof name);
        }
        sqlite3_reset(query);
        if (s == STATUS_OK && !visit(context, name))
            break;
    }
    return s == STATUS_NOT_FOUND ? STATUS_OK : s;
}
