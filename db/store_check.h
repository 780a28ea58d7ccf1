/* store_check.h - check tiles in station.db: what a tile should look like, and how each
 * instrument has seen it since.
 *
 * A tile is known by its name.  Its reference is a spectrum through one port: from a certificate,
 * which holds for every instrument with that port, or measured, which holds for the instrument
 * that measured it.  Its limit is one for all ports.  Both are rows that are only added: the
 * newest counts.  Threads, statuses and groups are as in db/store.h. */
#ifndef SKINSPEC_DB_STORE_CHECK_H
#define SKINSPEC_DB_STORE_CHECK_H

#include "db/store.h"

enum { STORE_TILE_SIZE = 64 };

enum store_tile_source {
    STORE_TILE_CERTIFICATE,
    STORE_TILE_MEASURED,
    STORE_TILE_LIMIT, /* another limit, the references stay as they are */
};

/* "certificate", "measured", "limit". */
const char *store_tile_source_name(enum store_tile_source source);

struct store_check_tile {
    char id[STORE_UUID_SIZE];       /* out: UUIDv7 */
    char taken_at[STORE_TIME_SIZE]; /* out */

    char uuid[STORE_UUID_SIZE], parameters_sha256[65]; /* the client's, to tell a retry */
    char who[STORE_TEXT_SIZE];
    char tile[STORE_TILE_SIZE];
    enum store_tile_source source;
    double limit_dE00; /* from here on */

    /* Of a reference; n = 0 and NAN for another limit. */
    struct spectrum spectrum; /* SCE */
    double aperture_mm;

    /* Of a measured one, else "" and 0. */
    struct store_instrument instrument;
    char calibration_id[STORE_UUID_SIZE];
    size_t replicates;
};

/* One check. */
struct store_check {
    char id[STORE_UUID_SIZE];       /* out: UUIDv7 */
    int64_t seq;                    /* out: from 1, without a gap */
    char taken_at[STORE_TIME_SIZE]; /* out */

    char uuid[STORE_UUID_SIZE], parameters_sha256[65];
    char operator_name[STORE_TEXT_SIZE]; /* "" */
    struct store_instrument instrument;
    char calibration_id[STORE_UUID_SIZE]; /* "" */
    int64_t fence;
    char tile[STORE_TILE_SIZE], reference_id[STORE_UUID_SIZE];
    double aperture_mm;
    size_t replicates;
    struct spectrum spectrum; /* the mean, SCE */
    double dE00, rms, limit_dE00;
    bool passed;
};

/* ---- writing: as store_add_record() -------------------------------------------------- */

/* A uuid that is there with the same parameters_sha256 (and source): *known is true and the row is
 * what was stored; with others STATUS_EXISTS.  STATUS_NOT_FOUND for a calibration or a reference
 * that is not there, STATUS_RANGE for a spectrum that is none: store_bad_member(). */
enum status store_add_check_tile(struct store *store, struct store_check_tile *tile, bool *known);
enum status store_add_check(struct store *store, struct store_check *check, bool *known);

/* ---- reading ------------------------------------------------------------------------- */

/* By the client's uuid.  STATUS_NOT_FOUND. */
enum status store_get_check_tile(struct store_reader *reader, const char *uuid,
                                 struct store_check_tile *ret);
enum status store_get_check(struct store_reader *reader, const char *uuid, struct store_check *ret);

/* The newest row of the tile, whatever its source: its limit is the one in force.
 * STATUS_NOT_FOUND: no such tile. */
enum status store_last_check_tile(struct store_reader *reader, const char *tile,
                                  struct store_check_tile *ret);

/* The newest reference of the tile through that port that holds for the instrument, which is
 * known by driver, maker, model and serial.  STATUS_NOT_FOUND. */
enum status store_find_check_reference(struct store_reader *reader, const char *tile,
                                       double aperture_mm,
                                       const struct store_instrument *instrument,
                                       struct store_check_tile *ret);

/* The tiles there are, each as its newest row, by name, those after one ("": from the first),
 * until the callback returns false. */
typedef bool store_visit_check_tile(void *context, const struct store_check_tile *tile);
enum status store_list_check_tiles(struct store_reader *reader, const char *after_tile,
                                   store_visit_check_tile *visit, void *context);

/* Checks in order of seq, until the callback returns false. */
struct store_check_query {
    int64_t since_seq;                         /* seq is above */
    const char *tile;                          /* NULL: all */
    const struct store_instrument *instrument; /* NULL: all; known as above */
};
typedef bool store_visit_check(void *context, const struct store_check *check);
enum status store_list_checks(struct store_reader *reader, const struct store_check_query *query,
                              store_visit_check *visit, void *context);

/* Of an instrument the newest check of each tile through each port, in order of seq. */
enum status store_last_checks(struct store_reader *reader,
                              const struct store_instrument *instrument, store_visit_check *visit,
                              void *context);

#endif
