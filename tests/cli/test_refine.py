#!/usr/bin/env python3
"""test_refine.py - `skinspec match --refine`: skins of known parameters are found again between the
rows, with standard errors that differences of `skinspec reflectance` give too, and intervals that
hold the truth as often as they say."""

import math
import random

from support import EXAMPLES, NM, PAPER, TWO_LAYER, Case, build_table, main, run, spectra_csv

THREE = ("Cm", "Bm", "Ch")
# Well inside the ranges, where all three show.
TRUTH = {"Cm": 0.0437, "Bm": 0.413, "Ch": 0.0171}
SKINS = [TRUTH, {"Cm": 0.0123, "Bm": 0.77, "Ch": 0.0345}, {"Cm": 0.151, "Bm": 0.62, "Ch": 0.0222},
         {"Cm": 0.0871, "Bm": 0.21, "Ch": 0.0611}]  # fmt: skip


def reflectance(skin, model="two-layer", **more):
    """400..700 nm by 10."""
    options = [f"--{name.lower().replace('_', '-')}={x!r}" for name, x in {**skin, **more}.items()]
    done = run("reflectance", "--model", model, "--bands", "400:700:10", "--json", *options)
    if done.status != 0:
        raise AssertionError(done.err)
    return done.json()[0]["spectrum"]["values"]


def inverse(m):
    """Of a small matrix, by Gauss and Jordan."""
    n = len(m)
    rows = [list(row) + [float(i == j) for j in range(n)] for i, row in enumerate(m)]
    for i in range(n):
        best = max(range(i, n), key=lambda r: abs(rows[r][i]))
        rows[i], rows[best] = rows[best], rows[i]
        rows[i] = [x / rows[i][i] for x in rows[i]]
        for r in range(n):
            if r != i:
                rows[r] = [x - rows[r][i] * y for x, y in zip(rows[r], rows[i])]
    return [row[n:] for row in rows]


def standard_errors(skin, noise):
    """Of Cm, Bm, Ch with white noise: sqrt of the diagonal of noise^2 (J^T J)^-1, J by central
    differences."""
    J = []
    for name in THREE:
        step = 1e-3 * skin[name]
        up, down = (reflectance({**skin, name: skin[name] + s}) for s in (step, -step))
        J.append([(a - b) / (2 * step) for a, b in zip(up, down)])
    information = [[sum(a * b for a, b in zip(x, y)) / noise**2 for y in J] for x in J]
    return {name: math.sqrt(inverse(information)[i][i]) for i, name in enumerate(THREE)}


def csv_of(spectra):
    return spectra_csv([([i + 1, "sce"], values) for i, values in enumerate(spectra)],
                       before=("id", "specular"))  # fmt: skip


class Refined(Case):
    def refine(self, spectra, *options, table=TWO_LAYER):
        return self.run_ok("match", self.file(csv_of(spectra)), "--table", table, "--json",
                           *(options or ("--refine", "--noise", "0.001"))).json()  # fmt: skip

    def test_known_skins_are_found_between_the_rows(self):
        for model in ("two-layer", "half-space"):
            table = build_table(self.folder(), "--cm", "0:0.4:9", "--bm", "0:1:5", "--ch",
                                "log:0.001:0.1:9", model=model)  # fmt: skip
            for skin, got in zip(SKINS, self.refine([reflectance(s, model) for s in SKINS], table=table)):
                for name in THREE:
                    self.assertClose(got[name], skin[name], relative=1e-4, what=(model, name))
                    self.assertNotEqual(got[name], got["nearest"][name])
                    low, high = got["interval"][name]
                    self.assertTrue(low < skin[name] < high, got)
                self.assertLess(got["rms"], 1e-7)
                self.assertLess(got["dE00"], 1e-4)
                self.assertLess(got["rms"], got["nearest"]["rms"])
                self.assertEqual((got["refine"], got["model"]), ("three", model))
                self.assertEqual(got["noise"], {"white": 0.001, "placement": 0, "from": "stated"})
                self.assertEqual(got["degrees"], 28)  # 31 bands, three parameters
                # 0 of 28 degrees cannot be chance: the noise was stated too large.
                self.assertIn("residual_too_small", got["flags"])
                self.assertAlmostEqual(got["p"], 1, 6)

    def test_the_nearest_row_is_what_match_gives(self):
        spectra = [reflectance(s) for s in SKINS]
        file = self.file(csv_of(spectra))
        plain = self.run_ok("match", file, "--json", "--k", "4").json()
        refined = self.run_ok("match", file, "--json", "--k", "4", "--refine").json()
        for one, two in zip(plain, refined):
            rows = one.pop("nearest")
            nearest = two["nearest"]
            self.assertEqual(nearest.pop("rows"), rows)
            self.assertEqual(nearest.pop("row"), rows[0]["row"])
            for name in ("by", "table", "table_sha256"):
                self.assertEqual(two[name], one[name])
            self.assertEqual(nearest, {n: one[n] for n in nearest})
        # The answer does not hang on how many rows were asked for, nor on the threads.
        for more in ((), ("--k", "50"), ("--threads", "1")):
            other = self.run_ok("match", file, "--json", "--refine", *more).json()
            for one, two in zip(refined, other):
                self.assertEqual([one[n] for n in THREE + ("se", "interval", "residual")],
                                 [two[n] for n in THREE + ("se", "interval", "residual")])  # fmt: skip

    def test_standard_errors(self):
        for skin in SKINS:
            expected = standard_errors(skin, 0.0004)
            got = self.refine([reflectance(skin)], "--refine", "--noise", "0.0004")[0]
            for name in THREE:
                self.assertClose(got["se"][name], expected[name], relative=0.02, what=(skin, name))
        # They grow with the noise, and placement makes them larger.
        twice = self.refine([reflectance(skin)], "--refine", "--noise", "0.0008")[0]
        moved = self.refine([reflectance(skin)], "--refine", "--noise", "0.0004", "--placement",
                            "0.01")[0]  # fmt: skip
        for name in THREE:
            self.assertClose(twice["se"][name], 2 * got["se"][name], relative=0.02, what=name)
            self.assertGreater(moved["se"][name], 1.02 * got["se"][name], name)

    def test_intervals_hold_the_truth_as_often_as_they_say(self):
        dice, n, noise = random.Random(7), 300, 0.002
        clean = reflectance(TRUTH)
        rows = [[max(0.0, x + dice.gauss(0, noise)) for x in clean] for _ in range(n)]
        answers = self.refine(rows, "--refine", "--noise", str(noise))
        for name in THREE:
            held = sum(a["interval"][name][0] <= TRUTH[name] <= a["interval"][name][1] for a in answers)
            # Of 300 with 0.95: sd 3.8; four of them each way.
            self.assertTrue(285 - 15 <= held <= 300 - 0, (name, held))
            spread = math.sqrt(sum((a[name] - TRUTH[name]) ** 2 for a in answers) / n)
            mean_se = sum(a["se"][name] for a in answers) / n
            self.assertClose(spread, mean_se, relative=0.2, what=name)
        chi = sum(a["chi_square"] for a in answers) / n
        self.assertClose(chi, 28, relative=0.06, what="chi-square")  # sd of the mean 0.43
        flagged = sum("residual_too_large" in a["flags"] or "residual_too_small" in a["flags"]
                      for a in answers)  # fmt: skip
        self.assertLessEqual(flagged, 4)  # 2 in 1000 by chance

    def test_residual_is_measured_less_fitted(self):
        values = reflectance(TRUTH)
        values[12] += 0.01
        got = self.refine([values])[0]
        fitted = reflectance({name: got[name] for name in THREE})
        self.assertEqual((got["residual"]["first_nm"], got["residual"]["step_nm"]), (400, 10))
        for nm, r, measured, R in zip(NM, got["residual"]["values"], values, fitted):
            self.assertClose(r, measured - R, absolute=1e-7, what=nm)
        rms = math.sqrt(sum(r * r for r in got["residual"]["values"]) / 31)
        self.assertClose(got["rms"], rms, relative=1e-12)
        self.assertClose(got["chi_square"], 31 * (rms / 0.001) ** 2, relative=1e-9)

    def test_too_little_noise_stated_shows(self):
        dice = random.Random(3)
        values = [x + dice.gauss(0, 0.004) for x in reflectance(TRUTH)]
        got = self.refine([values], "--refine", "--noise", "0.001")[0]
        self.assertIn("residual_too_large", got["flags"])
        self.assertLess(got["p"], 0.001)
        self.assertTrue(got["words"])

    def test_what_was_fixed_stays(self):
        values = reflectance({**TRUTH, "Bm": 0.0})
        got = self.refine([values], "--refine", "--noise", "0.001", "--fix", "Bm=0")[0]
        self.assertEqual((got["Bm"], got["fixed"]), (0, {"Bm": 0}))
        self.assertEqual(sorted(got["se"]), ["Ch", "Cm"])
        self.assertEqual(sorted(got["interval"]), ["Ch", "Cm"])
        self.assertEqual(got["degrees"], 29)
        for name in ("Cm", "Ch"):
            self.assertClose(got[name], TRUTH[name], relative=1e-4, what=name)
        thick = reflectance(TRUTH, epidermis_mm=0.1)
        got = self.refine([thick], "--refine", "--noise", "0.001", "--fix", "epidermis_mm=0.1")[0]
        self.assertEqual(got["fixed"], {"epidermis_mm": 0.1})
        for name in THREE:
            self.assertClose(got[name], TRUTH[name], relative=1e-4, what=name)

    def test_noise_where_none_is_stated(self):
        values = reflectance(TRUTH)
        got = self.refine([values], "--refine")[0]["noise"]
        self.assertEqual(got["from"], "population")
        self.assertTrue(got["white"] > 0 and got["placement"] > 0)
        stated = self.refine([values], "--refine", "--placement", "0.02")[0]["noise"]
        self.assertEqual(stated, {"white": got["white"], "placement": 0.02, "from": "stated"})
        self.assertEqual(self.refine([values], "--refine=three")[0]["noise"], got)

    def test_surface_is_taken_off_first(self):
        values = [x + 0.04 for x in reflectance(TRUTH)]
        file = self.file(spectra_csv([([1], values)]))
        got = self.run_ok("match", file, "--specular", "sci", "--surface", "0.04", "--refine",
                          "--json").json()[0]  # fmt: skip
        for name in THREE:
            self.assertClose(got[name], TRUTH[name], relative=1e-3, what=name)

    def test_csv(self):
        spectra = [reflectance(s) for s in SKINS]
        file = self.file(csv_of(spectra))
        objects = self.run_ok("match", file, "--refine", "--noise", "0.001", "--json").json()
        rows = self.run_ok("match", file, "--refine", "--noise", "0.001", "--k", "2").rows()
        for row, one in zip(rows, objects):
            expected = {"row": one["nearest"]["row"], "distance": one["nearest"]["distance"],
                        "noise": one["noise"]["white"], "placement": one["noise"]["placement"]}  # fmt: skip
            for name in THREE:
                expected |= {name: one[name], f"{name}_se": one["se"][name],
                             f"{name}_lo": one["interval"][name][0], f"{name}_hi": one["interval"][name][1],
                             f"nearest_{name}": one["nearest"][name]}  # fmt: skip
            for name in ("L", "a", "b", "dE00", "rms", "chi_square", "degrees", "p"):
                expected[name] = one[name]
            for name, value in expected.items():
                self.assertClose(float(row[name]), value, relative=1e-8, absolute=1e-300, what=name)
            self.assertEqual(row["flags"].split(";") if row["flags"] else [], one["flags"])
            self.assertEqual((row["table"], row["by"], row["error"]), ("two-layer", "spectrum", ""))
            self.assertNotEqual(row["row_2"], row["row"])


class Skin(Case):
    """The fit for measured skin.  How well it does on people: make accuracy, docs/inversion.md."""

    MEMBERS = ("Cm", "Bm", "Ch", "SO2", "epidermis_mm", "scattering")

    def skin(self, *options):
        return self.run_ok("match", EXAMPLES, "--refine=skin", *options, "--json").json()

    def test_all_its_parameters_are_told(self):
        for got in self.skin():
            self.assertEqual(got["refine"], "skin")
            for name in self.MEMBERS:
                self.assertIn(name, got)
            free = ["Ch", "Cm", "SO2", "scattering"]
            self.assertEqual((sorted(got["se"]), sorted(got["interval"])), (free, free))
            for name in ("a", "b"):
                low, high = got["interval"]["scattering"][name]
                self.assertTrue(low <= got["scattering"][name] <= high, got)
                self.assertGreater(got["se"]["scattering"][name], 0)
                self.assertLessEqual(got["repeat_se"]["scattering"][name], 1.001 * got["se"]["scattering"][name])
            self.assertEqual((got["Bm"], got["epidermis_mm"]), (0.25, 0.08))
            self.assertTrue(0 <= got["SO2"] <= 1)

    def test_freeing_more_fits_better(self):
        three = self.run_ok("match", EXAMPLES, "--refine", "--fix", "Bm=0.25", "--json").json()
        for skin, other in zip(self.skin("--noise", "0.001"), three):
            self.assertLess(skin["rms"], other["rms"])
            self.assertEqual(skin["noise"], {"white": 0.001, "placement": 0, "from": "stated"})

    def test_what_is_fixed(self):
        for got in self.skin("--fix", "scattering_b=1.25", "--fix", "SO2=0.5", "--fix", "Bm=0.75"):
            self.assertEqual((got["scattering"]["b"], got["SO2"], got["Bm"]), (1.25, 0.5, 0.75))
            self.assertEqual(got["fixed"], {"Bm": 0.75, "SO2": 0.5, "scattering_b": 1.25})
            self.assertEqual((sorted(got["se"]), list(got["se"]["scattering"])), (["Ch", "Cm", "scattering"], ["a"]))

    def test_csv(self):
        rows = self.run_ok("match", EXAMPLES, "--refine=skin").rows()
        for row, one in zip(rows, self.skin()):
            for name, value in (("SO2", one["SO2"]), ("epidermis_mm", 0.08), ("scattering_a", one["scattering"]["a"]),
                                ("scattering_b_lo", one["interval"]["scattering"]["b"][0]),
                                ("Ch_se", one["se"]["Ch"])):  # fmt: skip
                self.assertClose(float(row[name]), value, relative=1e-8, what=name)
            self.assertEqual((row["Bm_se"], row["epidermis_mm_hi"]), ("", ""))


class Refusals(Case):
    def match(self, *options, values=None, table=TWO_LAYER, status=2, says=()):
        file = self.file(csv_of([values or [0.3] * 31]))
        return self.refused(status, "match", file, "--table", table, *options, says=says)

    def test_usage(self):
        for options, says in (
            (("--noise", "0.001"), "--noise goes with --refine"),
            (("--placement", "0.001"), "--placement goes with --refine"),
            (("--fix", "Bm=0"), "--fix goes with --refine"),
            (("--refine=four",), "neither three nor skin"),
            (("--refine", "--noise", "0"), "outside"),
            (("--refine", "--noise", "-0.1"), "outside"),
            (("--refine", "--noise", "nan"), "not a number"),
            (("--refine", "--noise", "2"), "outside"),
            (("--refine", "--placement", "-0.001"), "outside"),
            (("--refine", "--fix", "Bm"), "NAME=X"),
            (("--refine", "--fix", "Dm=1"), "scattering_b"),
            (("--refine", "--fix", "Bm=x"), "no number"),
            (("--refine", "--fix", "Bm=0.1", "--fix", "Bm=0.2"), "Bm is fixed twice"),
            (("--refine", "--fix", "Bm=nan"), "no number"),
            (("--refine", "--fix", "Bm=1.5"), "fixed Bm"),
            (("--refine", "--fix", "Cm=0.7"), "fixed Cm"),
            (("--refine", "--fix", "Ch=-0.01"), "fixed Ch"),
            (("--refine", "--fix", "SO2=7"), "SO2"),
            (("--refine", "--fix", "scattering_a=1"), "skin"),
            (("--refine", "--fix", "Cm=0.1", "--fix", "Bm=0.1", "--fix", "Ch=0.1"), "free"),
        ):
            with self.subTest(options):
                self.match(*options, says=says)

    def test_a_table_of_a_model_that_cannot(self):
        self.match("--refine", table=PAPER, says=("paper", "model"))
        self.match("--refine=skin", table=PAPER, says="paper")

    def test_missing_bands_refuse_the_row(self):
        rows = [([1, "sce"], [0.3] * 31), ([2, "sce"], [0.3] * 30 + [""])]
        file = self.file(spectra_csv(rows, before=("id", "specular")))
        done = self.refused(1, "match", file, "--refine", "--ndjson", says="700")
        good, bad = done.ndjson()
        self.assertIn("Cm", good)
        self.assertEqual(sorted(bad), ["error", "id"])

    def test_fewer_bands_than_parameters(self):
        nm = [400, 700]
        file = self.file(spectra_csv([([1, "sce"], [0.2, 0.4])], nm=nm, before=("id", "specular")))
        self.refused(1, "match", file, "--refine", says="bands in common")

    def test_hostile_spectra_are_answered_and_flagged(self):
        dice = random.Random(11)
        rows = [[0.0] * 31, [1.0] * 31, [0.5] * 31, [2.0] * 31, [float(i % 2) for i in range(31)],
                [dice.random() for _ in range(31)], [1e-12] * 31]  # fmt: skip
        for options in (("--refine",), ("--refine", "--noise", "0.001")):
            done = self.run_ok("match", self.file(csv_of(rows)), *options, "--json")
            for got in done.json():
                self.assertTrue(0 <= got["Cm"] <= 0.5 and 0 <= got["Bm"] <= 1, got)
                self.assertTrue(0.001 <= got["Ch"] <= 0.1, got)
                for name in THREE:
                    low, high = got["interval"][name]
                    self.assertTrue(low <= got[name] <= high, got)
                    self.assertTrue(math.isfinite(got["se"][name]) and got["se"][name] >= 0, got)
                self.assertTrue(got["flags"] and got["words"], got)


if __name__ == "__main__":
    main()
