"""run.py - the station's figures, each beside its bar.

    BUILD=build python3 -B tests/bench/run.py [SECTION ...]

Sections are those of SECTIONS below; without a name all of them.  BENCH_DIR is a folder on the disk to measure (in BUILD by
default).  What is missing (redis, pip) is skipped with a message.  Every program runs
alone and in turns with the others, and the median of the rounds counts; still, other work on
the machine shows in the figures: "others" is the share of all cores that it took.
"""

import json
import os
import re
import statistics
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import environment  # noqa: E402
import batch  # noqa: E402
import latency  # noqa: E402
import machine  # noqa: E402
import maps  # noqa: E402
import queries  # noqa: E402
import services  # noqa: E402

ROUNDS = 3
SECONDS = 4
READINGS = 300
STARTS = 10
REST_S = 10
BATCH_ROUNDS, BATCH_ROWS, BATCH_FITS = 5, 200000, 10000
BENCH = os.path.join(services.BUILD, "bench")
DISK = os.environ.get("BENCH_DIR", os.path.join(BENCH, "disk"))
MEMORY = "/dev/shm"
TABLE = os.path.join(services.BUILD, "tables", "table-two-layer.db")

# The bars.
SLOW_DISK_US = 300  # a bare fdatasync from here on: more is to be gained
TIMES_BASELINE_SLOW, TIMES_BASELINE = 10, 4
SHARE_OF_REDIS = 50
ADDED_MS = 2
DRIVER_MS = 2
STATUS_MS, MATCH_MS = 50, 500
MAP_SHARE = 80
IDLE_PERCENT = 0.05  # prints as 0.0
NUMPY_BARS = {
    "half-space": (("f32 tuned", 3), ("f64", 10)),
    "two-layer": (("f32 tuned", 3), ("f32 shared", 3), ("f64", 10)),
}
TWO_CORES, EXECUTEMANY = 1.8, 2
RESIDENT_MB = 40
TWO_CORES = 1.8
TIMES_IADPYTHON = 100


def heading(text):
    print(f"\n{text}", flush=True)


def row(what, value, bar="", met=None):
    verdict = "" if met is None else "met" if met else "MISSED"
    print(f"  {what:<48} {value:>16}  {bar:<10} {verdict}".rstrip(), flush=True)


# ---- the machine --------------------------------------------------------------------------


def show_machine():
    load = " ".join(f"{x:.1f}" for x in os.getloadavg())
    print(f"{machine.processor()}; load {load}")
    for name, folder in (("disk", DISK), ("tmpfs", MEMORY)):
        print(f"{name}: {machine.disk(folder)}")
        for size in (400, 4096):
            took = machine.append_us(folder, size)
            p50, p99 = (machine.quantile(took, percent) for percent in (50, 99))
            row(f"append {size} bytes + fdatasync, median and p99", f"{p50:.1f} {p99:.1f} us")


# ---- answers a second -----------------------------------------------------------------------

COLUMNS = "  {:<12} {:>9} {:>7} {:>7} {:>7} {:>12} {:>12} {:>9}"
HEADINGS = ("", "answers/s", "p50 ms", "p99 ms", "max ms", "CPU us each", "to a commit", "others %")
CELLS = (("per_s", 1, 0), ("p50_us", 1e-3, 1), ("p99_us", 1e-3, 1), ("max_us", 1e-3, 1),
         ("cpu_us", 1, 0), ("group", 1, 1), ("others", 1, 0))  # fmt: skip


def show_rate(name, results):
    """Prints and gives the round with the median rate."""
    result = sorted(results, key=lambda result: result["per_s"])[len(results) // 2]
    cells = [
        f"{result[key] * scale:.{digits}f}" if key in result else "" for key, scale, digits in CELLS
    ]
    print(COLUMNS.format(name, *cells).rstrip(), flush=True)
    return result["per_s"]


def measure(folder, lines, kinds):
    """Median rates by name, one after the other, ROUNDS times; and the median of appends to
    the disk in between, microseconds: a disk that others use changes from minute to minute."""
    results, appends = {kind.name: [] for kind in kinds}, []
    for _ in range(ROUNDS):
        for kind in kinds:
            appends += machine.append_us(folder, 400, 200)
            where = os.path.join(folder, kind.name)
            with machine.Others() as others:
                with kind(where) if kind is services.Redis else kind(where, lines) as service:
                    result = service.rate(SECONDS)
                    service.check()
            results[kind.name].append({**result, "others": others.percent})
    print(COLUMNS.format(*HEADINGS))
    rate = {name: show_rate(name, result) for name, result in results.items()}
    return rate, statistics.median(appends)


def compare(rate, append_us):
    """Each ratio beside its bar."""
    bar = TIMES_BASELINE_SLOW if append_us >= SLOW_DISK_US else TIMES_BASELINE
    row("append 400 bytes + fdatasync in between, median", f"{append_us:.1f} us")
    if "baseline" in rate:
        times = rate["skinspecd"] / rate["baseline"]
        row("times the baseline", f"{times:.1f}", f">= {bar}", times >= bar)
    if "redis" in rate:
        share = 100 * rate["skinspecd"] / rate["redis"]
        row("of redis", f"{share:.0f} %", f">= {SHARE_OF_REDIS} %", share >= SHARE_OF_REDIS)


def show_throughput():
    """match.spectrum, matched and stored."""
    plain, with_uuid = os.path.join(BENCH, "plain"), os.path.join(BENCH, "uuid")
    queries.write(plain, TABLE)
    queries.write(with_uuid, TABLE, with_uuid=True)
    ours = [services.Station] + [services.Baseline] * services.can_run_baseline()
    redis = [services.Redis] * services.can_run_redis()
    with tempfile.TemporaryDirectory(prefix="skinspec-bench.", dir=MEMORY) as memory:
        for what, folder, lines, kinds in (
            ("disk", DISK, plain, ours + redis),
            ("disk, with uuids", DISK, with_uuid, ours),
            ("tmpfs", memory, plain, ours),
        ):
            heading(f"matched and stored, {services.CONNECTIONS} connections, {what}: "
                    f"median of {ROUNDS} times {SECONDS} s")  # fmt: skip
            compare(*measure(folder, lines, kinds))


# ---- latency, start, rest -------------------------------------------------------------------


def show_clients():
    """How the rate grows with connections; each waits for its answer before it asks again."""
    heading("matched and stored on disk, by connections")
    lines = os.path.join(BENCH, "plain")
    queries.write(lines, TABLE)
    print(COLUMNS.format(*HEADINGS))
    with services.Station(os.path.join(DISK, "clients"), lines) as station:
        for connections in (1, 2, 4, 8, 16, 32, 48):
            with machine.Others() as others:
                result = station.rate(SECONDS / 2, connections)
            show_rate(str(connections), [{**result, "others": others.percent}])
        station.check()


def show_latency():
    """What a measurement takes beyond the instrument's own time, against a bare append: of
    ROUNDS the one with the median difference."""
    folder = os.path.join(DISK, "latency")
    for what, instrument, times in (
        ("with an instrument that takes no time", latency.INSTANT, 1000),
        ("less the 20 ms of a shot", latency.WAITING, 300),
    ):
        heading(f"measure.start {what}: {ROUNDS} times {times}, the median round")
        rounds = []
        for _ in range(ROUNDS):
            with machine.Others() as others:
                (first, *added), bare = latency.measuring_us(folder, instrument, times)
            p50, p99, most = (machine.quantile(added, percent) / 1e3 for percent in (50, 99, 100))
            bare_p99 = machine.quantile(bare, 99) / 1e3
            rounds.append((p99 - bare_p99, p50, p99, most, bare_p99, first / 1e3, others.percent))
        more, p50, p99, most, bare_p99, first, others = sorted(rounds)[ROUNDS // 2]
        row("added, commit included, by the first of all", f"{first:.2f} ms")
        row("by the others: median, p99 and most", f"{p50:.2f} {p99:.2f} {most:.2f} ms")
        row("p99 of append 4 KiB + fdatasync in between", f"{bare_p99:.2f} ms")
        row("others took of all cores", f"{others:.0f} %")
        row("p99 added less that", f"{more:.2f} ms", f"<= {ADDED_MS} ms", more <= ADDED_MS)


def show_drivers():
    """What each driver takes beyond the instrument's own time for one reading, against
    simulators in the same program; and such a simulator behind a tty, through the station."""
    heading(f"one reading less the simulator's own time: {ROUNDS} times {READINGS}, the median round")
    with machine.Others() as others:
        rounds = [latency.drivers_us(READINGS) for _ in range(ROUNDS)]
    for same in zip(*rounds):
        found = [(machine.quantile(added, 99) / 1e3, machine.quantile(added, 50) / 1e3,
                  statistics.median(own) / 1e3) for _, added, own in same]  # fmt: skip
        p99, p50, own = sorted(found)[ROUNDS // 2]
        row(f"{same[0][0]}: median and p99", f"{p50:.3f} {p99:.3f} ms", f"<= {DRIVER_MS} ms",
            p99 <= DRIVER_MS)  # fmt: skip
        row("  the simulator's own time, median", f"{own:.3f} ms")
    row("others took of all cores", f"{others.percent:.0f} %")
    heading(f"measure.start with a CM-700d on a mocked tty: {READINGS} times")
    try:
        added, bare = latency.serial_us(os.path.join(DISK, "drivers"), READINGS)
    except unittest.SkipTest as why:
        print(f"bench: not measured: {why}")
        return
    p50, p99 = (machine.quantile(added, percent) / 1e3 for percent in (50, 99))
    row("all of it, commit included: median and p99", f"{p50:.2f} {p99:.2f} ms")
    row("p99 of append 4 KiB + fdatasync in between", f"{machine.quantile(bare, 99) / 1e3:.2f} ms")


def show_start():
    """How soon it is there, and what it takes when nobody asks."""
    folder = os.path.join(DISK, "start")
    spectrum = {"first_nm": 400, "step_nm": 10, "values": [0.2 + 0.01 * i for i in range(31)]}
    status, match = (statistics.median(x) for x in latency.starts_ms(folder, spectrum, STARTS))
    heading(f"from exec, median of {STARTS}")
    row("first status.get answered", f"{status:.1f} ms", f"<= {STATUS_MS} ms", status <= STATUS_MS)
    row("first match.spectrum answered", f"{match:.1f} ms", f"<= {MATCH_MS} ms", match <= MATCH_MS)
    percent, megabytes = latency.rest(folder, spectrum, REST_S)
    heading("after a match, at rest")
    row(f"of one core in {REST_S} s", f"{percent:.2f} %", "0.0 %", percent < IDLE_PERCENT)
    row("resident", f"{megabytes:.1f} MB", f"<= {RESIDENT_MB} MB", megabytes <= RESIDENT_MB)


# ---- inversion ------------------------------------------------------------------------------


def show_inversion():
    """One spectrum to one skin, beside cminpack; the program prints what it finds."""
    heading("one spectrum of 31 bands to one skin, beside cminpack's lmder")
    program = os.path.join(BENCH, "inversion")
    there = subprocess.run(["tools/need", "lib:cminpack=libcminpack-dev"], check=False)
    if there.returncode != 0:
        print("bench: not measured: there is no cminpack (Debian's libcminpack-dev)")
        return
    subprocess.run(["make", "--no-print-directory", f"BUILD={services.BUILD}", program], check=True)
    with machine.Others() as others:
        subprocess.run([program], check=False)  # ends with 1 where a bar is missed, and says so
    row("others took of all cores", f"{others.percent:.0f} %")
    python = environment.python_with(scipy="scipy")
    if python is not None:
        heading("all together, beside scipy's bounded least squares")
        print(environment.run(python, "scipy_inversion.py"), end="")


# ---- transport ------------------------------------------------------------------------------


def show_transport():
    """transport-8 beside its plain twin and, where it can be had, beside iadpython."""
    heading("one wavelength with 8 streams")
    program = os.path.join(BENCH, "transport")
    subprocess.run(["make", "--no-print-directory", f"BUILD={services.BUILD}", program], check=True)
    said = subprocess.run([program], check=True, stdout=subprocess.PIPE, text=True).stdout
    print(said, end="")
    python = environment.python_with(iadpython="iadpython", scipy="scipy")
    if python is None:
        return
    peer_us = float(environment.run(python, "transport_iadpython.py"))
    times = peer_us / float(said.split()[1])
    row("iadpython, one endless layer", f"{peer_us:.0f} us")
    row("times as fast", f"{times:.0f}", f"{TIMES_IADPYTHON}", times >= TIMES_IADPYTHON)


# ---- planner --------------------------------------------------------------------------------


def show_planner():
    """What planning adds, and what leaving out saves; the program prints what it finds."""
    heading("a spectrum by plan, beside the calls written by hand")
    program = os.path.join(BENCH, "planner")
    with machine.Others() as others:
        subprocess.run([program, TABLE], check=False)  # ends with 1 where a bar is missed
    row("others took of all cores", f"{others.percent:.0f} %")


# ---- maps -----------------------------------------------------------------------------------


def show_map():
    """A cube of a million pixels to maps and pictures, beside the same fits in memory on as many
    threads: in turns, the medians of ROUNDS, of wall clock and of CPU."""
    subprocess.run(["make", "--no-print-directory", f"BUILD={services.BUILD}", maps.RATE], check=True)
    cores = len(os.sched_getaffinity(0))
    for model in ("half-space", "two-layer"):
        with tempfile.TemporaryDirectory(prefix="skinspec-bench.", dir=MEMORY) as folder:
            cubes = maps.write(folder, model)
            heading(f"a cube of 1000 x 1000 x 31 to maps of Cm, Bm, Ch, {model}, {cores} threads: "
                    f"median of {ROUNDS}, seconds, and CPU seconds")  # fmt: skip
            reference = cubes["bip", 4, 0]
            took = {name: [] for name in ("in memory", *cubes)}
            with machine.Others() as others:
                for _ in range(ROUNDS):
                    took["in memory"].append(maps.in_memory(reference, model, "three", cores))
                    for layout, cube in cubes.items():
                        took[layout].append(maps.mapped(cube, model, "three", folder + "/out"))
            wall, cpu = (
                {name: statistics.median(x[i] for x in took[name]) for name in took} for i in (0, 1)
            )
            row("in memory", f"{wall['in memory']:.2f} {cpu['in memory']:.2f}")
            for (interleave, kind, order), _ in cubes.items():
                layout = interleave, kind, order
                name = f"{interleave}, {'float32' if kind == 4 else 'uint16'}, byte order {order}"
                row(name, f"{wall[layout]:.2f} {cpu[layout]:.2f}")
            slowest = max(cubes, key=lambda layout: wall[layout])
            share = 100 * wall["in memory"] / wall[slowest]
            row("rate of the slowest, of that in memory", f"{share:.0f} %", f">= {MAP_SHARE} %",
                share >= MAP_SHARE)  # fmt: skip
            row("the same by CPU", f"{100 * cpu['in memory'] / max(cpu[x] for x in cubes):.0f} %")
            row("others took of all cores", f"{others.percent:.0f} %")


# ---- search ---------------------------------------------------------------------------------

SIDE = 100  # values an axis: a million rows
TIMES_NANOFLANN, TIMES_BALLTREE = 2, 50


def ns_of(output, pattern):
    """Figures by sort of question, near and off, from the lines that match."""
    return {found[1]: [float(x) for x in found.groups()[1:]]
            for found in re.finditer(pattern, output, re.MULTILINE)}  # fmt: skip


def show_search():
    """The nearest of a million rows, beside nanoflann (Lab) and BallTree (spectra)."""
    heading(f"the nearest of {SIDE ** 3} rows, one thread, CPU time")
    program, folder = os.path.join(BENCH, "search"), os.path.join(BENCH, "rows")
    need = ["tools/need", "cmd:c++=g++", "file:/usr/include/nanoflann.hpp=libnanoflann-dev"]
    if subprocess.run(need, check=False).returncode != 0:
        print("bench: not measured: there is no nanoflann (Debian's libnanoflann-dev)")
        return
    subprocess.run(["make", "--no-print-directory", f"BUILD={services.BUILD}", program], check=True)
    os.makedirs(folder, exist_ok=True)
    output = subprocess.check_output([program, str(SIDE), folder], text=True)
    print(output, end="")
    beside = ns_of(output, r"^lab +(\w+) +k=1 +(\d+) ns +nanoflann +(\d+) ns")
    for sort, (ours, peer) in beside.items():
        row(f"lab, {sort}: times nanoflann", f"{peer / ours:.1f}", f">= {TIMES_NANOFLANN}",
            peer / ours >= TIMES_NANOFLANN)  # fmt: skip
    python = environment.python_with(sklearn="scikit-learn")
    if python is None:
        return
    peer = ns_of(environment.run(python, "balltree.py", folder, "31", "1000"), r"^(\w+) (\d+)")
    for sort, (ours,) in ns_of(output, r"^spectrum +(\w+) +k=1 +(\d+) ns").items():
        times = peer[sort][0] / ours
        row(f"spectrum, {sort}: BallTree", f"{peer[sort][0]:.0f} ns")
        row(f"spectrum, {sort}: times BallTree", f"{times:.0f}", f">= {TIMES_BALLTREE}",
            times >= TIMES_BALLTREE)  # fmt: skip


# ---- tables ---------------------------------------------------------------------------------


def said_by(program, *arguments):
    """The line of JSON that a program of the bench prints."""
    said = subprocess.run([program, *arguments], check=True, stdout=subprocess.PIPE, text=True)
    return json.loads(said.stdout)


def show_rows(program, model):
    """Rows on one core beside numpy, by turns: the best numpy of each kind, medians."""
    heading(f"rows of {model}: 37 bands -> XYZ -> Lab and sRGB, CPU of one core, {ROUNDS} rounds by turns")
    columns = os.path.join(BENCH, f"columns-{model}.json")
    given = said_by(program, "--columns", model)
    with open(columns, "w", encoding="ascii") as file:
        json.dump(given, file)
    python = environment.python_with(numpy="numpy")
    ours, peers = [], []
    for _ in range(ROUNDS):
        ours.append(said_by(program, "--rows", model))
        if python is not None:
            peers.append(json.loads(environment.run(python, "numpy_tables.py", columns, "3")))
    ns = {kind: statistics.median(round_[kind] for round_ in ours)
          for kind in ("vectors", "without_spectra", "plain")}  # fmt: skip
    row("ns a row, spectra kept; not kept; the plain twin",
        f"{ns['vectors']:.1f} {ns['without_spectra']:.1f} {ns['plain']:.0f}")  # fmt: skip
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
    for _ in range(ROUNDS):
        ours.append(said_by(program, "--file", file, "two-layer", rows))
        n = ours[0]["rows"]
        peers.append(json.loads(environment.run(sys.executable, "executemany_tables.py", file, str(n), "31")))
        os.unlink(file)

    def ns(rounds, name):
        return 1e9 * statistics.median(round_[name] for round_ in rounds) / n

    for what, name in ((f"{n} rows built on one core", "build_one"), ("  on two", "build_two"),
                       ("  read", "read"), ("  read without spectra", "read_without_spectra")):  # fmt: skip
        row(what, f"{ns(ours, name + '_cpu_s'):.0f} {ns(ours, name + '_s'):.0f}")
    row("  executemany(), nothing computed or hashed",
        f"{ns(peers, 'build_cpu_s'):.0f} {ns(peers, 'build_s'):.0f}")  # fmt: skip
    times = ns(peers, "build_cpu_s") / ns(ours, "build_one_cpu_s")
    row("  times as fast (CPU, one core)", f"{times:.1f}", f">= {EXECUTEMANY}", times >= EXECUTEMANY)


def show_tables():
    """Rows and files of tables, beside numpy and Python's executemany()."""
    program = os.path.join(BENCH, "tables")
    subprocess.run(["make", "--no-print-directory", f"BUILD={services.BUILD}", program], check=True)
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
        heading(f"files with spectra of 31 bands on {machine.disk(DISK)}; ns a row: CPU, and as time passes")
        for rows in (1e4, 1e5, 1e6):
            show_file(program, os.path.join(DISK, "table-bench.db"), str(rows))
    row("others took of all cores", f"{others.percent:.0f} %")


# ---- many spectra ---------------------------------------------------------------------------


def show_batch():
    """A file through `skinspec match`, by one thread and by two in turns."""
    folder = os.path.join(DISK, "batch")
    os.makedirs(folder, exist_ok=True)
    (table, lines), (few, _) = batch.write(folder, BATCH_ROWS), batch.write(folder, BATCH_FITS)
    heading(f"match of a file, two threads in turns with one: median of {BATCH_ROUNDS}")
    for what, path, rows, options in (
        ("CSV, nearest by spectrum", table, BATCH_ROWS, ()),
        ("CSV, nearest by lab", table, BATCH_ROWS, ("--by", "lab")),
        ("NDJSON, nearest by spectrum", lines, BATCH_ROWS, ("--ndjson",)),
        ("CSV, --refine", few, BATCH_FITS, ("--refine",)),
    ):
        with machine.Others() as others:
            rate = batch.rates(path, rows, BATCH_ROUNDS, *options)
        one, two = rate[1], rate[2]
        row(f"{what}: one, two", f"{one['per_s']:.0f} {two['per_s']:.0f} /s")
        row("  of a core for each", f"{one['cpu_us']:.2f} {two['cpu_us']:.2f} us")
        row("  memory at its highest", f"{max(one['mib'], two['mib']):.1f} MiB")
        ratio = two["per_s"] / one["per_s"]
        row("  two threads against one", f"{ratio:.2f}", f">= {TWO_CORES}", ratio >= TWO_CORES)
        row("  others took of all cores", f"{others.percent:.0f} %")


SECTIONS = {
    "throughput": show_throughput,
    "clients": show_clients,
    "latency": show_latency,
    "drivers": show_drivers,
    "start": show_start,
    "inversion": show_inversion,
    "batch": show_batch,
    "transport": show_transport,
    "planner": show_planner,
    "map": show_map,
    "search": show_search,
    "tables": show_tables,
}


def main():
    asked = sys.argv[1:] or list(SECTIONS)
    if not set(asked) <= set(SECTIONS):
        sys.exit(f"usage: run.py [{'] ['.join(SECTIONS)}]")
    os.makedirs(BENCH, exist_ok=True)
    os.makedirs(DISK, exist_ok=True)
    show_machine()
    for name in asked:
        SECTIONS[name]()


if __name__ == "__main__":
    main()
