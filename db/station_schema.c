/* station_schema.c - what stands in station.db, and how older files get there. */
#include "db/station_schema.h"

#include "base/log.h"
#include "db/sql.h"

/* STRICT, so that a value has the type of its column and the audit chain can rely on it. */
static const char step_1_station[] =
    "PRAGMA application_id = 1399542644;  -- 0x536b5374, \"SkSt\"\n"
    "PRAGMA user_version = 1;\n"
    "CREATE TABLE station(\n"
    "  " STATION_SIGN "\n"
    "  one       INTEGER PRIMARY KEY CHECK (one = 1),\n"
    "  id        TEXT NOT NULL,              -- random UUID, made with the file\n"
    "  made_at   TEXT NOT NULL,              -- RFC 3339 UTC, as all times here\n"
    "  first_seq INTEGER NOT NULL            -- 1, or above the numbers of a damaged predecessor\n"
    ") STRICT;\n"

    "CREATE TABLE subject(\n"
    "  id TEXT PRIMARY KEY                   -- random UUID and nothing else: it stays for good\n"
    ") STRICT;\n"

    /* Outside the audit chain: store_forget_subject() erases rows, and rewrites the
     * table so that SQLite's stale copies go as well. */
    "CREATE TABLE subject_person(            -- no row: forgotten\n"
    "  subject    TEXT PRIMARY KEY REFERENCES subject(id),\n"
    "  label      TEXT,\n"
    "  name       TEXT,\n"
    "  birth_year INTEGER,\n"
    "  notes      TEXT\n"
    ") STRICT;\n"

    "CREATE TABLE site(\n"
    "  id   INTEGER PRIMARY KEY,\n"
    "  name TEXT NOT NULL UNIQUE             -- place on the body, in the station's words\n"
    ") STRICT;\n"

    "CREATE TABLE instrument(                -- one row per unit and firmware\n"
    "  id       INTEGER PRIMARY KEY,\n"
    "  driver   TEXT NOT NULL,\n"
    "  maker    TEXT NOT NULL,               -- '' where the unit does not say\n"
    "  model    TEXT NOT NULL,\n"
    "  serial   TEXT NOT NULL,\n"
    "  firmware TEXT NOT NULL,\n"
    "  UNIQUE(driver, maker, model, serial, firmware)\n"
    ") STRICT;\n"

    "CREATE TABLE calibration(\n"
    "  id          TEXT PRIMARY KEY,         -- UUIDv7\n"
    "  taken_at    TEXT NOT NULL,\n"
    "  boot_id     TEXT,                     -- of the machine; boottime_ms counts from there\n"
    "  boottime_ms INTEGER NOT NULL,\n"
    "  instrument  INTEGER NOT NULL REFERENCES instrument(id),\n"
    "  step        TEXT NOT NULL,            -- zero, white\n"
    "  tile        TEXT,                     -- serial number of the white tile\n"
    "  operator    TEXT\n"
    ") STRICT;\n"
    "CREATE INDEX calibration_last ON calibration(step, instrument, id);\n";

/* Spectra are little-endian float64, band after band, replicate after replicate. */
static const char step_1_measurement[] =
    "CREATE TABLE measurement(\n"
    "  seq         INTEGER PRIMARY KEY,      -- first_seq, first_seq + 1, ...: without a gap\n"
    "  id          TEXT NOT NULL UNIQUE,     -- UUIDv7; rises with seq\n"
    "  taken_at    TEXT NOT NULL,            -- with milliseconds\n"
    "  boot_id     TEXT,\n"
    "  boottime_ms INTEGER NOT NULL,\n"
    "  uuid        TEXT,                     -- the client's\n"
    "  parameters_sha256 TEXT,               -- of the client's request\n"
    "  operator    TEXT,\n"
    "  instrument  INTEGER REFERENCES instrument(id),  -- NULL: a spectrum that a client sent\n"
    "  calibration TEXT REFERENCES calibration(id),\n"
    "  fence       INTEGER NOT NULL,         -- of the lease; 0 without one\n"
    "  subject     TEXT REFERENCES subject(id),\n"
    "  site        INTEGER REFERENCES site(id),\n"
    "  corrects    TEXT REFERENCES measurement(id),    -- this row replaces that one\n"
    "  specular    TEXT NOT NULL,            -- of spectrum: sce, sci, unknown\n"
    "  aperture_mm REAL,                     -- of all spectra of the row\n"
    "  first_nm    REAL NOT NULL,            -- grid of all spectra of the row\n"
    "  step_nm     REAL NOT NULL,\n"
    "  bands       INTEGER NOT NULL,\n"
    "  spectrum    BLOB NOT NULL,            -- the mean that was matched, 0..1\n"
    "  surface     REAL,                     -- taken off SCI to get it\n"
    "  replicates  INTEGER NOT NULL,\n"
    "  sce         BLOB,                     -- replicates as measured; NULL: not measured so\n"
    "  sci         BLOB,\n"
    "  band_flags  BLOB,                     -- a byte per band of spectrum, sce, sci; NULL: all "
    "0\n"
    "  raw         BLOB,                     -- the device's integers, little-endian int32\n"
    "  raw_unit    REAL,                     -- reflectance that a raw 1 stands for\n"
    "  X REAL, Y REAL, Z REAL, L REAL, a REAL, b REAL,\n"
    "  red INTEGER NOT NULL, green INTEGER NOT NULL, blue INTEGER NOT NULL,\n"
    "  ITA         REAL,                     -- degrees\n"
    "  ita_scheme  TEXT,\n"
    "  illuminant  TEXT,\n"
    "  observer    TEXT,\n"
    "  flags       TEXT                      -- JSON array of tokens\n"
    ") STRICT;\n"
    "CREATE INDEX measurement_subject ON measurement(subject, seq) WHERE subject IS NOT NULL;\n";

static const char step_1_match[] =
    "CREATE TABLE match(\n"
    "  measurement  INTEGER PRIMARY KEY REFERENCES measurement(seq),\n"
    "  table_name   TEXT,\n"
    "  table_sha256 TEXT,\n"
    "  method       TEXT,                    -- rgb, lab, de2000, spectrum\n"
    "  result       TEXT NOT NULL            -- the match object, JSON\n"
    ") STRICT;\n"

    "CREATE TABLE client_uuid(               -- to know a retry; pruned after 30 days\n"
    "  uuid        TEXT PRIMARY KEY,\n"
    "  parameters_sha256 TEXT NOT NULL,\n"
    "  measurement INTEGER NOT NULL REFERENCES measurement(seq),\n"
    "  at_ms       INTEGER NOT NULL          -- since 1970\n"
    ") STRICT, WITHOUT ROWID;\n"

    "CREATE TABLE audit(                     -- the chain: db/audit.h\n"
    "  id      INTEGER PRIMARY KEY,          -- 1, 2, ...: without a gap\n"
    "  at      TEXT NOT NULL,\n"
    "  who     TEXT,\n"
    "  action  TEXT NOT NULL,\n"
    "  entity  TEXT,                         -- id of what it is about\n"
    "  digests BLOB,                         -- SHA-256 of each row it is about\n"
    "  hash    BLOB NOT NULL                 -- SHA-256 of the hash before and of this row\n"
    ") STRICT;\n"

    "CREATE TABLE sync_peer(\n"
    "  name     TEXT PRIMARY KEY,\n"
    "  last_seq INTEGER NOT NULL             -- the peer has all up to this\n"
    ") STRICT, WITHOUT ROWID;\n";

/* Append-only, also for people with a shell: a correction is a new row. */
static const char step_1_triggers[] =
    "CREATE TRIGGER measurement_kept BEFORE DELETE ON measurement\n"
    "BEGIN SELECT RAISE(ABORT, 'append-only'); END;\n"
    "CREATE TRIGGER measurement_fixed BEFORE UPDATE ON measurement\n"
    "BEGIN SELECT RAISE(ABORT, 'append-only'); END;\n"
    "CREATE TRIGGER match_kept BEFORE DELETE ON match\n"
    "BEGIN SELECT RAISE(ABORT, 'append-only'); END;\n"
    "CREATE TRIGGER match_fixed BEFORE UPDATE ON match\n"
    "BEGIN SELECT RAISE(ABORT, 'append-only'); END;\n"
    "CREATE TRIGGER calibration_kept BEFORE DELETE ON calibration\n"
    "BEGIN SELECT RAISE(ABORT, 'append-only'); END;\n"
    "CREATE TRIGGER calibration_fixed BEFORE UPDATE ON calibration\n"
    "BEGIN SELECT RAISE(ABORT, 'append-only'); END;\n"
    "CREATE TRIGGER audit_kept BEFORE DELETE ON audit\n"
    "BEGIN SELECT RAISE(ABORT, 'append-only'); END;\n"
    "CREATE TRIGGER audit_fixed BEFORE UPDATE ON audit\n"
    "BEGIN SELECT RAISE(ABORT, 'append-only'); END;\n";

/* NULL in the rows there are: their dumps stay as they were. */
static const char step_2_owner[] =
    "PRAGMA user_version = 2;\n"
    "ALTER TABLE measurement ADD COLUMN owner_uid INTEGER;\n" /* account that asked for it */
    "ALTER TABLE calibration ADD COLUMN aperture_mm REAL;\n"  /* that was set */
    "CREATE INDEX measurement_owner ON measurement(owner_uid, seq) WHERE owner_uid IS NOT NULL;\n"
    "CREATE INDEX measurement_fence ON measurement(fence) WHERE fence > 0;\n";

/* What a check tile should look like and its limit, and what instruments saw of it. */
static const char step_3_check[] =
    "PRAGMA user_version = 3;\n"
    "CREATE TABLE check_tile(                -- a reference, a limit; the newest counts\n"
    "  seq         INTEGER PRIMARY KEY,      -- 1, 2, ...: without a gap\n"
    "  id          TEXT NOT NULL UNIQUE,     -- UUIDv7\n"
    "  taken_at    TEXT NOT NULL,\n"
    "  uuid        TEXT NOT NULL UNIQUE,     -- the client's\n"
    "  parameters_sha256 TEXT NOT NULL,\n"
    "  who         TEXT,\n"
    "  tile        TEXT NOT NULL,            -- its name\n"
    "  source      TEXT NOT NULL,            -- certificate, measured, limit\n"
    "  limit_dE00  REAL NOT NULL,            -- of the tile, from here on\n"
    "  aperture_mm REAL,                     -- of the reference; NULL: the limit alone\n"
    "  first_nm    REAL,\n"
    "  step_nm     REAL,\n"
    "  bands       INTEGER,\n"
    "  spectrum    BLOB,                     -- SCE, 0..1\n"
    "  instrument  INTEGER REFERENCES instrument(id),  -- that measured it; NULL: all\n"
    "  calibration TEXT REFERENCES calibration(id),\n"
    "  replicates  INTEGER\n"
    ") STRICT;\n"
    "CREATE INDEX check_tile_newest ON check_tile(tile, seq);\n"

    "CREATE TABLE check_reading(             -- a check of an instrument\n"
    "  seq         INTEGER PRIMARY KEY,      -- 1, 2, ...: without a gap\n"
    "  id          TEXT NOT NULL UNIQUE,     -- UUIDv7\n"
    "  taken_at    TEXT NOT NULL,\n"
    "  uuid        TEXT NOT NULL UNIQUE,     -- the client's\n"
    "  parameters_sha256 TEXT NOT NULL,\n"
    "  operator    TEXT,\n"
    "  instrument  INTEGER NOT NULL REFERENCES instrument(id),\n"
    "  calibration TEXT REFERENCES calibration(id),\n"
    "  fence       INTEGER NOT NULL,         -- of the lease\n"
    "  tile        TEXT NOT NULL,\n"
    "  reference   TEXT NOT NULL REFERENCES check_tile(id),\n"
    "  aperture_mm REAL NOT NULL,\n"
    "  replicates  INTEGER NOT NULL,\n"
    "  first_nm    REAL NOT NULL,\n"
    "  step_nm     REAL NOT NULL,\n"
    "  bands       INTEGER NOT NULL,\n"
    "  spectrum    BLOB NOT NULL,            -- the mean, SCE, 0..1\n"
    "  dE00        REAL NOT NULL,            -- from the reference; D65, 10 degrees\n"
    "  rms         REAL NOT NULL,            -- the same as reflectance, over common bands\n"
    "  limit_dE00  REAL NOT NULL,            -- that held then\n"
    "  passed      INTEGER NOT NULL CHECK (passed IN (0, 1))\n"
    ") STRICT;\n"
    "CREATE INDEX check_reading_newest ON check_reading(instrument, seq);\n";

static const char step_3_triggers[] =
    "CREATE TRIGGER check_tile_kept BEFORE DELETE ON check_tile\n"
    "BEGIN SELECT RAISE(ABORT, 'append-only'); END;\n"
    "CREATE TRIGGER check_tile_fixed BEFORE UPDATE ON check_tile\n"
    "BEGIN SELECT RAISE(ABORT, 'append-only'); END;\n"
    "CREATE TRIGGER check_reading_kept BEFORE DELETE ON check_reading\n"
    "BEGIN SELECT RAISE(ABORT, 'append-only'); END;\n"
    "CREATE TRIGGER check_reading_fixed BEFORE UPDATE ON check_reading\n"
    "BEGIN SELECT RAISE(ABORT, 'append-only'); END;\n";

/* What stands between the rows of the table, beside the nearest row; NULL in the rows there are. */
static const char step_4_refined[] = "PRAGMA user_version = 4;\n"
                                     "ALTER TABLE match ADD COLUMN refined TEXT;\n";

const struct station_step station_steps[] = {
    { 1, { step_1_station, step_1_measurement, step_1_match, step_1_triggers } },
    { 2, { step_2_owner } },
    { 3, { step_3_check, step_3_triggers } },
    { 4, { step_4_refined } },
};
const size_t station_steps_n = sizeof station_steps / sizeof *station_steps;

int station_version(void)
{
    return station_steps[station_steps_n - 1].version;
}

static enum status read_version(sqlite3 *db, int *ret)
{
    sqlite3_stmt *select;
    enum status s = sql_prepare(db, "PRAGMA user_version", &select);
    if (s == STATUS_OK)
        s = sql_status(sqlite3_step(select));
    if (s == STATUS_OK)
        *ret = sqlite3_column_int(select, 0);
    sqlite3_finalize(select);
    return s;
}

/* The SQL and the number it leaves behind, in the transaction that is open. */
static enum status run_step(sqlite3 *db, const struct station_step *step)
{
    int version = 0;
    enum status s = STATUS_OK;
    for (size_t i = 0; i < STATION_STEP_PARTS && step->sql[i] != NULL && s == STATUS_OK; i++)
        s = sql_run(db, step->sql[i]);
    if (s == STATUS_OK)
        s = read_version(db, &version);
    return s == STATUS_OK && version != step->version ? STATUS_DB : s;
}

static enum status take_step(sqlite3 *db, const struct station_step *step)
{
    enum status s = sql_run(db, "BEGIN IMMEDIATE");
    if (s == STATUS_OK)
        s = run_step(db, step);
    if (s == STATUS_OK)
        s = sql_run(db, "COMMIT");
    if (s == STATUS_OK)
        return STATUS_OK;
    log_error("store: cannot bring it to version %d: %s", step->version,
              sqlite3_errcode(db) != SQLITE_OK ? sql_reason(db) : "the step leads elsewhere");
    if (!sqlite3_get_autocommit(db))
        (void)sql_run(db, "ROLLBACK");
    return s;
}

enum status station_migrate(sqlite3 *db, const struct station_step *steps, size_t n)
{
    int version = 0, last = steps[n - 1].version;
    enum status s = read_version(db, &version);
    if (s != STATUS_OK) {
        log_error("store: cannot read its version: %s", sql_reason(db));
        return s;
    }
    if (version > last) {
        log_error("store: written as version %d, this program knows up to %d; use a newer one",
                  version, last);
        return STATUS_VERSION;
    }
    for (size_t i = 0; i < n && s == STATUS_OK; i++)
        if (steps[i].version > version)
            s = take_step(db, &steps[i]);
    return s;
}
