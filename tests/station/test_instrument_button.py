#!/usr/bin/env python3
"""test_instrument_button.py - the trigger button of handhelds: with nobody there, with two clients,
twenty times in a second.

expect: docs/protocol.md: a press is an event, and a shot only where a measurement waits for it."""

import os
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

from daemon import INSTRUMENTED, Refused, Silent, main, new_uuid  # noqa: E402
from instruments import SP62, CM700d, WithInstruments  # noqa: E402

HEARD_S = 20 if INSTRUMENTED else 6  # a CM-700d is asked once a second


class Button(WithInstruments):
    def each(self, test):
        for kind in (CM700d, SP62):
            with self.subTest(kind=kind.kind):
                unit = kind(self)
                c, lease = self.ready_with(unit)
                test(unit, c, lease)
                self.daemon.stop()

    def sound(self, client, lease, last_seq):
        """Nothing was stored that nobody asked for, and it measures."""
        self.assertEqual(client.call("status.get")["last_seq"], last_seq)
        self.assertEqual(client.measure(lease)["seq"], last_seq + 1)

    def test_with_no_client(self):
        """Nobody is connected: nothing is stored, and the next client finds all well."""
        for kind in (CM700d, SP62):
            with self.subTest(kind=kind.kind):
                unit = kind(self)
                c, lease = self.ready_with(unit)
                c.call("instrument.release", lease=lease)
                c.close()
                for _ in range(3):
                    unit.act("press")
                    time.sleep(0.4)
                c = self.client()
                lease = c.acquire(unit.name)["lease"]
                self.sound(c, lease, 0)
                self.daemon.stop()

    def test_with_two_clients(self):
        """Both hear of it; the shot is of the one whose measurement waits, and its alone."""

        def test(unit, c, lease):
            other = self.client()
            for client in (c, other):
                client.call("events.subscribe", topics=["instrument", "measurement"])
            time.sleep(1.2)  # it idles
            unit.act("press")
            for client in (c, other):
                client.event("instrument", "button", HEARD_S, instrument=unit.name)
            with self.assertRaises(Refused):
                other.measure("no lease of its")
            with self.refused("instrument_busy"):
                other.acquire(unit.name)
            uuid = new_uuid()
            request = c.send("measure.start", lease=lease, uuid=uuid, specular="sce", replicates=2,
                             pace="prompt")  # fmt: skip
            c.event("measurement", "waiting", uuid=uuid)
            time.sleep(0.5)
            unit.act("press")
            self.assertEqual(len(c.wait(request)["replicates"]), 2)
            with self.assertRaises(Silent):
                other.event("instrument", "button", 0.3)  # it was the measurement's
            self.sound(c, lease, 1)

        self.each(test)

    def test_the_reading_is_the_press_s_own(self):
        """One press, one flash, and that spectrum is what is recorded: the skin that lies there just
        after is another."""

        def test(unit, c, lease):
            c.call("events.subscribe", topics=["measurement"])
            for _ in range(3):
                unit.act("lightness 65")
                request, uuid = self.start_measuring(c, lease, replicates=2, pace="prompt")
                c.event("measurement", "waiting", uuid=uuid)
                time.sleep(0.5)  # it waits
                unit.act("count shots")
                unit.act("press")
                unit.act("lightness 30")
                before, pressed = (x["values"] for x in c.wait(request)["replicates"])
                unit.act("expect shots 1")
                self.assertLess(max(abs(x - y) for x, y in zip(before, pressed)), 0.01)
                self.assertNotEqual(before, pressed)

        self.each(test)

    def test_twenty_in_a_second(self):
        """Idle: some events, no record, others answered. In a measurement: no more shots than
        asked for, each a new one."""

        def test(unit, c, lease):
            other, slowest = self.client(), 0.0
            for _ in range(20):
                unit.act("press")
                began = time.monotonic()
                other.call("status.get")
                slowest = max(slowest, time.monotonic() - began)
                time.sleep(0.04)
            self.assertLess(slowest, 0.05 * (10 if INSTRUMENTED else 1))
            self.sound(c, lease, 0)
            c.call("events.subscribe", topics=["measurement"])
            request, uuid = self.start_measuring(c, lease, replicates=3, pace="prompt")
            c.event("measurement", "waiting", uuid=uuid)
            began, taken = time.monotonic(), None
            while taken is None and time.monotonic() - began < 20:
                unit.act("press")
                try:
                    taken = c.wait(request, 0.05)
                except Silent:
                    pass
            self.assertEqual(len(taken["replicates"]), 3)
            values = [tuple(x["values"]) for x in taken["replicates"]]
            self.assertEqual(len(set(values)), 3)
            self.sound(c, lease, 2)

        self.each(test)

    def test_pressed_and_pulled_out(self):
        """The wait ends with the instrument's going, not with a shot."""

        def test(unit, c, lease):
            c.call("events.subscribe", topics=["measurement"])
            request, uuid = self.start_measuring(c, lease, replicates=2, pace="prompt")
            c.event("measurement", "waiting", uuid=uuid)
            time.sleep(0.3)
            unit.unplug()
            with self.refused("instrument_gone"):
                c.wait(request)
            self.assertEqual(c.call("status.get")["last_seq"], 0)

        self.each(test)


if __name__ == "__main__":
    main()
