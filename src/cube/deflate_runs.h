/* deflate_runs.h - bytes as a zlib stream of Huffman codes and runs, for pictures of noise.
 * [RFC1950] ZLIB Compressed Data Format, [RFC1951] DEFLATE Compressed Data Format, both 1996.
 *
 * What zlib makes with its strategy Z_RLE, to about the same size, in a quarter of the time: a
 * byte is a code of its own or part of a run of the byte before; nothing else is looked for, as
 * in the noise of a map there is nothing else to find. */
#ifndef SKINSPEC_CUBE_DEFLATE_RUNS_H
#define SKINSPEC_CUBE_DEFLATE_RUNS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Bytes that go in at a time, at most; and what comes out of them then, at most. */
enum { DEFLATE_RUNS_IN = 1 << 15, DEFLATE_RUNS_OUT = 2 * DEFLATE_RUNS_IN + 1024 };

struct deflate_runs {
    bool begun;
    uint64_t bits; /* not yet given out, the lowest first; fewer than 8 between calls */
    unsigned bit_count;
    uint32_t sum[2];                  /* of Adler-32 */
    uint16_t symbol[DEFLATE_RUNS_IN]; /* scratch: a byte, or 256 and more: a run */
};

void deflate_runs_begin(struct deflate_runs *d);

/* The next n bytes, 1 .. DEFLATE_RUNS_IN; last: with them the stream ends.  How many bytes of
 * out[DEFLATE_RUNS_OUT] are the stream's next. */
size_t deflate_runs_add(struct deflate_runs *d, const unsigned char *in, size_t n, bool last,
                        unsigned char *out);

#endif
