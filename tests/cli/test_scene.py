#!/usr/bin/env python3
"""test_scene.py - `skinspec match --scene`: what is wanted is there and is what the plain command
says; what is not wanted is not; what cannot be had is refused with what comes nearest."""

import csv
import json
import os

from support import EXAMPLES, TABLES, Case, main, run


def csv_rows(path):
    with open(path, encoding="utf-8") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


# A folder where no table is, and no costs of this machine.
NOWHERE = os.path.join(os.sep, "nonexistent")
os.environ["XDG_STATE_HOME"] = NOWHERE


def without(record, *names):
    return {name: value for name, value in record.items() if name not in names}


class Scene(Case):
    def answer(self, scene, *options):
        path = self.file(json.dumps(scene))
        return self.run_ok("match", EXAMPLES, "--scene", path, "--json", "--tables", TABLES,
                           *options).json()  # fmt: skip

    def refused(self, scene, *parts, status=2, options=()):
        text = scene if isinstance(scene, str) else json.dumps(scene)
        done = run("match", EXAMPLES, "--scene", self.file(text), "--json", "--tables", TABLES,
                   *options)  # fmt: skip
        self.assertEqual(done.status, status, done.err)
        self.assertEqual(done.out, "")
        for part in parts:
            self.assertIn(part, done.err)

    def plain(self, *options):
        return self.run_ok("match", EXAMPLES, "--json", "--tables", TABLES, *options).json()

    def left_out(self, record):
        return {one["what"]: one["why"] for one in record["plan"]["left_out"]}

    def test_colour_needs_no_table(self):
        convert = self.run_ok("convert", EXAMPLES, "--json").json()
        path = self.file('{"want": ["lab", "rgb"]}')
        done = self.run_ok("match", EXAMPLES, "--scene", path, "--json", "--tables", NOWHERE)
        for record, expect in zip(done.json(), convert, strict=True):
            self.assertEqual(record["colour"]["Lab"], expect["Lab"])
            self.assertEqual(record["colour"]["sRGB"], expect["sRGB"])
            self.assertEqual(record["plan"]["ran"], ["colour"])
            self.assertEqual(record["plan"]["work"]["rows"], 0)
            self.assertNotIn("Cm", record)

    def test_nearest_is_the_plain_one(self):
        for by in ("spectrum", "lab", "rgb", "de2000"):
            plain = self.plain("--by", by, "--k", "3")
            ours = self.answer({"want": ["nearest"], "by": by, "k": 3})
            for record, expect in zip(ours, plain, strict=True):
                self.assertEqual(without(expect, "dE00", "rms", "flags"),
                                 without(record, "dE00", "rms", "flags", "plan"))  # fmt: skip
                self.assertNotIn("colour", record)
                self.assertIn("fit", self.left_out(record))
                self.assertEqual("spectra" in self.left_out(record), by != "spectrum")

    def test_whole_answer_is_the_plain_one(self):
        plain = self.plain("--refine", "--noise", "0.003", "--k", "2")
        ours = self.answer({"want": ["nearest", "refined", "interval", "lab"], "k": 2,
                            "noise": 0.003})  # fmt: skip
        for record, expect in zip(ours, plain, strict=True):
            self.assertEqual(expect, without(record, "plan", "colour"))
            self.assertEqual(record["plan"]["left_out"], [])

    def test_refined_without_intervals(self):
        plain = self.plain("--refine", "--noise", "0.003")
        for record, expect in zip(
            self.answer({"want": ["refined"], "noise": 0.003}), plain, strict=True
        ):
            for name in ("Cm", "Bm", "Ch", "rms", "chi_square", "residual"):
                self.assertEqual(record[name], expect[name])
            for name in ("se", "interval", "repeat_se", "second", "dE00", "colour", "L"):
                self.assertNotIn(name, record)
            self.assertIn("no interval", self.left_out(record)["covariance"])
            self.assertEqual(record["plan"]["work"]["colours"], 0)

    def test_settled_scene_gives_the_same(self):
        """`plan.scene` says all that was chosen: given again it does the same."""
        for scene in ({"want": ["coefficients"], "error": {"Cm": 0.02}},
                      {"want": ["refined"], "Bm": 1, "Cm": [0.01, 0.2]},
                      {"want": ["coefficients", "lab"], "budget_us": 50}):  # fmt: skip
            for record in self.answer(scene):
                again = self.answer(record["plan"]["scene"])
                same = next(one for one in again if one["id"] == record["id"])
                self.assertEqual(without(record, "plan"), without(same, "plan"))
                self.assertEqual(record["plan"]["scene"], same["plan"]["scene"])

    def test_held_and_ranged(self):
        for record in self.answer({"want": ["refined", "nearest"], "Bm": 1, "Cm": [0.02, 0.1]}):
            self.assertEqual(record["Bm"], 1)
            self.assertEqual(record["nearest"]["Bm"], 1)
            self.assertTrue(0.02 <= record["Cm"] <= 0.1)
            self.assertTrue(0.02 <= record["nearest"]["Cm"] <= 0.1)
            self.assertIn("eumelanin", self.left_out(record)["pheomelanin"])
            self.assertIn("rows", self.left_out(record))

    def test_off_the_grid(self):
        """What no row has can be held; without a dermis there is an answer, and no impossible error."""
        for scene, name, value in (
            ({"want": ["refined"], "dermis": False}, "Ch", 0.01),
            ({"want": ["coefficients"], "dermis": False}, "Ch", 0.01),
            ({"want": ["refined"], "Cm": 0.0123}, "Cm", 0.0123),
            ({"want": ["refined"], "Ch": [0.0123, 0.01230001]}, "Ch", 0.0123),
        ):
            for record in self.answer(scene):
                self.assertAlmostEqual(record[name], value, delta=1e-7)
                self.assertLess(record["plan"]["estimated"].get("rms", 0), 1)
        self.refused({"want": ["nearest"], "Ch": 0.0123}, "the nearest are in [0.01")

    def test_plan_alone(self):
        path = self.file('{"want": ["nearest"], "by": "lab"}')
        done = self.run_ok("match", EXAMPLES, "--scene", path, "--tables", TABLES, "--plan")
        self.assertIn("runs  table  search\n", done.out)
        self.assertIn("leaves out  spectra", done.out)
        done = self.run_ok("match", EXAMPLES, "--scene", path, "--tables", TABLES, "--plan",
                           "--json").json()  # fmt: skip
        self.assertEqual(done["ran"], ["table", "search"])
        self.assertNotIn("work", done)

    def test_refused(self):
        self.refused({"want": ["interval"]}, "`refined`")
        self.refused({"want": ["refined"], "Cm": [0.3, 0.1]}, "range of Cm is empty")
        self.refused({"want": ["refined"], "Cm": 0.9}, "outside 0..0.5")
        self.refused({"want": ["refined"], "error": {"Cm": 0.1}, "budget_us": 5}, "both given")
        self.refused({"want": ["refined"], "model": "paper"}, "no spectra")
        self.refused({"want": ["lab"], "bands": {"first_nm": 500, "last_nm": 600, "step_nm": 10}},
                     "give no colour")  # fmt: skip
        self.refused({"want": ["refined"], "error": {"Cm": 1e-6}}, "the nearest is", "Cm 0.0")
        self.refused({"want": ["refined"], "budget_us": 0.01}, "the quickest is", " us")
        self.refused({"want": ["nearest"], "model": "kubelka-munk"}, "skinspec table build")

    def test_what_nothing_uses(self):
        """Refused, whatever member it is; and where it is used, taken."""
        skin = ["coefficients", "nearest", "refined"]
        for member, value, users in (
            ("illuminant", "A", ["lab", "rgb"]), ("observer", "2", ["lab", "rgb"]),
            ("model", "two-layer", skin), ("by", "lab", skin), ("k", 3, ["nearest"]),
            ("fit", "three", ["coefficients", "refined"]), ("start", "rows", ["coefficients", "refined"]),
            ("Cm", [0.01, 0.1], skin), ("Bm", 1, skin), ("Ch", [0.01, 0.1], skin),
            ("dermis", False, ["coefficients", "refined"]), ("noise", 0.003, skin),
            ("placement", 0.01, skin),
        ):  # fmt: skip
            for wanted in ("lab", "rgb", *skin):
                scene = {"want": [wanted], member: value}
                if wanted in users:
                    self.answer(scene)
                else:
                    self.refused(scene, "leave ", " out")

    def test_no_scene(self):
        self.refused({"wnat": ["lab"]}, '"wnat" is no member of a scene')
        self.refused({"want": ["lab"], "error": {"CM": 1}}, '"CM" is no member of `error`')
        self.refused({"want": ["labb"]}, '"labb" cannot be wanted')
        self.refused({"want": "lab"}, "`want` must be a list")
        self.refused({"want": ["lab"], "illuminant": "D66"}, "no illuminant")
        self.refused({"want": ["lab"], "k": 1.5}, "`k` must be a whole number")
        self.refused({"want": ["refined"], "Cm": "0.1"}, "`Cm` must be a number")
        self.refused([], "a scene is an object")
        self.refused('{"want": ["lab"],}', ":1: this is not JSON")
        self.refused('{"want":\n ["lab"], "want": ["rgb"]}', ":2: a name that stands twice")
        self.refused('{"want": ["lab"], "budget_us": 1e999}', ":1: a number beyond")
        self.refused('{"want": ["lab"], "observer": 2}', '`observer` must be a text: say "2" or "10"')
        done = run("match", EXAMPLES, "--scene", NOWHERE, "--json")
        self.assertEqual(done.status, 1)
        self.assertIn("cannot read the scene", done.err)

    def test_costs(self):
        """By costs that say that lab takes no time and is never wrong, lab it is."""
        line = "two-layer,50400,%s,none,0,%g,%g,%g,0.1,0.01,%g,0.1,0.01,1,0.01,0\n"
        costs = ("# machine: none\n# costs: 2\nmodel,rows,by,refine,interval,us,us_p95,Cm,Bm,Ch,Cm_transport,"
                 "Bm_transport,Ch_transport,dE00,rms_R,bytes\n"
                 + line % ("lab", 1, 1, 1e-5, 1e-5) + line % ("spectrum", 9, 9, 1e-5, 1e-5))  # fmt: skip
        path = self.file(costs)
        scene = {"want": ["nearest"], "error": {"Cm": 1e-4}, "noise": 0.003}
        for record in self.answer(scene, "--costs", path):
            self.assertEqual(record["by"], "lab")
            self.assertEqual(record["plan"]["estimated"]["us"], 1)
        self.refused(scene, "the nearest is")
        self.refused(scene, "skinspec bench --calibrate", status=1, options=["--costs", NOWHERE])
        self.refused(scene, status=1, options=["--costs", EXAMPLES])
        head = costs[: costs.index("two-layer,50400,spectrum")]
        self.refused(scene, ":5: the file ends too soon", "--calibrate", status=1,
                     options=["--costs", self.file(head)])  # fmt: skip
        self.refused(scene, "cut short", "--calibrate", status=1,
                     options=["--costs", self.file(costs.replace("# costs: 2\n", ""))])  # fmt: skip

    def lines(self, scene, text, *options, status=0):
        done = run("match", "-", "--scene", self.file(json.dumps(scene)), "--ndjson", "--tables", TABLES,
                   *options, stdin=text)  # fmt: skip
        self.assertEqual(done.status, status, done.err)
        return done

    def test_ndjson(self):
        """Planned for the first good line's bands; the answers are those of the same spectra as CSV."""
        scene = {"want": ["lab", "refined"], "noise": 0.003}
        expected, lines = self.answer(scene), []
        for row in csv_rows(EXAMPLES):
            nm = [name for name in row if name.isdigit()]
            spectrum = {"first_nm": int(nm[0]), "step_nm": int(nm[1]) - int(nm[0]),
                        "values": [float(row[x]) for x in nm]}  # fmt: skip
            lines.append({"id": row["id"], "spectrum": spectrum, "specular": "sce"})
        text = "".join(json.dumps(line) + "\n" for line in lines)
        timeless = [{**one, "plan": without(one["plan"], "us")} for one in expected]
        for more, bad in (("", 0), ("\n" * 3, 0), ('{"id":"x"}\n' * 3, 3), ("no JSON\n" * 20, 20)):
            done = self.lines(scene, more + text, status=1 if bad else 0,
                              *(["--input", "ndjson"] if more else []))  # fmt: skip
            ours = done.ndjson()
            self.assertEqual([one for one in ours if "error" in one], ours[:bad])
            self.assertEqual(len(done.err.splitlines()), bad)
            for one, expect in zip(ours[bad:], timeless, strict=True):
                self.assertEqual(one.pop("specular"), "sce")  # carried through, as all members are
                self.assertEqual({**one, "plan": without(one["plan"], "us")}, expect)
        done = self.lines(scene, text, "--plan")
        self.assertEqual(json.loads(done.out)["scene"], expected[0]["plan"]["scene"])

    def test_ndjson_of_other_bands(self):
        """Bad rows, wherever they stand, and of whatever part of a file."""
        def line(step_nm, n):
            return json.dumps({"spectrum": {"first_nm": 400, "step_nm": step_nm, "values": [0.3] * n},
                               "specular": "sce"}) + "\n"  # fmt: skip

        scene = {"want": ["lab"]}
        text = line(10, 31) + line(5, 61) * 3 + line(10, 31) + line(10, 36)
        done = self.lines(scene, text, status=1)
        self.assertEqual(["error" in one for one in done.ndjson()], [False, True, True, True, False, True])
        self.assertIn("<stdin>:2:", done.err)
        self.assertIn("61 bands 400..700 nm by 5; the scene is planned for the first row's, 31 bands 400..700 nm by 10",
                      done.err)  # fmt: skip
        scene, path, parts = self.file(json.dumps(scene)), self.file(text), []
        for i in (1, 2, 3):
            done = run("match", path, "--scene", scene, "--ndjson", "--shard", f"{i}/3")
            parts += done.ndjson()
        self.assertEqual(["error" in one for one in parts], [False, True, True, True, False, True])

    def test_ndjson_without_a_spectrum(self):
        done = self.lines({"want": ["lab"]}, "", "--input", "ndjson", status=1)
        self.assertIn("<stdin>: empty", done.err)
        done = self.lines({"want": ["lab"]}, '{"id":"a"}\n' * 500, status=1)
        self.assertIn("<stdin>:1:1: no spectrum", done.err)
        self.assertEqual((done.out, len(done.err.splitlines())), ("", 1))

    def test_options(self):
        path = self.file('{"want": ["lab"]}')
        for options in (["--by", "lab"], ["--k", "3"], ["--refine"]):
            done = run("match", EXAMPLES, "--scene", path, "--json", *options)
            self.assertEqual(done.status, 2)
            self.assertIn("in the scene", done.err)
        self.assertEqual(run("match", EXAMPLES, "--scene", path).status, 2)
        self.assertEqual(run("match", EXAMPLES, "--plan").status, 2)


if __name__ == "__main__":
    main()
