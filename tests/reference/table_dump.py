#!/usr/bin/env python3
"""Both hashes of a table file, by what docs and db/table_hash.h say of them and
nothing else: sqlite3, struct and hashlib of Python's own library.

    python3 tests/reference/table_dump.py [--pages] FILE

prints "content HEX", "pages HEX" as computed and "written HEX HEX" as the file has
them; with --pages the latter two of any file that holds the key and digits.
Ends with 3 where Python has no sqlite3 module, 1 where the file has no hash.
"""
import hashlib
import re
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


# NIST's GCM specification, test case 1: the key and the nonce are zeros.
H = 0x66E94BD4EF8A2C3B884CFA59CA342B2E
MASK = 0x58E2FCCEFA7E3061367F1D57A4E7455A
PIECE = 1 << 20


def times_h():
    """H by each value of each byte of a block; the highest bit is x^0 (SP 800-38D, 6.3)."""
    power = [H]
    while len(power) < 128:
        last = power[-1]
        power.append(last >> 1 ^ (0xE1 << 120 if last & 1 else 0))
    tables = []
    for byte in range(16):
        table = [0] * 256
        for value in range(256):
            for bit in range(8):
                if value >> (7 - bit) & 1:
                    table[value] ^= power[8 * byte + bit]
        tables.append(table)
    return tables


TIMES_H = times_h()


def gmac(data):
    """The tag of data that is authenticated and not encrypted (SP 800-38D, 6.4 and 7.1)."""
    y = 0
    padded = data + bytes(-len(data) % 16) + struct.pack(">QQ", 8 * len(data), 0)
    for at in range(0, len(padded), 16):
        y ^= int.from_bytes(padded[at:at + 16], "big")
        product = 0
        for table, byte in zip(TIMES_H, y.to_bytes(16, "big")):
            product ^= table[byte]
        y = product
    return (y ^ MASK).to_bytes(16, "big")


def pages_sha256(path):
    """The tags of the file's pieces, its own digits as '0'; and the digits."""
    with open(path, "rb") as file:
        data = file.read()
    place = re.search(b"pages_sha256([0-9a-f]{64})", data)
    if place is None:
        sys.exit("the file has no hash of its pages")
    data = data[:place.start(1)] + b"0" * 64 + data[place.end(1):]
    tags = b"".join(gmac(data[at:at + PIECE]) for at in range(0, len(data), PIECE))
    return hashlib.sha256(tags).hexdigest(), place[1].decode()


def main():
    if sys.argv[1] == "--pages":
        print("pages {} written {}".format(*pages_sha256(sys.argv[2])))
        return
    path = sys.argv[1]
    db = sqlite3.connect(f"file:{urllib.parse.quote(path)}?mode=ro", uri=True)
    meta = dict(db.execute("SELECT key, value FROM meta WHERE key LIKE '%_sha256'"))
    if set(meta) != {"content_sha256", "pages_sha256"}:
        sys.exit("the file has no hashes")
    pages, written = pages_sha256(path)
    if written != meta["pages_sha256"]:
        sys.exit("the hash of the pages stands elsewhere as well")
    print("content", content_sha256(db))
    print("pages", pages)
    print("written", meta["content_sha256"], written)


if __name__ == "__main__":
    main()
