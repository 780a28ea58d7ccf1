#!/usr/bin/env python3
"""test_shipped_captures.py - `skinspec replay` of each capture in drivers/*/captures, as
docs/drivers.md shows it.

The records in them were answered when they were made (tests/station/make_captures.py)."""

import glob
import os

from support import ROOT, Case, main, run

CALIBRATED = "calibrate zero: done\ncalibrate white: done\n"
HANDHELD = CALIBRATED + (
    "measure sce, 3 shots: same\nmeasure sce, 2 shots: same\nsame: 2 measurements bit for bit\n"
)
SPECTROMETER = CALIBRATED + "measure sce, 1 shot: same\n" * 3 + "same: 3 measurements bit for bit\n"
EACH = {
    "drivers/km_ascii/captures/cm700d.capture": HANDHELD,
    "drivers/km_ascii/captures/cm2600d.capture": HANDHELD,
    "drivers/xrite_rci/captures/sp62.capture": HANDHELD,
    "drivers/ocean_ooi/captures/usb2000-simulated.txt": SPECTROMETER,
}


def heading(path):
    with open(os.path.join(ROOT, path), encoding="ascii") as file:
        return [line[2:].rstrip("\n") for line in file if line.startswith("# ")]


class Shipped(Case):
    def test_each_gives_the_same_records(self):
        for path, says in EACH.items():
            with self.subTest(path):
                done = run("replay", path, cwd=ROOT)
                self.assertEqual((done.status, done.out, done.err), (0, says, ""))

    def test_from_another_folder(self):
        """No table is wanted, and the spectrometer's tile is beside its capture."""
        for path, says in EACH.items():
            with self.subTest(path):
                done = run("replay", os.path.join(ROOT, path), cwd=self.folder())
                self.assertEqual((done.status, done.out, done.err), (0, says, ""))

    def test_all_are_here_and_headed(self):
        found = [os.path.relpath(x, ROOT) for x in glob.glob(ROOT + "/drivers/*/captures/*")]
        self.assertEqual(sorted(x for x in found if not x.endswith(".csv")), sorted(EACH))
        for path in EACH:
            with self.subTest(path):
                notes = heading(path)
                for what in ("skinspec capture 1", "date: 20", "by: ", "done: ", "compared: ", "model: "):
                    self.assertTrue(any(x.startswith(what) for x in notes), what)
                self.assertIn("simulated, not seen on hardware", notes)

    def test_the_command_is_documented(self):
        with open(os.path.join(ROOT, "docs", "drivers.md"), encoding="utf-8") as file:
            text = file.read()
        shown = [x.split("replay ", 1)[1].split()[0] for x in text.splitlines()
                 if "skinspec replay drivers/" in x]  # fmt: skip
        self.assertTrue(shown)
        for path in shown:
            self.assertIn(path, EACH)


if __name__ == "__main__":
    main()
