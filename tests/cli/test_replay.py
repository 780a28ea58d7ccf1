#!/usr/bin/env python3
"""test_replay.py - skinspecd --record, and `skinspec replay` of what it wrote.

The instrument is Ocean's USB2000+ from the driver's own capture: a station that replays it records
it anew, with what it was asked in between.  Numbers are compared with what the independent client
of tests/station was answered."""

import json
import os
import re
import resource
import shutil
import signal
import stat
import tempfile
import time
import unittest

from station_case import StationCase  # and where daemon.py is
from daemon import wait_for
from support import ROOT, TABLES, Case, environment, build_table, main, run, start

CAPTURES = os.path.join(ROOT, "drivers", "ocean_ooi", "captures")
TILE = os.path.join(CAPTURES, "tile-simulated.csv")
OCEAN = f"ocean_ooi:replay:{CAPTURES}/usb2000-simulated.txt,tile={TILE},port_mm=8"
COMPARED = ("specular", "aperture_mm", "replicates", "spectrum", "XYZ", "Lab", "sRGB", "ITA",
            "illuminant", "observer", "flags", "match")  # fmt: skip


class Recorded(StationCase):
    """A session that was recorded: both calibrations, three shots."""

    more = {}  # for measure.start

    @classmethod
    def setUpClass(cls):
        Case.setUpClass.__func__(cls)
        cls.place = tempfile.mkdtemp(prefix="rp.", dir="/tmp")  # short: sockets are made in it
        cls.capture = os.path.join(cls.place, "session.txt")
        shutil.copy(TILE, cls.place)
        with cls.new_daemon("--record", cls.capture, instruments=(OCEAN,)) as daemon:
            with daemon.client(operator="Ada Lovelace") as c:
                lease = c.acquire()["lease"]
                c.calibrate(lease)
                cls.subject = c.call("subject.add", label="patient-7")["id"]
                cls.record = c.measure(
                    lease, replicates=3, site="left-arm", subject=cls.subject, **cls.more
                )
        with open(cls.capture, encoding="ascii") as file:
            cls.lines = file.readlines()

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.place, ignore_errors=True)
        Case.tearDownClass.__func__(cls)

    def asked(self):
        """[(word, object)] of the lines @."""
        found = [re.match(r"\d+\.\d{6} @ (\w+) (\{.*\})\n$", x) for x in self.lines]
        return [(m[1], json.loads(m[2])) for m in found if m]

    def altered(self, change):
        """Another capture beside the first: change(lines) in place or anew; its path."""
        lines = list(self.lines)
        lines = change(lines) or lines
        fd, path = tempfile.mkstemp(dir=self.place, suffix=".txt")
        with os.fdopen(fd, "w", encoding="ascii") as file:
            file.writelines(lines)
        return path

    def replay(self, path=None, *options, tables=TABLES, **more):
        """A run whose private folders are in one of our own, which is empty afterwards."""
        tmp = tempfile.mkdtemp(dir=self.place)
        tabled = ("--tables", tables) if tables else ()
        done = run("replay", path or self.capture, *tabled, *options,
                   env=environment(TMPDIR=tmp), **more)  # fmt: skip
        self.assertEqual(os.listdir(tmp), [], done.err)
        return done

    def index(self, pattern, last=False):
        found = [i for i, line in enumerate(self.lines) if re.search(pattern, line)]
        return found[-1 if last else 0]


class Recording(Recorded):
    def test_what_was_asked(self):
        asked = self.asked()
        self.assertEqual(
            [word for word, _ in asked], ["station", "calibrate", "calibrate", "measure", "record"]
        )
        self.assertEqual(asked[0][1]["options"], "tile=tile-simulated.csv,port_mm=8")
        self.assertEqual([x["step"] for _, x in asked[1:3]], ["zero", "white"])
        self.assertEqual(asked[3][1], {"specular": "sce", "replicates": 3, "pace": "auto"})
        self.assertEqual(asked[4][1], {x: self.record[x] for x in COMPARED})

    def test_nobody_is_named(self):
        text = "".join(self.lines)
        for secret in ("Ada", "left-arm", "patient", self.subject, self.record["id"],
                       self.record["uuid"], self.record["calibration_id"], self.place, ROOT):  # fmt: skip
            self.assertNotIn(secret, text)
        self.assertEqual(stat.S_IMODE(os.stat(self.capture).st_mode), 0o600)

    def test_the_instrument_is_noted(self):
        notes = [x for x in self.lines if x.startswith("# model:")]
        self.assertEqual(len(notes), 1)
        self.assertIn(self.record["serial"], notes[0])
        self.assertIn("Ocean Optics USB2000+", notes[0])

    def test_an_existing_file_is_kept(self):
        with self.assertRaises(AssertionError) as caught:
            self.new_daemon("--record", self.capture, instruments=(OCEAN,))
        self.assertIn("never written over", str(caught.exception))
        with open(self.capture, encoding="ascii") as file:
            self.assertEqual(file.readlines(), self.lines)

    def test_a_full_disk_ends_the_capture_alone(self):
        """No file may grow beyond less than the capture needs and more than the store does."""
        limit = 300_000
        self.assertGreater(os.path.getsize(self.capture), limit)
        path = os.path.join(self.place, "cut.txt")
        small = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))  # noqa: E731
        with self.new_daemon("--record", path, instruments=(OCEAN,), before=small) as daemon:
            with daemon.client() as c:
                lease = c.acquire()["lease"]
                c.calibrate(lease)
                record = c.measure(lease, replicates=3)
            wait_for("the end of the capture", lambda: "not whole" in daemon.log(), 20)
            log = daemon.log()
        self.assertEqual(record["spectrum"], self.record["spectrum"])
        self.assertEqual(log.count("the capture ends here and is not whole"), 1, log)
        self.assertLessEqual(os.path.getsize(path), limit)
        with open(path, encoding="ascii") as file:
            self.assertTrue(file.read().endswith("\n"), "the last line is whole")


class Refined(Recorded):
    """The refined skin is asked for again, and comes out the same."""

    more = {"refine": "three", "noise": 0.001, "placement": 0.002, "fix": {"Bm": 0.5}}

    def test_bit_for_bit(self):
        asked = self.asked()
        self.assertEqual({x: asked[3][1][x] for x in self.more}, self.more)
        self.assertEqual(asked[4][1]["match"], self.record["match"])
        self.assertEqual(self.record["match"]["refine"], "three")
        done = self.replay()
        self.assertEqual((done.status, done.err), (0, ""))
        self.assertIn("same: 1 measurement bit for bit\n", done.out)

    def test_another_answer_differs(self):
        def change(lines):
            i = self.index(" @ record ")
            lines[i] = lines[i].replace('"refine":"three"', '"refine":"four"', 1)

        done = self.replay(self.altered(change))
        self.assertEqual(done.status, 1)
        self.assertIn("match.refine", done.out)


class Same(Recorded):
    def test_bit_for_bit(self):
        done = self.replay()
        self.assertEqual((done.status, done.err), (0, ""))
        self.assertEqual(
            done.out,
            "calibrate zero: done\ncalibrate white: done\nmeasure sce, 3 shots: same\n"
            "same: 1 measurement bit for bit\n",
        )

    def test_json(self):
        done = self.replay(None, "--json")
        self.assertEqual(done.status, 0, done.err)
        result = json.loads(done.out)
        self.assertTrue(result["same"] and result["whole"])
        self.assertEqual(result["driver"], "ocean_ooi")
        self.assertEqual([x["outcome"] for x in result["steps"]], ["done", "done", "same"])
        self.assertEqual(result["steps"][2]["line"], 1 + self.index("@ measure"))

    def test_from_another_folder(self):
        """Its tile is looked for beside the capture, or where --with says."""
        folder = self.folder()
        moved = shutil.copy(self.capture, folder)
        done = self.replay(moved)
        self.assertEqual(done.status, 1)
        self.assertIn("tile-simulated.csv: No such file", done.err)
        self.assertIn("--with", done.err)
        self.assertEqual(self.replay(moved, "--with", f"tile={TILE},port_mm=8").status, 0)
        shutil.copy(TILE, folder)
        self.assertEqual(self.replay(moved).status, 0)

    def test_ended_by_a_signal(self):
        tmp = tempfile.mkdtemp(dir=self.place)
        process = start("replay", self.capture, "--tables", TABLES, env=environment(TMPDIR=tmp))
        until = time.monotonic() + 20
        while not os.listdir(tmp) and time.monotonic() < until:
            time.sleep(0.001)
        self.assertTrue(os.listdir(tmp))
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=30)
        self.assertEqual(process.returncode, -signal.SIGINT)
        self.assertEqual(os.listdir(tmp), [])

    def test_unfinished(self):
        """The station was killed while it measured, in the middle of a line."""
        at = self.index("@ record")
        path = self.altered(lambda lines: lines[:at] + [lines[at][:500]])
        done = self.replay(path)
        self.assertEqual(done.status, 0, done.err)
        self.assertIn("measure sce, 3 shots: not compared\n", done.out)
        self.assertIn("1 that it does not tell the end of", done.out)


class Differs(Recorded):
    def test_a_byte_of_the_wire(self):
        """A count of the last spectrum: the record is another."""
        at = self.index(r" < 82 :?", last=True)
        while len(self.lines[at]) < 500:  # not the byte that ends a spectrum
            at -= 1

        def change(lines):
            head, text = lines[at].split(" < 82 :", 1)
            digit = 4 * (len(text) // 8)  # the lower byte of a pixel in the middle, its upper half
            other = "0" if text[digit] != "0" else "1"
            lines[at] = f"{head} < 82 :{text[:digit]}{other}{text[digit + 1:]}"

        path = self.altered(change)
        done = self.replay(path, "--json")
        self.assertEqual(done.status, 1, done.err)
        result = json.loads(done.out)
        self.assertFalse(result["same"])
        step = result["steps"][2]
        self.assertEqual(step["outcome"], "differs")
        members = [x["member"] for x in step["differences"]]
        self.assertRegex(members[0], r"^replicates\[2\]\.values\[\d+\]$")
        self.assertIn("spectrum.values", " ".join(members))
        self.assertNotIn("replicates[0]", " ".join(members))

    def test_a_value_of_the_record(self):
        """The last bit of one band."""
        was = self.record["spectrum"]["values"][7]
        other = was * (1 + 2**-52)
        self.assertNotEqual(was, other)
        at = self.index("@ record")

        def change(lines):
            record = json.loads(lines[at].split(" ", 3)[3])
            record["spectrum"]["values"][7] = other
            lines[at] = " ".join(lines[at].split(" ", 3)[:3] + [json.dumps(record)]) + "\n"

        done = self.replay(self.altered(change))
        self.assertEqual(done.status, 1)
        self.assertIn("measure sce, 3 shots: differs\n    spectrum.values[7]: ", done.out)
        shown = re.search(r"values\[7\]: (\S+) in the capture, (\S+) here", done.out)
        self.assertEqual((float(shown[1]), float(shown[2])), (other, was))
        self.assertTrue(done.out.endswith("differs in 1 step\n"), done.out)

    def test_how_it_ended(self):
        at = self.index("@ record")

        def change(lines):
            lines[at] = lines[at].split(" @ ")[0]
            lines[at] += ' @ refused {"of":"measure","reason":"instrument_timeout"}\n'

        done = self.replay(self.altered(change))
        self.assertEqual(done.status, 1)
        self.assertIn(
            "how it ended: refused: instrument_timeout in the capture, a record here", done.out
        )

    def test_another_table(self):
        tables = tempfile.mkdtemp(dir=self.place)
        build_table(tables, "--cm", "0.01:0.4:5", "--bm", "0:1:3", "--ch", "0.001:0.1:3", name="two-layer")
        done = self.replay(tables=tables)
        self.assertEqual(done.status, 1)
        self.assertIn(f"another table: \"{self.record['match']['table_sha256']}\"", done.out)
        self.assertIn("--tables DIR", done.out)
        self.assertNotIn("match.Cm", done.out)
        self.assertNotIn("spectrum", done.out, "all but the match is the same")

    def test_no_table(self):
        if os.path.exists("/var/lib/skinspec/tables"):
            self.skipTest("this machine has tables of its own")
        done = self.replay(tables=None, cwd=self.folder())
        self.assertEqual(done.status, 1)
        self.assertIn("there is no table here to match with: --tables DIR", done.out)

    def test_another_sequence(self):
        """A calibration that the wire has not: the driver's error names file and line."""
        at = self.index("@ calibrate")
        path = self.altered(lambda lines: lines[:at] + [lines[at]] + lines[at:])
        done = self.replay(path)
        self.assertEqual(done.status, 1)
        self.assertIn("calibrate zero: differs", done.out)
        self.assertIn("no further call 'calibrate zero' in this capture", done.err)


class Refused(Recorded):
    def test_what_is_no_capture(self):
        with open(TILE, encoding="ascii") as file:
            tile = file.read()
        for what, text, says in (
            ("missing", None, "No such file"),
            ("a table", tile, ":1: "),
            ("empty", "", ""),
            ("of another version", "# skinspec capture 2\n", "2"),
            ("nothing asked", "".join(x for x in self.lines if " @ " not in x), "nothing was asked"),
        ):
            with self.subTest(what):
                path = os.path.join(self.place, "not-one.txt")
                if os.path.exists(path):
                    os.unlink(path)
                if text is not None:
                    with open(path, "w", encoding="ascii") as file:
                        file.write(text)
                done = self.replay(path)
                self.assertEqual((done.status, done.out), (1, ""))
                self.assertIn(path, done.err)
                self.assertIn(says, done.err)

    def test_a_damaged_line_is_named(self):
        at = self.index("@ measure")
        for line, says in (
            ("1.0 @ measure {\"specular\":\n", "damaged: no JSON object"),
            ("1.0 @ measure 7\n", "damaged: no JSON object"),
            ("1.0 @ dance {}\n", "nothing is known of '@ dance'"),
            ("1.0 ? 00\n", ""),
        ):
            with self.subTest(line):
                path = self.altered(lambda lines, new=line: lines[:at] + [new] + lines[at + 1 :])
                done = self.replay(path)
                self.assertEqual((done.status, done.out), (1, ""))
                self.assertIn(f"{path}:{at + 1}: ", done.err)
                self.assertIn(says, done.err)

    def test_an_unknown_driver(self):
        path = self.altered(lambda lines: [x.replace("driver ocean_ooi", "driver no_such")
                                           for x in lines])  # fmt: skip
        done = self.replay(path)
        self.assertEqual(done.status, 1)
        self.assertIn("there is no driver 'no_such'; there are: simulated", done.err)

    def test_usage(self):
        for arguments, says in (((), "give a capture"), (("a", "b"), ""), (("--frob",), "")):
            with self.subTest(arguments=arguments):
                self.refused(2, "replay", *arguments, says=says)


if __name__ == "__main__":
    unittest.TestCase.maxDiff = 3000
    main()
