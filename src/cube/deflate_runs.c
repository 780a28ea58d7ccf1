/* deflate_runs.c - each call makes a block with Huffman codes of its own. */
#include "cube/deflate_runs.h"

#include <stdlib.h>
#include <string.h>

/* [RFC1951] 3.2.5: codes for bytes, the block's end, and lengths of runs, LENGTH_LEAST .. _MOST. */
enum { END = 256, CODES = 286, LENGTH_LEAST = 3, LENGTH_MOST = 258 };
/* Symbols here: bytes, then runs by their length. */
enum { SYMBOLS = 256 + LENGTH_MOST - LENGTH_LEAST + 1 };
/* [RFC1951] 3.2.7: a code of at most 15 bits, told by lengths that are coded by at most 7. */
enum { CODE_BITS = 15, LENGTH_CODES = 19, LENGTH_BITS = 7 };
enum { ADLER = 65521, ADLER_STEP = 32, ADLER_STEPS = 128 };

struct code {
    uint32_t bits; /* the first in the lowest */
    uint32_t count;
};

/* ---- Adler-32 ----------------------------------------------------------------------- */

/* [RFC1950] 8.2: sums of the bytes, and of those sums. */
static void add_up(uint32_t sum[2], const unsigned char *in, size_t n)
{
    uint32_t a = sum[0], b = sum[1];
    while (n >= ADLER_STEP) {
        size_t steps = n / ADLER_STEP < ADLER_STEPS ? n / ADLER_STEP : ADLER_STEPS;
        for (size_t k = 0; k < steps; k++, in += ADLER_STEP) {
            uint32_t all = 0, weighted = 0;
            for (uint32_t i = 0; i < ADLER_STEP; i++) {
                all += in[i];
                weighted += (ADLER_STEP - i) * in[i];
            }
            b += ADLER_STEP * a + weighted;
            a += all;
        }
        a %= ADLER;
        b %= ADLER;
        n -= steps * ADLER_STEP;
    }
    for (size_t i = 0; i < n; i++) {
        a += in[i];
        b += a;
    }
    sum[0] = a % ADLER;
    sum[1] = b % ADLER;
}

/* ---- Huffman's codes ---------------------------------------------------------------- */

struct leaf {
    uint32_t weight, symbol;
};

static int lighter(const void *a, const void *b)
{
    const struct leaf *x = a, *y = b;
    if (x->weight != y->weight)
        return x->weight < y->weight ? -1 : 1;
    return x->symbol < y->symbol ? -1 : 1;
}

/* Depths of m leaves, two or more, in order of weight; the deepest. */
static unsigned find_depths(const struct leaf *leaf, size_t m, unsigned char *depth)
{
    uint32_t weight[CODES];                       /* of inner nodes, which come in order as well */
    size_t parent[2 * CODES], next[2] = { 0, 0 }; /* leaves, then inner nodes */
    unsigned deepest = 0;
    for (size_t k = 0; k + 1 < m; k++) {
        weight[k] = 0;
        for (int twice = 0; twice < 2; twice++) {
            bool inner = next[0] == m || (next[1] < k && weight[next[1]] < leaf[next[0]].weight);
            parent[inner ? m + next[1] : next[0]] = m + k;
            weight[k] += inner ? weight[next[1]] : leaf[next[0]].weight;
            next[inner ? 1 : 0]++;
        }
    }
    unsigned char below[CODES] = { 0 }; /* depth of an inner node; the last is the root */
    for (size_t k = m - 1; k-- > 0;) {
        if (k + 2 < m)
            below[k] = (unsigned char)(below[parent[m + k] - m] + 1);
    }
    for (size_t i = 0; i < m; i++) {
        depth[i] = (unsigned char)(below[parent[i] - m] + 1);
        deepest = depth[i] > deepest ? depth[i] : deepest;
    }
    return deepest;
}

/* Lengths of codes for n symbols so frequent, two of them or more; no code is longer than `most`.
 * Where the best would be, weights are evened out until it fits. */
static void find_lengths(const uint32_t *count, size_t n, unsigned most, unsigned char *length)
{
    struct leaf leaf[CODES];
    unsigned char depth[CODES];
    size_t m = 0;
    memset(length, 0, n);
    for (uint32_t i = 0; i < n; i++)
        if (count[i] > 0)
            leaf[m++] = (struct leaf){ count[i], i };
    qsort(leaf, m, sizeof *leaf, lighter);
    while (find_depths(leaf, m, depth) > most)
        for (size_t i = 0; i < m; i++)
            leaf[i].weight = (leaf[i].weight + 1) / 2;
    for (size_t i = 0; i < m; i++)
        length[leaf[i].symbol] = depth[i];
}

/* [RFC1951] 3.2.2: codes follow from their lengths; bits are sent from the highest. */
static void make_codes(const unsigned char *length, size_t n, struct code *code)
{
    uint32_t next[CODE_BITS + 2] = { 0 }, many[CODE_BITS + 1] = { 0 };
    for (size_t i = 0; i < n; i++)
        many[length[i]]++;
    many[0] = 0;
    for (size_t k = 1; k <= CODE_BITS; k++)
        next[k + 1] = (next[k] + many[k]) << 1;
    for (size_t i = 0; i < n; i++) {
        uint32_t bits = length[i] > 0 ? next[length[i]]++ : 0, turned = 0;
        for (unsigned k = 0; k < length[i]; k++)
            turned |= (bits >> k & 1u) << (length[i] - 1u - k);
        code[i] = (struct code){ turned, length[i] };
    }
}

/* ---- runs --------------------------------------------------------------------------- */

/* [RFC1951] 3.2.5: from 11 on four codes share a number of further bits, of which 258 needs none.
 */
static uint32_t code_of_length(uint32_t length, struct code *further)
{
    uint32_t over = length - LENGTH_LEAST, bits = 0;
    *further = (struct code){ 0, 0 };
    if (length == LENGTH_MOST)
        return CODES - 1;
    while (over >> bits >= 8)
        bits++;
    *further = (struct code){ over & ((1u << bits) - 1), bits };
    return END + 1 + 4 * bits + (over >> bits);
}

/* Bytes into symbols; how many. */
static size_t find_runs(struct deflate_runs *d, const unsigned char *in, size_t n)
{
    size_t symbols = 0, i = 0;
    while (i < n) {
        d->symbol[symbols++] = in[i++];
        /* Seldom in noise, so that the branch costs little. */
        while (n - i >= LENGTH_LEAST && in[i] == in[i - 1] && in[i + 1] == in[i] &&
               in[i + 2] == in[i]) {
            size_t length = LENGTH_LEAST, left = n - i;
            size_t most = left < LENGTH_MOST ? left : LENGTH_MOST;
            while (length < most && in[i + length] == in[i])
                length++;
            d->symbol[symbols++] = (uint16_t)(256 + length - LENGTH_LEAST);
            i += length;
        }
    }
    return symbols;
}

/* ---- bits --------------------------------------------------------------------------- */

/* On their way out; the same three as in struct deflate_runs, at hand. */
struct bits {
    uint64_t bits;
    unsigned count;
    unsigned char *out;
};

static inline void put_bits(struct bits *b, struct code code)
{
    b->bits |= (uint64_t)code.bits << b->count;
    b->count += code.count;
}

/* Whole bytes of what is there, up to 56 bits, after which fewer than 8 are left.  What is beyond
 * them in out[8] does not matter.  Written out, compilers make one store of it; a loop they leave.
 */
static inline void give_out(struct bits *b)
{
    uint64_t x = b->bits;
    unsigned char *out = b->out;
    out[0] = (unsigned char)x;
    out[1] = (unsigned char)(x >> 8);
    out[2] = (unsigned char)(x >> 16);
    out[3] = (unsigned char)(x >> 24);
    out[4] = (unsigned char)(x >> 32);
    out[5] = (unsigned char)(x >> 40);
    out[6] = (unsigned char)(x >> 48);
    out[7] = (unsigned char)(x >> 56);
    b->out += b->count / 8;
    b->bits >>= b->count / 8 * 8;
    b->count %= 8;
}

/* [RFC1951] 3.2.7, without its abbreviations for lengths that repeat. */
static void put_header(const unsigned char *length, bool last, struct bits *b)
{
    static const unsigned char order[LENGTH_CODES] = { 16, 17, 18, 0, 8,  7, 9,  6, 10, 5,
                                                       11, 4,  12, 3, 13, 2, 14, 1, 15 };
    uint32_t count[LENGTH_CODES] = { 0 };
    unsigned char short_length[LENGTH_CODES];
    struct code code[LENGTH_CODES];
    for (size_t i = 0; i <= CODES; i++)
        count[length[i]]++;
    find_lengths(count, LENGTH_CODES, LENGTH_BITS, short_length);
    make_codes(short_length, LENGTH_CODES, code);
    put_bits(b, (struct code){ last ? 1 : 0, 1 });
    put_bits(b, (struct code){ 2, 2 });                /* codes of its own */
    put_bits(b, (struct code){ CODES - 257, 5 });      /* so many of bytes and lengths */
    put_bits(b, (struct code){ 0, 5 });                /* one of distances */
    put_bits(b, (struct code){ LENGTH_CODES - 4, 4 }); /* all lengths of short codes follow */
    for (size_t i = 0; i < LENGTH_CODES; i++) {
        give_out(b);
        put_bits(b, (struct code){ short_length[order[i]], 3 });
    }
    for (size_t i = 0; i <= CODES; i++) {
        give_out(b);
        put_bits(b, code[length[i]]);
    }
    give_out(b);
}

/* A symbol has 21 bits at most: a code, 5 more of a length, 1 of the distance. */
static void put_symbols(const struct code *code, const uint16_t *symbol, size_t n, struct bits *ret)
{
    struct bits b = *ret;
    size_t i = 0;
    for (; i + 1 < n; i += 2) {
        put_bits(&b, code[symbol[i]]);
        put_bits(&b, code[symbol[i + 1]]);
        give_out(&b);
    }
    if (i < n)
        put_bits(&b, code[symbol[i]]);
    give_out(&b);
    *ret = b;
}

/* ---- blocks ------------------------------------------------------------------------- */

static void put_block(struct deflate_runs *d, const unsigned char *in, size_t n, bool last,
                      struct bits *b)
{
    uint32_t seen[SYMBOLS] = { 0 }, count[CODES] = { 0 };
    unsigned char length[CODES + 1];
    struct code code[CODES], whole[SYMBOLS], further;
    size_t symbols = find_runs(d, in, n);
    for (size_t i = 0; i < symbols; i++)
        seen[d->symbol[i]]++;
    memcpy(count, seen, 256 * sizeof *count);
    count[END] = 1;
    for (uint32_t k = LENGTH_LEAST; k <= LENGTH_MOST; k++)
        count[code_of_length(k, &further)] += seen[256 + k - LENGTH_LEAST];
    find_lengths(count, CODES, CODE_BITS, length);
    length[CODES] = 1; /* of the one distance, the code 0 */
    make_codes(length, CODES, code);
    memcpy(whole, code, 256 * sizeof *whole);
    for (uint32_t k = LENGTH_LEAST; k <= LENGTH_MOST; k++) {
        struct code first = code[code_of_length(k, &further)];
        whole[256 + k - LENGTH_LEAST] = (struct code){ first.bits | further.bits << first.count,
                                                       first.count + further.count + 1 };
    }
    put_header(length, last, b);
    put_symbols(whole, d->symbol, symbols, b);
    put_bits(b, code[END]);
    give_out(b);
}

void deflate_runs_begin(struct deflate_runs *d)
{
    d->begun = false;
    d->bits = 0;
    d->bit_count = 0;
    d->sum[0] = 1;
    d->sum[1] = 0;
}

size_t deflate_runs_add(struct deflate_runs *d, const unsigned char *in, size_t n, bool last,
                        unsigned char *out)
{
    struct bits b = { d->bits, d->bit_count, out };
    if (!d->begun) /* [RFC1950] 2.2: deflate, a window of 32 KiB, made in haste */
        put_bits(&b, (struct code){ 0x0178, 16 });
    d->begun = true;
    add_up(d->sum, in, n);
    put_block(d, in, n, last, &b);
    if (last) {
        b.count = (b.count + 7) / 8 * 8;
        give_out(&b);
        for (int i = 0; i < 4; i++)
            *b.out++ = (unsigned char)((d->sum[1] << 16 | d->sum[0]) >> (24 - 8 * i));
    }
    d->bits = b.bits;
    d->bit_count = b.count;
    return (size_t)(b.out - out);
}
