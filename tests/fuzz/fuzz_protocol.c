/* fuzz_protocol.c - any bytes as a client's line, a result and a station's line: whatever
 * comes, what goes out is one valid line that says one of the known reasons. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "station/protocol.h"
#include "station/strict_json.h"
#include "station/wire.h"

static struct protocol *protocol;

static void must(bool condition, const char *what)
{
    if (condition)
        return;
    fprintf(stderr, "fuzz_protocol: %s\n", what);
    abort();
}

static bool is_reason(const char *name)
{
    for (int i = 0; name != NULL && i < REASONS; i++)
        if (strcmp(reason_name((enum reason)i), name) == 0)
            return true;
    return false;
}

/* One line, strict JSON in one line, and readable as a client reads it. */
static void check_line(const struct line *line, bool refused)
{
    struct answer answer;
    enum strict_json_fault fault = strict_json_check(line->text, line->n, NULL);
    must(line->n < PROTOCOL_MAX_LINE && strlen(line->text) == line->n, "length");
    must(strchr(line->text, '\n') == NULL, "one line");
    must(fault == STRICT_JSON_FINE, "not JSON");
    must(protocol_read_answer(line->text, line->n, &answer) == STATUS_OK, "no answer");
    if (refused) {
        const cJSON *data = strict_json_member(answer.error, "data");
        must(is_reason(cJSON_GetStringValue(strict_json_member(data, "reason"))), "reason");
    }
    cJSON_Delete(answer.tree);
}

/* What was accepted goes back as a result: it must be the same JSON. */
static void send_back(struct request *request)
{
    struct line line;
    cJSON *copy = cJSON_Duplicate(request->params, true);
    must(protocol_reply(protocol, &request->id, copy, &line) == STATUS_OK, "memory");
    check_line(&line, false);
    struct answer answer;
    must(protocol_read_answer(line.text, line.n, &answer) == STATUS_OK, "answer");
    must(answer.result != NULL && cJSON_Compare(answer.result, request->params, true), "changed");
    cJSON_Delete(answer.tree);
    free(line.text);
}

/* The tree is the one that cJSON's own parser makes. */
static void check_tree(const cJSON *value, const char *text, size_t size)
{
    cJSON *expect = cJSON_ParseWithLength(text, size);
    must(expect != NULL && cJSON_Compare(expect, value, true), "another tree");
    cJSON_Delete(expect);
}

static void read_wire(const cJSON *value)
{
    static struct store_record record;
    struct spectrum spectrum;
    struct wire_match match;
    cJSON *again;
    if (wire_read_spectrum(value, &spectrum) == STATUS_OK &&
        wire_spectrum(&spectrum, &again) == STATUS_OK)
        cJSON_Delete(again);
    wire_read_match(value, &match);
    if (wire_read_record(value, &record) == STATUS_OK && wire_record(&record, &again) == STATUS_OK)
        cJSON_Delete(again);
}

int LLVMFuzzerTestOneInput(const unsigned char *data, size_t size);

int LLVMFuzzerTestOneInput(const unsigned char *data, size_t size)
{
    const char *text = (const char *)data;
    struct request request;
    struct refusal refusal;
    if (protocol == NULL)
        must(protocol_open(&protocol) == STATUS_OK, "description");
    if (protocol_read(protocol, text, size, &request, &refusal)) {
        send_back(&request);
        request_done(&request);
    } else {
        struct line line;
        must(protocol_refuse(protocol, &request.id, &refusal, &line) == STATUS_OK, "memory");
        check_line(&line, true);
        free(line.text);
    }
    cJSON *value;
    enum strict_json_fault fault;
    if (strict_json_parse(text, size, &value, &fault, NULL) == STATUS_OK) {
        check_tree(value, text, size);
        struct schema_error error;
        for (int i = 0; i < METHODS; i++)
            protocol_check_result(protocol, (enum method)i, value, &error);
        read_wire(value);
        cJSON_Delete(value);
    }
    struct answer answer;
    if (protocol_read_answer(text, size, &answer) == STATUS_OK)
        cJSON_Delete(answer.tree);
    return 0;
}
