"""test_match_stream.py - many rows through `skinspec match`: NDJSON, pieces, runs that are stopped."""

import json
import os
import random
import re
import resource
import shutil
import signal
import subprocess
import threading
import time

import support
from support import (
    INSTRUMENTED,
    SKINSPEC,
    TIMEOUT_S,
    TWO_LAYER,
    Case,
    build_table,
    environment,
    main,
    run,
    skin_like,
    spectra_csv,
    start,
)

SMALL_GRID = ("--cm", "0:0.16:3", "--bm", "0:1:4", "--ch", "log:0.001:0.1:5")
NM = support.NM


def csv_text(spectra, name="s"):
    """With an id, a note that has quotes and line breaks, and `specular`."""
    rows = []
    for i, values in enumerate(spectra):
        note = ("", "plain", 'a "quoted", one', "two\nlines", ' "', "#5", "\n\n\n,,,\n")[i % 7]
        rows.append(([f"{name}{i}", note, "sce"], values))
    return spectra_csv(rows, before=("id", "note", "specular"))


def line_of(values, first_nm=400, step_nm=10, **more):
    spectrum = {"first_nm": first_nm, "step_nm": step_nm, "values": values}
    return json.dumps({"specular": "sce", **more, "spectrum": spectrum})


def lines_of(spectra, **more):
    return "".join(line_of(v, id=f"s{i}", **more) + "\n" for i, v in enumerate(spectra))


class Stream(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.table = build_table(cls.shared_folder, *SMALL_GRID)
        spread = random.Random(41)
        cls.spectra = [skin_like(spread) for _ in range(900)]

    def match(self, text, *options, status=0):
        done = run("match", "-", "--table", self.table, *options, stdin=text)
        self.assertEqual(done.status, status, done.err)
        return done


# ---- NDJSON --------------------------------------------------------------------------


class Ndjson(Stream):
    def test_answers_as_of_csv(self):
        """The same numbers to the last digit."""
        for how in ((), ("--by", "de2000", "--k", "3"), ("--refine",)):
            few = self.spectra[:60] if how == ("--refine",) else self.spectra
            rows = spectra_csv([([f"s{i}"], v) for i, v in enumerate(few)])
            by_csv = self.match(rows, "--specular", "sce", "--json", *how).json()
            by_lines = self.match(lines_of(few), "--json", *how).json()
            for answer in by_lines:
                self.assertEqual(answer.pop("specular"), "sce")
            self.assertEqual(by_lines, by_csv)

    def test_as_csv(self):
        rows = self.match(lines_of(self.spectra[:5], visit=3)).rows()
        self.assertEqual([r["id"] for r in rows], [f"s{i}" for i in range(5)])
        self.assertEqual(list(rows[0])[:4], ["id", "Cm", "Bm", "Ch"])

    def test_members_are_carried_as_they_are_written(self):
        text = line_of([0.3] * 31)[:-1] + (
            ', "x": 1.10, "big":12345678901234567890, "deep": {"a": [1, {"b": "}]\\""}]},'
            ' "L": "mine", "\\u006e\\u00e4me": "\\u00e4", "words": null, "input_L": 5, "id": 7.50}\n'
        )
        said = self.match(text, "--ndjson").out
        for part in (
            '"id":7.50,',
            '"x":1.10',
            '"big":12345678901234567890',
            '"deep":{"a": [1, {"b": "}]\\""}]}',
            '"input_L":"mine"',
            '"input_words":null',
            '"input_input_L":5',
            '"näme":"\\u00e4"',
            '"specular":"sce"',
        ):
            self.assertIn(part, said)
        answer = json.loads(said)
        self.assertIsInstance(answer["L"], float)
        self.assertNotIn("spectrum", answer)
        names = re.findall(r'"(\w+)":', said)
        self.assertEqual(len([n for n in names if n == "L"]), 1)

    def test_every_name_of_an_answer_is_kept_free(self):
        for how in (("--k", "2"), ("--refine", "--k", "2"), ("--refine=skin", "--fix", "SO2=0.7")):
            plain = self.match(line_of(self.spectra[3]), "--ndjson", *how).ndjson()[0]
            names = [n for n in plain if n not in ("id", "specular")]
            more = {name: "mine" for name in names}
            answer = self.match(line_of(self.spectra[3], **more), "--ndjson", *how).ndjson()[0]
            for name in names:
                self.assertEqual(answer[name], plain[name])
                self.assertEqual(answer[f"input_{name}"], "mine")

    def test_ids(self):
        text = "".join(
            line_of([0.3] * 31, **more) + "\n"
            for more in ({"id": "ä\"\\\n"}, {}, {"id": ""}, {"id": 12}, {"id": "12"})
        )
        answers = self.match(text, "--ndjson").ndjson()
        self.assertEqual([x["id"] for x in answers], ['ä"\\\n', 2, 3, 12, "12"])
        rows = self.match(text).rows()
        self.assertEqual([r["id"] for r in rows], ['ä"\\\n', "2", "3", "12", "12"])

    def test_bad_lines_keep_their_places(self):
        good = line_of([0.3] * 31)
        values = json.dumps([0.3] * 31)
        bad = (
            ("{", "1:2:", "not JSON"),
            ("[1,2]", "1:1:", "no object"),
            (good[:-1] + ",}", f"1:{len(good) + 1}:", "not JSON"),
            ('{"id":1,"id":2}', "1:9:", "twice"),
            ('{"id":[1]}', "1:7:", "neither a text nor a number"),
            ('{"specular":"sce"}', "1:1:", "no spectrum"),
            ('{"spectrum":[1]}', "1:13:", "spectrum is no object"),
            ('{"spectrum":{"step_nm":10,"values":[1]}}', "1:13:", "has no first_nm"),
            ('{"spectrum":{"first_nm":"4","step_nm":10}}', "1:25:", "first_nm is not a number"),
            ('{"spectrum":{"first_nm":40,"step_nm":10}}', "1:25:", "first_nm is 40"),
            ('{"spectrum":{"first_nm":400,"step_nm":10}}', "1:13:", "has no values"),
            ('{"spectrum":{"first_nm":400,"step_nm":10,"values":7}}', "1:51:", "no array"),
            ('{"spectrum":{"first_nm":400,"step_nm":10,"values":[]}}', "1:51:", "0 values"),
            ('{"spectrum":{"first_nm":400,"step_nm":10,"Values":[]}}', "1:51:", "member 'Values'"),
            (good.replace("[0.3, 0.3", "[0.3, null", 1), "1:", "at 410 nm is not a number"),
            (good.replace("[0.3, 0.3", "[0.3, [0.3]", 1), "1:", "at 410 nm is not a number"),
            (good.replace("[0.3", "[[0.3", 1).replace("]}", "]]}"), "1:", "at 400 nm is not a num"),
            (good.replace("[0.3, 0.3", "[0.3, -0.1", 1), "1:", "-0.1 at 410 nm is negative"),
            (good.replace("[0.3, 0.3", "[0.3, 31.5", 1), "1:", "divide by 100"),
            (good.replace('"sce"', '"both"'), "1:14:", 'specular is "both"; expected "sce"'),
            (good.replace('"sce"', '"sci"'), "1:14:", "say --surface"),
            ('{"spectrum":{"first_nm":400,"step_nm":10,"values":%s}}' % values, "1:1:", "not said"),
            ('{"x":"\xff"}', "1:1:", "not UTF-8"),
        )
        for text, where, what in bad:
            with self.subTest(text=text[:80]):
                content = text.encode("latin-1") + b"\n\n  \t\n" + good.encode() + b"\n"
                options = ("--ndjson", "--input", "ndjson")
                done = self.match(content, *options, status=1)
                first, second = done.ndjson()
                self.assertEqual(set(first), {"id", "error"})
                self.assertIn("Cm", second)
                self.assertEqual(second["id"], 2)
                self.assertEqual(len(done.err.splitlines()), 1)
                self.assertIn(f"<stdin>:{where}", done.err)
                self.assertIn(what, done.err)

    def test_each_line_has_its_own_bands(self):
        halves = [0.2 + i / 400 for i in range(61)]
        text = line_of(halves[::2]) + "\n" + line_of(halves, step_nm=5) + "\n"
        for how in ((), ("--refine",)):
            first, second = self.match(text, "--ndjson", *how).ndjson()
            self.assertAlmostEqual(first["Cm"], second["Cm"], places=2)
            self.assertEqual(first["L"] == second["L"], not how)
        done = self.match(text + line_of([0.3] * 5) + "\n", "--ndjson", status=1)
        self.assertIn("5 bands in common with table 'small'", done.err)
        done = self.match(line_of([0.3] * 5) + "\n", "--by", "lab", status=1)
        self.assertIn("give no colour, which --by lab needs", done.err)

    def test_more_grids_than_fits_are_kept_for(self):
        text = "".join(line_of([0.3] * (31 + i), step_nm=5) + "\n" for i in range(17))
        done = self.match(text, "--refine", "--ndjson", "--threads", 1, status=1)
        answers = done.ndjson()
        self.assertEqual(["Cm" in x for x in answers], [True] * 16 + [False])
        self.assertIn("more than 16 grids", answers[16]["error"])

    def test_what_it_is_can_be_said(self):
        text = lines_of(self.spectra[:2])
        self.assertEqual(len(self.match(" " + text, "--input", "ndjson").rows()), 2)
        self.match(text, "--input", "csv", status=1)
        self.assertEqual(self.match("", "--input", "ndjson", "--json").json(), [])
        self.refused(2, "match", "-", "--input", "xml", says="neither csv nor ndjson")

    def test_a_line_too_long_ends_it(self):
        text = lines_of(self.spectra[:2]) + '{"x":"' + "a" * (1 << 20) + '"}\n'
        for more in ("", " " * (5 << 20)):
            done = self.match(text + more + lines_of(self.spectra[:1]), "--ndjson", status=1)
            self.assertEqual(len(done.ndjson()), 2)
            self.assertIn("<stdin>:3:1048577: line longer than 1 MiB", done.err)


# ---- pieces --------------------------------------------------------------------------


class Pieces(Stream):
    def dribble(self, content, sizes, *options):
        """Through a pipe, in parts of these sizes, each when the one before was read."""
        with start(
            "match", "-", "--table", self.table, *options,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        ) as child:  # fmt: skip

            def feed():
                at = 0
                while at < len(content):
                    n = next(sizes)
                    child.stdin.write(content[at : at + n])
                    child.stdin.flush()
                    at += n
                child.stdin.close()

            feeder = threading.Thread(target=feed)
            feeder.start()
            out = child.stdout.read()
            err = child.stderr.read()
            feeder.join()
            child.wait(TIMEOUT_S)
        return out, err

    def test_where_it_is_cut_changes_no_byte(self):
        """Records with line breaks in quotes, comments, blank rows; no ids but the numbers."""
        text = csv_text(self.spectra[:300]).replace("id,", "name,", 1)
        header, rest = text.split("\n", 1)
        rest = rest.replace("s7,", "# a \"comment\nGap", 1).replace("Gap", "s7,").replace(
            "\ns9,", "\n" + "," * 33 + "\n\n\ns9,", 1
        )
        bad = rest.replace("s100,", "s100,,", 1).replace("s204,plain,sce,", "s204,plain,sce,-", 1)
        content = (header + "\n" + bad).encode()
        whole = run("match", self.file(content), "--table", self.table, "--threads", 1)
        self.assertEqual(whole.status, 1)
        self.assertEqual(len(whole.rows()), 300)
        self.assertEqual([r["id"] for r in whole.rows()], [str(i + 1) for i in range(300)])
        messages = [line.split(".csv:", 1)[1] for line in whole.err.splitlines()]
        self.assertEqual(len(messages), 2)
        lines = content.decode().split("\n")
        for message, what in zip(messages, ("s100,,", "s204,plain,sce,-")):
            self.assertTrue(lines[int(message.split(":")[0]) - 1].startswith(what), message)
        dice = random.Random(5)
        for threads in (1, 2, 3):
            for most in (7, 300, 5000, 200000):
                out, err = self.dribble(
                    content, iter(lambda: dice.randrange(1, most), 0), "--threads", str(threads)
                )
                self.assertEqual(out, whole.out_bytes, (threads, most))
                self.assertEqual(
                    [x.split("<stdin>:", 1)[1] for x in err.decode().splitlines()], messages
                )

    def test_an_answer_comes_when_its_row_is_there(self):
        """Not when there are more."""
        header, row = csv_text([[0.3] * 31]).encode().splitlines(keepends=True)
        with start(
            "match", "-", "--table", self.table, "--threads", 2,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        ) as child:  # fmt: skip
            late = threading.Timer(30, child.kill)
            late.start()
            child.stdin.write(header)
            child.stdin.flush()
            self.assertTrue(child.stdout.readline().startswith(b"id,note"))
            for _ in range(3):
                child.stdin.write(row)
                child.stdin.flush()
                self.assertTrue(child.stdout.readline().startswith(b"s0,"))
            late.cancel()
            child.stdin.close()

    def test_messages_are_in_order_on_many_threads(self):
        spectra = [list(v) for v in self.spectra]
        for i in range(0, 900, 3):
            spectra[i][0] = -0.5
        text = spectra_csv([([f"s{i}"], v) for i, v in enumerate(spectra)])
        done = self.match(text, "--specular", "sce", "--threads", 4, status=1)
        lines = [int(x.split(":")[2]) for x in done.err.splitlines()]
        self.assertEqual(lines, [i + 2 for i in range(0, 900, 3)])
        done = self.match(text.replace("s0,-0.5", "s0,0.5"), "--specular", "sce", "--strict",
                          "--threads", 4, status=1)  # fmt: skip
        self.assertEqual(len(done.rows()), 4)
        self.assertEqual(len(done.err.splitlines()), 1)

    def test_strict_does_not_wait_for_more(self):
        """The bad row ends it, though the pipe stays open and a thread is waiting at it."""
        text = csv_text([[0.3] * 31, [-0.3] * 31]).encode()
        with start(
            "match", "-", "--table", self.table, "--strict", "--threads", 3,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        ) as child:  # fmt: skip
            child.stdin.write(text)
            child.stdin.flush()
            self.assertEqual(child.wait(30), 1)
            self.assertIn(b"negative", child.stderr.read())

    def peak_kib(self, header, rows, times, *options):
        """Memory of a run at its highest, once it has read all of a pipe that stays open."""
        with start(
            "match", "-", "--table", TWO_LAYER, "--threads", 2, *options,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        ) as child:  # fmt: skip
            lines = rows.count(b"\n") * times
            counted = threading.Thread(target=lambda: [child.stdout.readline() for _ in range(lines)])
            counted.start()
            child.stdin.write(header)
            for _ in range(times):
                child.stdin.write(rows)
            child.stdin.flush()
            counted.join(TIMEOUT_S)
            with open(f"/proc/{child.pid}/status", encoding="ascii") as status:
                peak = next(x for x in status if x.startswith("VmHWM"))
            child.stdin.close()
            child.stdout.read()
            self.assertEqual(child.wait(), 0)
        return int(peak.split()[1])

    def test_memory_is_constant(self):
        """10 000 rows and 200 000."""
        if INSTRUMENTED:
            self.skipTest("sanitizers keep freed memory")
        if not os.path.exists("/proc/self/status"):
            self.skipTest("/proc is not here")
        plain = spectra_csv([([f"s{i}", "sce"], v) for i, v in enumerate(self.spectra[:500])],
                            before=("id", "specular"))  # fmt: skip
        for text, options in ((plain, ()), (lines_of(self.spectra[:500]), ("--ndjson",))):
            header = text.split("\n", 1)[0] + "\n" if not options else ""
            rows = text[len(header) :].encode()
            few = self.peak_kib(header.encode(), rows, 20, *options)
            many = self.peak_kib(header.encode(), rows, 400, *options)
            self.assertLess(abs(many - few), 2048, f"{few} and {many} KiB")
            print(f"# 10 000 and 200 000 rows: {few} and {many} KiB")


# ---- runs that are stopped -----------------------------------------------------------


class Stopped(Stream):
    def setUp(self):
        self.path = self.file(csv_text(self.spectra))
        self.out = os.path.join(self.folder(), "answers")

    def resume(self, *options, status=0, path=None, table=None):
        done = run("match", path or self.path, "--table", table or self.table, "--out", self.out,
                   "--resume", *options)  # fmt: skip
        self.assertEqual(done.status, status, done.err)
        self.assertEqual(done.out, "")
        return done

    def there(self):
        with open(self.out, "rb") as f:
            return f.read()

    def put(self, content):
        with open(self.out, "wb") as f:
            f.write(content)

    def test_out_is_what_standard_output_is(self):
        whole = run("match", self.path, "--table", self.table).out_bytes
        self.resume()
        self.assertEqual(self.there(), whole)
        options = ("match", self.path, "--table", self.table, "--out", self.out)
        self.refused(1, *options, says=("exists already", "--resume", "--force"))
        self.run_ok(*options, "--json", "--force")
        self.assertEqual(len(json.loads(self.there())), 900)
        self.refused(1, *options[:-1], "/dev/null", says="no regular file")

    def test_from_wherever_it_was_cut(self):
        """After any number of bytes the end is that of one run."""
        dice = random.Random(6)
        for options in ((), ("--ndjson", "--k", "2"), ("--no-header",)):
            whole = run("match", self.path, "--table", self.table, *options).out_bytes
            first = whole.index(b"\n") + 1
            cuts = [0, 1, first - 1, first, first + 1, len(whole) - 1, len(whole)]
            for cut in cuts + [dice.randrange(len(whole)) for _ in range(25)]:
                with self.subTest(options=options, cut=cut):
                    self.put(whole[:cut])
                    self.resume(*options)
                    self.assertEqual(self.there(), whole)

    def test_of_a_pipe(self):
        whole = run("match", self.path, "--table", self.table).out_bytes
        self.put(whole[: len(whole) // 2])
        with open(self.path, "rb") as f:
            self.run_ok("match", "-", "--table", self.table, "--out", self.out, "--resume",
                        stdin=f.read())  # fmt: skip
        self.assertEqual(self.there(), whole)

    def test_zeros_that_a_power_cut_leaves(self):
        whole = run("match", self.path, "--table", self.table).out_bytes
        self.put(whole[:5000] + bytes(9000))
        self.resume()
        self.assertEqual(self.there(), whole)

    def test_what_does_not_belong_is_refused_and_kept(self):
        whole = run("match", self.path, "--table", self.table).out_bytes
        other_table = build_table(self.folder(), "--cm", "0:0.2:3", "--bm", "0:1:3",
                                  "--ch", "log:0.001:0.1:5")  # fmt: skip
        swapped = list(self.spectra)
        swapped[290:300] = swapped[300:310]
        half = whole[: whole.index(b"\ns300,") + 1]
        cases = (
            (half, {"table": other_table}, (), "are others"),
            (half, {}, ("--by", "lab"), "are others"),
            (half, {"path": self.file(csv_text(swapped))}, (), "rows from 285 on"),
            (half, {}, ("--k", "2"), "columns are not those"),
            (half, {}, ("--ndjson",), "are others"),
            (whole, {"path": self.file(csv_text(self.spectra[:500]))}, (), "more rows than"),
            (b"my letters\nto Milena\n", {}, (), "columns are not those"),
        )
        for content, where, options, says in cases:
            with self.subTest(says=says):
                self.put(content)
                done = self.resume(*options, status=1, **where)
                self.assertIn(says, done.err)
                self.assertEqual(self.there(), content)

    def test_no_input_is_written_over(self):
        """By whatever name --out leads to a file that is read, it is refused and stays as it is."""
        folder = self.folder()
        scene = {"want": ["nearest"], "by": "lab"}
        costs = (
            "# machine: none\n# costs: 1\nmodel,rows,by,refine,interval,us,us_p95,Cm,Bm,Ch,Cm_transport,"
            "Bm_transport,Ch_transport,dE00,rms_R,bytes\n"
            "two-layer,50400,lab,none,0,1,1,1e-5,0.1,0.01,1e-5,0.1,0.01,1,0.01,0\n"
        )
        columns = csv_text([])
        contents = {
            "in.csv": csv_text(self.spectra[:40]),
            "piece.csv": csv_text(self.spectra[:40])[len(columns) :],
            "columns.csv": columns,
            "scene.json": json.dumps(scene),
            "costs.csv": costs,
        }
        for name, text in contents.items():
            with open(os.path.join(folder, name), "w", encoding="utf-8") as f:
                f.write(text)
        shutil.copy(self.table, os.path.join(folder, "table-mine.db"))
        os.makedirs(os.path.join(folder, "links"))
        for name in [*contents, "table-mine.db"]:
            os.symlink(os.path.join("..", name), os.path.join(folder, "links", "soft-" + name))
            os.link(os.path.join(folder, name), os.path.join(folder, "links", "hard-" + name))

        def there():
            return {name: open(os.path.join(folder, name), "rb").read()
                    for name in [*contents, "table-mine.db"]}  # fmt: skip

        before = there()
        plain = ("in.csv", "--table", "table-mine.db")
        piece = ("piece.csv", "--table", "table-mine.db", "--header", "columns.csv")
        by_scene = (*plain, "--scene", "scene.json", "--costs", "costs.csv", "--ndjson")
        for options, read in (
            (plain, ("in.csv", "table-mine.db")),
            ((*plain, "--json"), ("in.csv",)),
            (piece, ("piece.csv", "columns.csv")),
            (by_scene, ("in.csv", "scene.json", "costs.csv", "table-mine.db")),
        ):
            for name in read:
                for out in (name, f"./links/../{name}", f"links/soft-{name}", f"links/hard-{name}"):
                    for mode in ("--force", "--resume"):
                        if mode == "--resume" and "--json" in options:
                            continue
                        with self.subTest(options=options, out=out, mode=mode):
                            done = run("match", *options, "--out", out, mode, cwd=folder)
                            self.assertEqual(done.status, 1)
                            self.assertRegex(done.err, rf"^skinspec: {out} is the .* itself; give ")
                            self.assertEqual(there(), before)
        for mode in ("--force", "--resume"):
            with open(os.path.join(folder, "in.csv"), "rb") as f:
                done = subprocess.run(
                    [SKINSPEC, "match", "-", "--table", self.table, "--out", "in.csv", mode],
                    cwd=folder, stdin=f, stderr=subprocess.PIPE, env=environment(), check=False,
                    timeout=TIMEOUT_S,
                )  # fmt: skip
            self.assertEqual(done.returncode, 1)
            self.assertIn(b"in.csv is standard input itself", done.stderr)
        for command in (("match", "in.csv", "--table", self.table), ("convert", "in.csv")):
            with open(os.path.join(folder, "in.csv"), "ab") as f:
                done = subprocess.run(
                    [SKINSPEC, *command], cwd=folder, stdout=f, stderr=subprocess.PIPE,
                    env=environment(), check=False, timeout=TIMEOUT_S,
                )  # fmt: skip
            self.assertEqual(done.returncode, 1)
            self.assertIn(b"standard output is the input itself", done.stderr)
        self.assertEqual(there(), before)
        with open(os.path.join(folder, "new.csv"), "w", encoding="utf-8"):
            self.run_ok("match", *plain, "--out", "new.csv", "--force", cwd=folder)

    def test_usage(self):
        for options, says in (
            (("--resume",), "--out"),
            (("--force",), "--out"),
            (("--out", "x", "--resume", "--force"), "one of them"),
            (("--out", "x", "--resume", "--json"), "--ndjson"),
            (("--shard", "1/2", "--json"), "--ndjson"),
            (("--shard", "3/2"), "1..2"),
            (("--shard", "2"), "I/N"),
            (("--header", "h", "--input", "ndjson"), "for CSV"),
        ):
            self.refused(2, "match", self.path, "--table", self.table, *options, says=says)
        self.refused(2, "match", "-", "--table", self.table, "--shard", "1/2", stdin=csv_text([]),
                     says="only a file has parts")  # fmt: skip

    def stopped(self, *options, number=signal.SIGINT):
        """A run ended by a signal when some rows of a pipe were answered; what it said."""
        text = csv_text(self.spectra[:200]).encode()
        with start(
            "match", "-", "--table", self.table, "--threads", 2, *options,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        ) as child:  # fmt: skip
            child.stdin.write(text + b"s200,half of a r")
            child.stdin.flush()
            last = b'"s199"' if set(options) & {"--json", "--ndjson"} else b"\ns199,"
            until = time.monotonic() + 30
            while "--out" in options and time.monotonic() < until:
                time.sleep(0.02)
                if any(last in content for content in self.beside().values()):
                    break
            self.said = b""
            while "--out" not in options and last not in self.said:
                self.said += os.read(child.stdout.fileno(), 65536)
            child.send_signal(number)
            self.said += child.stdout.read()
            self.assertEqual(child.wait(TIMEOUT_S), -number)
            return child.stderr.read().decode()

    def beside(self):
        """What stands in the folder of --out, hidden files too."""
        folder = os.path.dirname(self.out)
        content = {}
        for name in os.listdir(folder):
            with open(os.path.join(folder, name), "rb") as f:
                content[name] = f.read()
        return content

    def test_by_a_signal(self):
        whole = run("match", self.path, "--table", self.table).out_bytes
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            said = self.stopped("--out", self.out, number=number)
            self.assertEqual(
                said,
                f"skinspec: stopped after 200 rows, which are whole in {self.out}; with --resume "
                "the same command goes on\n",
            )
            self.assertEqual(self.there(), whole[: whole.index(b"\ns200,") + 1])
            self.resume()
            self.assertEqual(self.there(), whole)
            os.unlink(self.out)
        self.assertIn("stopped after 200 rows; if they went to a file", self.stopped())

    def test_two_runs_do_not_share_a_file(self):
        with start("match", "-", "--table", self.table, "--out", self.out,
                   stdin=subprocess.PIPE) as child:  # fmt: skip
            child.stdin.write(csv_text(self.spectra[:100]).encode())
            child.stdin.flush()
            until = time.monotonic() + 30
            while time.monotonic() < until:
                time.sleep(0.02)
                if os.path.exists(self.out) and b"\ns99," in self.there():
                    break
            for how in ("--resume", "--force"):
                self.refused(1, "match", self.path, "--table", self.table, "--out", self.out, how,
                             says="another skinspec match is writing it")  # fmt: skip
            child.stdin.close()
            self.assertEqual(child.wait(TIMEOUT_S), 0)
        whole = run("match", self.path, "--table", self.table).out_bytes
        self.assertEqual(self.there(), whole[: whole.index(b"\ns100,") + 1])
        self.resume()
        self.assertEqual(self.there(), whole)

    def test_how_to_go_on_is_what_goes_on(self):
        """After --force too, which does not go with --resume."""
        whole = run("match", self.path, "--table", self.table).out_bytes
        self.put(b"an old one")
        said = self.stopped("--out", self.out, "--force")
        self.assertIn("with --resume in place of --force the same command goes on", said)
        self.resume()
        self.assertEqual(self.there(), whole)

    def test_an_array_is_whole_or_not_at_all(self):
        """Nothing under its name, nothing beside it, no ']' and no word of --resume."""
        whole = run("match", self.path, "--table", self.table, "--json").out_bytes
        for there, how in ((None, ()), (b"what was there", ("--force",))):
            if there is not None:
                self.put(there)
            for number in (signal.SIGINT, signal.SIGTERM):
                said = self.stopped("--out", self.out, "--json", *how, number=number)
                self.assertIn(f"stopped after 200 rows; an array is whole or not at all, so they "
                              f"are not in {self.out}; --ndjson in place", said)  # fmt: skip
                self.assertNotIn("--resume", said)
                left = {} if there is None else {os.path.basename(self.out): there}
                self.assertEqual(self.beside(), left)
        said = self.stopped("--json")
        self.assertIn("stopped after 200 rows; the array has no end", said)
        self.assertNotIn("--resume", said)
        self.assertEqual(self.said, whole[: whole.index(b',\n{"id":"s200"')])
        options = ("match", self.path, "--table", self.table, "--json", "--out", self.out)
        self.refused(1, *options, says=("exists already", "--force"))
        self.run_ok(*options, "--force")
        self.assertEqual(self.beside(), {os.path.basename(self.out): whole})

    def test_an_input_that_breaks_off_makes_no_array(self):
        """An open quote, in the middle: 400 answers are no answer to 900 rows."""
        before, after = csv_text(self.spectra).split("\ns400,")
        broken = before + '\ns400,"' + after.replace('"', "")
        options = ("match", self.file(broken), "--table", self.table, "--json")
        done = self.refused(1, *options, says="quote")
        self.assertEqual(done.out.count('"id"'), 400)
        with self.assertRaises(ValueError):
            json.loads(done.out)
        self.refused(1, *options, "--out", self.out, says="quote")
        self.assertEqual(self.beside(), {})

    def test_strict_array_ends_with_the_bad_row(self):
        """Up to there is what was asked for."""
        spectra = [*self.spectra[:7], [-0.1] * 31, *self.spectra[7:20]]
        options = ("match", self.file(csv_text(spectra)), "--table", self.table, "--json",
                   "--strict", "--out", self.out)  # fmt: skip
        self.refused(1, *options, says="negative")
        answers = json.loads(self.there())
        self.assertEqual([x["id"] for x in answers], [f"s{i}" for i in range(8)])
        self.assertIn("error", answers[-1])

    def test_a_full_disk(self):
        """A file size that is not enough: what to do is said, and does it."""
        whole = run("match", self.path, "--table", self.table).out_bytes

        def limit():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (len(whole) // 2, len(whole) // 2))

        def limited(*options):
            done = subprocess.run(
                [SKINSPEC, "match", self.path, "--table", self.table, "--out", self.out, *options],
                stderr=subprocess.PIPE, env=environment(), check=False, timeout=TIMEOUT_S,
                preexec_fn=limit,
            )  # fmt: skip
            self.assertEqual(done.returncode, 1)
            return done.stderr.decode()

        for options, how in (((), ""), (("--force",), " in place of --force"), (("--resume",), "")):
            said = limited(*options)
            self.assertIn(f"cannot write {self.out}: File too large; the rows in it stay", said)
            self.assertIn(f" with --resume{how} the same command goes on\n", said)
            self.assertEqual(self.there(), whole[: len(whole) // 2])
        self.resume()
        self.assertEqual(self.there(), whole)
        os.unlink(self.out)
        self.assertNotIn("--resume", limited("--json"))
        self.assertEqual(self.beside(), {})

    def test_scene_by_a_signal(self):
        """No line has anything of the clock in it: the end of a run that was stopped, twice, is that
        of one which was not."""
        for scene in (
            {"want": ["nearest", "lab"], "by": "lab", "k": 2},
            {"want": ["refined", "interval", "nearest"], "noise": 0.003},
            {"want": ["coefficients"], "error": {"Cm": 0.05}},
        ):
            options = ("--scene", self.file(json.dumps(scene), "scene.json"), "--ndjson")
            with self.subTest(scene=scene):
                plain = ("match", self.path, "--table", self.table, *options)
                whole = self.run_ok(*plain, "--threads", 2).out_bytes
                self.assertEqual(self.run_ok(*plain, "--threads", 1).out_bytes, whole)
                self.assertEqual(whole.count(b"\n"), 900)
                self.assertNotIn("us", json.loads(whole.split(b"\n")[0])["plan"])
                said = self.stopped("--out", self.out, *options)
                self.assertIn("stopped after 200 rows", said)
                self.assertEqual(self.there().count(b"\n"), 200)
                self.put(self.there()[:-100])  # a row that was cut off, as by a crash
                self.resume(*options)
                self.assertEqual(self.there(), whole)
                os.unlink(self.out)

    def test_a_reader_that_leaves(self):
        """`| head`: ended by SIGPIPE at once, without a word, though many rows are bad."""
        bad = [[-0.1] * 31 if i % 2 and i > 500 else v for i, v in enumerate(self.spectra)]
        text = csv_text(bad)
        header, rows = text.split("\n", 1)
        path = self.file(header + "\n" + rows * 100)
        for options in ("", "--ndjson", "--threads 2"):
            done = subprocess.run(
                ["bash", "-c", f'"$0" match "$1" --table "$2" {options} | head -n 3; '
                 'echo ${PIPESTATUS[0]}', SKINSPEC, path, self.table],
                stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment(), check=False,
                timeout=TIMEOUT_S, preexec_fn=lambda: signal.signal(signal.SIGPIPE, signal.SIG_DFL),
            )  # fmt: skip
            self.assertTrue(done.stdout.endswith(b"\n141\n"), done.stdout[-100:])
            self.assertLess(len(done.stderr.splitlines()), 3000)
            self.assertNotIn(b"write", done.stderr)


if __name__ == "__main__":
    main()
