/* strict_json.c - a reader by recursive descent; on request it makes the tree as it goes. */
#include "station/strict_json.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "base/number.h"
#include "base/utf8.h"

struct reader {
    const char *begin, *at, *end;
    int depth;
    enum strict_json_fault fault;
    bool builds;    /* a tree of what is read */
    bool no_memory; /* for more of it: the text is read on, as a fault comes first */
};

static bool fail(struct reader *r, enum strict_json_fault fault)
{
    r->fault = fault;
    return false;
}

/* The next byte; 0 at the end, where no NUL can be (checked before). */
static char peek(const struct reader *r)
{
    return r->at < r->end ? *r->at : '\0';
}

static bool take(struct reader *r, char c)
{
    if (peek(r) != c)
        return fail(r, STRICT_JSON_SYNTAX);
    r->at++;
    return true;
}

static void skip_space(struct reader *r)
{
    while (r->at < r->end && (*r->at == ' ' || *r->at == '\t' || *r->at == '\n' || *r->at == '\r'))
        r->at++;
}

/* ---- strings ------------------------------------------------------------------------ */

static int hex_digit(char c)
{
    if (c >= '0' && c <= '9')
        return c - '0';
    if (c >= 'a' && c <= 'f')
        return c - 'a' + 10;
    return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

/* Four digits at text; -1 where they are none. */
static int32_t hex4(const char *text, const char *end)
{
    int32_t x = 0;
    if (end - text < 4)
        return -1;
    for (int i = 0; i < 4; i++) {
        int digit = hex_digit(text[i]);
        if (digit < 0)
            return -1;
        x = x * 16 + digit;
    }
    return x;
}

enum { HIGH_FIRST = 0xd800, LOW_FIRST = 0xdc00, SURROGATES = 0x400 };

static bool is_in(int32_t x, int32_t first)
{
    return x >= first && x < first + SURROGATES;
}

/* What follows "\u" at *at: a character, or two surrogates that make one.  -1 for no
 * digits or a lone surrogate, which readers disagree about. */
static int32_t unicode_escape(const char **at, const char *end)
{
    int32_t x = hex4(*at, end);
    if (x < 0 || is_in(x, LOW_FIRST))
        return -1;
    *at += 4;
    if (!is_in(x, HIGH_FIRST))
        return x;
    if (end - *at < 6 || (*at)[0] != '\\' || (*at)[1] != 'u')
        return -1;
    int32_t low = hex4(*at + 2, end);
    if (!is_in(low, LOW_FIRST))
        return -1;
    *at += 6;
    return 0x10000 + (x - HIGH_FIRST) * SURROGATES + (low - LOW_FIRST);
}

/* What a backslash at (*at)[-1] stands for; -1 where that is nothing. */
static int32_t escape(const char **at, const char *end)
{
    static const char letters[] = "\"\\/bfnrt", means[] = "\"\\/\b\f\n\r\t";
    if (*at == end)
        return -1;
    char c = *(*at)++;
    if (c == 'u')
        return unicode_escape(at, end);
    const char *found = strchr(letters, c);
    return found != NULL ? means[found - letters] : -1;
}

/* What stands between the quotes. */
struct piece {
    const char *from, *to;
    bool escaped; /* somewhere in it */
};

/* A string from its opening quote. */
static bool read_string(struct reader *r, struct piece *ret)
{
    if (!take(r, '"'))
        return false;
    ret->from = r->at;
    ret->escaped = false;
    while (peek(r) != '"') {
        if (r->at == r->end || (unsigned char)*r->at < 0x20)
            return fail(r, STRICT_JSON_SYNTAX);
        if (*r->at++ != '\\')
            continue;
        ret->escaped = true;
        int32_t x = escape(&r->at, r->end);
        if (x <= 0)
            return fail(r, x < 0 ? STRICT_JSON_SYNTAX : STRICT_JSON_NUL);
    }
    ret->to = r->at++;
    return true;
}

/* The next character of a string as UTF-8; its length. */
static size_t next_character(const char **at, const char *end, char utf8[4])
{
    int32_t x = (unsigned char)*(*at)++;
    if (x != '\\') { /* bytes of UTF-8 are compared as they are */
        utf8[0] = (char)x;
        return 1;
    }
    x = escape(at, end);
    if (x < 0x80) {
        utf8[0] = (char)x;
        return 1;
    }
    size_t n = x < 0x800 ? 2 : x < 0x10000 ? 3 : 4;
    for (size_t i = n - 1; i > 0; i--, x >>= 6)
        utf8[i] = (char)(0x80 | (x & 0x3f));
    static const unsigned char lead[] = { 0, 0, 0xc0, 0xe0, 0xf0 };
    utf8[0] = (char)(lead[n] | x);
    return n;
}

/* The bytes of a name one by one, escapes resolved. */
struct cursor {
    const char *at, *end;
    char utf8[4];
    size_t n, i;
};

static int next_byte(struct cursor *c)
{
    if (c->i == c->n) {
        if (c->at == c->end)
            return -1;
        c->n = next_character(&c->at, c->end, c->utf8);
        c->i = 0;
    }
    return (unsigned char)c->utf8[c->i++];
}

static bool same_name(const struct piece *a, const struct piece *b)
{
    struct cursor x = { .at = a->from, .end = a->to }, y = { .at = b->from, .end = b->to };
    size_t n = (size_t)(a->to - a->from);
    if (!a->escaped && !b->escaped)
        return n == (size_t)(b->to - b->from) && memcmp(a->from, b->from, n) == 0;
    for (;;) {
        int next = next_byte(&x);
        if (next != next_byte(&y))
            return false;
        if (next < 0)
            return true;
    }
}

/* ---- the tree, as cJSON would make it ----------------------------------------------- */

/* Items and texts are NULL where no tree is made, or there is no memory for it. */
static cJSON *made(struct reader *r, cJSON *item, int type)
{
    if (item == NULL)
        r->no_memory = true;
    else
        item->type = type;
    return item;
}

static bool builds(const struct reader *r)
{
    return r->builds && !r->no_memory;
}

static cJSON *make_item(struct reader *r, int type)
{
    return builds(r) ? made(r, cJSON_CreateNull(), type) : NULL;
}

static cJSON *make_number(struct reader *r, double x)
{
    return builds(r) ? made(r, cJSON_CreateNumber(x), cJSON_Number) : NULL;
}

/* With escapes resolved, which makes it no longer. */
static char *make_text(struct reader *r, const struct piece *piece)
{
    size_t n = (size_t)(piece->to - piece->from);
    char *text = builds(r) ? cJSON_malloc(n + 1) : NULL;
    if (text == NULL) {
        r->no_memory = r->builds;
        return NULL;
    }
    char *to = text;
    if (piece->escaped) {
        for (const char *at = piece->from; at < piece->to;)
            to += next_character(&at, piece->to, to);
    } else {
        memcpy(text, piece->from, n);
        to += n;
    }
    *to = '\0';
    return text;
}

/* The first knows the last. */
static void append(cJSON *list, cJSON *item)
{
    if (list == NULL || item == NULL)
        return;
    cJSON *first = list->child;
    if (first == NULL) {
        list->child = item->prev = item;
        return;
    }
    item->prev = first->prev;
    first->prev->next = item;
    first->prev = item;
}

/* ---- numbers and words -------------------------------------------------------------- */

static size_t skip_digits(struct reader *r)
{
    const char *from = r->at;
    while (peek(r) >= '0' && peek(r) <= '9')
        r->at++;
    return (size_t)(r->at - from);
}

/* number = [ "-" ] int [ "." digits ] [ "e" [ sign ] digits ], [R8259] section 6. */
static bool read_number(struct reader *r, cJSON **ret)
{
    const char *from = r->at;
    if (peek(r) == '-')
        r->at++;
    bool zero = peek(r) == '0';
    size_t digits = skip_digits(r);
    if (digits == 0 || (zero && digits > 1))
        return fail(r, STRICT_JSON_SYNTAX);
    if (peek(r) == '.') {
        r->at++;
        if (skip_digits(r) == 0)
            return fail(r, STRICT_JSON_SYNTAX);
    }
    bool has_exponent = peek(r) == 'e' || peek(r) == 'E';
    if (has_exponent) {
        r->at++;
        if (peek(r) == '+' || peek(r) == '-')
            r->at++;
        if (skip_digits(r) == 0)
            return fail(r, STRICT_JSON_SYNTAX);
    }
    size_t n = (size_t)(r->at - from);
    double x;
    if (n > STRICT_JSON_MAX_NUMBER)
        return fail(r, STRICT_JSON_NUMBER);
    if (!has_exponent && !builds(r))
        return true; /* so few digits are no more than 1e63 */
    if (number_parse_n(from, n, &x) != STATUS_OK)
        return fail(r, STRICT_JSON_NUMBER);
    *ret = make_number(r, x);
    return true;
}

static bool read_word(struct reader *r, const char *word, int type, cJSON **ret)
{
    size_t n = strlen(word);
    if ((size_t)(r->end - r->at) < n || memcmp(r->at, word, n) != 0)
        return fail(r, STRICT_JSON_SYNTAX);
    r->at += n;
    *ret = make_item(r, type);
    if (*ret != NULL && type == cJSON_True)
        (*ret)->valueint = 1; /* as cJSON has it */
    return true;
}

static bool read_text(struct reader *r, cJSON **ret)
{
    struct piece piece;
    if (!read_string(r, &piece))
        return false;
    *ret = make_item(r, cJSON_String);
    if (*ret != NULL)
        (*ret)->valuestring = make_text(r, &piece);
    return true;
}

/* ---- objects and arrays ------------------------------------------------------------- */

/* *ret is what was made of the value, of one with a fault as well; untouched: nothing. */
static bool read_value(struct reader *r, cJSON **ret);

static bool read_member(struct reader *r, struct piece *names, size_t *n, cJSON **ret)
{
    struct piece name;
    const char *here = r->at;
    if (!read_string(r, &name))
        return false;
    for (size_t i = 0; i < *n; i++) {
        if (same_name(&names[i], &name)) {
            r->at = here;
            return fail(r, STRICT_JSON_DUPLICATE);
        }
    }
    if (*n == STRICT_JSON_MAX_MEMBERS)
        return fail(r, STRICT_JSON_MEMBERS);
    names[(*n)++] = name;
    skip_space(r);
    bool good = take(r, ':') && read_value(r, ret);
    if (*ret != NULL)
        (*ret)->string = make_text(r, &name);
    return good;
}

/* From the opening bracket to the closing one. */
static bool read_list(struct reader *r, bool object, cJSON **ret)
{
    struct piece names[STRICT_JSON_MAX_MEMBERS];
    size_t n = 0;
    char close = object ? '}' : ']';
    if (++r->depth > STRICT_JSON_MAX_DEPTH)
        return fail(r, STRICT_JSON_DEPTH);
    cJSON *list = *ret = make_item(r, object ? cJSON_Object : cJSON_Array);
    r->at++;
    skip_space(r);
    if (peek(r) == close) {
        r->at++;
        r->depth--;
        return true;
    }
    for (;;) {
        cJSON *item = NULL;
        skip_space(r);
        bool good = object ? read_member(r, names, &n, &item) : read_value(r, &item);
        append(list, item);
        if (!good)
            return false;
        skip_space(r);
        if (peek(r) == close)
            break;
        if (!take(r, ','))
            return false;
    }
    r->at++;
    r->depth--;
    return true;
}

static bool read_value(struct reader *r, cJSON **ret)
{
    skip_space(r);
    switch (peek(r)) {
    case '{':
        return read_list(r, true, ret);
    case '[':
        return read_list(r, false, ret);
    case '"':
        return read_text(r, ret);
    case 't':
        return read_word(r, "true", cJSON_True, ret);
    case 'f':
        return read_word(r, "false", cJSON_False, ret);
    case 'n':
        return read_word(r, "null", cJSON_NULL, ret);
    default:
        return read_number(r, ret);
    }
}

/* *ret is then the tree, as far as it was made. */
static void read_all(struct reader *r, cJSON **ret)
{
    const char *nul = memchr(r->at, '\0', (size_t)(r->end - r->at));
    if (nul != NULL) {
        r->at = nul;
        fail(r, STRICT_JSON_NUL);
    } else if (!utf8_is_valid_n(r->at, (size_t)(r->end - r->at))) {
        fail(r, STRICT_JSON_UTF8);
    } else if (read_value(r, ret)) {
        skip_space(r);
        if (r->at < r->end)
            fail(r, STRICT_JSON_SYNTAX);
    }
}

enum strict_json_fault strict_json_check(const char *text, size_t n, size_t *offset)
{
    struct reader r = { .begin = text, .at = text, .end = text + n };
    cJSON *none = NULL;
    read_all(&r, &none);
    if (offset != NULL)
        *offset = (size_t)(r.at - r.begin);
    return r.fault;
}

enum status strict_json_parse(const char *text, size_t n, cJSON **ret,
                              enum strict_json_fault *fault, size_t *offset)
{
    struct reader r = { .begin = text, .at = text, .end = text + n, .builds = true };
    cJSON *value = NULL;
    read_all(&r, &value);
    *fault = r.fault;
    if (offset != NULL)
        *offset = (size_t)(r.at - r.begin);
    if (r.fault == STRICT_JSON_FINE && !r.no_memory) {
        *ret = value;
        return STATUS_OK;
    }
    cJSON_Delete(value);
    return r.fault != STRICT_JSON_FINE ? STATUS_FORMAT : STATUS_NO_MEMORY;
}

const cJSON *strict_json_member(const cJSON *object, const char *name)
{
    return cJSON_GetObjectItemCaseSensitive(object, name);
}

/* ---- a client's text, shown --------------------------------------------------------- */

/* Length of the valid UTF-8 character at text, and which it is. */
static size_t decode(const unsigned char *text, uint32_t *ret)
{
    if (text[0] < 0x80) {
        *ret = text[0];
        return 1;
    }
    size_t n = text[0] < 0xe0 ? 2 : text[0] < 0xf0 ? 3 : 4;
    uint32_t x = text[0] & (0x7fu >> n);
    for (size_t i = 1; i < n; i++)
        x = x << 6 | (text[i] & 0x3fu);
    *ret = x;
    return n;
}

/* C0, DEL, C1, quote and backslash; line and paragraph separators, what has no width, and
 * what changes the direction of writing (Unicode's Bidi_Control). */
static bool is_shown_by_number(uint32_t x)
{
    return x < 0x20 || x == '"' || x == '\\' || (x >= 0x7f && x < 0xa0) || x == 0x61c ||
           (x >= 0x200b && x <= 0x200f) || (x >= 0x2028 && x <= 0x202e) ||
           (x >= 0x2060 && x <= 0x2069) || x == 0xfeff;
}

const char *strict_json_echo(const char *text, char into[STRICT_JSON_ECHO_SIZE])
{
    const unsigned char *p = (const unsigned char *)text;
    char *out = into;
    size_t used = 0;
    *out++ = '"';
    while (*p != '\0') {
        uint32_t x;
        size_t n = decode(p, &x);
        if (used + n > STRICT_JSON_ECHO)
            break;
        if (is_shown_by_number(x)) {
            out += snprintf(out, 7, "\\u%04x", (unsigned)x & 0xffffu);
        } else {
            memcpy(out, p, n);
            out += n;
        }
        used += n;
        p += n;
    }
    strcpy(out, *p == '\0' ? "\"" : "\"...");
    return into;
}
