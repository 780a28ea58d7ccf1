"""drivers.py - what the drivers take for a reading beyond the instrument's own time."""

import json
import os
import statistics
import subprocess
import sys
import unittest

_TESTS = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, os.path.join(_TESTS, "station"))

import latency  # noqa: E402
import machine  # noqa: E402
import report  # noqa: E402
from places import BENCH, DISK, ROUNDS  # noqa: E402
from report import heading, row  # noqa: E402
from simhost import Simhost  # noqa: E402

READINGS = 300
DRIVER_MS = 2
# Behind a tty of simhost, where somebody places what a calibration wants.
SERIAL = "km_ascii:/dev/ttyACM0", 0
SERIAL_OPTIONS = "delays=0,operator=1"


def drivers_us(times):
    """Of each driver's simulators: a name, what the driver took for each reading beyond the
    simulator's own time, and that time.  tests/bench/drivers.c says how."""
    program = os.path.join(BENCH, "drivers")
    done = subprocess.run(
        [program, str(times)], check=True, stdout=subprocess.PIPE, text=True, timeout=60
    )
    found = [json.loads(line) for line in done.stdout.splitlines()]
    return [(one["name"], one["added_us"], one["instrument_us"]) for one in found]


def serial_us(folder, times):
    """measuring_us() of a simulated CM-700d that takes no time, on a mocked tty."""
    with Simhost() as host:
        host.say(f"plug cm700d one ttyACM0 {SERIAL_OPTIONS}")
        return latency.measuring_us(folder, SERIAL, times, env=host.mocked)


def show():
    """What each driver takes beyond the instrument's own time for one reading, against
    simulators in the same program; and such a simulator behind a tty, through the station."""
    heading(f"one reading less the simulator's own time: {ROUNDS} times {READINGS}, the median round")
    with machine.Others() as others:
        rounds = [drivers_us(READINGS) for _ in range(ROUNDS)]
    for same in zip(*rounds):
        found = [(machine.quantile(added, 99) / 1e3, machine.quantile(added, 50) / 1e3,
                  statistics.median(own) / 1e3) for _, added, own in same]  # fmt: skip
        p99, p50, own = sorted(found)[ROUNDS // 2]
        row(f"{same[0][0]}: median and p99", f"{p50:.3f} {p99:.3f} ms", f"<= {DRIVER_MS} ms",
            p99 <= DRIVER_MS)  # fmt: skip
        row("  the simulator's own time, median", f"{own:.3f} ms")
    report.others(others.percent)
    heading(f"measure.start with a CM-700d on a mocked tty: {READINGS} times")
    try:
        added, bare = serial_us(os.path.join(DISK, "drivers"), READINGS)
    except unittest.SkipTest as why:
        print(f"bench: not measured: {why}")
        return
    p50, p99 = (machine.quantile(added, percent) / 1e3 for percent in (50, 99))
    row("all of it, commit included: median and p99", f"{p50:.2f} {p99:.2f} ms")
    row("p99 of append 4 KiB + fdatasync in between", f"{machine.quantile(bare, 99) / 1e3:.2f} ms")
