"""executemany_tables.py - a table file as one would write it in Python: seconds.

    python3 executemany_tables.py FILE ROWS BANDS

The schema and the settings of db/table_build.c, one transaction, rows that are there already: tuples of an
id, nine numbers and a blob of float32.  Nothing is computed, hashed or synced meanwhile, which favours it.
Prints a line of JSON.
"""

import array
import json
import os
import random
import sqlite3
import sys
import time

SCHEMA = """CREATE TABLE entry(id INTEGER PRIMARY KEY, cm REAL NOT NULL, bm REAL NOT NULL, ch REAL NOT NULL,
    l REAL NOT NULL, a REAL NOT NULL, b REAL NOT NULL, r REAL NOT NULL, g REAL NOT NULL, b_ REAL NOT NULL,
    spectrum BLOB)"""


def main():
    path, rows, bands = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    draw = random.Random(1).random
    some = [(*(draw() for _ in range(9)), array.array("f", (draw() for _ in range(bands))).tobytes())
            for _ in range(1000)]  # fmt: skip
    values = [(i + 1, *some[i % 1000]) for i in range(rows)]
    if os.path.exists(path):
        os.unlink(path)
    begun, cpu = time.perf_counter(), time.process_time()
    db = sqlite3.connect(path, isolation_level=None)
    db.execute("PRAGMA journal_mode = OFF")
    db.execute("PRAGMA synchronous = OFF")
    db.execute(SCHEMA)
    db.execute("BEGIN")
    db.executemany("INSERT INTO entry VALUES (?,?,?,?,?,?,?,?,?,?,?)", values)
    db.execute("COMMIT")
    db.close()
    took = {"build_s": time.perf_counter() - begun, "build_cpu_s": time.process_time() - cpu}
    print(json.dumps({"rows": rows, **took}))


if __name__ == "__main__":
    main()
