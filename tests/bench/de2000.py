"""de2000.py - the nearest row by CIEDE2000 beside a look at every row; the program prints what it finds.
`make de2000` has it check answers as well."""

import re
import subprocess

import machine
import places
import report
from report import heading, row

QUERIES = 1000
ROWS, TIMES_EVERY_ROW = 1000000, 300


def show():
    heading("the nearest rows by CIEDE2000, beside every row by vectors, one thread")
    program = places.program("de2000")
    with machine.Others() as others:
        said = subprocess.check_output([program, str(QUERIES), "0"], text=True)
    print(said, end="")
    found = re.search(rf"^ *{ROWS} rows +typical +k 1: .*ratio (\d+)", said, re.MULTILINE)
    times = int(found[1])
    row(f"{ROWS} rows, typical: times every row", f"{times}", f">= {TIMES_EVERY_ROW}",
        times >= TIMES_EVERY_ROW)  # fmt: skip
    report.others(others.percent)
