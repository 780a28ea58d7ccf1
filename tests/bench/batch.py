"""batch.py - spectra a second of `skinspec match` over a file: one core and two, CSV and NDJSON."""

import json
import math
import os
import random
import select
import statistics
import subprocess
import time

import machine
import report
from places import BUILD, DISK
from report import heading, row

PROGRAM = os.path.join(BUILD, "skinspec")
TABLES = os.path.join(BUILD, "tables")
NM = range(400, 701, 10)
ROUNDS, ROWS, FITS = 5, 200000, 10000
TWO_CORES = 1.8


def _skin(dice):
    """Somewhat like skin: a rise to the red, haemoglobin's dips."""
    level, rise = dice.uniform(0.02, 0.3), dice.uniform(0.0, 0.4)
    dip, place = dice.uniform(0.0, 0.4), dice.uniform(0.45, 0.7)
    values = []
    for nm in NM:
        R = level + rise / (1 + math.exp(-12 * ((nm - 400) / 300 - place)))
        for centre, width in ((420, 20), (542, 12), (576, 9)):
            R *= 1 - dip * math.exp(-(((nm - centre) / width) ** 2))
        values.append(round(R * dice.uniform(0.99, 1.01), 6))
    return values


def write(folder, rows):
    """spectra.csv and spectra.ndjson of so many rows; their paths."""
    dice = random.Random(71)
    some = [_skin(dice) for _ in range(2000)]
    paths = [os.path.join(folder, f"spectra-{rows}.{kind}") for kind in ("csv", "ndjson")]
    with open(paths[0], "w", encoding="ascii") as table, open(paths[1], "w", encoding="ascii") as lines:
        table.write("id,specular," + ",".join(map(str, NM)) + "\n")
        for i in range(rows):
            values = some[i % len(some)]
            spectrum = {"first_nm": 400, "step_nm": 10, "values": values}
            table.write(f"s{i},sce," + ",".join(map(repr, values)) + "\n")
            line = {"id": f"s{i}", "specular": "sce", "spectrum": spectrum}
            lines.write(json.dumps(line, separators=(",", ":")) + "\n")
    return paths


def _peak_kib(child):
    """Memory at its highest, looked at every 20 ms until the very moment the program ends."""
    peak, ended = 0, select.poll()
    pidfd = os.pidfd_open(child.pid)
    ended.register(pidfd, select.POLLIN)
    while not ended.poll(20):
        with open(f"/proc/{child.pid}/status", encoding="ascii") as status:
            peak = max([peak] + [int(x.split()[1]) for x in status if x.startswith("VmHWM")])
    os.close(pidfd)
    return peak


def run(path, threads, *options):
    """Seconds on the clock, seconds of all cores, and memory at its highest, MiB."""
    begun, own = time.perf_counter(), os.times()
    command = [PROGRAM, "match", path, "--tables", TABLES, "--threads", str(threads), *options]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as child:
        peak = _peak_kib(child)
        took = time.perf_counter() - begun
    if child.returncode != 0:
        raise RuntimeError(f"{' '.join(command)} ended with {child.returncode}")
    now = os.times()
    cores = now.children_user + now.children_system - own.children_user - own.children_system
    return took, cores, peak / 1024


def rates(path, rows, rounds, *options):
    """By one thread and by two, in turns: spectra a second (median), microseconds of a core for each,
    and memory."""
    found = {1: [], 2: []}
    for _ in range(rounds):
        for threads, runs in found.items():
            runs.append(run(path, threads, *options))
    return {
        threads: {
            "per_s": rows / statistics.median(x[0] for x in runs),
            "cpu_us": 1e6 * statistics.median(x[1] for x in runs) / rows,
            "mib": max(x[2] for x in runs),
        }
        for threads, runs in found.items()
    }


def show():
    """A file through `skinspec match`, by one thread and by two in turns."""
    folder = os.path.join(DISK, "batch")
    os.makedirs(folder, exist_ok=True)
    (table, lines), (few, _) = write(folder, ROWS), write(folder, FITS)
    heading(f"match of a file, two threads in turns with one: median of {ROUNDS}")
    for what, path, rows, options in (
        ("CSV, nearest by spectrum", table, ROWS, ()),
        ("CSV, nearest by lab", table, ROWS, ("--by", "lab")),
        ("NDJSON, nearest by spectrum", lines, ROWS, ("--ndjson",)),
        ("CSV, --refine", few, FITS, ("--refine",)),
    ):
        with machine.Others() as others:
            rate = rates(path, rows, ROUNDS, *options)
        one, two = rate[1], rate[2]
        row(f"{what}: one, two", f"{one['per_s']:.0f} {two['per_s']:.0f} /s")
        row("  of a core for each", f"{one['cpu_us']:.2f} {two['cpu_us']:.2f} us")
        row("  memory at its highest", f"{max(one['mib'], two['mib']):.1f} MiB")
        ratio = two["per_s"] / one["per_s"]
        row("  two threads against one", f"{ratio:.2f}", f">= {TWO_CORES}", ratio >= TWO_CORES)
        report.others(others.percent)
