"""executemany_tables.py - a table file as one would write it in Python: seconds.

    python3 executemany_tables.py FILE ROWS BANDS SQL

SQL is the settings and the schema of db/table_schema.c; one transaction; rows that are there already: tuples
of nine numbers and a blob of float32, which SQLite numbers, as it does for ours (given ids it takes 7 %
longer).  Nothing is computed, hashed or synced meanwhile, which favours it.  Prints a line of JSON.
"""

import array
import json
import os
import random
import sqlite3
import sys
import time

INSERT = "INSERT INTO entry(cm, bm, ch, l, a, b, r, g, b_, spectrum) VALUES (?,?,?,?,?,?,?,?,?,?)"


def main():
    path, rows, bands, sql = sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), sys.argv[4]
    draw = random.Random(1).random
    some = [(*(draw() for _ in range(9)), array.array("f", (draw() for _ in range(bands))).tobytes())
            for _ in range(1000)]  # fmt: skip
    values = [(*some[i % 1000],) for i in range(rows)]
    if os.path.exists(path):
        os.unlink(path)
    begun, cpu = time.perf_counter(), time.process_time()
    db = sqlite3.connect(path, isolation_level=None)
    db.executescript(sql)
    db.execute("BEGIN")
    db.executemany(INSERT, values)
    db.execute("COMMIT")
    db.close()
    took = {"build_s": time.perf_counter() - begun, "build_cpu_s": time.process_time() - cpu}
    print(json.dumps({"rows": rows, **took}))


if __name__ == "__main__":
    main()
