#!/usr/bin/env python3
"""test_station_refine.py - `skinspec measure --refine` through a real skinspecd: what a person sees of
the interval then, in `history` and in `watch`."""

import os
import signal

from station_case import SPECTRUM, StationCase
from support import TIMEOUT_S, main, run


def interval(match, name, digits):
    """As it is shown: "Cm 0.0310 (0.0280 .. 0.0350)"."""
    low, high = match["interval"][name]
    return f"{name} {match[name]:.{digits}f} ({low:.{digits}f} .. {high:.{digits}f})"


def shown(match):
    return "  ".join(interval(match, name, digits) for name, digits in (("Cm", 4), ("Bm", 2), ("Ch", 4)))


class Refined(StationCase):
    def setUp(self):
        self.calibrated()

    def test_measured(self):
        record = self.done("measure", "--refine", "--json").json()
        match = record["match"]
        self.assertEqual((match["refine"], match["noise"]["from"]), ("three", "replicates"))
        stated = self.done("measure", "--refine=three", "--noise", "0.0007", "--placement", "0.004", "--fix",
                           "Bm=0.7", "--replicates", 2, "--json").json()["match"]  # fmt: skip
        self.assertEqual(stated["noise"], {"white": 0.0007, "placement": 0.004, "from": "stated"})
        self.assertEqual(stated["fixed"], {"Bm": 0.7})
        self.assertNotIn("refine", self.done("measure", "--json").json()["match"])

    def test_for_a_person(self):
        out = self.done("measure", "--refine", "--noise", "0.0005", "--placement", "0.01").out
        record = self.done("history", "--limit", 1, "--json").json()[0]
        match = record["match"]
        nearest = match["nearest"]
        self.assertIn(f"  skin     {shown(match)}\n", out)
        self.assertIn(f"  fit      three: rms {match['rms']:.4f}, dE00 {match['dE00']:.2f}, chi-square "
                      f"{match['chi_square']:.1f} of {match['degrees']} degrees, p ", out)  # fmt: skip
        self.assertIn("  noise    0.0005 a band, 0.01 placement (stated)\n", out)
        self.assertIn(f"  nearest  Cm {nearest['Cm']:.4f}  Bm {nearest['Bm']:.2f}  Ch {nearest['Ch']:.4f}: row "
                      f"{nearest['row']}, distance ", out)  # fmt: skip
        # The same page later, a line in the list, and computed again.
        page = self.done("history", record["id"]).out
        self.assertEqual(page[page.index("  skin "):], out[out.index("  skin "):])
        line = self.done("history", "--limit", 1).out.splitlines()[-1]
        self.assertIn(f"{match['Cm']:8.4f}{match['Bm']:6.2f}{match['Ch']:8.4f}", line)
        again = self.done("history", record["id"], "--recompute").out
        self.assertIn("the same to the last bit", again)
        self.assertEqual(again.count(f"  skin     {shown(match)}\n"), 2)

    def test_measured_skin(self):
        out = self.done("measure", "--refine=skin").out
        match = self.done("history", "--limit", 1, "--json").json()[0]["match"]
        scattering = {"scattering a": match["scattering"]["a"], "b": match["scattering"]["b"]}
        pairs = {"scattering a": match["interval"]["scattering"]["a"], "b": match["interval"]["scattering"]["b"]}
        told = {**match, **scattering, "interval": {**match["interval"], **pairs}}
        self.assertIn(f"  skin     {interval(match, 'Cm', 4)}  Bm 0.25  {interval(match, 'Ch', 4)}\n", out)
        self.assertIn(f"           {interval(match, 'SO2', 2)}  epidermis 0.080 mm  {interval(told, 'scattering a', 2)} "
                      f"/mm  {interval(told, 'b', 2)}\n", out)  # fmt: skip
        self.assertIn("a band, the skin differs between placements (replicates)\n", out)

    def test_what_cannot_be_told_is_said_in_words(self):
        with self.client() as c:
            got = c.call("match.spectrum", spectrum={**SPECTRUM, "values": [0.5] * 31}, specular="sce", store=True,
                         refine="three")  # fmt: skip
        self.assertTrue(got["words"])
        page = self.done("history", got["record"]["id"]).out
        for words in got["words"]:
            self.assertIn(f"  beware   {words}\n", page)
        self.assertIn(f"  flags    {' '.join(got['flags'])}\n", page)

    def test_watched(self):
        before = self.client().call("status.get")["event_seq"]
        with self.start("watch", "--topics", "measurement", "--since", before, stdout=-1, stderr=-1) as child:
            record = self.done("measure", "--refine", "--json").json()
            lines = [""]
            while "  record " not in lines[-1]:
                lines.append(child.stdout.readline().decode())
            child.send_signal(signal.SIGINT)
            child.communicate(timeout=TIMEOUT_S)
        self.assertIn("measurement/done", lines[-2])
        words = "".join(f"; {x}" for x in record["match"]["words"])
        self.assertEqual(lines[-1], f"        record {record['seq']}  {shown(record['match'])}{words}\n")

    def test_refused(self):
        for options, says in (
            (("--noise", "0.01"), "--noise goes with --refine"),
            (("--refine", "--noise", "0"), "outside"),
            (("--refine=four",), "--refine: 'four'"),
            (("--refine", "--fix", "Bm"), "NAME=X"),
        ):
            self.refuses(2, "measure", *options, says=says)
        self.refuses(1, "measure", "--refine", "--fix", "Bm=1.5", says="Bm")
        self.refuses(1, "measure", "--refine", "--table", "paper", says="paper")

    def test_exported(self):
        record = self.done("measure", "--refine", "--json").json()
        out = os.path.join(self.folder(), "all.csv")
        self.done("export", "--format", "csv", "--out", out)
        # What was exported is a spectrum file all the same.
        rows = run("match", out, "--refine", "--json")
        self.assertEqual(rows.status, 0, rows.err)
        last = rows.json()[-1]
        self.assertEqual(last["id"], record["id"])
        self.assertAlmostEqual(last["Cm"], record["match"]["Cm"], delta=record["match"]["se"]["Cm"])


if __name__ == "__main__":
    main()
