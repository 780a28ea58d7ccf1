#!/usr/bin/env python3
"""seeds_captures.py - what instruments sent, out of captures, as seeds for a fuzzer.

   tests/fuzz/seeds_captures.py FOLDER CAPTURE...

Of each capture FOLDER gets the bytes that came on a serial line, 0xfe for a silence.
"""
import os
import re
import sys

ESCAPES = {b"r": b"\r", b"n": b"\n", b"\\": b"\\"}


def received(path):
    """The bytes of all lines `<`."""
    out = []
    for line in open(path, "rb"):
        match = re.match(rb"[0-9.]+ ([<~]) 00 ?(.*)\n$", line)
        if match is None:
            continue
        if match.group(1) == b"~":
            out.append(b"\xfe")
            continue
        out.append(re.sub(rb"\\(x[0-9A-Fa-f]{2}|.)",
                          lambda m: ESCAPES.get(m.group(1)) or bytes([int(m.group(1)[1:], 16)]),
                          match.group(2)))
    return b"".join(out)


def main():
    folder = sys.argv[1]
    os.makedirs(folder, exist_ok=True)
    for path in sys.argv[2:]:
        with open(os.path.join(folder, os.path.basename(path)), "wb") as seed:
            seed.write(received(path))


main()
