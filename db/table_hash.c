/* table_hash.c - canonical bytes of rows, and hashing a file around its own hash. */
#define _GNU_SOURCE /* memmem */
#include "db/table_hash.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <nettle/gcm.h>

#include "base/parallel.h"

/* One by one, which a compiler makes one store of. */
static void little_endian(uint64_t bits, unsigned char out[8])
{
    out[0] = (unsigned char)bits;
    out[1] = (unsigned char)(bits >> 8);
    out[2] = (unsigned char)(bits >> 16);
    out[3] = (unsigned char)(bits >> 24);
    out[4] = (unsigned char)(bits >> 32);
    out[5] = (unsigned char)(bits >> 40);
    out[6] = (unsigned char)(bits >> 48);
    out[7] = (unsigned char)(bits >> 56);
}

static void hex_of(struct sha256_ctx *sha256, char hex[TABLE_SHA256_SIZE])
{
    uint8_t digest[SHA256_DIGEST_SIZE];
    sha256_digest(sha256, sizeof digest, digest);
    for (size_t i = 0; i < sizeof digest; i++)
        snprintf(hex + 2 * i, 3, "%02x", (unsigned)digest[i]);
}

static void add_text(struct sha256_ctx *sha256, const char *text)
{
    sha256_update(sha256, strlen(text), (const uint8_t *)text);
}

void table_content_begin(struct table_content_hash *hash, const struct table_meta *meta)
{
    sha256_init(&hash->sha256);
    for (size_t i = 0; i < TABLE_META_COUNT; i++) {
        add_text(&hash->sha256, meta->key[i]);
        add_text(&hash->sha256, "=");
        add_text(&hash->sha256, meta->value[i]);
        add_text(&hash->sha256, "\n");
    }
    add_text(&hash->sha256, "\n");
}

enum { COLUMNS = 9, NUMBERS_BYTES = 8 + 8 * COLUMNS, ROWS_AT_ONCE = 16 };

/* How many bytes it is. */
static size_t row_bytes(const struct table *table, size_t i, size_t id, unsigned char *bytes)
{
    const double column[COLUMNS] = { table->Cm[i],  table->Bm[i],    table->Ch[i],
                                     table->L[i],   table->a[i],     table->b[i],
                                     table->red[i], table->green[i], table->blue[i] };
    size_t bands = table->recipe.bands;
    little_endian(id, bytes);
    for (size_t c = 0; c < COLUMNS; c++) {
        uint64_t bits;
        memcpy(&bits, &column[c], sizeof bits);
        little_endian(bits, bytes + 8 + 8 * c);
    }
    if (bands > 0)
        table_spectrum_to_blob(table_spectrum(table, i), bands, bytes + NUMBERS_BYTES);
    return NUMBERS_BYTES + 4 * bands;
}

/* Some at once: most of a row would else be kept until the next completes a block. */
void table_content_rows(struct table_content_hash *hash, const struct table *table, size_t first,
                        size_t count, size_t id)
{
    unsigned char bytes[ROWS_AT_ONCE * (NUMBERS_BYTES + 4 * SPECTRUM_MAX_BANDS)];
    for (size_t at = 0; at < count;) {
        size_t size = 0;
        for (size_t n = 0; n < ROWS_AT_ONCE && at < count; n++, at++)
            size += row_bytes(table, first + at, id + at, bytes + size);
        sha256_update(&hash->sha256, size, bytes);
    }
}

void table_content_end(struct table_content_hash *hash, char hex[TABLE_SHA256_SIZE])
{
    hex_of(&hash->sha256, hex);
}

/* Where the machine's own order is the file's, a copy: millions of rows go through here. */
#if __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
void table_spectrum_to_blob(const float *spectrum, size_t bands, unsigned char *blob)
{
    memcpy(blob, spectrum, 4 * bands);
}

void table_spectrum_from_blob(const unsigned char *blob, size_t bands, float *spectrum)
{
    memcpy(spectrum, blob, 4 * bands);
}
#else
void table_spectrum_to_blob(const float *spectrum, size_t bands, unsigned char *blob)
{
    for (size_t i = 0; i < bands; i++) {
        uint32_t bits;
        memcpy(&bits, &spectrum[i], sizeof bits);
        for (size_t k = 0; k < 4; k++)
            blob[4 * i + k] = (unsigned char)(bits >> (8 * k));
    }
}

void table_spectrum_from_blob(const unsigned char *blob, size_t bands, float *spectrum)
{
    for (size_t i = 0; i < bands; i++) {
        const unsigned char *b = blob + 4 * i;
        uint32_t bits =
            (uint32_t)b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
        memcpy(&spectrum[i], &bits, sizeof bits);
    }
}
#endif

static bool is_hex_digit(unsigned char c)
{
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
}

/* Where the digits of the pages hash stand: SQLite keeps key and value of a meta
 * row side by side. */
static unsigned char *find_digits(unsigned char *file, size_t size)
{
    static const char key[] = TABLE_PAGES_KEY;
    const size_t key_size = sizeof key - 1, digits = TABLE_SHA256_SIZE - 1;
    unsigned char *from = file, *end = file + size;
    while (from < end) {
        unsigned char *found = memmem(from, (size_t)(end - from), key, key_size);
        if (found == NULL || (size_t)(end - found) < key_size + digits)
            return NULL;
        unsigned char *value = found + key_size;
        size_t n = 0;
        while (n < digits && is_hex_digit(value[n]))
            n++;
        if (n == digits)
            return value;
        from = value;
    }
    return NULL;
}

/* As '0', in this process's own copy of the pages of memory that they stand on. */
static enum status unset_digits(unsigned char *digits)
{
    size_t before = (uintptr_t)digits % (uintptr_t)sysconf(_SC_PAGESIZE);
    size_t size = before + TABLE_SHA256_SIZE - 1;
    if (mprotect(digits - before, size, PROT_READ | PROT_WRITE) != 0)
        return STATUS_IO;
    memset(digits, '0', TABLE_SHA256_SIZE - 1);
    return STATUS_OK;
}

/* ---- pieces ------------------------------------------------------------------------------ */

/* So many are summed at once: 256 MiB. */
enum { PIECE_BYTES = 1 << 20, BATCH = 256 };

struct pieces {
    const unsigned char *file;
    size_t size;
    uint8_t sum[BATCH][GCM_DIGEST_SIZE];
};

/* Whoever reads it takes it for a checksum: the key is known. */
static enum status sum_piece(size_t piece, unsigned worker, void *context)
{
    static const uint8_t zeros[AES128_KEY_SIZE];
    struct pieces *p = context;
    struct gcm_aes128_ctx gcm;
    size_t at = piece * PIECE_BYTES, rest = p->size - at;
    (void)worker;
    gcm_aes128_set_key(&gcm, zeros);
    gcm_aes128_set_iv(&gcm, GCM_IV_SIZE, zeros);
    gcm_aes128_update(&gcm, rest < PIECE_BYTES ? rest : PIECE_BYTES, p->file + at);
    gcm_aes128_digest(&gcm, GCM_DIGEST_SIZE, p->sum[piece]);
    return STATUS_OK;
}

static void hash_pieces(const unsigned char *file, size_t size, unsigned threads,
                        char hex[TABLE_SHA256_SIZE])
{
    struct sha256_ctx sha256;
    sha256_init(&sha256);
    while (size > 0) {
        struct pieces p = { .file = file, .size = size };
        size_t n = (size + PIECE_BYTES - 1) / PIECE_BYTES;
        if (n > BATCH)
            n = BATCH;
        (void)parallel_run(n, threads, sum_piece, &p); /* no piece can fail */
        sha256_update(&sha256, n * GCM_DIGEST_SIZE, p.sum[0]);
        size_t done = n * PIECE_BYTES < size ? n * PIECE_BYTES : size;
        file += done;
        size -= done;
    }
    hex_of(&sha256, hex);
}

/* ---- the file ---------------------------------------------------------------------------- */

/* Hash of an open file, what it says itself, and where. */
static enum status pages_hash(int fd, unsigned threads, char computed[TABLE_SHA256_SIZE],
                              char written[TABLE_SHA256_SIZE], off_t *place)
{
    struct stat st;
    if (fstat(fd, &st) != 0)
        return STATUS_IO;
    if (st.st_size <= 0)
        return STATUS_FORMAT;
    size_t size = (size_t)st.st_size;
    unsigned char *file = mmap(NULL, size, PROT_READ, MAP_PRIVATE, fd, 0);
    if (file == MAP_FAILED)
        return STATUS_IO;
    unsigned char *digits = find_digits(file, size);
    enum status s = digits != NULL ? STATUS_OK : STATUS_FORMAT;
    if (s == STATUS_OK) {
        memcpy(written, digits, TABLE_SHA256_SIZE - 1);
        written[TABLE_SHA256_SIZE - 1] = '\0';
        *place = digits - file;
        s = unset_digits(digits);
    }
    if (s == STATUS_OK)
        hash_pieces(file, size, threads, computed);
    munmap(file, size);
    return s;
}

enum status table_pages_hash(int fd, unsigned threads, char computed[TABLE_SHA256_SIZE],
                             char written[TABLE_SHA256_SIZE])
{
    off_t place;
    return pages_hash(fd, threads, computed, written, &place);
}

enum status table_pages_seal(int fd, unsigned threads)
{
    char computed[TABLE_SHA256_SIZE], written[TABLE_SHA256_SIZE];
    off_t place;
    enum status s = pages_hash(fd, threads, computed, written, &place);
    if (s != STATUS_OK)
        return s;
    ssize_t n = pwrite(fd, computed, TABLE_SHA256_SIZE - 1, place);
    return n == TABLE_SHA256_SIZE - 1 ? STATUS_OK : STATUS_IO;
}
