"""growth.py - how cost grows: with rows of a table, bands, spectra, cores (growth.c measures)."""

import json
import math
import subprocess

import machine
import places
import report
from report import heading, row


def _exponent(sizes):
    """x of n^x that lies nearest, in logarithms, to what is given as {n: cost}."""
    points = [(math.log(n), math.log(cost)) for n, cost in sizes.items()]
    middle = [sum(x) / len(points) for x in zip(*points)]
    above = sum((x - middle[0]) * (y - middle[1]) for x, y in points)
    return above / sum((x - middle[0]) ** 2 for x, _ in points)


def _measured(program, what):
    """Of each work its sizes, and what growth.c says of each."""
    found = {}
    for line in subprocess.check_output([program, what], text=True).splitlines():
        one = json.loads(line)
        found.setdefault(one["what"], {})[one["n"]] = one
    return found


def _show_sizes(program, what, text):
    heading(text)
    with machine.Others() as others:
        found = _measured(program, what)
    for work, sizes in found.items():
        ns = {n: one["ns"] for n, one in sizes.items()}
        row(work, "", f"grows as n^{_exponent(ns):.2f}" if len(ns) > 1 else "")
        for n, cost in ns.items():
            row(f"  {n}", f"{cost:.0f} ns")
    report.others(others.percent)


def _show_cores(program):
    heading("by cores: seconds by the clock, and of CPU")
    with machine.Others() as others:
        found = _measured(program, "cores")
    for work, sizes in found.items():
        row(work, "")
        for n, one in sizes.items():
            times = sizes[1]["wall_s"] / one["wall_s"]
            row(f"  {n}: {times:.2f} times one", f"{one['wall_s']:.4f} {one['cpu_s']:.4f}")
    report.others(others.percent)


def show():
    program = places.program("growth")
    _show_sizes(program, "rows", "one of so many rows, CPU; indices and rows once, by all cores")
    _show_sizes(program, "bands", "by bands, CPU for one skin")
    _show_sizes(program, "spectra", "by spectra fitted together, CPU for each, one thread")
    _show_cores(program)
