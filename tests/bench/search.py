"""search.py - the nearest of a million rows, beside nanoflann (Lab) and BallTree (spectra)."""

import os
import re
import statistics
import subprocess

import environment
import places
from report import heading, row

SIDE = 100  # values an axis: a million rows
TIMES_NANOFLANN, TIMES_BALLTREE = 2, 50


def ns_of(output, pattern):
    """Figures by sort of question, near and off, from the lines that match."""
    return {found[1]: [float(x) for x in found.groups()[1:]]
            for found in re.finditer(pattern, output, re.MULTILINE)}  # fmt: skip


def show():
    heading(f"the nearest of {SIDE ** 3} rows, one thread, CPU time")
    folder = os.path.join(places.BENCH, "rows")
    if not environment.has("nanoflann"):
        print("bench: search not measured: the program that does has nanoflann in it")
        return
    program = places.program("search")
    os.makedirs(folder, exist_ok=True)
    output = subprocess.check_output([program, str(SIDE), folder], text=True)
    print(output, end="")
    beside = ns_of(output, r"^lab +(\w+) +k=1 +(\d+) ns +nanoflann +(\d+) ns")
    for sort, (ours, peer) in beside.items():
        row(f"lab, {sort}: times nanoflann", f"{peer / ours:.1f}", f">= {TIMES_NANOFLANN}",
            peer / ours >= TIMES_NANOFLANN)  # fmt: skip
    python = environment.python_with("sklearn")
    if python is None:
        return
    peer = ns_of(environment.run(python, "balltree.py", folder, "31", "1000"), r"^(\w+) (\d+)")
    again = subprocess.check_output([program, str(SIDE)], text=True, env={**os.environ, "NO_PEER": "1"})
    for sort in peer:  # ours before the peer and after it
        ours = statistics.mean(ns_of(x, r"^spectrum +(\w+) +k=1 +(\d+) ns")[sort][0] for x in (output, again))
        times = peer[sort][0] / ours
        row(f"spectrum, {sort}: ours, BallTree", f"{ours:.0f} {peer[sort][0]:.0f} ns")
        row(f"spectrum, {sort}: times BallTree", f"{times:.1f}", f">= {TIMES_BALLTREE}",
            times >= TIMES_BALLTREE)  # fmt: skip
