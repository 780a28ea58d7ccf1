#!/usr/bin/env python3
"""soak.py - many clients at a time for a while: they measure, match, store, read, listen, come and
go, and send garbage.

    BUILD=build/asan python3 tests/soak/soak.py [SECONDS [SEED]]

What it is for is a station built with a sanitizer.  Fails on any report of one, on an answer that
is wrong or missing (soak_visitor.py), on an end that is late or not clean while all still
ask, and where station.db does not hold what was told (station_file.py).
"""

import collections
import multiprocessing
import os
import random
import re
import signal
import subprocess
import sys
import time

_HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [_HERE, os.path.join(os.path.dirname(_HERE), "station")]

import station_file  # noqa: E402
from daemon import Daemon  # noqa: E402
from soak_visitor import ACTS, END, FINISH, PATIENCE_S, Connection, Visitor  # noqa: E402

SECONDS = 60
PROCESSES, VISITORS = 4, 8
INSTRUMENTS = 4
# Calibrations fall due under way; the battery lasts.
INSTRUMENT = (
    "simulated:serial=SOAK-{0},seed={0},shot_ms=3,charge_ms=0,calibrate_ms=3,drain=0,"
    "calibration_shots=200"
)
VERIFY_EVERY_S = 10
STOP_S = 20  # docs say 2; a sanitizer and 32 clients take their time
REPORTS = re.compile(r"AddressSanitizer|LeakSanitizer|ThreadSanitizer|runtime error:")
SANITIZERS = {
    "ASAN_OPTIONS": "detect_leaks=1:exitcode=97",
    "UBSAN_OPTIONS": "print_stacktrace=1",
    "TSAN_OPTIONS": "second_deadlock_stack=1:exitcode=98",
}


class Crowd:
    """A process of VISITORS clients."""

    def __init__(self, number, path, instruments, seed):
        self.order = multiprocessing.Value("b", 0, lock=False)
        self.pipe, theirs = multiprocessing.Pipe(duplex=False)
        self.process = multiprocessing.Process(
            target=self.work, args=(number, path, instruments, seed, theirs), daemon=True
        )
        self.process.start()

    def work(self, number, path, instruments, seed, pipe):
        """The pipe gets (faults, tally, ledger, the longest wait) when all have gone."""
        visitors = [
            Visitor(path, instruments, seed, f"visitor {number}.{i}", lambda: self.order.value)
            for i in range(VISITORS)
        ]
        for visitor in visitors:
            visitor.start()
        faults, tally, ledger = [], collections.Counter(), station_file.Ledger()
        for visitor in visitors:
            visitor.join()  # it waits for nothing longer than PATIENCE_S
            faults += [visitor.fault] if visitor.fault else []
            tally.update(visitor.tally)
            ledger.take(visitor.ledger)
        pipe.send((faults, tally, ledger, Connection.longest_s))

    def tell(self, order):
        self.order.value = order

    def told(self):
        """What work() sends."""
        if not self.pipe.poll(2 * PATIENCE_S):
            raise AssertionError("a process of clients says nothing")
        told = self.pipe.recv()
        self.process.join()
        return told


def verify(client):
    told = client.call("store.verify")
    if not told["sound"]:
        raise AssertionError(f"store.verify: {told}")


def watch(daemon, client, crowds, seconds):
    """Let them work, and look at the store now and then; sooner done where a visitor fails."""
    until = time.monotonic() + seconds
    while time.monotonic() < until and not any(crowd.pipe.poll() for crowd in crowds):
        time.sleep(min(VERIFY_EVERY_S, max(until - time.monotonic(), 0)))
        verify(client)
        if daemon.process.poll() is not None:
            raise AssertionError(f"skinspecd ended by itself: {daemon.log()[-5000:]}")


def end(daemon):
    """SIGTERM; how long it took."""
    begun = time.monotonic()
    daemon.process.send_signal(signal.SIGTERM)
    try:
        status = daemon.process.wait(STOP_S)
    except subprocess.TimeoutExpired:
        raise AssertionError(f"no end within {STOP_S} s of SIGTERM: {daemon.log()}") from None
    log = daemon.log()
    reports = REPORTS.search(log)
    if status != 0 or reports:
        start = max(reports.start() - 200, 0) if reports else -5000
        raise AssertionError(f"ended with {status}: {log[start:][:20000]}")
    return time.monotonic() - begun


def soak(seconds, seed):
    """AssertionError where anything is wrong; else what there was, as text."""
    instruments = [INSTRUMENT.format(i) for i in range(INSTRUMENTS)]
    names = ["simulated"] + [f"simulated-{i + 1}" for i in range(1, INSTRUMENTS)]
    with Daemon(instruments=instruments, env=SANITIZERS) as daemon:
        daemon.wait_for_table()
        daemon.wait_for_instrument()
        crowds = [Crowd(i, daemon.socket, names, seed) for i in range(PROCESSES)]
        with daemon.client(timeout_s=PATIENCE_S) as client:
            watch(daemon, client, crowds, seconds)
        some, others = crowds[: PROCESSES // 2], crowds[PROCESSES // 2 :]
        for crowd in some:  # nobody of these is left without an answer
            crowd.tell(FINISH)
        told = [crowd.told() for crowd in some]
        for crowd in others:  # these are at work when it ends
            crowd.tell(END)
        stop_s = end(daemon)
        told += [crowd.told() for crowd in others]
        return report(daemon, told, stop_s)


def report(daemon, told, stop_s):
    tally, ledger = collections.Counter(), station_file.Ledger()
    faults = [fault for crowd in told for fault in crowd[0]]
    if faults:
        raise AssertionError(f"{len(faults)} visitors failed; {faults[0]}")
    for crowd in told:
        tally.update(crowd[1])
        ledger.take(crowd[2])
    missing = [act.__name__ for act in ACTS if not tally[act.__name__]]
    if missing:
        raise AssertionError(f"nobody came to: {', '.join(missing)}")
    found = station_file.check(daemon.state, ledger)
    return "\n".join(
        (
            ", ".join(f"{name} {n}" for name, n in sorted(tally.items())),
            f"told of {len(ledger.records)} records; station.db has {found[0]}, and {found[1]} "
            f"audit rows; the longest wait was {max(crowd[3] for crowd in told):.2f} s, the end "
            f"took {stop_s:.2f} s",
        )
    )


def main():
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else SECONDS
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else random.randrange(1 << 32)
    print(f"seed {seed}", flush=True)
    print(soak(seconds, seed))


if __name__ == "__main__":
    main()
