#!/usr/bin/env python3
"""test_doctor.py - `skinspec doctor`: what it sees of mocked devices, and its walk through an
instrument that is a capture."""

import json
import os
import shutil
import tempfile

from simhost import Simhost, drivers
from support import ROOT, TABLES, Case, environment, main, run

CAPTURES = os.path.join(ROOT, "drivers", "ocean_ooi", "captures")
OCEAN = (
    f"ocean_ooi:replay:{CAPTURES}/usb2000-simulated.txt,"
    f"tile={CAPTURES}/tile-simulated.csv,port_mm=8"
)


class Look(Case):
    """In a mocked /sys, whatever this machine has."""

    def setUp(self):
        self.host = self.enterContext(Simhost())

    def look(self, *options):
        return run("doctor", *options, env=self.host.env)

    def test_nothing(self):
        done = self.look()
        self.assertEqual((done.status, done.err), (0, ""))
        self.assertIn("no tty of a USB device and no USB instrument is there: connect it", done.out)
        found = self.look("--json").json()
        self.assertEqual(found["devices"], [])
        self.assertTrue(found["skinspecd"].endswith("skinspecd"))

    def test_a_tty(self):
        self.host.say("plug cm700d one ttyACM0 serial=00012345")
        self.host.say("plug cm700d two ttyACM7 serial=00099999")
        found = self.look("--json").json()["devices"]
        self.assertEqual([x["node"] for x in found], ["/dev/ttyACM0", "/dev/ttyACM7"])
        self.assertEqual([x["serial"] for x in found], ["00012345", "00099999"])
        for device in found:
            self.assertRegex(device["usb"], "^132b:[0-9a-f]{4}$")
            self.assertEqual(device["kind"], "tty")
            self.assertEqual(device.get("driver"), "km_ascii" if "km_ascii" in drivers() else None)
            self.assertRegex(device["mode"], "^0[0-7]{3}$")
        out = self.look().out
        self.assertIn("/dev/ttyACM0  132b:", out)
        self.assertIn("serial 00012345\n", out)
        self.assertIn(":/dev/ttyACM0", out)

    def test_gone_again(self):
        self.host.say("plug cm700d one ttyACM0 serial=00012345")
        self.host.say("unplug one")
        self.assertEqual(self.look("--json").json()["devices"], [])


class Walk(Case):
    def setUp(self):
        self.place = tempfile.mkdtemp(prefix="dw.", dir="/tmp")
        self.addCleanup(shutil.rmtree, self.place, ignore_errors=True)
        self.capture = os.path.join(self.place, "walk.txt")

    def walk(self, answers, *options, instrument=OCEAN):
        tmp = tempfile.mkdtemp(dir=self.place)
        done = run("doctor", "--instrument", instrument, "--record", self.capture, "--tables", TABLES,
                   *options, stdin="".join(x + "\n" for x in answers),
                   env=environment(TMPDIR=tmp))  # fmt: skip
        self.assertEqual(os.listdir(tmp), [])
        return done

    def notes(self):
        with open(self.capture, encoding="ascii") as file:
            return [x[len("# doctor: ") : -1] for x in file if x.startswith("# doctor: ")]

    # zero, white, shots; label, display, label, lamp off, lamp on, speed; cable
    ANSWERS = ("", "", "", "USB2000+", "", "a USB2000+", "s", "s", "alone", "s")

    def test_to_its_end(self):
        done = self.walk(self.ANSWERS)
        self.assertEqual(done.status, 0, done.err)
        self.assertIn(f"The capture is {self.capture}.\n", done.out)
        self.assertIn(f"skinspec replay {self.capture}\n", done.out)
        notes = self.notes()
        self.assertEqual(notes[0], "open: done")
        self.assertRegex(notes[1], r"^identity: maker Ocean Optics, model USB2000\+, serial SIM00042")
        self.assertEqual(notes[3:5], ["calibrate zero: done", "calibrate white: done"])
        self.assertRegex(notes[5], r"^three shots: done: L\* \d+\.\d\d  a\* ")
        self.assertEqual(notes[6], "button: the driver knows of none")
        self.assertTrue(notes[7].startswith("label: ") and notes[7].endswith(" -> USB2000+"))
        self.assertTrue(notes[8].endswith(" -> not known"), notes[8])
        self.assertIn("lamp off: skipped", notes)
        self.assertEqual(notes[-1], "cable: skipped")
        for text in ("put the black trap at the port", "SIM-WHITE", "Lamp", "s: skip"):
            self.assertIn(text.lower(), done.err.lower())

    def test_its_capture_can_be_replayed(self):
        self.walk(self.ANSWERS)
        done = run("replay", self.capture, "--tables", TABLES, "--with",
                   f"tile={CAPTURES}/tile-simulated.csv,port_mm=8")  # fmt: skip
        self.assertEqual(done.status, 0, done.out + done.err)
        self.assertIn("measure sce, 3 shots: same\n", done.out)

    def test_json(self):
        done = self.walk(self.ANSWERS, "--json")
        result = json.loads(done.out)
        self.assertEqual((result["capture"], result["whole"]), (self.capture, True))
        self.assertEqual(
            [f"{x['step']}: {x['outcome']}" for x in result["steps"]], self.notes()
        )

    def test_left_early(self):
        for what, answers in (("q", ("", "q")), ("standard input ends", ("",))):
            with self.subTest(what):
                done = self.walk(answers)
                self.assertEqual(done.status, 1)
                self.assertEqual(self.notes()[-1], "calibrate zero: done")
                self.assertIn("The capture is", done.out)
                os.unlink(self.capture)

    def test_a_step_that_fails(self):
        """The white before the zero: said by the station, and the walk goes on."""
        done = self.walk(("s", "", "s", "q"))
        self.assertEqual(done.status, 1)
        notes = self.notes()
        self.assertIn("calibrate zero: skipped", notes)
        self.assertTrue(any(x.startswith("calibrate white: failed: ") and
                            x.endswith("(calibration_order)") for x in notes), notes)  # fmt: skip

    def test_what_cannot_be_walked_through(self):
        for instrument, says in (
            ("no_such:usb", "there is no driver 'no_such'"),
            ("simulated", "has no wire"),
            ("auto", "more than one could come"),
        ):
            with self.subTest(instrument):
                done = self.walk((), instrument=instrument)
                self.assertEqual((done.status, done.out), (1, ""))
                self.assertIn(says, done.err)
                self.assertFalse(os.path.exists(self.capture))

    def test_an_instrument_that_does_not_open(self):
        done = self.walk((), instrument=OCEAN.replace("usb2000", "no-such"))
        self.assertEqual(done.status, 1)
        self.assertRegex(self.notes()[0], "^open: failed: cannot replay .*no-such")

    def test_an_existing_file_is_kept(self):
        with open(self.capture, "w", encoding="ascii") as file:
            file.write("mine\n")
        done = self.walk(self.ANSWERS)
        self.assertEqual((done.status, done.out), (1, ""))
        self.assertIn("never written over", done.err)
        with open(self.capture, encoding="ascii") as file:
            self.assertEqual(file.read(), "mine\n")

    def test_usage(self):
        self.refused(2, "doctor", "--record", "x", says="--record goes with --instrument")
        self.refused(2, "doctor", "what")


if __name__ == "__main__":
    main()
