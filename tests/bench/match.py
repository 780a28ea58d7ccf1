"""match.py - one search of the default table by each kind of distance, beside a look at every row; the
program prints what it finds.  MEASURED names files of spectra to be asked for as well."""

import os
import subprocess

import machine
import places
import report
from report import heading


def show():
    heading("the nearest 5 of the default table, one thread: every row, the index")
    program = places.program("match")
    with machine.Others() as others:
        subprocess.run([program, places.TABLE, *os.environ.get("MEASURED", "").split()], check=True)
    report.others(others.percent)
