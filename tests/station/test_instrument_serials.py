#!/usr/bin/env python3
"""test_instrument_serials.py - two equal instruments, serial numbers that are none: each is one of its
own in the station, with a name a client can use.

expect: docs/drivers.md: told apart by their ports where the numbers say nothing."""

import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

from daemon import main, wait_for  # noqa: E402
from instruments import SP62, USB2000, CM700d, WithInstruments, write_tile  # noqa: E402
from support import run  # noqa: E402


class Serials(WithInstruments):
    def both_measure(self, client, units):
        """units: name -> unit.  Each its own shots."""
        for seq, (name, unit) in enumerate(units.items(), 1):
            lease = client.acquire(name)["lease"]
            unit.calibrate(client, lease)
            record = client.measure(lease)
            self.assertEqual(record["seq"], seq)
            self.assertEqual(record.get("serial", ""), self.listed(client, name).get("serial", ""))

    # ---- two that are equal ---------------------------------------------------------------

    def test_one_number_twice(self):
        """One keeps the number for its name, the other has its port's; each measures by itself."""
        units = [CM700d(self, i) for i in range(2)]
        for i, unit in enumerate(units):
            unit.come(place=f"ttyACM{i}")
        c = self.start()
        wait_for("both", lambda: len(self.states(c)) == 2)
        (other,) = set(self.states(c)) - {units[0].name}
        second = units[int(other[-1])]
        first = units[1 - int(other[-1])]
        self.assertEqual(other, f"km_ascii@ttyACM{second.nth}")
        for name in (units[0].name, other):
            self.wait_for_state(c, name, "calibration_due")
        self.both_measure(c, {units[0].name: first, other: second})

    def test_the_second_goes_and_the_first_stays(self):
        units = [CM700d(self, i) for i in range(2)]
        for i, unit in enumerate(units):
            unit.come(place=f"ttyACM{i}")
        c = self.start()
        wait_for("both", lambda: len(self.states(c)) == 2)
        (other,) = set(self.states(c)) - {units[0].name}
        units[int(other[-1])].unplug()
        self.wait_for_state(c, other, "gone")
        self.assertEqual(self.states(c)[units[0].name], "calibration_due")

    def test_two_spectrometers(self):
        """`usb` alone names both of them as a choice; by their places each is taken."""
        tile = write_tile(self)
        units = [USB2000(self, i) for i in range(2)]
        for i, unit in enumerate(units):
            unit.come(place=f"001/{4 + i:03d}")
        c = self.start(f"ocean_ooi:usb,tile={tile},port_mm=8")
        self.wait_for_state(c, "ocean_ooi", "failed")
        said = self.listed(c, "ocean_ooi")["error"]
        self.assertIn("usb:001:004", said)
        self.assertIn("usb:001:005", said)
        self.daemon.stop()
        c = self.start(*(f"ocean_ooi:usb:001:00{4 + i},tile={tile},port_mm=8" for i in range(2)))
        names = ("ocean_ooi", "ocean_ooi-2")
        for name in names:
            self.wait_for_state(c, name, "calibration_due")
        self.both_measure(c, dict(zip(names, units)))

    def test_two_at_configured_ports(self):
        units = [SP62(self, i) for i in range(2)]
        for i, unit in enumerate(units):
            unit.come(place=f"ttyUSB{i}")
        c = self.start("xrite_rci:/dev/ttyUSB0", "xrite_rci:/dev/ttyUSB1")
        names = ("xrite_rci", "xrite_rci-2")
        for name in names:
            self.wait_for_state(c, name, "calibration_due")
        self.both_measure(c, dict(zip(names, units)))

    # ---- numbers that are none --------------------------------------------------------------

    def strange(self, unit, *options):
        """What `skinspec devices` has of it is text, and it measures."""
        unit.come(*options)
        c = self.start(unit.instrument())
        wait_for("opened", lambda: "calibration_due" in self.states(c).values())
        (one,) = c.call("instrument.list")["instruments"]
        self.assertRegex(one["instrument"], r"\A[A-Za-z0-9@._:-]+\Z")
        self.assertLessEqual(len(one.get("serial", "")), 48)
        self.assertTrue(all(" " <= x <= "~" for x in one.get("serial", "")))
        done = run("devices", "--socket", self.daemon.socket)
        self.assertEqual((done.status, done.err), (0, ""))
        self.assertIn(one["instrument"], done.out)
        self.both_measure(c, {one["instrument"]: unit})
        self.daemon.stop()
        return one

    def test_a_kilobyte_of_bytes(self):
        """No line of any of these instruments: shown under its port, with what to look at."""
        for unit, name in ((CM700d(self), "km_ascii@ttyACM0"), (SP62(self, 1), "xrite_rci")):
            with self.subTest(kind=unit.kind):
                unit.come("binary_serial=1")
                c = self.start(unit.instrument())
                self.wait_for_state(c, name, "failed")
                said = self.listed(c, name)["error"]
                self.assertIn("is this the right instrument?", said)
                self.daemon.stop()

    def test_empty(self):
        for unit in (CM700d(self), SP62(self, 1)):
            with self.subTest(kind=unit.kind):
                one = self.strange(unit, "serial=")
                self.assertEqual(one.get("serial", ""), "")

    def test_bytes_in_an_eeprom(self):
        for text in ("hex:" + "ff80000a1b5b324a" + "00" * 6, ""):
            with self.subTest(text=text):
                unit = USB2000(self, len(text))
                unit.come(place=f"001/{4 + len(text):03d}")
                unit.act(f"fault slot 0 {text}".rstrip())
                c = self.start(unit.instrument())
                wait_for("an answer", lambda: set(self.states(c).values()) - {"opening"})
                one = self.listed(c, unit.name)
                if one["state"] == "failed":
                    self.assertTrue(one["error"])
                else:
                    self.assertTrue(all(" " <= x <= "~" for x in one.get("serial", "")))
                    self.both_measure(c, {unit.name: unit})
                self.daemon.stop()
                unit.unplug()


if __name__ == "__main__":
    main()
