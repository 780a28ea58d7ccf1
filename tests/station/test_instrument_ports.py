#!/usr/bin/env python3
"""test_instrument_ports.py - instruments that were configured wrongly, ports that others use: what
`skinspec devices` says of them, and that it says what to do.

expect: the texts are what a person needs to find the mistake: the port or file, and a next step."""

import os
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

from child import Child, forever  # noqa: E402
from daemon import INSTRUMENTED, Refused, main, wait_for  # noqa: E402
from instruments import SP62, USB2000, CM700d, WithInstruments, tile_rows, write_tile  # noqa: E402
from support import run  # noqa: E402


class Told(WithInstruments):
    """The station serves all the same."""

    def told(self, *instruments, state="failed", **more):
        """What `skinspec devices` says of the first, and how the station refuses to use it."""
        c = self.start(*instruments, **more)
        wait_for("an error", lambda: any(x.get("error") for x in
                                         c.call("instrument.list")["instruments"]))  # fmt: skip
        (one,) = c.call("instrument.list")["instruments"]
        self.assertEqual(one["state"], state, one)
        lease = c.acquire(one["instrument"])["lease"]
        with self.assertRaises(Refused) as caught:
            c.call("instrument.calibrate", lease=lease, step="zero")
        self.assertIn(one["error"], caught.exception.message)
        done = run("devices", "--socket", self.daemon.socket)
        self.assertEqual((done.status, done.err), (0, ""))
        self.assertIn(one["error"], done.out)
        self.daemon.stop()
        return one["error"]

    def expect(self, texts, said):
        for text in texts:
            self.assertIn(text, said)


class Ports(Told):
    # ---- no port -------------------------------------------------------------------------

    def test_does_not_exist(self):
        for driver in ("km_ascii", "xrite_rci"):
            with self.subTest(driver=driver):
                said = self.told(f"{driver}:/dev/ttyUSB9", state="gone")
                self.expect(("/dev/ttyUSB9", "connect the instrument", "/dev/serial/by-id"), said)

    def test_is_no_tty(self):
        path = os.path.join(self.folder(), "a file")
        with open(path, "w", encoding="ascii"):
            pass
        for port in ("/dev/null", path, self.folder()):
            for driver in ("km_ascii", "xrite_rci"):
                with self.subTest(driver=driver, port=port):
                    said = self.told(f"{driver}:{port}")
                    self.expect((port, "no serial port", "/dev/ttyACM0"), said)

    def test_no_address(self):
        """A driver that can find none by itself, and one whose instrument needs more than its port."""
        self.assertIn("/dev/", self.told("xrite_rci"))
        USB2000(self).come()
        c = self.start("ocean_ooi")
        self.wait_for_state(c, "ocean_ooi@usb:001:004", "failed")
        self.assertIn("tile=FILE", self.listed(c, "ocean_ooi@usb:001:004")["error"])

    def test_is_not_permitted_until_it_is(self):
        for unit, node in ((CM700d(self), "ttyACM0"), (SP62(self, 1), "ttyUSB0")):
            with self.subTest(kind=unit.kind):
                unit.come(place=node)
                self.bed.order(f"mode {node} 0000")
                c = self.start(f"{unit.driver}:/dev/{node}", **self.as_nobody())
                self.wait_for_state(c, unit.driver, "failed")
                said = self.listed(c, unit.driver)["error"]
                self.expect(("no permission to open", f"/dev/{node}", "a udev rule"), said)
                self.bed.order(f"mode {node} 0666")
                self.wait_for_state(c, unit.driver, "calibration_due")
                self.daemon.stop()

    def test_usb_is_not_permitted_until_it_is(self):
        unit = USB2000(self)
        unit.come()
        self.bed.order("mode bus/usb/001/004 0000")
        os.chmod(self.folder(), 0o755)
        c = self.start(unit.instrument(), **self.as_nobody())
        self.wait_for_state(c, unit.name, "failed")
        self.expect(("no permission", "a udev rule"), self.listed(c, unit.name)["error"])
        self.bed.order("mode bus/usb/001/004 0666")
        self.wait_for_state(c, unit.name, "calibration_due")

    # ---- another instrument ---------------------------------------------------------------

    def test_another_model_on_the_port(self):
        SP62(self).come(place="ttyUSB0")
        said = self.told("km_ascii:/dev/ttyUSB0")
        self.expect(("at this port",), said)

    def test_another_maker_on_the_port(self):
        CM700d(self).come(place="ttyUSB0")
        said = self.told("xrite_rci:/dev/ttyUSB0")
        self.expect(("SP60, SP62 or SP64", "right port"), said)

    def test_a_model_nobody_knows(self):
        CM700d(self).come("id=0777", place="ttyUSB0")
        said = self.told("km_ascii:/dev/ttyUSB0")
        self.expect(("0777", "CM-700d"), said)

    def test_firmware_with_other_codes(self):
        """Statuses that no description has."""
        for unit, reply in ((CM700d(self), "ER99"), (SP62(self, 1), "<7E>")):
            with self.subTest(kind=unit.kind):
                unit.come(place=f"ttyUSB{unit.nth}")
                unit.act(f"fault reply {reply} from 1")
                said = self.told(f"{unit.driver}:/dev/ttyUSB{unit.nth}")
                self.assertRegex(said, r"right port|right driver|at this port|no other program")

    def test_firmware_with_other_codes_later(self):
        """One that opened."""
        for unit, reply in ((CM700d(self), "ER99"), (SP62(self, 1), "<7E>")):
            with self.subTest(kind=unit.kind):
                c, lease = self.ready_with(unit)
                unit.act(f"fault reply {reply} from 1")
                with self.assertRaises(Refused) as caught:
                    c.measure(lease)
                self.assertIn(caught.exception.reason, ("instrument_protocol", "instrument_timeout"))
                self.assertRegex(caught.exception.message, "check the cable|switch it off and on")
                unit.act("fault none")
                self.assertEqual(c.measure(lease)["seq"], 1)
                self.daemon.stop()

    # ---- others on the port -----------------------------------------------------------------

    def test_busy_in_another_process(self):
        """A daemon of somebody else's holds it; when that ends it is taken."""
        for unit in (CM700d(self), SP62(self, 1)):
            with self.subTest(kind=unit.kind):
                node = f"ttyUSB{unit.nth}"
                unit.come(place=node)
                self.start(f"{unit.driver}:/dev/{node}")
                holder = self.daemon
                self.wait_for_state(self.client(), unit.driver, "calibration_due")
                said = self.told(f"{unit.driver}:/dev/{node}")
                self.expect((f"/dev/{node}", "is held by", "close that one first"), said)
                c = self.start(f"{unit.driver}:/dev/{node}")
                self.wait_for_state(c, unit.driver, "failed")
                holder.stop()
                self.wait_for_state(c, unit.driver, "calibration_due")
                self.daemon.stop()

    def test_interface_claimed_by_another_process(self):
        unit = USB2000(self)
        unit.come()
        self.start(unit.instrument())
        holder = self.daemon
        self.wait_for_state(self.client(), unit.name, "calibration_due")
        said = self.told(unit.instrument())
        self.expect(("another program holds the instrument", "close that one first"), said)
        c = self.start(unit.instrument())
        self.wait_for_state(c, unit.name, "failed")
        holder.stop()
        self.wait_for_state(c, unit.name, "calibration_due")

    def test_a_lock_file_of_a_living_process(self):
        """As minicom leaves it."""
        if not os.access("/run/lock", os.W_OK):
            self.skipTest("/run/lock cannot be written")
        unit, path = SP62(self), "/run/lock/LCK..ttyUSB0"
        if os.path.exists(path):
            self.skipTest(f"{path} is somebody's")
        unit.come()
        holder = self.enterContext(Child(lambda say: forever()))
        with open(path, "w", encoding="ascii") as file:
            file.write(f"{holder.pid:10d}\n")
        self.addCleanup(lambda: os.path.exists(path) and os.unlink(path))
        said = self.told(unit.instrument())
        self.expect((f"process {holder.pid}", "/dev/ttyUSB0"), said)
        c = self.start(unit.instrument())
        self.wait_for_state(c, unit.name, "failed")
        holder.kill()  # its file stays
        self.wait_for_state(c, unit.name, "calibration_due")

    def test_a_modem_prober(self):
        """Its AT in the stream of what is asked: the reading is right, or an error; never another.
        expect: the simulators' truth, which the driver's own tests compare with."""
        for unit in (CM700d(self), SP62(self, 1)):
            with self.subTest(kind=unit.kind):
                c, lease = self.ready_with(unit)
                clean = c.measure(lease)["spectrum"]["values"]
                for on in range(1, 6):
                    unit.act(f"fault prober on {on}")
                    try:
                        said = c.measure(lease)["spectrum"]["values"]
                    except Refused as refused:
                        self.assertIn(refused.reason,
                                      ("instrument_protocol", "instrument_timeout"))  # fmt: skip
                        continue
                    worst = max(abs(a - b) for a, b in zip(clean, said))
                    self.assertLess(worst, 0.01)  # two shots of one skin
                unit.act("fault none")
                c.measure(lease)
                self.daemon.stop()

    def test_a_prober_at_the_opening(self):
        for unit in (CM700d(self), SP62(self, 1)):
            with self.subTest(kind=unit.kind):
                unit.come()
                for on in (1, 2, 3):
                    unit.act(f"fault prober on {on}")
                self.start_with(unit, come=False)
                self.daemon.stop()


class Tiles(Told):
    """What an Ocean spectrometer's white tile may be said to be."""

    def with_tile(self, **tile):
        return self.told(f"ocean_ooi:usb,tile={write_tile(self, **tile)},port_mm=8")

    def test_bad_files(self):
        nms, values = tile_rows(400, 700)
        gap = tile_rows(400, 700, without=(500, 510))
        short = tile_rows(420, 700)
        rows = (
            ("bands are missing", {"nms": gap[0], "values": gap[1]}, "give them all"),
            ("a range too short", {"nms": short[0], "values": short[1]}, "ask the maker"),
            ("SCI", {"specular": "sci"}, "sce values"),
            ("neither", {"specular": "d65"}, "must say sce"),
            ("percent", {"nms": nms, "values": [100 * x for x in values]}, "for 98.7 %"),
            ("micrometres", {"nms": [nm / 1000 for nm in nms], "values": values}, "in nm"),
            ("negative", {"nms": nms, "values": [-x for x in values]}, "certificate"),
            ("a grey one", {"nms": nms, "values": [0.3 * x for x in values]}, "no white tile"),
        )
        USB2000(self).come()
        for what, tile, todo in rows:
            with self.subTest(what=what):
                said = self.with_tile(**tile)
                self.expect(("tile.csv", todo), said)

    def test_no_file(self):
        said = self.told("ocean_ooi:usb,tile=/nowhere/tile.csv,port_mm=8")
        self.expect(("/nowhere/tile.csv", "No such file", "name the certificate's"), said)

    def test_mended_while_the_station_runs(self):
        """It is read again with each attempt: no restart."""
        unit = USB2000(self)
        unit.come()
        path = write_tile(self, specular="sci")
        c = self.start(f"ocean_ooi:usb,tile={path},port_mm=8")
        self.wait_for_state(c, unit.name, "failed")
        write_tile(self)
        self.wait_for_state(c, unit.name, "calibration_due")

    def test_what_is_missing_or_unknown(self):
        tile = write_tile(self)
        for address, todo in (
            ("usb,port_mm=8", "tile=FILE"),
            (f"usb,tile={tile}", "port_mm=N"),
            (f"usb,tile={tile},port_mm=0", "1 to 100"),
            (f"usb,tile={tile},port_mm=8,model=usb9000", "usb2000+"),
            (f"usb,tile={tile},port_mm=8,lamp=on", "tile, port_mm, greys and model"),
        ):
            with self.subTest(address=address):
                self.expect((todo,), self.told(f"ocean_ooi:{address}"))

    def test_eeprom(self):
        """Calibration constants that are none."""
        unit = USB2000(self)
        unit.come()
        unit.act("fault slots")
        said = self.told(unit.instrument())
        self.assertIn("programmed anew by its maker", said)

    def test_not_plugged_in(self):
        started = time.monotonic()
        said = self.told(USB2000(self).instrument(), state="gone")
        self.expect(("connect",), said)
        self.assertLess(time.monotonic() - started, 30 if INSTRUMENTED else 10)


if __name__ == "__main__":
    main()
