"""latency.py - what the station adds to a measurement, beyond the instrument's own time."""

import os
import shutil
import sys

_TESTS = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, os.path.join(_TESTS, "station"))

import machine  # noqa: E402
import report  # noqa: E402
from asking import asked_us, fresh, line  # noqa: E402
from client import new_uuid  # noqa: E402
from daemon import Daemon, wait_for  # noqa: E402
from places import DISK, ROUNDS  # noqa: E402
from report import heading, row  # noqa: E402

ADDED_MS = 2
# No charging, no battery that runs empty, no calibration that runs out.
_TIRELESS = "charge_ms=0,calibrate_ms=0,drain=0,calibration_shots=1000000"
# The address, and the instrument's own time.  The driver waits for a shot by poll(), which
# takes at least as long as asked for.
WAITING = f"simulated:{_TIRELESS},shot_ms=20", 20
INSTANT = f"simulated:{_TIRELESS},speed=instant", 0


def measuring_us(folder, instrument, times, env=None):
    """Of each measure.start: what it took beyond the instrument's own time; and of appends of
    4 KiB to the same disk between them."""
    address, own_ms = instrument
    fresh(folder)
    added, bare = [], []
    with Daemon(instruments=(address,), state=folder, env=env) as daemon:
        daemon.wait_for_table()
        with daemon.client() as client:
            wait_for("it is found", lambda: client.call("instrument.list")["instruments"])
        daemon.wait_for_instrument()
        with daemon.client() as client, machine.Appending(folder, 4096) as appending:
            lease = client.acquire(ttl_ms=600000)["lease"]
            client.calibrate(lease)
            for i in range(times):
                request = line(
                    1000 + i, "measure.start", lease=lease, uuid=new_uuid(),
                    specular="sce", replicates=1, pace="auto",
                )  # fmt: skip
                added.append(asked_us(client, request) - 1e3 * own_ms)
                bare.append(appending.took_us())
            listed = client.call("record.list", limit=1)["records"]
            if client.call("status.get")["last_seq"] != times or len(listed) != 1:
                raise AssertionError("not every measurement was stored")
    shutil.rmtree(folder)
    return added, bare


def show():
    """What a measurement takes beyond the instrument's own time, against a bare append: of
    ROUNDS the one with the median difference."""
    folder = os.path.join(DISK, "latency")
    for what, instrument, times in (
        ("with an instrument that takes no time", INSTANT, 1000),
        ("less the 20 ms of a shot", WAITING, 300),
    ):
        heading(f"measure.start {what}: {ROUNDS} times {times}, the median round")
        rounds = []
        for _ in range(ROUNDS):
            with machine.Others() as others:
                (first, *added), bare = measuring_us(folder, instrument, times)
            p50, p99, most = (machine.quantile(added, percent) / 1e3 for percent in (50, 99, 100))
            bare_p99 = machine.quantile(bare, 99) / 1e3
            rounds.append((p99 - bare_p99, p50, p99, most, bare_p99, first / 1e3, others.percent))
        more, p50, p99, most, bare_p99, first, others = sorted(rounds)[ROUNDS // 2]
        row("added, commit included, by the first of all", f"{first:.2f} ms")
        row("by the others: median, p99 and most", f"{p50:.2f} {p99:.2f} {most:.2f} ms")
        row("p99 of append 4 KiB + fdatasync in between", f"{bare_p99:.2f} ms")
        report.others(others)
        row("p99 added less that", f"{more:.2f} ms", f"<= {ADDED_MS} ms", more <= ADDED_MS)
