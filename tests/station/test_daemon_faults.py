"""What an instrument can do to a measurement, through the whole station.

expect: docs/protocol.md (reasons) and drivers/simulated/simulated.h (what each fault is).
"""

import time

from client import Refused
from daemon import Case, Daemon, main, new_uuid

FAST = "simulated:speed=instant,fault="


class Faults(Case):
    instruments = None

    def station(self, *instruments, options=()):
        daemon = self.enterContext(Daemon(*options, instruments=instruments))
        daemon.wait_for_table()
        return daemon

    def calibrated(self, daemon):
        daemon.wait_for_instrument()
        c = daemon.client()
        self.addCleanup(c.close)
        lease = c.acquire()["lease"]
        c.calibrate(lease)
        return c, lease

    def test_during_a_shot(self):
        """Each ends the measurement with its own reason, stores nothing, and is told."""
        rows = (
            ("silence", "instrument_timeout"),
            ("garbage", "instrument_protocol"),
            ("lamp", "instrument_fault"),
            ("battery", "instrument_battery"),
            ("charge", "instrument_busy"),
            ("expired", "calibration_due"),
            ("wrong_bands", "instrument_protocol"),
            ("nan", "measurement_failed"),
            ("all_zero", "measurement_failed"),
            ("gone", "instrument_gone"),
        )
        for fault, reason in rows:
            with self.subTest(fault=fault):
                daemon = self.station(FAST + f"measure:2:{fault}")
                c, lease = self.calibrated(daemon)
                c.call("events.subscribe", topics=["measurement"])
                uuid = new_uuid()
                with self.refused(reason):
                    c.measure(lease, uuid=uuid, replicates=3)
                self.assertEqual(c.event("measurement", "failed", uuid=uuid)["data"]["reason"], reason)
                self.assertEqual(c.call("status.get")["last_seq"], 0)

    def test_a_shot_after_a_fault(self):
        """The same uuid is free for another try."""
        daemon = self.station(FAST + "measure:1:garbage")
        c, lease = self.calibrated(daemon)
        uuid = new_uuid()
        with self.refused("instrument_protocol"):
            c.measure(lease, uuid=uuid)
        self.assertEqual(c.measure(lease, uuid=uuid)["seq"], 1)

    def test_a_warning_travels_with_the_record(self):
        daemon = self.station(FAST + "measure:1:weak_lamp")
        c, lease = self.calibrated(daemon)
        self.assertIn("lamp_weak", c.measure(lease)["flags"])

    def test_during_a_calibration(self):
        for fault, reason in (
            ("swapped", "calibration_implausible"),
            ("lamp", "instrument_fault"),
            ("silence", "instrument_timeout"),
            ("garbage", "instrument_protocol"),
        ):
            with self.subTest(fault=fault):
                daemon = self.station(FAST + f"calibrate:2:{fault}")
                daemon.wait_for_instrument()
                with daemon.client() as c:
                    lease = c.acquire()["lease"]
                    c.call("instrument.calibrate", lease=lease, step="zero")
                    with self.refused(reason):
                        c.call("instrument.calibrate", lease=lease, step="white")
                    with self.refused("calibration_due"):
                        c.measure(lease)
                    done = c.call("instrument.calibrate", lease=lease, step="white")
                    self.assertEqual([s["due"] for s in done["calibration"]], [False, False])
                    self.assertEqual(c.measure(lease)["seq"], 1)

    def test_at_the_opening(self):
        """The station serves all the same, and says what is wrong."""
        for fault, reason in (
            ("busy", "instrument_busy"),
            ("no_permission", "instrument_no_permission"),
            ("garbage", "instrument_protocol"),
        ):
            with self.subTest(fault=fault):
                daemon = self.station(FAST + f"open:1+:{fault}")
                with daemon.client() as c:
                    c.call("events.subscribe", topics=["instrument"], since_seq=0)
                    c.event("instrument", "gone")
                    listed = c.call("instrument.list")["instruments"][0]
                    self.assertEqual(listed["state"], "failed")
                    self.assertTrue(listed["error"])
                    lease = c.acquire()["lease"]
                    with self.refused(reason):
                        c.call("instrument.calibrate", lease=lease, step="zero")

    def test_a_button_that_fails(self):
        """The shots that are there are not lost: measure.next takes the others."""
        daemon = self.station(FAST + "wait_button:1+:garbage")
        c, lease = self.calibrated(daemon)
        c.call("events.subscribe", topics=["measurement"])
        uuid = new_uuid()
        wanted = {"lease": lease, "uuid": uuid, "specular": "sce", "replicates": 2, "pace": "prompt"}
        asked = c.send("measure.start", **wanted)
        c.event("measurement", "waiting", uuid=uuid)
        self.assertEqual(c.call("measure.next", lease=lease, uuid=uuid)["shot"], 2)
        self.assertEqual(len(c.wait(asked)["replicates"]), 2)

    def test_configured(self):
        daemon = self.station("simulated:speed=instant")
        c, lease = self.calibrated(daemon)
        self.assertEqual(c.call("instrument.configure", lease=lease, grid=1)["grid"], 1)
        self.assertEqual(len(c.measure(lease)["spectrum"]["values"]), 39)
        set_to = c.call("instrument.configure", lease=lease, aperture_mm=3)
        self.assertEqual(set_to["aperture_mm"], 3)
        self.assertEqual({s["due"] for s in set_to["calibration"]}, {True})
        for wrong in ({"grid": 3}, {"aperture_mm": 5}):
            with self.refused("instrument_unsupported"):
                c.call("instrument.configure", lease=lease, **wrong)
        c.calibrate(lease)
        self.assertEqual(c.measure(lease)["aperture_mm"], 3)

    def test_an_old_calibration(self):
        """expect: the options: it blocks, or warns and flags, after 0.36 s."""
        for policy in ("block", "warn"):
            options = ("--calibration-hours", "0.0001", "--calibration-policy", policy)
            daemon = self.station("simulated:speed=instant", options=options)
            c, lease = self.calibrated(daemon)
            time.sleep(0.5)
            if policy == "warn":
                self.assertIn("calibration_old", c.measure(lease)["flags"])
                continue
            with self.assertRaises(Refused) as caught:
                c.measure(lease)
            self.assertEqual(caught.exception.reason, "calibration_due")


if __name__ == "__main__":
    main()
