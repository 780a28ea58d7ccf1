"""queries.py - request lines of match.spectrum for the load, made before it runs.

Skins of the table, each placed, lit and read a little differently, as an instrument gives
them: 31 bands, five decimals.  The same lines every time.
"""

import contextlib
import json
import random
import sqlite3
import struct

LINES = 1024
BASES = 16
_NEW_UUID = "00000000-0000-4000-8000-000000000000"  # load.c counts in its last digits


def _bases(table):
    """Spectra of rows spread over the table."""
    with contextlib.closing(sqlite3.connect(f"file:{table}?mode=ro", uri=True)) as db:
        rows = db.execute("SELECT max(id) FROM entry").fetchone()[0]
        for i in range(BASES):
            row = 1 + (2 * i + 1) * rows // (2 * BASES)
            blob = db.execute("SELECT spectrum FROM entry WHERE id = ?", (row,)).fetchone()[0]
            yield struct.unpack(f"<{len(blob) // 4}f", blob)


def _spectrum(base, chance):
    """Level and tilt differ by 3 %, each band by 0.001."""
    level, tilt = 1 + chance.gauss(0, 0.03), chance.gauss(0, 0.03)
    middle = (len(base) - 1) / 2
    values = (
        value * (level + tilt * (band - middle) / middle) + chance.gauss(0, 0.001)
        for band, value in enumerate(base)
    )
    return [round(min(max(value, 0.0), 1.0), 5) for value in values]


def write(path, table, with_uuid=False):
    """LINES requests that store what they match."""
    chance = random.Random(1)
    bases = list(_bases(table))
    with open(path, "w", encoding="ascii") as file:
        for i in range(LINES):
            params = {
                "spectrum": {
                    "first_nm": 400,
                    "step_nm": 10,
                    "values": _spectrum(bases[i % BASES], chance),
                },
                "specular": "sce",
                "store": True,
            }
            if with_uuid:
                params["uuid"] = _NEW_UUID
            request = {"jsonrpc": "2.0", "id": i, "method": "match.spectrum", "params": params}
            file.write(json.dumps(request, separators=(",", ":")) + "\n")
