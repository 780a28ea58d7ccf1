#!/usr/bin/env python3
"""Both hashes of a table file, by what docs and db/table_hash.h say of them and
nothing else: sqlite3, struct and hashlib of Python's own library.

    python3 tests/reference/table_dump.py FILE

prints "content HEX", "pages HEX" as computed and "written HEX HEX" as the file has
them.  Ends with 3 where Python has no sqlite3 module, 1 where the file has no hash.
"""
import hashlib
import struct
import sys
import urllib.parse

try:
    import sqlite3
except ImportError:
    sys.exit(3)


def content_sha256(db):
    """meta as "key=value\\n" by key without the hashes, "\\n", then rows, little-endian."""
    sha = hashlib.sha256()
    for key, value in sorted(db.execute("SELECT key, value FROM meta")):
        if key not in ("content_sha256", "pages_sha256"):
            sha.update(f"{key}={value}\n".encode("utf-8"))
    sha.update(b"\n")
    for row in db.execute("SELECT id, cm, bm, ch, l, a, b, r, g, b_, spectrum"
                          " FROM entry ORDER BY id"):
        sha.update(struct.pack("<Q9d", *row[:10]))
        if row[10] is not None:
            bands = struct.unpack(f"<{len(row[10]) // 4}f", row[10])
            sha.update(struct.pack(f"<{len(bands)}f", *bands))
    return sha.hexdigest()


def pages_sha256(path, written):
    """The file's bytes with the hash's own digits as '0'."""
    with open(path, "rb") as file:
        data = file.read()
    if data.count(written.encode()) != 1:
        sys.exit("the hash of the pages is not in the file just once")
    return hashlib.sha256(data.replace(written.encode(), b"0" * 64)).hexdigest()


def main():
    path = sys.argv[1]
    db = sqlite3.connect(f"file:{urllib.parse.quote(path)}?mode=ro", uri=True)
    meta = dict(db.execute("SELECT key, value FROM meta WHERE key LIKE '%_sha256'"))
    if set(meta) != {"content_sha256", "pages_sha256"}:
        sys.exit("the file has no hashes")
    print("content", content_sha256(db))
    print("pages", pages_sha256(path, meta["pages_sha256"]))
    print("written", meta["content_sha256"], meta["pages_sha256"])


if __name__ == "__main__":
    main()
