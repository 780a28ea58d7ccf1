/* table_hash.h - the two hashes of a table file.
 *
 * content: over a canonical dump of meta and rows, so that it names what the
 * table says, however the file is laid out.  The dump is every meta row but the
 * two hashes as "key=value\n" in the order of the keys, "\n", and then per row
 * id (unsigned 64 bit), cm bm ch l a b r g b_ (float64), the spectrum (float32 a
 * band), all little-endian.
 *
 * pages: over the bytes of the file, with the 64 digits of this hash itself taken
 * as '0', so that any changed byte is noticed before SQLite reads it.  It is the
 * SHA-256 of 16 bytes for each MiB of the file, in order: the AES-128-GMAC of that
 * piece with key and nonce of zeros [GCM], which is a checksum of 128 bits, sure to
 * differ where one block of 16 bytes does, at three times the speed of SHA-256
 * (docs/decisions/0006).
 *
 * [GCM] NIST SP 800-38D */
#ifndef SKINSPEC_DB_TABLE_HASH_H
#define SKINSPEC_DB_TABLE_HASH_H

#include <nettle/sha2.h>

#include "base/status.h"
#include "db/table_schema.h"
#include "match/table.h"

#define TABLE_PAGES_UNSET "0000000000000000000000000000000000000000000000000000000000000000"

struct table_content_hash {
    struct sha256_ctx sha256;
};

void table_content_begin(struct table_content_hash *hash, const struct table_meta *meta);
/* Rows first .. first + count - 1 of the table, whose ids in the file are id, id + 1, ... */
void table_content_rows(struct table_content_hash *hash, const struct table *table, size_t first,
                        size_t count, size_t id);
void table_content_end(struct table_content_hash *hash, char hex[TABLE_SHA256_SIZE]);

/* The pages hash as computed from an open file and as written in it, by so many threads.
 * STATUS_FORMAT where the file holds no place for it; STATUS_IO. */
enum status table_pages_hash(int fd, unsigned threads, char computed[TABLE_SHA256_SIZE],
                             char written[TABLE_SHA256_SIZE]);

/* Compute the pages hash of a finished file and write it into its place. */
enum status table_pages_seal(int fd, unsigned threads);

/* Little-endian float32 as stored, whatever the machine. */
void table_spectrum_to_blob(const float *spectrum, size_t bands, unsigned char *blob);
void table_spectrum_from_blob(const unsigned char *blob, size_t bands, float *spectrum);

#endif
