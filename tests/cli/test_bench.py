#!/usr/bin/env python3
"""test_bench.py - `skinspec bench`: figures known from elsewhere, the fronts, and its files."""

import ast
import csv
import io
import json
import os
import re
import signal
import subprocess
import time
import unittest
import xml.etree.ElementTree

from support import BUILD, ROOT, SKINSPEC, TIMEOUT_S, Case, main, run

# By sanitizers, whose malloc() keeps other books, or by counting lines.
SLOWED = os.path.basename(BUILD) in ("asan", "tsan", "cover")

ERRORS = ("Cm", "Bm", "Ch")

# Fits and bounds: docs/inversion.md, "What the numbers mean": 40 000 noisy spectra of the same
# kind of skins by tests/reference/inversion.py, which shares no code with the program.  500
# skins tell a root mean square to 10 %, its heavy tail (dark skins) to 25 %.
KNOWN = {
    ("half-space", "three"): (0.0034, 0.060, 0.0024),
    ("two-layer", "three"): (0.0020, 0.052, 0.0023),
}
OVER_BOUND = {"half-space": (0.90, 0.91, 0.89), "two-layer": (0.98, 0.95, 0.88)}

# rms of R against transport: optics/transport.h (60 skins of tests/reference/transport_skins.csv,
# against 64 streams), docs/physics.md for the others; of other skins, so to 40 %.
LADDER = {
    "half-space": 0.08,
    "kubelka-munk": 0.027,
    "two-layer": 0.006,
    "transport-4": 0.0043,
    "transport-8": 0.00093,
    "transport-16": 1.4e-4,
    "transport-32": 1.6e-5,
}

COST_COLUMNS = (
    "model,rows,by,refine,interval,us,us_p95,Cm,Bm,Ch,Cm_transport,Bm_transport,"
    "Ch_transport,dE00,rms_R,bytes"
)


def rows_of(text):
    """CSV below its lines of remarks."""
    lines = [x for x in text.splitlines() if not x.startswith("#")]
    return list(csv.DictReader(io.StringIO("\n".join(lines))))


def dominated(points, which):
    """Is another as good in both and better in one?"""
    us, error = points[which]
    return any(
        u <= us and e <= error and (u < us or e < error)
        for i, (u, e) in enumerate(points)
        if i != which
    )


class Quick(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        folder = cls.shared_folder
        names = ("csv", "svg", "md", "costs", "c")
        cls.path = {x: os.path.join(folder, f"bench.{x}") for x in names}
        began = time.monotonic()
        cls.done = subprocess.run(
            [SKINSPEC, "bench", "--quick", "--json", "--out", cls.path["csv"], "--svg"]
            + [cls.path["svg"], "--markdown", cls.path["md"], "--calibrate", "--costs"]
            + [cls.path["costs"], "--c-source", cls.path["c"]],
            capture_output=True,
            text=True,
            timeout=600,
            check=False,
        )
        cls.seconds = time.monotonic() - began
        if cls.done.returncode != 0:
            raise AssertionError(cls.done.stderr)
        cls.json = json.loads(cls.done.stdout)

    def text(self, name):
        with open(self.path[name], encoding="utf-8") as f:
            return f.read()

    def find(self, **members):
        found = [
            x for x in self.json["inversion"] if all(x.get(k) == v for k, v in members.items())
        ]
        self.assertEqual(len(found), 1, f"{members}: {[x['name'] for x in found]}")
        return found[0]

    # ---- figures known from elsewhere ----------------------------------------------------

    def test_fits_err_as_the_reference_says(self):
        for (model, answer), expected in KNOWN.items():
            got = self.find(model=model, answer=answer, rows=0, interval=False, batch=False, kernel="quick")
            for name, value in zip(ERRORS, expected):
                self.assertClose(got["own"][name], value, relative=0.25, what=f"{model} {name}")

    def test_the_bound_is_the_references(self):
        bounds = {x["model"]: x for x in self.json["bounds"]}
        for model, ratios in OVER_BOUND.items():
            for name, value, ratio in zip(ERRORS, KNOWN[model, "three"], ratios):
                expected = value / ratio
                self.assertClose(bounds[model][name], expected, relative=0.25, what=model + name)

    def test_the_closed_form_is_nearly_as_good(self):
        """.0032 .050 .0025 beside a fit's .0028 .048 .0024, by another program."""
        got = self.find(model="half-space", answer="closed form")["own"]
        fit = self.find(
            model="half-space", answer="three", rows=0, interval=False, batch=False, kernel="quick"
        )["own"]
        for name, most in zip(ERRORS, (1.4, 1.25, 1.25)):
            self.assertLess(0.85 * fit[name], got[name], name)
            self.assertLess(got[name], most * fit[name], name)

    def test_colours_tell_less_than_spectra(self):
        """docs/inversion.md: by 8-bit sRGB several times the error of a fit."""
        for model in ("half-space", "two-layer"):
            rgb = self.find(model=model, rows=50400, by="rgb", answer="nearest")["own"]
            row = self.find(model=model, rows=50400, by="spectrum", answer="nearest")["own"]
            for name in ("Bm", "Ch"):
                self.assertGreater(rgb[name], 2 * row[name], f"{model} {name}")

    def test_the_ladder_of_models(self):
        got = {x["name"]: x for x in self.json["forward"]}
        for name, value in LADDER.items():
            self.assertClose(got[name]["rms_R"], value, relative=0.4, what=name)
            self.assertGreater(got[name]["worst_R"], got[name]["rms_R"])
        self.assertNotIn("rms_R", got["paper"])
        # Noise of walks falls as the root of their number.
        few, many = (got[f"monte-carlo, {n} photons"]["rms_R"] for n in (100, 1000))
        self.assertClose(few / many, 10**0.5, relative=0.35, what="walks")

    def test_kernels_are_the_same_model(self):
        for model in ("half-space", "two-layer"):
            plain = next(x for x in self.json["forward"] if x["name"] == model)
            others = [x for x in self.json["forward"] if x["name"].startswith(model + ", ")]
            self.assertGreaterEqual(len(others), 3)
            for other in others:
                self.assertClose(other["rms_R"], plain["rms_R"], relative=1e-9, what=other["name"])
            a, b = (
                self.find(model=model, answer="three", rows=0, interval=False, batch=False, kernel=x)
                for x in ("quick", "plain")
            )
            for name in ERRORS:
                self.assertClose(a["own"][name], b["own"][name], relative=1e-4, what=name)

    def test_a_batch_answers_as_one_by_one_does(self):
        """To 1e-3 standard errors (match/refine_many.h)."""
        for model in ("half-space", "two-layer"):
            one, many = (
                self.find(
                    model=model, answer="three", rows=0, interval=False, batch=x, kernel="quick"
                )
                for x in (False, True)
            )
            for name in ERRORS:
                for set_ in ("own", "transport"):
                    self.assertClose(many[set_][name], one[set_][name], relative=2e-3)

    def test_transports_own_fit_has_no_model_error(self):
        own = self.find(model="transport-8", answer="three", rows=0, interval=False)
        for name in ERRORS:
            self.assertClose(own["transport"][name], own["own"][name], relative=0.25, what=name)
        wrong = self.find(
            model="two-layer", answer="three", rows=0, interval=False, batch=False, kernel="quick"
        )
        self.assertGreater(wrong["transport"]["times"], 3 * own["transport"]["times"])

    # ---- times, memory, fronts -----------------------------------------------------------

    def test_quick_is_quick(self):
        if not SLOWED:
            self.assertLess(self.seconds, 60.0)

    def test_times_and_bytes(self):
        for x in self.json["inversion"] + self.json["forward"]:
            self.assertGreater(x["us"], 0.0, x["name"])
            self.assertGreaterEqual(x["us_p95"], x["us"], x["name"])
            self.assertGreaterEqual(x["timed"], 8, x["name"])
        if SLOWED:
            return  # there malloc() keeps no books
        for x in self.json["inversion"]:
            # Nine doubles a row, and 32 floats where there are spectra.
            least = x["rows"] * (72 + (0 if x["model"] == "paper" else 128))
            self.assertGreaterEqual(x["bytes"], max(least, 10000), x["name"])
            self.assertLess(x["bytes"], 2 * least + 1000000, x["name"])

    def test_fronts_are_fronts(self):
        models = {x["model"] for x in self.json["inversion"]}
        sets = [("transport", list(self.json["inversion"]))]
        sets += [("own", [x for x in self.json["inversion"] if x["model"] == m]) for m in models]
        for name, all_of_it in sets:
            there = [x for x in all_of_it if "times" in x[name]]
            points = [(x["us"], x[name]["times"]) for x in there]
            for i, x in enumerate(there):
                self.assertEqual(x[name]["front"], not dominated(points, i), x["name"])
        there = [x for x in self.json["forward"] if "rms_R" in x]
        points = [(x["us"], x["rms_R"]) for x in there]
        for i, x in enumerate(there):
            self.assertEqual(x["front"], not dominated(points, i), x["name"])

    def test_what_is_held_or_unknown_is_left_out(self):
        paper = self.find(model="paper", rows=50400)
        self.assertNotIn("Cm", paper["own"])
        self.assertIn("Cm", paper["transport"])
        skin = self.find(model="two-layer", answer="skin", rows=0, interval=False)
        self.assertNotIn("Bm", skin["own"])
        self.assertIn("Ch", skin["own"])

    # ---- files ---------------------------------------------------------------------------

    def test_the_csv_says_the_same(self):
        rows = rows_of(self.text("csv"))
        kinds = {}
        for row in rows:
            self.assertNotIn(None, row, "a field too many")
            self.assertNotIn(None, row.values(), "a field too few")
            kinds.setdefault(row["kind"], []).append(row)
        for kind, name in (("inversion",) * 2, ("bound", "bounds"), ("forward",) * 2):
            self.assertEqual(len(kinds[kind]), len(self.json[name]), kind)
        for row, x in zip(kinds["inversion"], self.json["inversion"]):
            self.assertEqual(row["name"], x["name"])
            self.assertClose(float(row["us"]), x["us"], relative=1e-3)
            for column, value in (
                ("Bm", x["own"].get("Bm")),
                ("Bm_transport", x["transport"].get("Bm")),
                ("times_own", x["own"].get("times")),
                ("times", x["transport"].get("times")),
            ):
                if value is None:
                    self.assertEqual(row[column], "", column)
                else:
                    self.assertClose(float(row[column]), value, relative=1e-3, what=column)
            self.assertEqual(row["front"], "1" if x["transport"]["front"] else "0")
            self.assertEqual(int(row["bytes"]), x["bytes"])
        for row, x in zip(kinds["forward"], self.json["forward"]):
            self.assertEqual(row["name"], x["name"])
            if "rms_R" in x:
                self.assertClose(float(row["rms_R"]), x["rms_R"], relative=1e-3)
                self.assertClose(float(row["worst_R"]), x["worst_R"], relative=1e-3)

    def test_the_picture_is_well_formed(self):
        root = xml.etree.ElementTree.parse(self.path["svg"]).getroot()
        width, height = (float(x) for x in root.get("viewBox").split()[2:])
        texts = [x for x in root.iter() if x.tag.endswith("text")]
        said = " ".join(x.text or "" for x in texts)
        for wanted in ("Error against run time", "two-layer", "transport-8", self.json["machine"]):
            self.assertIn(wanted, said)
        for x in texts:
            if x.get("transform") is None:
                self.assertTrue(0 <= float(x.get("x")) < width, x.text)
                self.assertTrue(0 <= float(x.get("y")) < height, x.text)
        self.assertNotRegex(self.text("svg"), r"\b(nan|inf)\b")

    def test_the_page_names_machine_and_picture(self):
        page = self.text("md")
        for wanted in (
            "# Error against run time",
            self.json["machine"],
            "](bench.svg)",
            "## What to conclude",
            "### two-layer",
            "## How it was measured",
        ):
            self.assertIn(wanted, page)
        for x in self.json["inversion"]:
            self.assertIn(f"| {x['name']} |", page)
        columns = None
        for line in page.splitlines():  # every row of a table has as many cells
            columns = None if not line.startswith("|") else columns or line.count("|")
            self.assertTrue(columns is None or line.count("|") == columns, line)

    def test_the_costs_are_those_of_the_run(self):
        lines = self.text("costs").splitlines()
        self.assertEqual(lines[0], "# machine: " + self.json["machine"])
        rows = rows_of(self.text("costs"))
        self.assertEqual(lines[1:3], [f"# costs: {len(rows)}", COST_COLUMNS])
        chosen = [x for x in self.json["inversion"] if x["kernel"] == "quick" and not x["batch"]]
        self.assertEqual(len(rows), len(chosen))
        for row, x in zip(rows, chosen):
            self.assertEqual((row["model"], int(row["rows"])), (x["model"], x["rows"]))
            self.assertEqual(row["interval"], "1" if x["interval"] else "0")
            self.assertClose(float(row["us"]), x["us"], relative=1e-3)
            self.assertEqual(int(row["bytes"]), x["bytes"])

    def test_the_source_holds_the_same_text(self):
        source = self.text("c")
        strings = re.findall(r'^    ("(?:[^"\\]|\\.)*")', source, re.M)
        self.assertEqual("".join(ast.literal_eval(x) for x in strings), self.text("costs"))
        self.assertTrue(all(len(x) <= 100 for x in source.splitlines()))
        made = subprocess.run(
            ["cc", "-std=c11", "-Wall", "-Werror", "-fsyntax-only"]
            + ["-I" + os.path.join(ROOT, "src"), self.path["c"]],
            capture_output=True,
            text=True,
            check=False,
        )
        self.assertEqual(made.returncode, 0, made.stderr)


class Small(Case):
    """As few skins as may be: what does not depend on how many."""

    FEW = ("bench", "--quick", "--skins", "20")

    @classmethod
    def setUpClass(cls):
        """CSV is what comes where nothing else is asked for."""
        super().setUpClass()
        cls.first = []
        if SLOWED:  # half a minute each: once for the files is enough
            return
        done = run(*cls.FEW, "--threads", "1")
        if done.status != 0:
            raise AssertionError(done.err)
        cls.first = rows_of(done.out)

    @unittest.skipIf(SLOWED, "the same program as without a sanitizer, four times as long")
    def test_the_same_seed_gives_the_same_errors(self):
        """By other threads; and what is there is replaced by force."""
        path = self.file("x", "there.csv")
        self.run_ok(*self.FEW, "--threads", "3", "--out", path, "--force")
        with open(path, encoding="utf-8") as f:
            text = f.read()
        self.assertTrue(text.startswith("# machine: "))
        self.assertEqual({x["kind"] for x in self.first}, {"inversion", "bound", "forward"})
        for a, b in zip(self.first, rows_of(text)):
            if a["kind"] == "forward":
                continue
            for name in a:
                if name not in ("us", "us_p95", "timed", "front", "front_own", "bytes"):
                    self.assertEqual(a[name], b[name], f"{a['name']} {name}")

    def test_calibrate_makes_its_folder_and_another_seed_other_errors(self):
        home = self.folder()
        path = f"{home}/.local/state/skinspec/costs.csv"
        environment = {**os.environ, "HOME": home}
        environment.pop("XDG_STATE_HOME", None)
        done = run(*self.FEW, "--seed", "2", "--calibrate", "--out", f"{home}/other.csv",
                   env=environment)  # fmt: skip
        self.assertEqual((done.status, done.out), (0, ""), done.err)
        with open(f"{home}/other.csv", encoding="utf-8") as f:
            for a, c in zip(self.first, rows_of(f.read())):
                if a["kind"] == "inversion":
                    self.assertNotEqual(a["Ch_transport"], c["Ch_transport"], a["name"])
        with open(path, encoding="utf-8") as f:
            self.assertEqual(f.read().splitlines()[2], COST_COLUMNS)
        os.chmod(os.path.dirname(path), 0o500)
        if os.geteuid() != 0:  # told before minutes are spent
            self.refused(1, "bench", "--calibrate", env=environment, says=path)
        os.chmod(os.path.dirname(path), 0o700)

    def test_nothing_is_left_by_an_interrupt(self):
        folder = self.folder()
        bench = subprocess.Popen(
            [SKINSPEC, "bench", "--svg", f"{folder}/a.svg", "--out", f"{folder}/a.csv"],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )
        deadline = time.monotonic() + 30
        while len(os.listdir(folder)) < 2 and time.monotonic() < deadline:
            time.sleep(0.05)
        time.sleep(0.5)
        bench.send_signal(signal.SIGINT)
        out, _ = bench.communicate(timeout=TIMEOUT_S)
        self.assertEqual((bench.returncode, out), (-signal.SIGINT, b""))
        self.assertEqual(os.listdir(folder), [])

    def test_what_it_refuses(self):
        there = self.file("x", "there.csv")
        for arguments, says in (
            (["--costs", "x"], "--calibrate"),
            (["--skins", "3"], "--skins"),
            (["--skins", "many"], "--skins"),
            (["--seed", "-1"], "--seed"),
            (["--threads", "0"], "--threads"),
            (["--out", "x", "--svg", "x"], "two files"),
            (["more"], "'more'"),
        ):
            self.refused(2, "bench", *arguments, says=says)
        # One file by two names: links to what is there, two ways to a place where nothing is.
        folder = os.path.dirname(there)
        os.symlink("there.csv", f"{folder}/soft")
        os.link(there, f"{folder}/hard")
        for other in (f"{folder}/soft", f"{folder}/hard", f"{folder}/./there.csv"):
            self.refused(2, "bench", "--out", there, "--svg", other, "--force", says="two files")
        self.refused(2, "bench", "--out", f"{folder}/a", "--c-source", f"{folder}/../"
                     + os.path.basename(folder) + "/a", says="two files")  # fmt: skip
        # Costs are replaced by costs, but nothing else is, unless it is said.
        self.refused(1, "bench", "--calibrate", "--costs", there, says="--force")
        self.refused(1, "bench", "--out", there, says="--force")
        self.refused(1, "bench", "--out", "/nowhere/at/all.csv", says="/nowhere/at/all.csv")
        with open(there, encoding="utf-8") as f:
            self.assertEqual(f.read(), "x")

    def test_calibrate_without_a_home(self):
        environment = {k: v for k, v in os.environ.items() if k not in ("HOME", "XDG_STATE_HOME")}
        done = subprocess.run(
            [SKINSPEC, "bench", "--calibrate"],
            capture_output=True,
            text=True,
            env=environment,
            timeout=60,
            check=False,
        )
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn("--costs", done.stderr)


if __name__ == "__main__":
    main()
