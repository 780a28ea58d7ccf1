"""tables.py - rows and files of tables, beside numpy and Python's executemany()."""

import json
import os
import statistics
import subprocess
import sys

import environment
import machine
import places
import report
from report import heading, row

NUMPY_BARS = {
    "half-space": (("f32 tuned", 3), ("f64", 10)),
    "two-layer": (("f32 tuned", 3), ("f32 shared", 3), ("f64", 10)),
}
TWO_CORES, EXECUTEMANY = 1.8, 2


def said_by(program, *arguments):
    """The line of JSON that a program of the bench prints."""
    said = subprocess.run([program, *arguments], check=True, stdout=subprocess.PIPE, text=True)
    return json.loads(said.stdout)


def show_rows(program, model):
    """Rows on one core beside numpy, by turns: the best numpy of each kind, medians."""
    heading(f"rows of {model}: 37 bands -> XYZ -> Lab and sRGB, CPU of one core, {places.ROUNDS} rounds by turns")
    columns = os.path.join(places.BENCH, f"columns-{model}.json")
    given = said_by(program, "--columns", model)
    with open(columns, "w", encoding="ascii") as file:
        json.dump(given, file)
    python = environment.python_with("numpy")
    ours, peers = [], []
    for _ in range(places.ROUNDS):
        ours.append(said_by(program, "--rows", model))
        if python is not None:
            peers.append(json.loads(environment.run(python, "numpy_tables.py", columns, "3")))
    ns = {kind: statistics.median(round_[kind] for round_ in ours)
          for kind in ("vectors", "without_spectra", "plain")}  # fmt: skip
    row("ns a row, spectra kept; not kept; the plain twin",
        f"{ns['vectors']:.1f} {ns['without_spectra']:.1f} {ns['plain']:.0f}")  # fmt: skip
    opening = statistics.median(round_["opening_us"] for round_ in ours)
    row("opening, us; not kept with opening: 50 400 rows, a million",
        f"{opening:.0f} {ns['without_spectra'] + 1e3 * opening / ours[0]['rows']:.1f} "
        f"{ns['without_spectra'] + 1e-3 * opening:.1f}")  # fmt: skip
    for kind, bar in NUMPY_BARS[model]:
        took = [min(x for name, x in peer["ns_a_row"].items() if name.startswith(kind)) for peer in peers]
        if took:
            times = statistics.median(took) / ns["without_spectra"]
            row(f"numpy {kind}, ns a row", f"{statistics.median(took):.1f}")
            row("  times as fast", f"{times:.1f}", f">= {bar}", times >= bar)
    for peer in peers[:1]:  # the same work: a colour is a colour
        for name, Lab in peer["Lab"].items():
            worst = max(abs(x - y) for x, y in zip(Lab, given["Lab"]))
            if worst > (1e-9 if name.startswith("f64") else 2e-3):
                raise AssertionError(f"{name}: Lab differs by {worst}")


def show_file(program, file, rows):
    """Built and read beside executemany(), by turns; medians."""
    ours, peers = [], []
    sql = subprocess.run([program, "--sql"], check=True, stdout=subprocess.PIPE, text=True).stdout
    for _ in range(places.ROUNDS):
        ours.append(said_by(program, "--file", file, "two-layer", rows))
        n = ours[0]["rows"]
        peers.append(json.loads(environment.run(sys.executable, "executemany_tables.py", file, str(n), "31", sql)))
        os.unlink(file)

    def ns(rounds, name):
        return 1e9 * statistics.median(round_[name] for round_ in rounds) / n

    for what, name in ((f"{n} rows built on one core", "build_one"), ("  on two", "build_two"),
                       ("  read", "read"), ("  read without spectra", "read_without_spectra")):  # fmt: skip
        row(what, f"{ns(ours, name + '_cpu_s'):.0f} {ns(ours, name + '_s'):.0f}")
    row("  executemany(), nothing computed or hashed",
        f"{ns(peers, 'build_cpu_s'):.0f} {ns(peers, 'build_s'):.0f}")  # fmt: skip
    times = ns(peers, "build_cpu_s") / ns(ours, "build_one_cpu_s")
    row("  times as fast (CPU, one core)", f"{times:.2f}", f">= {EXECUTEMANY}", times >= EXECUTEMANY)
    row("  times as fast (by the clock, on two)", f"{ns(peers, 'build_s') / ns(ours, 'build_two_s'):.2f}")


def show():
    program = places.program("tables")
    with machine.Others() as others:
        for model in NUMPY_BARS:
            show_rows(program, model)
            threads = said_by(program, "--threads", model, "1e6")
            row(f"{threads['rows']} rows, two cores beside one", f"{threads['ratio']:.2f}",
                f">= {TWO_CORES}", threads["ratio"] >= TWO_CORES)  # fmt: skip
            row("  CPU of both beside that of one", f"{threads['two_cpu_s'] / threads['one_cpu_s']:.3f}")
        heading("rows in memory by all cores, two-layer of 31 bands: s, ns a row")
        for rows in (1e4, 1e5, 1e6, 1e7):
            took = said_by(program, "--threads", "two-layer", str(rows))
            row(f"{took['rows']} rows", f"{took['two_s']:.4f} {1e9 * took['two_s'] / took['rows']:.0f}")
        heading(f"files of 31 bands on {machine.disk(places.DISK)}; ns a row: CPU, and as time passes")
        for rows in (1e4, 1e5, 1e6):
            show_file(program, os.path.join(places.DISK, "table-bench.db"), str(rows))
    report.others(others.percent)
