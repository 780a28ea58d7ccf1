#!/usr/bin/env python3
"""test_replay_live.py - a CM-700d at a mocked port, measured by a station that records it, with its
button, its cable and another of its kind; then replayed without it."""

import os
import shutil
import sys
import tempfile
import time
import unittest

sys.path.insert(
    0, os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "station")
)

from daemon import Daemon, new_uuid, wait_for  # noqa: E402
from simhost import Simhost, drivers  # noqa: E402
from support import TABLES, Case, main, run  # noqa: E402

UNIT = "serial=00012345,seed=3,operator=1"  # somebody places what a calibration wants


@unittest.skipUnless("km_ascii" in drivers(), "km_ascii is not in this skinspecd")
class Live(Case):
    def setUp(self):
        self.place = tempfile.mkdtemp(prefix="rl.", dir="/tmp")
        self.addCleanup(shutil.rmtree, self.place, ignore_errors=True)
        self.capture = os.path.join(self.place, "session.txt")
        self.host = self.enterContext(Simhost())
        self.host.say(f"plug cm700d one ttyACM0 {UNIT}")

    def record(self, instrument):
        daemon = self.enterContext(
            Daemon("--record", self.capture, instruments=(instrument,), env=self.host.mocked)
        )
        daemon.wait_for_table()
        with daemon.client() as c:
            wait_for("the instrument", lambda: c.call("instrument.list")["instruments"])
        daemon.wait_for_instrument()
        return daemon

    def replay(self):
        done = run("replay", self.capture, "--tables", TABLES)
        return done.status, done.out, done.err

    def words(self):
        with open(self.capture, encoding="ascii") as file:
            return [x.split()[2] for x in file if " @ " in x]

    def test_next_and_the_button(self):
        with self.record("km_ascii:/dev/ttyACM0") as daemon, daemon.client() as c:
            c.call("events.subscribe", topics=["measurement"])
            lease, uuid = c.acquire()["lease"], new_uuid()
            c.calibrate(lease)
            asked = c.send("measure.start", lease=lease, uuid=uuid, specular="sce", replicates=3,
                           pace="prompt")  # fmt: skip
            c.event("measurement", "waiting")
            time.sleep(0.3)  # it polls the button meanwhile
            c.call("measure.next", lease=lease, uuid=uuid)
            c.event("measurement", "waiting")
            time.sleep(3)  # its flash charges: a press before would be in vain
            self.host.say("act one press")
            self.assertEqual(len(c.wait(asked, timeout_s=30)["replicates"]), 3)
            c.measure(lease, replicates=2)
        self.assertEqual(
            self.words(),
            ["station", "calibrate", "calibrate", "measure", "next", "button", "record",
             "measure", "record"],
        )  # fmt: skip
        self.assertEqual(
            self.replay(),
            (0, "calibrate zero: done\ncalibrate white: done\nmeasure sce, 3 shots: same\n"
                "measure sce, 2 shots: same\nsame: 2 measurements bit for bit\n", ""),
        )  # fmt: skip

    def test_what_was_refused_and_cancelled(self):
        with self.record("km_ascii:/dev/ttyACM0") as daemon, daemon.client() as c:
            c.call("events.subscribe", topics=["measurement"])
            lease, uuid = c.acquire()["lease"], new_uuid()
            c.calibrate(lease)
            asked = c.send("measure.start", lease=lease, uuid=uuid, specular="sce", replicates=2,
                           pace="prompt")  # fmt: skip
            c.event("measurement", "waiting")
            c.call("measure.cancel", lease=lease, uuid=uuid)
            with self.assertRaises(Exception):
                c.wait(asked)
            c.measure(lease)
        self.assertIn("cancelled", self.words())
        status, out, err = self.replay()
        self.assertEqual((status, err), (0, ""), out)
        self.assertIn("measure sce, 2 shots: same\nmeasure sce, 1 shot: same\n", out)

    def test_the_cable(self):
        """Two connections, each calibrated: two parts of one capture."""
        with self.record("km_ascii:/dev/ttyACM0") as daemon, daemon.client() as c:
            c.call("events.subscribe", topics=["instrument"])
            lease = c.acquire()["lease"]
            c.calibrate(lease)
            c.measure(lease)
            self.host.say("unplug one")
            c.event("instrument", "gone")
            self.host.say("plug cm700d one ttyACM0")
            c.event("instrument", "connected", timeout_s=30)
            c.calibrate(lease)
            c.measure(lease, replicates=2)
        status, out, err = self.replay()
        self.assertEqual((status, err), (0, ""), out)
        self.assertEqual(out.count("calibrate zero: done\n"), 2)
        self.assertIn("measure sce, 1 shot: same\n", out)
        self.assertIn("measure sce, 2 shots: same\nsame: 2 measurements", out)

    @unittest.skipUnless("xrite_rci" in drivers(), "xrite_rci is not in this skinspecd")
    def test_a_way_back_into_step(self):
        """Each wait for an SP62's button that is cut short leaves it out of step."""
        self.host.say("plug sp62 other ttyUSB0 serial=777,operator_ms=300")
        with self.record("xrite_rci:/dev/ttyUSB0") as daemon, daemon.client() as c:
            lease = c.acquire()["lease"]
            c.call("instrument.calibrate", 60, lease=lease, step="zero")
            self.host.say("act other place white")
            c.call("instrument.calibrate", 60, lease=lease, step="white")
            self.host.say("act other place skin")
            c.measure(lease, replicates=2)
        status, out, err = self.replay()
        self.assertEqual((status, err), (0, ""), out)
        self.assertIn("measure sce, 2 shots: same\n", out)

    def test_the_second_of_a_kind_is_not_recorded(self):
        self.host.say("plug cm700d two ttyACM1 serial=00099999,seed=4,operator=1")
        with self.record("km_ascii") as daemon, daemon.client() as c:
            wait_for("both", lambda: len(c.call("instrument.list")["instruments"]) == 2)
            log = daemon.log()
        self.assertEqual(log.count("is not recorded"), 1, log)
        with open(self.capture, encoding="ascii") as file:
            serials = [x for x in file if x.startswith("# model")]
        self.assertEqual(len(serials), 1, serials)


if __name__ == "__main__":
    main()
