"""planner.py - what planning adds, and what leaving out saves; the program prints what it finds."""

import subprocess

import machine
import places
import report
from report import heading


def show():
    heading("a spectrum by plan, beside the calls written by hand")
    program = places.program("planner")
    with machine.Others() as others:
        subprocess.run([program, places.TABLE], check=False)  # ends with 1 where a bar is missed
    report.others(others.percent)
