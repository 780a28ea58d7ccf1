#!/usr/bin/env python3
"""The audit chain of a station file, by what docs and db/audit.h say of it and nothing
else: sqlite3, struct and hashlib of Python's own library.

    python3 tests/reference/audit_chain.py FILE

prints "rows N", "last HEX" as recomputed, or "wrong ID" for the first audit row whose
hash or digests differ.  Ends with 3 where Python has no sqlite3 module.
"""
import hashlib
import struct
import sys
import urllib.parse

try:
    import sqlite3
except ImportError:
    sys.exit(3)

# What an action is about, and how the rows are found from the entity.
ABOUT = {
    "station.make": [("station", "id = ?")],
    "subject.add": [("subject", "id = ?")],
    "site.add": [("site", "id = CAST(? AS INTEGER)")],
    "instrument.add": [("instrument", "id = CAST(? AS INTEGER)")],
    "calibration.add": [("calibration", "id = ?")],
    "check_tile.add": [("check_tile", "id = ?")],
    "check.add": [("check_reading", "id = ?")],
    "measurement.add": [
        ("measurement", "id = ?"),
        ("match", "measurement = (SELECT seq FROM measurement WHERE id = ?)"),
    ],
}


def dump(table, columns, row):
    """TABLE "\\n", then NAME "=" TYPE LENGTH ":" BYTES "\\n" for each that is not NULL."""
    out = table.encode() + b"\n"
    for name, value in zip(columns, row):
        if value is None:
            continue
        if isinstance(value, int):
            kind, data = "i", str(value).encode()
        elif isinstance(value, float):
            kind, data = "f", struct.pack(">d", value).hex().encode()
        elif isinstance(value, bytes):
            kind, data = "b", value
        else:
            kind, data = "t", value.encode("utf-8")
        out += f"{name}={kind}{len(data)}:".encode() + data + b"\n"
    return out


def digests(db, action, entity):
    """SHA-256 of each row the action is about."""
    out = b""
    for table, where in ABOUT.get(action, []):
        cursor = db.execute(f"SELECT * FROM {table} WHERE {where}", (entity,))
        columns = [c[0] for c in cursor.description]
        for row in cursor:
            out += hashlib.sha256(dump(table, columns, row)).digest()
    return out


def main():
    db = sqlite3.connect(f"file:{urllib.parse.quote(sys.argv[1])}?mode=ro", uri=True)
    cursor = db.execute("SELECT * FROM audit ORDER BY id")
    columns = [c[0] for c in cursor.description]
    last, rows = bytes(32), 0
    for row in cursor.fetchall():
        audit = dict(zip(columns, row))
        covered = dump("audit", columns[:-1], row[:-1])
        last = hashlib.sha256(last + covered).digest()
        rows += 1
        about = digests(db, audit["action"], audit["entity"])
        if audit["id"] != rows or last != audit["hash"] or about != (audit["digests"] or b""):
            print("wrong", rows)
            return
    print("rows", rows)
    print("last", last.hex())


if __name__ == "__main__":
    main()
