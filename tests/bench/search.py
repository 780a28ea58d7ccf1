"""search.py - the nearest of a million rows, beside nanoflann (Lab) and BallTree (spectra)."""

import os
import re
import statistics
import subprocess
import sys

import environment
import places
from report import heading, row

SIDE = 100  # values an axis: a million rows
TIMES_NANOFLANN, TIMES_BALLTREE = 2, 50
SPECTRA_ROUNDS = 5


def ns_of(output, pattern):
    """Figures by sort of question, near and off, from the lines that match."""
    return {found[1]: [float(x) for x in found.groups()[1:]]
            for found in re.finditer(pattern, output, re.MULTILINE)}  # fmt: skip


def wait_ready(worker):
    for line in worker.stdout:
        if line.strip() == "ready":
            return
    sys.exit("bench: a search ended before it was ready")


def turn(worker):
    """Figures by sort of question from one round: near NS .. off NS .. (ours: many, one by one)"""
    print(file=worker.stdin, flush=True)
    said = {}
    for word in worker.stdout.readline().split():
        if word.isdigit():
            said[list(said)[-1]].append(float(word))
        else:
            said[word] = []
    return said


def show_spectra(program, folder, python):
    """Rounds by turns with BallTree, medians; its best leaf for each sort of question."""
    workers = [
        subprocess.Popen([program, str(SIDE), folder, "turns"], stdin=subprocess.PIPE,
                         stdout=subprocess.PIPE, text=True),  # fmt: skip
        environment.start(python, "balltree.py", folder, "31", "1000"),
    ]
    for worker in workers:
        wait_ready(worker)
    rounds = [[turn(worker) for worker in workers] for _ in range(SPECTRA_ROUNDS)]
    for worker in workers:
        worker.stdin.close()
        worker.wait()
    for sort in rounds[0][0]:
        ours, single = (statistics.median(x) for x in zip(*(r[0][sort] for r in rounds)))
        peers = [statistics.median(leaf) for leaf in zip(*(r[1][sort] for r in rounds))]
        times = min(peers) / ours
        row(f"spectrum, {sort}: ours, all in one call", f"{ours:.0f} ns")
        row(f"spectrum, {sort}: ours, one by one", f"{single:.0f} ns")
        row(f"spectrum, {sort}: BallTree, by leaf size", " ".join(f"{x:.0f}" for x in peers))
        row(f"spectrum, {sort}: times BallTree", f"{times:.1f}", f">= {TIMES_BALLTREE}",
            times >= TIMES_BALLTREE)  # fmt: skip
        row(f"spectrum, {sort}: times BallTree, one by one", f"{min(peers) / single:.1f}")


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
    beside = ns_of(output, r"^lab +(\w+) +k=1 +(\d+) ns +many +(\d+) ns +nanoflann +(\d+) ns")
    for sort, (ours, many, peer) in beside.items():
        row(f"lab, {sort}: times nanoflann", f"{peer / ours:.1f}", f">= {TIMES_NANOFLANN}",
            peer / ours >= TIMES_NANOFLANN)  # fmt: skip
        row(f"lab, {sort}: times nanoflann, all in one call", f"{peer / many:.1f}")
    python = environment.python_with("sklearn")
    if python is None:
        return
    show_spectra(program, folder, python)
