#!/usr/bin/env python3
"""test_instrument_faults.py - what each driver's instrument can do to the running daemon: pulled out
again and again, silent, its battery dying, its calibration lost, its tiles swapped.

expect: docs/protocol.md (reasons); tests/sim/faults.h and ocean.h (what each fault is)."""

import os
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

from daemon import INSTRUMENTED, Refused, main, wait_for  # noqa: E402
from instruments import EACH, SP62, USB2000, CM700d, WithInstruments  # noqa: E402

SLOWER = 10 if INSTRUMENTED else 1
SEEN_S = 0.6 * SLOWER  # that it was pulled out
BACK_S = 1.5 * SLOWER  # from being plugged in to being asked for its calibration
CYCLES = int(os.environ.get("PLUGS", "10" if INSTRUMENTED else "50"))


class Unplugged(WithInstruments):
    """At a configured port and on the bus; test_hotplug.py has those that udev finds."""

    def cycles(self, unit):
        """Often: it is seen to go and come each time, and nothing is left open."""
        client = self.start_with(unit)
        before = None
        for i in range(CYCLES):
            unit.unplug()
            self.assertLess(self.wait_for_state(client, unit.name, "gone"), SEEN_S)
            unit.plug(unit.place(1 + i % 100))
            self.assertLess(self.wait_for_state(client, unit.name, "calibration_due"), BACK_S)
            if i == 1:
                time.sleep(0.3)
                before = self.left_open()
        # The last seat is closed a moment after its instrument was seen to go.
        wait_for("no more descriptors than before", lambda: self.left_open() <= before, 10)
        self.assertEqual(list(self.states(client)), [unit.name])

    def test_spectrometer_many_times(self):
        self.cycles(USB2000(self))

    def test_configured_port_many_times(self):
        self.cycles(SP62(self))

    def test_back_before_it_is_missed(self):
        """Out and in again within 200 ms, at another node where its port may have one: it is not taken
        for the one that was calibrated."""
        for kind in EACH:
            with self.subTest(kind=kind.kind):
                unit = kind(self)
                client, lease = self.ready_with(unit)
                self.wait_for_state(client, unit.name, "ready")
                began = time.monotonic()
                unit.unplug()
                unit.plug(unit.place(7))
                if not INSTRUMENTED:
                    self.assertLess(time.monotonic() - began, 0.2)
                self.assertLess(self.wait_for_state(client, unit.name, "calibration_due"), BACK_S)
                with self.refused("calibration_due"):
                    client.measure(lease)
                unit.calibrate(client, lease)
                self.assertEqual(client.measure(lease)["seq"], 1)
                self.assertEqual(list(self.states(client)), [unit.name])
                self.daemon.stop()

    def test_cpu_while_it_is_out(self):
        """Of each; expect: 2 % of two seconds."""
        for kind in EACH:
            with self.subTest(kind=kind.kind):
                unit = kind(self)
                client, _ = self.ready_with(unit)
                unit.unplug()
                self.wait_for_state(client, unit.name, "gone")
                # Loading it takes ten ticks, on a busy machine later than this.
                wait_for("the table", lambda c=client: c.call("status.get")["table"] == "ready")
                time.sleep(0.3)
                before = self.daemon.cpu_ticks()
                time.sleep(2)
                if not INSTRUMENTED:  # what an instrumented program takes says nothing
                    self.assertLessEqual(self.daemon.cpu_ticks() - before, 4)
                self.daemon.stop()

    def test_ready_and_idle(self):
        """One with good calibrations: waited at for its button, or left alone."""
        for kind in EACH:
            with self.subTest(kind=kind.kind):
                unit = kind(self)
                client, lease = self.ready_with(unit)
                time.sleep(1.2)  # it is idle by now
                unit.unplug()
                self.assertLess(self.wait_for_state(client, unit.name, "gone"), SEEN_S)
                with self.refused("instrument_gone"):
                    client.measure(lease)
                unit.plug(unit.place(7))
                self.wait_for_state(client, unit.name, "calibration_due")
                unit.calibrate(client, lease)
                self.assertEqual(client.measure(lease)["seq"], 1)
                self.daemon.stop()


class Silent(WithInstruments):
    """What ends in no answer."""

    def test_battery_dies_in_mid_measurement(self):
        """For ever silent, or for ever busy: an end in time that names the battery, and others are
        answered meanwhile.  Slow: 10 and 21 s are the drivers' patience."""
        units = (CM700d(self), SP62(self, 1))
        for unit in units:
            unit.come()
        c = self.start(*(unit.instrument() for unit in units))
        asked = []
        for unit in units:
            self.wait_for_state(c, unit.name, "calibration_due")
            lease = c.acquire(unit.name)["lease"]
            unit.calibrate(c, lease)
            if unit.kind == "cm700d":
                unit.act("battery 1")
            unit.act("fault battery_dies")
            asked.append(self.start_measuring(c, lease)[0])
        other, slowest = self.client(), 0.0
        for _ in range(50):
            began = time.monotonic()
            other.call("status.get")
            slowest = max(slowest, time.monotonic() - began)
            time.sleep(0.02)
        self.assertLess(slowest, 0.05 * SLOWER)
        for request in asked:
            with self.assertRaises(Refused) as caught:
                c.wait(request, 40)
            self.assertEqual(caught.exception.reason, "instrument_timeout")
            self.assertIn("battery", caught.exception.message)
        self.assertEqual(c.call("status.get")["last_seq"], 0)

    def test_shot_that_ends_without_data(self):
        """As where the battery gives way to the adapter."""
        unit = CM700d(self)
        c, lease = self.ready_with(unit)
        unit.act("fault battery_dies 200")
        with self.assertRaises(Refused) as caught:
            c.measure(lease)
        self.assertIn("battery", caught.exception.message)
        unit.act("charge")
        self.assertEqual(c.measure(lease)["seq"], 1)

    def test_a_transfer_that_never_completes(self):
        """The spectrum does not come: an error in time, the next reading is right."""
        unit = USB2000(self)
        c, lease = self.ready_with(unit)
        unit.act("fault silent 82")
        began = time.monotonic()
        with self.refused("instrument_timeout"):
            c.measure(lease)
        self.assertLess(time.monotonic() - began, 3 * SLOWER)
        unit.act("fault none")
        self.assertEqual(c.measure(lease)["seq"], 1)

    def test_a_transfer_that_hangs_once(self):
        """One packet of a spectrum and no end: asked again, and stored once."""
        unit = USB2000(self)
        c, lease = self.ready_with(unit)
        unit.act("fault hang")
        self.assertEqual(c.measure(lease)["seq"], 1)
        self.assertEqual(c.call("status.get")["last_seq"], 1)

    def test_shut_down_while_a_transfer_hangs(self):
        """The daemon ends in its two seconds."""
        unit = USB2000(self)
        c, lease = self.ready_with(unit)
        unit.act("fault silent 82")
        self.start_measuring(c, lease)
        time.sleep(0.2)
        self.daemon.stop()


class Calibration(WithInstruments):
    def test_lost_between_start_and_result(self):
        """The shot is not stored, what is due is told, and after it all is well."""
        faults = {"cm700d": "fault calibration_lost", "sp62": "fault calibration_lost",
                  "usb2000": "reset"}  # fmt: skip
        for kind in EACH:
            with self.subTest(kind=kind.kind):
                unit = kind(self)
                c, lease = self.ready_with(unit)
                c.call("events.subscribe", topics=["calibration"])
                unit.act(faults[unit.kind])
                with self.refused("calibration_due"):
                    c.measure(lease, replicates=2)
                wait_for("due", lambda: self.listed(c, unit.name)["state"] == "calibration_due")
                c.event("calibration", "due", instrument=unit.name)
                with self.refused("calibration_due"):
                    c.measure(lease)
                unit.calibrate(c, lease)
                self.assertEqual(c.measure(lease)["seq"], 1)
                self.daemon.stop()

    def test_swapped_tiles(self):
        """White for the trap, the trap for white: refused, and still due."""
        for kind in (CM700d, USB2000):
            with self.subTest(kind=kind.kind):
                unit = kind(self)
                more = ("operator=0",) if kind is CM700d else ()
                c = self.start_with(unit, *more)
                lease = c.acquire(unit.name)["lease"]
                self.swap(unit, c, lease)
                with self.refused("calibration_due"):
                    c.measure(lease)
                unit.calibrate(c, lease)
                self.assertEqual(c.measure(lease)["seq"], 1)
                self.daemon.stop()

    def swap(self, unit, client, lease):
        """At the latest the second step finds out."""
        reasons = []
        for step, under in (("zero", "white"), ("white", "black")):
            unit.act(f"place {under}")
            try:
                client.call("instrument.calibrate", lease=lease, step=step)
            except Refused as refused:
                reasons.append(refused.reason)
        self.assertIn("calibration_implausible", reasons)
        self.assertIn(True, [x["due"] for x in self.listed(client, unit.name)["calibration"]])

    def test_swapped_before_an_instruments_own_display(self):
        """An SP62 asks for white first: black is put there."""
        unit = SP62(self)
        c = self.start_with(unit)
        lease = c.acquire(unit.name)["lease"]
        with self.refused("calibration_implausible"):
            unit.calibrate(c, lease, ("black", "white"))
        with self.refused("calibration_due"):
            c.measure(lease)
        unit.calibrate(c, lease)
        self.assertEqual(c.measure(lease)["seq"], 1)

    def test_white_tile_not_in_place(self):
        """Skin where white should be."""
        for kind in (CM700d, USB2000):
            with self.subTest(kind=kind.kind):
                unit = kind(self)
                c = self.start_with(unit, *(("operator=0",) if kind is CM700d else ()))
                lease = c.acquire(unit.name)["lease"]
                unit.act("place black")
                c.call("instrument.calibrate", lease=lease, step="zero")
                unit.act("place skin")
                with self.refused("calibration_implausible"):
                    c.call("instrument.calibrate", lease=lease, step="white")
                self.daemon.stop()

    def test_tile_not_in_place_at_an_instruments_own_display(self):
        """An SP62 asks for white, and skin is there: refused, still due, and well after it."""
        unit = SP62(self)
        c = self.start_with(unit)
        lease = c.acquire(unit.name)["lease"]
        with self.refused("calibration_implausible"):
            unit.calibrate(c, lease, ("skin", "black"))
        with self.refused("calibration_due"):
            c.measure(lease)
        unit.calibrate(c, lease)
        self.assertEqual(c.measure(lease)["seq"], 1)

    def test_lamp_fails(self):
        """Each says so in its own way; nothing is stored."""
        reasons = {"cm700d": "instrument_fault", "sp62": "instrument_fault",
                   "usb2000": "measurement_failed"}  # fmt: skip
        for kind in EACH:
            with self.subTest(kind=kind.kind):
                unit = kind(self)
                c, lease = self.ready_with(unit)
                unit.act("fault lamp")
                with self.assertRaises(Refused) as caught:
                    c.measure(lease)
                self.assertEqual(caught.exception.reason, reasons[unit.kind])
                self.assertIn("lamp", caught.exception.message)
                self.assertEqual(c.call("status.get")["last_seq"], 0)
                self.daemon.stop()


if __name__ == "__main__":
    main()
