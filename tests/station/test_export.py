#!/usr/bin/env python3
"""test_export.py - files that a running station exports, read by programs that know nothing of
it: ArgyllCMS, Python's csv, and our own command line."""

import csv
import io
import math
import os
import shutil
import subprocess
import tempfile
import unittest

from daemon import Case, main
from support import BUILD, EXAMPLES, TWO_LAYER, run

# ColorChecker's two skins, BabelColor's average (D. Pascale, 2012), 380..730 by 10.
PATCHES = {
    "dark, as printed": [
        0.055, 0.058, 0.061, 0.062, 0.062, 0.062, 0.062, 0.062, 0.062, 0.062, 0.062, 0.063,
        0.065, 0.07, 0.076, 0.079, 0.081, 0.084, 0.091, 0.103, 0.119, 0.134, 0.143, 0.147,
        0.151, 0.158, 0.168, 0.179, 0.188, 0.19, 0.186, 0.181, 0.182, 0.187, 0.196, 0.209],
    '=the "light" one': [
        0.117, 0.143, 0.175, 0.191, 0.196, 0.199, 0.204, 0.213, 0.228, 0.251, 0.28, 0.309,
        0.329, 0.333, 0.315, 0.286, 0.273, 0.276, 0.277, 0.289, 0.339, 0.42, 0.488, 0.525,
        0.546, 0.562, 0.578, 0.595, 0.612, 0.625, 0.638, 0.656, 0.678, 0.7, 0.717, 0.734],
}  # fmt: skip


def skins():
    """(site, spectrum): the examples, the patches, and one by 20 nm, which has no colour."""
    with open(EXAMPLES, encoding="ascii", newline="") as file:
        for row in csv.DictReader(line for line in file if not line.startswith("#")):
            values = [float(row[str(nm)]) for nm in range(400, 701, 10)]
            yield row["id"], {"first_nm": 400, "step_nm": 10, "values": values}
    for site, values in PATCHES.items():
        yield site, {"first_nm": 380, "step_nm": 10, "values": values}
    yield "by 20 nm", {"first_nm": 400, "step_nm": 20, "values": [0.3] * 16}


class Exported(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        with cls.daemon.client() as c:
            for site, spectrum in skins():
                c.call("match.spectrum", spectrum=spectrum, specular="sce", store=True, site=site,
                       by="spectrum")  # fmt: skip
            cls.records = c.call("record.list")["records"]

    def exported(self, form):
        """All of it, by pages of three."""
        c, text, more = self.client(), "", {}
        while True:
            page = c.call("record.export", format=form, limit=3, **more)
            text += page["text"]
            if not page["more"]:
                return text
            more = {"since_seq": page["next_seq"], "until_seq": page["until_seq"]}

    # ---- ArgyllCMS --------------------------------------------------------------------

    def spec2cie(self, text):
        """XYZ and Lab of each sample by ArgyllCMS, for D65 and 10 degrees."""
        if shutil.which("spec2cie") is None:
            self.skipTest("spec2cie: not here, install argyll")
        folder = self.enterContext(tempfile.TemporaryDirectory(dir=BUILD))
        given, made = os.path.join(folder, "given.sp"), os.path.join(folder, "made.sp")
        with open(given, "w", encoding="utf-8", newline="") as file:
            file.write(text)
        done = subprocess.run(
            ["spec2cie", "-n", "-i", "D65", "-o", "1964_10", given, made],
            capture_output=True, text=True, timeout=60, check=False,
        )  # fmt: skip
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        with open(made, encoding="utf-8") as file:
            lines = file.read().splitlines()
        fields = lines[lines.index("BEGIN_DATA_FORMAT") + 1].split()
        for line in lines[lines.index("BEGIN_DATA") + 1 : lines.index("END_DATA")]:
            sample = dict(zip(fields, line.split()))
            yield (
                sample["SAMPLE_ID"].strip('"'),
                [float(sample["XYZ_" + name]) for name in "XYZ"],
                [float(sample["D65LAB_" + name]) for name in "LAB"],
            )

    def test_argyll_takes_it_and_agrees(self):
        """ArgyllCMS sums by 1 nm between bands, we weigh bands by 10 nm: seen 0.0034 (XYZ) and
        0.0065 (Lab) apart at most."""
        samples = list(self.spec2cie(self.exported("cgats")))
        coloured = [record for record in self.records if "XYZ" in record]
        self.assertEqual(len(coloured), len(self.records) - 1)
        self.assertEqual([sample[0] for sample in samples], [record["id"] for record in coloured])
        for (_, XYZ, Lab), record in zip(samples, coloured):
            with self.subTest(site=record["site"]):
                self.assertLess(math.dist(XYZ, record["XYZ"]), 0.01)
                self.assertLess(math.dist(Lab, record["Lab"]), 0.01)

    def test_head_says_what_is_left_out(self):
        self.assertIn("left out for want of a band or a colour: 1\n", self.exported("cgats"))

    # ---- CSV --------------------------------------------------------------------------

    def test_csv_as_python_reads_it(self):
        rows = list(csv.DictReader(io.StringIO(self.exported("csv"), newline="")))
        self.assertEqual([row["id"] for row in rows], [record["id"] for record in self.records])
        for row, record in zip(rows, self.records):
            with self.subTest(site=record["site"]):
                formula = record["site"].startswith("=")
                self.assertEqual(row["site"], "'" * formula + record["site"])
                for name in ("X", "Y", "Z"):
                    XYZ = dict(zip("XYZ", record.get("XYZ", ())))
                    self.assertEqual(row[name], repr_of(XYZ.get(name)))
                spectrum = record["spectrum"]
                nm = [spectrum["first_nm"] + i * spectrum["step_nm"]
                      for i in range(len(spectrum["values"]))]  # fmt: skip
                at = dict(zip(nm, spectrum["values"]))
                for x in range(360, 741, 10):
                    column = str(x) if 400 <= x <= 700 else f"nm{x}"
                    self.assertEqual(row[column], repr_of(at.get(x)), column)

    def test_match_reads_it(self):
        """The rows with all bands from 400 to 700 nm match as they did; the other is refused."""
        done = run("match", "-", "--table", TWO_LAYER, "--by", "spectrum", "--json",
                   stdin=self.exported("csv"))  # fmt: skip
        self.assertEqual(done.status, 1, done.err)
        answers = done.json()
        self.assertEqual(len(answers), len(self.records))
        self.assertIn("no value at 410 nm", answers[-1]["error"])
        for answer, record in zip(answers[:-1], self.records):
            self.assertEqual(answer.pop("id"), record["id"])
            self.assertEqual(answer, record["match"])


def repr_of(x):
    """A number as the fewest digits that read back, as the protocol has them; "" for none."""
    return "" if x is None else repr(x).removesuffix(".0")


if __name__ == "__main__":
    main()
