"""station_file.py - whether station.db holds what clients were told, by Python's sqlite3 and
tests/reference/audit_chain.py: no code of the station.

The files are copied first, and the copy is opened: a WAL that a killed station left stays as
it is for the next one.
"""

import contextlib
import json
import os
import re
import shutil
import sqlite3
import struct
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
AUDIT_CHAIN = os.path.join(ROOT, "tests", "reference", "audit_chain.py")


def canonical(value):
    return json.dumps(value, sort_keys=True)


def blob(values):
    """docs/data.md: little-endian float64, band after band."""
    return struct.pack(f"<{len(values)}d", *values)


def person_name(dice):
    """A name that is found wherever its bytes are left."""
    return f"Person-{dice.getrandbits(128):032x}"


class Ledger:
    """What clients were told.  Values are what a row of the file must hold."""

    def __init__(self):
        self.records = {}  # uuid -> {column: value}
        self.calibrations = set()
        self.subjects = {}  # id -> whether its person must be there; None: asked to forget
        self.erased = set()  # names of persons, as person_name() makes them
        self.cancelled = set()  # uuids of which nothing must be stored
        self.unmatched = set()  # taken_at of records told without a match: none must be left here

    def record(self, record):
        """The result of measure.start.  Where there is no match, none must be in the file."""
        L, a, b = record["Lab"]
        if "match" not in record:
            self.unmatched.add(record["taken_at"])
        row = {
            "id": record["id"],
            "seq": record["seq"],
            "taken_at": record["taken_at"],
            "operator": record["operator"],
            "fence": record["fence"],
            "calibration": record["calibration_id"],
            "spectrum": blob(record["spectrum"]["values"]),
            "replicates": len(record["replicates"]),
            "flags": canonical(record["flags"]),
            "result": canonical(record.get("match")),
            **{"L": L, "a": a, "b": b},
        }
        return self._keep(record["uuid"], row)

    def match(self, uuid, spectrum, match):
        """The result of match.spectrum with store; which other rows were near is not kept."""
        told = {name: match[name] for name in match if name not in ("record", "nearest")}
        row = {
            "id": match["record"]["id"],
            "seq": match["record"]["seq"],
            "taken_at": match["record"]["taken_at"],
            "spectrum": blob(spectrum["values"]),
            "result": canonical(told),
        }
        return self._keep(uuid, row)

    def _keep(self, uuid, row):
        """A uuid that was told before must be told the same again.  The row."""
        known = self.records.setdefault(uuid, row)  # at once, whatever other threads do
        if known != row:
            raise AssertionError(f"uuid {uuid} was told {known}, and now {row}")
        return row

    def take(self, other):
        """What the clients of another ledger were told."""
        for name, known in vars(self).items():
            known.update(getattr(other, name))


def check(state, ledger):
    """Hold the file against the ledger; how many (records, audit rows) it has.  AssertionError
    lists what is wrong."""
    with tempfile.TemporaryDirectory(prefix="sk.") as folder:
        copy = os.path.join(folder, "station.db")
        faults = []
        for end in ("", "-wal"):
            with contextlib.suppress(FileNotFoundError):
                shutil.copyfile(os.path.join(state, "station.db" + end), copy + end)
                faults += _erasure_faults(copy + end, ledger.erased)
        with contextlib.closing(sqlite3.connect(copy)) as db:
            faults += _faults(db, ledger)
            records = db.execute("SELECT count(*) FROM measurement").fetchone()[0]
            audit_rows, last = db.execute("SELECT count(*), max(id) FROM audit").fetchone()
        told = _audit_chain(copy)
    if told[:2] != ["rows", str(audit_rows)] or last != audit_rows:
        faults.append(f"{audit_rows} audit rows up to {last}; audit_chain.py: {' '.join(told)}")
    if faults:
        raise AssertionError("station.db: " + "; ".join(faults[:10]))
    return records, audit_rows


def _erasure_faults(path, erased):
    with open(path, "rb") as file:
        names = {x.decode("ascii") for x in re.findall(rb"Person-[0-9a-f]{32}", file.read())}
    if names & erased:
        yield f"{os.path.basename(path)} holds {len(names & erased)} names that were erased"


def _audit_chain(path):
    done = subprocess.run(
        [sys.executable, "-B", AUDIT_CHAIN, path], stdout=subprocess.PIPE, check=True
    )
    return done.stdout.decode("ascii").split()


def _faults(db, ledger):
    for pragma, sound in (("integrity_check", [("ok",)]), ("foreign_key_check", [])):
        found = db.execute(f"PRAGMA {pragma}").fetchall()
        if found != sound:
            yield f"{pragma}: {found[:5]}"
    yield from _order_faults(db)
    yield from _record_faults(db, ledger.records)
    uuids = {row[0] for row in db.execute("SELECT uuid FROM measurement")}
    if uuids & ledger.cancelled:
        yield f"{len(uuids & ledger.cancelled)} cancelled measurements were stored"
    if ledger.unmatched:
        yield f"records were made without a match: {sorted(ledger.unmatched)[:3]}"
    kept = {row[0] for row in db.execute("SELECT id FROM calibration")}
    if not ledger.calibrations <= kept:
        yield f"calibrations are missing: {sorted(ledger.calibrations - kept)[:3]}"
    yield from _subject_faults(db, ledger.subjects)


def _order_faults(db):
    """docs: seq is gap-free from first_seq; ids rise with it; a uuid is there once; a fence never
    comes back."""
    first = db.execute("SELECT first_seq FROM station").fetchone()[0]
    rows = db.execute("SELECT seq, id, uuid FROM measurement ORDER BY seq").fetchall()
    if [seq for seq, _, _ in rows] != list(range(first, first + len(rows))):
        yield "seq has gaps"
    ids = [row_id for _, row_id, _ in rows]
    if ids != sorted(set(ids)):
        yield "ids do not rise with seq"
    uuids = [uuid for _, _, uuid in rows if uuid is not None]
    if len(uuids) != len(set(uuids)):
        yield f"{len(uuids) - len(set(uuids))} uuids are there twice"
    fences = db.execute(
        "SELECT fence FROM measurement WHERE fence > 0 GROUP BY fence"
        " HAVING count(DISTINCT instrument || ' ' || operator) > 1"
    ).fetchall()
    if fences:
        yield f"fences {fences[:3]} were given twice"


def _record_faults(db, told):
    cursor = db.execute(
        "SELECT m.*, match.result FROM measurement AS m LEFT JOIN match ON measurement = seq"
    )
    columns = [column[0] for column in cursor.description]
    found = 0
    for values in cursor:
        row = dict(zip(columns, values))
        expected = told.get(row["uuid"])
        if expected is None:
            continue
        found += 1
        for name in ("flags", "result"):  # NULL: no match was stored
            row[name] = canonical(json.loads(row[name] or "null"))
        wrong = [name for name, value in expected.items() if row[name] != value]
        if wrong:
            yield f"seq {row['seq']}: {', '.join(wrong)} are not as told"
    if found != len(told):
        yield f"{len(told) - found} of {len(told)} acknowledged records are missing"


def _subject_faults(db, told):
    subjects = {row[0] for row in db.execute("SELECT id FROM subject")}
    persons = {row[0] for row in db.execute("SELECT subject FROM subject_person")}
    for subject, has_person in told.items():
        if subject not in subjects:
            yield f"subject {subject} is missing"
        elif has_person is not None and has_person != (subject in persons):
            yield f"the person of subject {subject} is {'missing' if has_person else 'there still'}"
