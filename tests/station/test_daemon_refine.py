#!/usr/bin/env python3
"""test_daemon_refine.py - match.spectrum and measure.start with `refine`: the daemon's answers
against the command line's, which works on files, and against the skin under the simulated
instrument; what the store keeps of them, gives back, exports and computes again."""

import csv
import io
import json
import sqlite3

from client import Refused
from daemon import FAST, Case, Daemon, main, new_uuid
from support import EXAMPLES, TWO_LAYER, run
from test_daemon_records import example_skins

THREE = ("Cm", "Bm", "Ch")
TRUTH = {"Cm": 0.03, "Bm": 0.7, "Ch": 0.01}  # drivers/simulated/simulated.h
# A unit without an error of its own, so that what it sees is that skin but for chance.
TRUE_UNIT = FAST + ",unit=0"


def dig(record, *names):
    for name in names:
        record = record[name]
    return record


class Matching(Case):
    def match(self, c, spectrum, **more):
        return c.call("match.spectrum", **{"spectrum": spectrum, "specular": "sce", "store": False,
                                           "refine": "three", **more})  # fmt: skip

    def test_as_the_command_line_refines(self):
        c = self.client()
        for options, more in (
            ((), {}),
            (("--noise", "0.001"), {"noise": 0.001}),
            (("--placement", "0.01"), {"placement": 0.01}),
            (("--noise", "0.002", "--fix", "Bm=0.25", "--k", "5"), {"noise": 0.002, "fix": {"Bm": 0.25}, "k": 5}),
            (("--by", "rgb"), {"by": "rgb"}),
            (("--refine=skin",), {"refine": "skin"}),
            (("--refine=skin", "--fix", "scattering_b=1.5"), {"refine": "skin", "fix": {"scattering_b": 1.5}}),
        ):
            done = run("match", EXAMPLES, "--table", TWO_LAYER, "--refine", "--json", *options)
            self.assertEqual(done.status, 0, done.err)
            for spectrum, expected in zip(example_skins(), done.json()):
                with self.subTest(options, id=expected.pop("id")):
                    self.assertEqual(self.match(c, spectrum, **more), expected)

    def test_what_is_stored_comes_back(self):
        c = self.client()
        spectrum = next(iter(example_skins()))
        uuid = new_uuid()
        asked = {"store": True, "uuid": uuid, "noise": 0.001, "k": 2}
        stored = self.match(c, spectrum, **asked)
        self.assertEqual(len(dig(stored, "nearest", "rows")), 2)
        retry = self.match(c, spectrum, **asked)
        del stored["nearest"]["rows"]  # they are not stored
        self.assertEqual(retry, stored)
        place = stored.pop("record")
        record = c.call("record.get", id=place["id"])
        self.assertEqual(record["match"], stored)
        again = c.call("record.recompute", id=place["id"])
        self.assertEqual((again["same_bits"], again["difference"]), (True, 0))
        self.assertEqual((again["stored"], again["recomputed"]), (stored, stored))
        with self.refused("uuid_reused"):
            self.match(c, spectrum, **{**asked, "noise": 0.002})
        with self.refused("uuid_reused"):
            self.match(c, spectrum, **{**asked, "refine": "skin"})
        # In the file: the nearest row as ever, and the refined match beside it.
        db = sqlite3.connect(f"file:{self.daemon.state}/station.db?mode=ro", uri=True)
        result, refined = db.execute("SELECT result, refined FROM match WHERE measurement = ?", (place["seq"],)).fetchone()
        db.close()
        self.assertEqual(json.loads(refined), stored)
        nearest = json.loads(result)
        for name in ("Cm", "Bm", "Ch", "distance", "rms"):
            self.assertEqual(nearest[name], dig(stored, "nearest", name))

    def test_refused(self):
        c = self.client()
        spectrum = next(iter(example_skins()))
        for more in ({"noise": 0.001}, {"placement": 0.001}, {"fix": {"Bm": 0}}):
            with self.refused("params_invalid"):
                c.call("match.spectrum", spectrum=spectrum, specular="sce", store=False, **more)
        for more in ({"refine": "four"}, {"noise": 0}, {"noise": -1}, {"placement": -0.1}, {"fix": {"Bm": 2}},
                     {"fix": {"Bm": -0.1}}, {"fix": {"Cm": 0.9}}, {"fix": {"Dm": 0.9}}, {"fix": {"scattering_a": 1}},
                     {"fix": {"Cm": 0.1, "Bm": 0.1, "Ch": 0.1}}):  # fmt: skip
            with self.subTest(more), self.refused("params_invalid"):
                self.match(c, spectrum, **more)
        with self.assertRaises(Refused) as caught:  # the hint says that data.path names the member
            self.match(c, spectrum, fix={"Cm": 0.9})
        self.assertEqual(caught.exception.path, "/params/fix")
        with self.refused("table_unsuitable"):
            self.match(c, spectrum, table="paper")
        with self.refused("spectrum_unsuitable"):
            self.match(c, {"first_nm": 400, "step_nm": 100, "values": [0.2, 0.3, 0.4, 0.5]})
        few = {"first_nm": 400, "step_nm": 10, "values": [0.2, 0.4]}
        with self.refused("spectrum_unsuitable"):
            self.match(c, few)

    def test_hostile_spectra_are_flagged(self):
        c = self.client()
        for value in (0, 0.5, 1, 2):
            got = self.match(c, {"first_nm": 400, "step_nm": 10, "values": [value] * 31})
            self.assertTrue(got["flags"] and got["words"], got)
            self.assertTrue(0 <= got["Cm"] <= 0.5 and 0.001 <= got["Ch"] <= 0.1)


class Measuring(Case):
    instruments = (TRUE_UNIT,)

    def test_the_skin_under_the_instrument(self):
        c, lease = self.ready()
        record = c.measure(lease, replicates=5, refine="three")
        match = record["match"]
        for name in THREE:
            low, high = match["interval"][name]
            self.assertTrue(low <= match[name] <= high)
            self.assertLess(abs(match[name] - TRUTH[name]), 4 * match["se"][name] + 1e-3 * TRUTH[name])
        self.assertEqual(match["noise"]["from"], "replicates")
        self.assertGreater(match["noise"]["placement"], 0)
        self.assertEqual(match["degrees"], 5 * 31 - 3)
        again = c.call("record.recompute", id=record["id"])
        self.assertEqual((again["same_bits"], again["difference"]), (True, 0))
        self.assertEqual(again["stored"], match)
        # The probe put down again and again pins the skin down; one shot knows no placement.
        one = c.measure(lease, replicates=1, refine="three")["match"]
        self.assertEqual(one["noise"]["from"], "population")
        self.assertEqual(one["degrees"], 31 - 3)

    def test_noise_that_is_stated(self):
        c, lease = self.ready()
        uuid = new_uuid()
        asked = {"uuid": uuid, "replicates": 3, "refine": "three", "noise": 0.0007, "placement": 0.006,
                 "fix": {"Bm": 0.7}}  # fmt: skip
        record = c.measure(lease, **asked)
        match = record["match"]
        self.assertEqual(match["noise"], {"white": 0.0007, "placement": 0.006, "from": "stated"})
        self.assertEqual((match["Bm"], match["fixed"], sorted(match["se"])), (0.7, {"Bm": 0.7}, ["Ch", "Cm"]))
        self.assertEqual(c.measure(lease, **asked), record)  # a retry
        self.assertTrue(c.call("record.recompute", id=record["id"])["same_bits"])
        with self.refused("uuid_reused"):
            c.measure(lease, **{**asked, "noise": 0.0008})

    def test_measured_skin(self):
        c, lease = self.ready()
        record = c.measure(lease, replicates=3, refine="skin")
        match = record["match"]
        self.assertEqual((match["refine"], match["noise"]["from"]), ("skin", "replicates"))
        self.assertEqual(sorted(match["scattering"]), ["a", "b"])
        self.assertTrue(0 <= match["SO2"] <= 1)
        again = c.call("record.recompute", id=record["id"])
        self.assertEqual((again["same_bits"], again["stored"]), (True, match))

    def test_sci_less_its_surface(self):
        c, lease = self.ready()
        record = c.measure(lease, replicates=3, specular="sci", surface=0.04, refine="three")
        self.assertEqual(record["match"]["refine"], "three")
        self.assertTrue(c.call("record.recompute", id=record["id"])["same_bits"])

    def test_without_refine_nothing_changes(self):
        c, lease = self.ready()
        match = c.measure(lease, replicates=3)["match"]
        self.assertNotIn("refine", match)
        self.assertNotIn("interval", match)

    def test_refused_before_a_shot(self):
        c, lease = self.ready()
        before = c.call("status.get")["last_seq"]
        for reason, more in (("params_invalid", {"noise": 0.001}),
                             ("params_invalid", {"refine": "three", "fix": {"Ch": 0.5}}),
                             ("table_unsuitable", {"refine": "three", "table": "paper"})):  # fmt: skip
            c.call("table.info", table="paper")
            with self.subTest(more), self.refused(reason):
                c.measure(lease, **more)
        self.assertEqual(c.call("status.get")["last_seq"], before)

    def test_an_outlier_is_left_out(self):
        """Fitted is what the mean is of: with a shot far off the answer is the others'."""
        with Daemon(instruments=(TRUE_UNIT + ",placement=0.06,seed=5",)) as daemon:
            daemon.wait_for_table()
            daemon.wait_for_instrument()
            with daemon.client() as c:
                lease = c.acquire()["lease"]
                c.calibrate(lease)
                for _ in range(20):
                    record = c.measure(lease, replicates=4, refine="three", noise=0.001)
                    if "outlier" in record["flags"]:
                        break
                self.assertIn("outlier", record["flags"])
                self.assertLess(record["match"]["degrees"], 4 * 31 - 3)
                self.assertEqual(record["match"]["degrees"] % 31, 31 - 3)
                self.assertTrue(c.call("record.recompute", id=record["id"])["same_bits"])

    def test_exported(self):
        c, lease = self.ready()
        record = c.measure(lease, replicates=3, refine="three")
        match = record["match"]
        since = record["seq"] - 1
        text = c.call("record.export", format="csv", since_seq=since, head=True)["text"]
        row = next(csv.DictReader(io.StringIO(text, newline="")))
        expected = {"Cm": match["Cm"], "dE00": match["dE00"], "rms": match["rms"], "p": match["p"],
                    "chi_square": match["chi_square"], "degrees": match["degrees"], "row": match["nearest"]["row"],
                    "nearest_Cm": match["nearest"]["Cm"], "noise": match["noise"]["white"],
                    "placement": match["noise"]["placement"]}  # fmt: skip
        for name in THREE:
            expected |= {f"{name}_se": match["se"][name], f"{name}_lo": match["interval"][name][0],
                         f"{name}_hi": match["interval"][name][1]}  # fmt: skip
        self.assertEqual({name: float(row[name]) for name in expected}, expected)
        self.assertEqual((row["refine"], row["SO2"], row["scattering_a_hi"]), ("three", "", ""))
        self.assertEqual(row["match_flags"], ";".join(match["flags"]))
        whole = c.call("record.export", format="json", since_seq=since, head=True)["text"]
        self.assertEqual(json.loads(whole)[0]["match"], match)
        cgats = c.call("record.export", format="cgats", since_seq=since, head=True)["text"]
        self.assertIn(record["id"], cgats)


if __name__ == "__main__":
    main()
