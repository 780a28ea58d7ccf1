#!/usr/bin/env python3
"""test_match.py - `skinspec match` against brute force over the table's own rows, read by
sqlite3; what it asks about the mirror reflection; batches."""

import fcntl
import math
import os
import random
import struct
import subprocess
import termios
import threading
import time
import unittest

from support import (
    MEASURED,
    NM,
    PAPER,
    INSTRUMENTED,
    TWO_LAYER,
    Case,
    Table,
    build_table,
    ciede2000,
    environment,
    linear_srgb,
    main,
    run,
    skin_like,
    spectra_csv,
    srgb_code,
    srgb_encode,
    start,
)

SMALL_GRID = ("--cm", "0:0.4:6", "--bm", "0:1:4", "--ch", "log:0.001:0.1:5")
MEMBERS = ["id", "Cm", "Bm", "Ch", "L", "a", "b", "dE00", "rms", "distance", "by", "table"]
MEMBERS += ["table_sha256", "flags"]


class Brute:
    """Distances from a query to every row of a table, by its way."""

    def __init__(self, table, by):
        self.table, self.by = table, by
        if by in ("rgb", "rgb-float"):
            self.codes = [self.code(row["rgb"]) for row in table.rows]

    def code(self, linear):
        if self.by == "rgb":
            return srgb_code(linear)
        return [255 * srgb_encode(x) for x in linear]

    def distance(self, i, query, code):
        row = self.table.rows[i]
        if code is not None:
            return math.dist(self.codes[i], code)
        if self.by == "lab":
            return math.dist(row["Lab"], query["Lab"])
        if self.by == "de2000":
            return ciede2000(query["Lab"], row["Lab"])
        squares = [(x - y) ** 2 for x, y in zip(row["spectrum"], query["values"])]
        return math.sqrt(sum(squares) / len(squares))

    def nearest(self, query, k):
        """The k best as (distance, id); equally near ones by id."""
        code = None
        if self.by in ("rgb", "rgb-float"):
            code = self.code(linear_srgb(query["XYZ"], query["white"]))
        rows = range(len(self.table.rows))
        found = [(self.distance(i, query, code), self.table.rows[i]["id"]) for i in rows]
        return sorted(found)[:k]


def queries(case, spectra, observer=10):
    """Spectra with the colours that `convert` gives them."""
    rows = [("white", [1.0] * 31)] + [(f"q{i}", values) for i, values in enumerate(spectra)]
    options = ("--json", "--observer", observer)
    colours = case.run_ok("convert", "-", *options, stdin=spectra_csv(rows)).json()
    white = colours[0]["XYZ"]
    return [
        {"id": x["id"], "values": v, "XYZ": x["XYZ"], "Lab": x["Lab"], "white": white}
        for x, (_, v) in zip(colours[1:], rows[1:])
    ]


def sce(spectra, **more):
    return spectra_csv(
        [((f"q{i}", "sce"), v) for i, v in enumerate(spectra)], before=("id", "specular"), **more
    )


class Nearest(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.small = build_table(cls.shared_folder, *SMALL_GRID)
        cls.small_paper = build_table(cls.shared_folder, *SMALL_GRID, name="sp", model="paper")

    def check(self, path, ways, spectra, k, observer=10):
        table = Table(path)
        asked = queries(self, spectra, observer)
        for by in ways:
            how = ("--rgb", "float") if by == "rgb-float" else ("--by", by)
            got = self.run_ok(
                "match", "-", "--table", path, *how, "--k", k, "--json", stdin=sce(spectra)
            ).json()
            brute = Brute(table, by)
            for query, answer in zip(asked, got):
                with self.subTest(by=by, table=os.path.basename(path), query=query["id"]):
                    self.check_answer(answer, query, table, by, brute.nearest(query, k + 1))

    def check_answer(self, answer, query, table, by, best):
        expected = [n for n in MEMBERS if n != "rms" or table.rows[0]["spectrum"] is not None]
        self.assertEqual(set(answer), {*expected, "nearest"})
        self.assertEqual(answer["by"], by)
        self.assertEqual(answer["table_sha256"], table.meta["content_sha256"])
        row = table.rows[answer["nearest"][0]["row"] - 1]
        for name in ("Cm", "Bm", "Ch"):
            self.assertEqual(answer[name], row[name])
        self.assertEqual([answer[x] for x in "Lab"], list(row["Lab"]))
        self.assertClose(answer["dE00"], ciede2000(query["Lab"], row["Lab"]), absolute=1e-9)
        self.assertEqual(answer["distance"], answer["nearest"][0]["distance"])
        if row["spectrum"] is not None:
            squares = [(x - y) ** 2 for x, y in zip(row["spectrum"], query["values"])]
            rms = math.sqrt(sum(squares) / len(squares))
            self.assertClose(answer["rms"], rms, absolute=1e-12)
        count = min(len(best), len(answer["nearest"]))
        self.assertGreaterEqual(count, min(len(best) - 1, len(table.rows)))
        for i, hit in enumerate(answer["nearest"]):
            self.assertEqual(list(hit), ["row", "Cm", "Bm", "Ch", "distance"])
            self.assertClose(hit["distance"], best[i][0], relative=1e-9, absolute=1e-9)
            row = table.rows[hit["row"] - 1]
            self.assertEqual(
                [hit[x] for x in ("Cm", "Bm", "Ch")], [row[x] for x in ("Cm", "Bm", "Ch")]
            )
            # Where two are nearer to each other than arithmetic tells, or codes
            # are whole and so truly equal, the order is that of ids.
            gap = min(abs(best[i][0] - d) for j, (d, _) in enumerate(best) if j != i)
            if gap > 1e-8 or by == "rgb":
                self.assertEqual(hit["row"], best[i][1], f"place {i + 1}")

    def test_small_table_every_way(self):
        spread = random.Random(5)
        spectra = [skin_like(spread) for _ in range(40)]
        ways = ("rgb", "rgb-float", "lab", "de2000", "spectrum")
        self.check(self.small, ways, spectra, 7)

    def test_small_paper_table(self):
        spread = random.Random(6)
        spectra = [skin_like(spread) for _ in range(40)]
        self.check(self.small_paper, ("rgb", "rgb-float", "lab", "de2000"), spectra, 4, observer=2)

    def test_default_tables(self):
        spread = random.Random(8)
        spectra = [skin_like(spread) for _ in range(2)]
        self.check(TWO_LAYER, ("rgb", "lab", "de2000", "spectrum"), spectra, 3)
        self.check(PAPER, ("rgb", "lab"), spectra, 3, observer=2)

    def test_default_way(self):
        """By spectrum where the table has spectra, else by rgb."""
        text = sce([[0.3] * 31])
        for path, by in ((self.small, "spectrum"), (self.small_paper, "rgb")):
            (x,) = self.run_ok("match", "-", "--table", path, "--json", stdin=text).json()
            self.assertEqual(x["by"], by)

    def test_spectrum_over_the_common_bands_only(self):
        """450..600 by 10 has 16 bands and no colour; 380..780 by 5 has all 31."""
        table = Table(self.small)
        for nm in (list(range(450, 601, 10)), list(range(380, 781, 5)), list(range(400, 701, 1))):
            common = [x for x in NM if x in nm]
            spread = random.Random(len(nm))
            values = skin_like(spread, nm)
            at = dict(zip(nm, values))
            expected = []
            for row in table.rows:
                reflectance = dict(zip(NM, row["spectrum"]))
                squares = [(at[x] - reflectance[x]) ** 2 for x in common]
                expected.append((math.sqrt(sum(squares) / len(squares)), row["id"]))
            best = min(expected)
            with self.subTest(bands=len(nm)):
                (x,) = self.run_ok(
                    "match",
                    "-",
                    "--table",
                    self.small,
                    "--k",
                    1,
                    "--json",
                    stdin=sce([values], nm=nm),
                ).json()
                self.assertEqual(x["nearest"][0]["row"], best[1])
                self.assertClose(x["distance"], best[0], absolute=1e-12)
                self.assertEqual("dE00" in x, len(nm) > 16)
                self.assertEqual("no_colour" in x["flags"], len(nm) == 16)

    def test_too_few_common_bands(self):
        nm = list(range(400, 481, 10))
        text = sce([[0.3] * len(nm)], nm=nm)
        for nm in (
            list(range(400, 481, 10)),
            [403, 413, 423, 433, 443],
            list(range(800, 1001, 10)),
        ):
            text = sce([[0.3] * len(nm)], nm=nm)
            says = ("<stdin>:1:13:", "bands in common", "10")
            done = self.refused(1, "match", "-", "--table", self.small, stdin=text, says=says)
            self.assertEqual(done.out, "")
        self.refused(
            1, "match", "-", "--table", self.small, "--by", "lab", stdin=text, says="400..700"
        )

    def test_more_asked_for_than_there_are(self):
        folder = self.folder()
        path = build_table(folder, "--cm", "0.1", "--bm", "0.5", "--ch", "0.01", name="one")
        text = sce([[0.3] * 31])
        for by in ("rgb", "lab", "de2000", "spectrum"):
            (x,) = self.run_ok(
                "match", "-", "--table", path, "--by", by, "--k", 5, "--json", stdin=text
            ).json()
            self.assertEqual(len(x["nearest"]), 1)
            (row,) = self.run_ok("match", "-", "--table", path, "--k", 3, stdin=text).rows()
            self.assertEqual((row["row"], row["Cm_3"]), ("1", ""))

    def test_flags(self):
        table = Table(self.small)
        grid = {(r["Cm"], r["Bm"], r["Ch"]): r for r in table.rows}
        Cm, Bm, Ch = (sorted({key[i] for key in grid}) for i in range(3))
        cases = [
            ((Cm[2], Bm[1], Ch[2]), set()),
            ((Cm[-1], Bm[1], Ch[2]), {"Cm_at_limit"}),
            ((Cm[2], Bm[0], Ch[2]), {"Bm_at_limit"}),
            ((Cm[2], Bm[1], Ch[-1]), {"Ch_at_limit"}),
            ((Cm[0], Bm[0], Ch[2]), {"Cm_at_limit", "Bm_undetermined"}),
            ((Cm[-1], Bm[-1], Ch[0]), {"Cm_at_limit", "Bm_at_limit", "Ch_at_limit"}),
        ]
        text = sce([grid[key]["spectrum"] for key, _ in cases])
        got = self.run_ok("match", "-", "--table", self.small, "--json", stdin=text).json()
        for (key, flags), x in zip(cases, got):
            self.assertEqual((x["Cm"], x["Bm"], x["Ch"]), key)
            self.assertEqual(set(x["flags"]), flags, key)
        (x,) = self.run_ok(
            "match", "-", "--table", self.small, "--json", stdin=sce([[0.9, 0.1] * 15 + [0.9]])
        ).json()
        self.assertIn("poor_fit", x["flags"])

    def test_rows_equally_near_by_id(self):
        """Black by rgb: 8-bit codes of dark skins coincide."""
        text = sce([[0.0] * 31])
        path = build_table(self.folder(), "--cm", "0.49:0.5:3", "--bm", "0.99:1:3", "--ch", "0.1")
        table = Table(path)
        codes = [math.hypot(*srgb_code(row["rgb"])) for row in table.rows]
        first = codes.index(min(codes)) + 1
        self.assertGreater(codes.count(min(codes)), 1)
        (x,) = self.run_ok(
            "match", "-", "--table", path, "--by", "rgb", "--k", 9, "--json", stdin=text
        ).json()
        self.assertEqual(x["nearest"][0]["row"], first)
        self.assertIn("tie", x["flags"])
        pairs = [(h["distance"], h["row"]) for h in x["nearest"]]
        self.assertEqual(pairs, sorted(pairs))

    def test_members_and_columns(self):
        text = sce([[0.3] * 31])
        (x,) = self.run_ok("match", "-", "--table", self.small, "--json", stdin=text).json()
        self.assertEqual(list(x), MEMBERS)
        (line,) = self.run_ok("match", "-", "--table", self.small, "--ndjson", stdin=text).ndjson()
        self.assertEqual(line, x)
        (row,) = self.run_ok("match", "-", "--table", self.small, "--k", "2", stdin=text).rows()
        for name in ("Cm", "Bm", "Ch", "L", "a", "b", "dE00", "rms", "distance"):
            self.assertClose(float(row[name]), x[name], relative=1e-8)
        self.assertEqual(row["table"], "small")
        self.assertEqual(row["flags"].split(";"), x["flags"])
        self.assertGreaterEqual(float(row["distance_2"]), float(row["distance"]))

    def test_paper_table_has_no_spectra(self):
        text = sce([[0.3] * 31])
        says = ("'sp'", "has no spectra", "rgb, lab or de2000")
        self.refused(
            2, "match", "-", "--table", self.small_paper, "--by", "spectrum", stdin=text, says=says
        )

    def test_reflectance_comes_back(self):
        """A row of the table as a spectrum finds itself."""
        table = Table(TWO_LAYER)
        for row in random.Random(9).sample(table.rows, 12):
            skin = [f"--{name.lower()}={row[name]!r}" for name in ("Cm", "Bm", "Ch")]
            spectrum = self.run_ok("reflectance", *skin).out
            options = ("--table", TWO_LAYER, "--k", "1", "--json")
            (x,) = self.run_ok("match", "-", *options, stdin=spectrum).json()
            self.assertEqual(x["nearest"][0]["row"], row["id"])
            self.assertLess(x["distance"], 1e-6)

    def test_usage(self):
        self.refused(2, "match", says="FILE")
        self.refused(2, "match", "-", "--by", "hue", says=("'hue'", "rgb, lab, de2000"))
        for k in ("0", "101", "-1", "1.5", "x", ""):
            self.refused(2, "match", "-", f"--k={k}", says=("--k", f"'{k}'", "1..100"))
        self.refused(2, "match", "-", "--rgb", "double", says="float")
        self.refused(2, "match", "-", "--rgb", "float", "--by", "lab", says="--by rgb")
        self.refused(2, "match", "-", "--threads", "0", says="--threads")


class Specular(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.table = build_table(cls.shared_folder, *SMALL_GRID)

    def match(self, text, *options):
        return self.run_ok(
            "match", "-", "--table", self.table, "--json", *options, stdin=text
        ).json()

    def test_unstated_is_refused(self):
        text = spectra_csv([("a", [0.3] * 31)])
        says = ("<stdin>", "--specular sce", "--specular sci --surface S", "column 'specular'")
        for options in ((), ("--surface", "0.04"), ("--json",)):
            done = self.refused(
                2, "match", "-", "--table", self.table, *options, stdin=text, says=says
            )
            self.assertEqual(done.out, "")

    def test_an_unstated_row_does_not_stop_the_others(self):
        rows = [((f"q{i}", "sci" if i == 3 else "sce"), [0.3] * 31) for i in range(600)]
        text = spectra_csv(rows, before=("id", "specular"))
        done = run("match", "-", "--table", self.table, "--ndjson", stdin=text)
        answers = done.ndjson()
        self.assertEqual(done.status, 1)
        self.assertEqual(len(answers), 600)
        self.assertEqual([x["id"] for x in answers if "error" in x], ["q3"])

    def test_a_bad_row_is_status_1_whatever_is_wrong_with_it(self):
        """2 is for how the program was called; of CSV and NDJSON, first, last and only row."""
        good = ["sce", *["0.3"] * 31]
        bad = (
            ["", *["0.3"] * 31],
            ["sci", *["0.3"] * 31],
            ["both", *["0.3"] * 31],
            ["sce", "-0.1", *["0.3"] * 30],
            ["sce", "x", *["0.3"] * 30],
            ["sce", "", *["0.3"] * 30],
            ["sce", *["30"] * 31],
            ["sce", *["0.3"] * 30],
            ["sce", *["0.3"] * 32],
        )
        header = ",".join(["specular", *map(str, range(400, 701, 10))])
        scene = self.file('{"want": ["nearest"], "by": "lab"}', "scene.json")
        for row in bad:
            for rows in ([row, good], [good, row], [row], [row] * 300):
                text = "\n".join([header, *map(",".join, rows)]) + "\n"
                for options in ((), ("--refine",), ("--ndjson", "--scene", scene)):
                    with self.subTest(row=row[:2], rows=len(rows), options=options):
                        done = run("match", "-", "--table", self.table, *options, stdin=text)
                        self.assertEqual(done.status, 1, done.err)
                        lines = done.ndjson() if "--ndjson" in options else done.rows()
                        told = [bool(x.get("error")) for x in lines]
                        self.assertEqual(told, [x is row for x in rows])

    def test_unstated_in_a_row_is_refused(self):
        text = spectra_csv([(("a", ""), [0.3] * 31)], before=("id", "specular"))
        says = ("<stdin>:2", "--specular sce")
        self.refused(1, "match", "-", "--table", self.table, stdin=text, says=says)
        self.assertEqual(len(self.match(text, "--specular", "sce")), 1)

    def test_included_needs_the_surface(self):
        text = spectra_csv([("a", [0.3] * 31)])
        self.refused(2, "match", "-", "--specular", "sci", stdin=text, says="--surface S")
        text = spectra_csv([(("a", "sci"), [0.3] * 31)], before=("id", "specular"))
        says = ("<stdin>:2", "--surface S")
        self.refused(1, "match", "-", "--table", self.table, stdin=text, says=says)

    def test_surface_is_taken_off(self):
        spread = random.Random(12)
        plain = [skin_like(spread) for _ in range(10)]
        raised = [[x + 0.0375 for x in values] for values in plain]
        expected = self.match(spectra_csv(list(enumerate(plain))), "--specular", "sce")
        text = spectra_csv(list(enumerate(raised)))
        got = self.match(text, "--specular", "sci", "--surface", "0.0375")
        column = spectra_csv(
            [((i, "SCI"), v) for i, v in enumerate(raised)], before=("id", "Specular")
        )
        by_column = self.match(column, "--surface", "0.0375")
        self.assertEqual(got, by_column)
        for x, y in zip(got, expected):
            self.assertEqual([x[n] for n in ("Cm", "Bm", "Ch")], [y[n] for n in ("Cm", "Bm", "Ch")])
            self.assertClose(x["distance"], y["distance"], absolute=1e-12)

    def test_row_and_option_contradict(self):
        rows = [(("a", "sce"), [0.3] * 31), (("b", "sci"), [0.3] * 31), (("c", "sce"), [0.3] * 31)]
        text = spectra_csv(rows, before=("id", "specular"))
        done = self.refused(
            1,
            "match",
            "-",
            "--table",
            self.table,
            "--specular",
            "sce",
            "--json",
            stdin=text,
            says=("<stdin>:3:3:", "row says sci", "--specular sce"),
        )
        answers = done.json()
        self.assertEqual([set(x) == {"id", "error"} for x in answers], [False, True, False])

    def test_surface_with_excluded_is_a_contradiction(self):
        text = spectra_csv([("a", [0.3] * 31)])
        options = ("--specular", "sce", "--surface", "0.04")
        self.refused(2, "match", "-", *options, stdin=text, says="--surface")

    def test_surface_range(self):
        for surface in ("-0.01", "0.11", "nan", "x"):
            options = ("--specular", "sci", f"--surface={surface}")
            self.refused(2, "match", "-", *options, says=("--surface", surface))
        text = spectra_csv([("a", [0.3] * 31)])
        for surface in ("0", "0.1"):
            self.assertEqual(len(self.match(text, "--specular", "sci", "--surface", surface)), 1)

    def test_surface_above_a_band(self):
        """Below by more than 0.005 refuses the row; by less it becomes 0, flagged."""
        rows = [
            ("far", [0.3] * 3 + [0.034] + [0.3] * 27),
            ("near", [0.3] * 3 + [0.036] + [0.3] * 27),
            ("edge", [0.3] * 3 + [0.035] + [0.3] * 27),
            ("none", [0.3] * 3 + [0.04] + [0.3] * 27),
        ]
        done = self.refused(
            1,
            "match",
            "-",
            "--table",
            self.table,
            "--json",
            "--specular",
            "sci",
            "--surface",
            "0.04",
            stdin=spectra_csv(rows),
            says=("<stdin>:2:17:", "430 nm", "0.034", "0.04"),
        )
        far, near, edge, none = done.json()
        self.assertEqual(set(far), {"id", "error"})
        self.assertIn("bands_zeroed", near["flags"])
        self.assertIn("bands_zeroed", edge["flags"])
        self.assertNotIn("bands_zeroed", none["flags"])
        zeroed = [x - 0.04 for x in rows[1][1]]
        zeroed[3] = 0.0
        (expected,) = self.match(spectra_csv([("near", zeroed)]), "--specular", "sce")
        self.assertClose(near["distance"], expected["distance"], absolute=1e-12)

    def test_no_such_word(self):
        self.refused(2, "match", "-", "--specular", "yes", says=("'yes'", "sce nor sci"))
        text = spectra_csv([(("a", "both"), [0.3] * 31)], before=("id", "specular"))
        says = ("<stdin>:2:3:", "'both'", "sce or sci")
        self.refused(1, "match", "-", "--table", self.table, stdin=text, says=says)

    def test_measured_forearms(self):
        """Measured with the mirror reflection: refused until that is said."""
        path = os.path.join(MEASURED, "nist_forearm_avg_10nm.csv")
        if not os.path.exists(path):
            raise unittest.SkipTest("nist_forearm_avg_10nm.csv: not here, set SKINSPEC_MEASURED")
        how = ("match", path, "--table", TWO_LAYER, "--by", "spectrum", "--json")
        self.refused(2, *how, says=("--specular", "--surface"))
        self.refused(2, *how, "--specular", "sci", says="--surface")
        answers = self.run_ok(*how, "--specular", "sci", "--surface", "0.04").json()
        self.assertEqual(len(answers), 100)
        for x in answers:
            self.assertTrue(0 <= x["Cm"] <= 0.5 and 0 <= x["Bm"] <= 1 and 0.001 <= x["Ch"] <= 0.1)
            self.assertTrue(0 < x["rms"] < 0.2)
            self.assertEqual(x["rms"], x["distance"])


class Batches(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.table = build_table(cls.shared_folder, *SMALL_GRID)

    def test_threads_do_not_change_a_byte(self):
        spread = random.Random(13)
        text = sce([skin_like(spread) for _ in range(700)])
        for how in (
            ("--by", "spectrum"),
            ("--by", "de2000", "--k", "5"),
            ("--by", "rgb", "--json"),
        ):
            outs = {
                self.run_ok(
                    "match", "-", "--table", self.table, *how, "--threads", n, stdin=text
                ).out
                for n in (1, 2, 3)
            }
            self.assertEqual(len(outs), 1, how)
            self.assertIn("q699", outs.pop())

    def test_a_bad_row_keeps_its_place(self):
        """In the first batch and in a later one."""
        spectra = [[0.3] * 31 for _ in range(600)]
        for bad in (0, 5, 300, 599):
            spectra[bad] = [-0.1] * 31
        done = run("match", "-", "--table", self.table, "--ndjson", stdin=sce(spectra))
        self.assertEqual(done.status, 1)
        answers = done.ndjson()
        self.assertEqual([x["id"] for x in answers], [f"q{i}" for i in range(600)])
        bad = [i for i, x in enumerate(answers) if "error" in x]
        self.assertEqual(bad, [0, 5, 300, 599])
        self.assertEqual(set(answers[5]), {"id", "error"})
        self.assertEqual(len(done.err.splitlines()), 4)
        self.assertIn("<stdin>:7:8:", done.err)
        rows = run("match", "-", "--table", self.table, stdin=sce(spectra)).rows()
        self.assertEqual([i for i, r in enumerate(rows) if r["error"]], [0, 5, 300, 599])

    def test_strict_stops_at_the_first(self):
        spectra = [[0.3] * 31 for _ in range(20)]
        spectra[3] = [-0.1] * 31
        options = ("--table", self.table, "--strict", "--json")
        done = self.refused(1, "match", "-", *options, stdin=sce(spectra), says="<stdin>:5:8:")
        self.assertEqual([x["id"] for x in done.json()], ["q0", "q1", "q2", "q3"])

    def test_a_thousand_in_about_a_second(self):
        """Against the default table; ten seconds here, for a busy machine."""
        spread = random.Random(14)
        text = sce([skin_like(spread) for _ in range(1000)])
        began = time.monotonic()
        done = self.run_ok("match", "-", "--table", TWO_LAYER, stdin=text)
        took = time.monotonic() - began
        self.assertEqual(len(done.rows()), 1000)
        if not INSTRUMENTED:
            self.assertLess(took, 10.0)

    def peak_kib(self, rows):
        """Memory at its highest once so many rows were read from a pipe."""
        if not os.path.exists("/proc/self/status"):
            raise unittest.SkipTest("/proc is not here")
        text = sce([[0.25 + i / 1e4 for i in range(31)]]).encode()
        header, row = text.splitlines(keepends=True)
        # The pipe stays open while memory is looked at, so the program is still there.
        with start(
            "match",
            "-",
            "--table",
            self.table,
            "--threads",
            "2",
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            env=environment(ASAN_OPTIONS="quarantine_size_mb=1"),
        ) as child:
            child.stdin.write(header + row * rows)
            child.stdin.flush()
            unread = 1
            while unread:
                time.sleep(0.01)
                unread = struct.unpack("i", fcntl.ioctl(child.stdin, termios.FIONREAD, b"\0" * 4))[
                    0
                ]
            time.sleep(0.05)
            with open(f"/proc/{child.pid}/status", encoding="ascii") as status:
                peak = next(x for x in status if x.startswith("VmHWM"))
            child.stdin.close()
            self.assertEqual(child.wait(), 0)
        return int(peak.split()[1])

    def test_memory_does_not_grow(self):
        few, many = self.peak_kib(2000), self.peak_kib(20000)
        self.assertLess(many, 1.1 * few + 1024)

    def test_answers_come_while_the_input_goes_on(self):
        """A batch is answered before the pipe is closed."""
        row = sce([[0.3] * 31]).encode()
        header, row = row.splitlines(keepends=True)
        with start(
            "match",
            "-",
            "--table",
            self.table,
            "--ndjson",
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        ) as child:
            child.stdin.write(header + row * 600)
            child.stdin.flush()
            late = threading.Timer(30, child.kill)
            late.start()
            first = child.stdout.readline()
            late.cancel()
            self.assertIn(b'"q0"', first)
            child.stdin.close()
            self.assertEqual(len(child.stdout.read().splitlines()), 599)


if __name__ == "__main__":
    main()
