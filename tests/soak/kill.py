#!/usr/bin/env python3
"""kill.py - the station killed at random moments while four clients measure and match, again
and again: what it acknowledged is there, once, and a retry is never a second record.

    BUILD=build python3 tests/soak/kill.py [ROUNDS [SEED]]

The clients are in kill_clients.py.  The seed settles what they ask and when a kill is due;
threads and disks do the rest.
"""

import collections
import os
import random
import signal
import sys
import time

_HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [_HERE, os.path.join(os.path.dirname(_HERE), "station")]

import station_file  # noqa: E402
from daemon import Daemon  # noqa: E402
from kill_clients import PATIENCE_S, Asker  # noqa: E402

ROUNDS = 500
CLIENTS = 4
CHECK_EVERY = 20
MAKING = 5  # the first rounds, in which station.db is made
# Shots and calibrations take a moment, so that kills can fall into them.
INSTRUMENT = "simulated:serial=KILL-{0},seed={0},shot_ms=4,charge_ms=0,calibrate_ms=4,drain=0"
TIMER_S = 4.9  # from the start to just before the first checkpoint by the clock


def clock_text():
    """Now, as records tell the time."""
    now = time.time()
    whole = time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime(now))
    return f"{whole}.{int(now * 1000) % 1000:03d}Z"


class Killing:
    """One state folder, CLIENTS clients, and many short lives of the station."""

    def __init__(self, seed):
        self.seed = seed
        self.dice = random.Random(f"{seed} kills")
        self.ledger = station_file.Ledger()
        self.daemon = None
        self.life, self.begun_at = 0, ""
        self.stopping = self.ending = False
        self.told_to_stop = set()  # lives
        self.stops = []  # (begun, ended) of each life that was told to stop
        self.remembering = False  # nobody is forgotten meanwhile
        self.faults = []
        self.moments, self.stages, self.retries = (collections.Counter() for _ in range(3))
        self.with_records = self.ended_first = 0
        self.askers = [Asker(self, i) for i in range(CLIENTS)]

    def run(self, rounds):
        """AssertionError where anything is wrong; else what there was, as text."""
        begun = time.monotonic()
        instruments = [INSTRUMENT.format(i) for i in range(CLIENTS)]
        with Daemon(instruments=instruments, wait=False) as self.daemon:
            self.daemon.kill()
            for asker in self.askers:
                asker.start()
            for n in range(rounds):
                self.round(n)
            found = self.finish()
        return self.report(rounds, time.monotonic() - begun, found)

    # ---- a life and its end ----------------------------------------------------------

    def begin_life(self, wait):
        """Clients look at `life` before and after they connect, see Asker.live()."""
        self.stopping = False
        self.begun_at = clock_text()
        self.life += 1
        self.daemon.start(wait)

    def round(self, n):
        name = self.choose(n)
        before = len(self.ledger.records)
        self.begin_life(wait=name != "start")
        MOMENTS[name][1](self)
        self.moments[name] += 1
        self.stages.update(asker.stage for asker in self.askers)
        self.end_life()
        self.with_records += len(self.ledger.records) > before
        if n % CHECK_EVERY == CHECK_EVERY - 1:
            self.check()
        self.look_for_faults()

    def choose(self, n):
        if n < MAKING:
            return "start"
        names = list(MOMENTS)
        return self.dice.choices(names, [MOMENTS[name][0] for name in names])[0]

    def end_life(self):
        status = self.daemon.process.poll()
        if status is None:
            self.daemon.kill()
        elif self.stopping and status == 0:
            self.ended_first += 1
        else:
            raise AssertionError(f"it ended by itself with {status}: {self.daemon.log()[-3000:]}")
        if self.stopping:
            self.stops.append((self.begun_at, clock_text()))

    def check(self):
        """Told to stop while the table is still loading, the station keeps a reading that is
        there without a match; at any other time the record waits for the table."""
        for taken_at in list(self.ledger.unmatched):
            if any(begun <= taken_at <= ended for begun, ended in self.stops):
                self.ledger.unmatched.discard(taken_at)
        return station_file.check(self.daemon.state, self.ledger)

    def look_for_faults(self):
        if self.faults:
            log = self.daemon.log()[-3000:]
            raise AssertionError(f"seed {self.seed}, life {self.life}: {self.faults[0]}\n{log}")

    def finish(self):
        """A last life in which every client gets its answer, and a clean end."""
        self.begin_life(wait=True)
        self.ending = True
        for asker in self.askers:
            asker.join(PATIENCE_S)
            if asker.is_alive():
                self.faults.append(f"{asker.name} has no answer to {asker.request}")
        self.look_for_faults()
        with self.daemon.client(timeout_s=PATIENCE_S) as c:
            verified = c.call("store.verify")
        self.daemon.stop()
        found = self.check()
        if not verified["sound"] or (verified["records"], verified["audit_rows"]) != found:
            raise AssertionError(f"store.verify says {verified}, the file has {found}")
        return found

    # ---- moments: each returns when the kill is due ----------------------------------

    def pause(self, most_s):
        time.sleep(self.dice.uniform(0, most_s))

    def until(self, condition, most_s=1):
        """As soon as it holds, or when the time is up."""
        until = time.monotonic() + most_s
        while not condition() and time.monotonic() < until:
            time.sleep(0.0002)

    def starting(self):
        """The store is made or recovered, the socket taken over, tables and instruments read."""
        self.pause(0.15)

    def any_time(self):
        self.pause(0.8)

    def settle(self):
        """Mostly until this life has made records, which takes a table; sometimes before."""
        before = len(self.ledger.records)
        if self.dice.random() < 0.8:
            self.until(lambda: len(self.ledger.records) > before, PATIENCE_S)
        self.pause(0.3)

    def stage(self, stage):
        """Shortly after a client asked for it."""
        self.settle()
        self.until(lambda: any(asker.stage == stage for asker in self.askers))
        self.pause(0.006)

    def file(self, name):
        """Right after this file was written to: between write, sync and answer."""
        self.settle()
        before = self.look(name)
        self.until(lambda: self.look(name) != before)
        self.pause(0.001)

    def look(self, name):
        try:
            now = os.stat(os.path.join(self.daemon.state, name))
        except FileNotFoundError:
            return None
        return now.st_size, now.st_mtime_ns

    def timer(self):
        """During the checkpoint by the clock.  Forgetting makes checkpoints of its own."""
        self.remembering = True
        time.sleep(TIMER_S)
        before = self.look("station.db")
        self.until(lambda: self.look("station.db") != before)
        self.pause(0.002)
        self.remembering = False

    def stop(self):
        """On its way down, which ends with a checkpoint."""
        self.settle()
        self.stopping = True
        self.told_to_stop.add(self.life)
        self.daemon.process.send_signal(signal.SIGTERM)
        self.pause(0.015)

    # ---- what there was --------------------------------------------------------------

    def report(self, rounds, took_s, found):
        def listed(counter):
            return ", ".join(f"{name} {n}" for name, n in sorted(counter.items()))

        return "\n".join(
            (
                f"seed {self.seed}: {rounds} kills in {took_s:.0f} s, {self.with_records} after "
                f"records were acknowledged; {self.ended_first} came after the end",
                f"kills were due at: {listed(self.moments)}",
                f"clients were at: {listed(self.stages)}",
                f"asked again after a kill: {listed(self.retries)}",
                f"acknowledged: {len(self.ledger.records)} records, "
                f"{len(self.ledger.calibrations)} calibrations, {len(self.ledger.subjects)} "
                f"subjects, {len(self.ledger.erased)} erased; "
                f"in the file: {found[0]} records, {found[1]} audit rows",
            )
        )


# How often of 100, and what.
MOMENTS = {
    "start": (15, Killing.starting),
    "any": (15, Killing.any_time),
    "calibrate": (8, lambda k: k.stage("instrument.calibrate")),
    "measure": (20, lambda k: k.stage("measure.start")),
    "match": (8, lambda k: k.stage("match.spectrum")),
    "commit": (18, lambda k: k.file("station.db-wal")),
    "forget": (5, lambda k: k.stage("subject.forget")),
    "checkpoint": (4, lambda k: k.file("station.db")),
    "timer": (1, Killing.timer),
    "stop": (6, Killing.stop),
}


def main():
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else ROUNDS
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else random.randrange(1 << 32)
    print(f"seed {seed}", flush=True)
    print(Killing(seed).run(rounds))


if __name__ == "__main__":
    main()
