#!/usr/bin/env python3
"""test_demo.py - `skinspec demo` for a person, and what terminals are shown."""

import fcntl
import os
import pty
import re
import select
import signal
import struct
import subprocess
import termios
import time

from support import EXAMPLES, ROOT, TABLES, TIMEOUT_S, Case, environment, main, spectra_csv, start

ESCAPE = "\x1b"


class Terminal:
    """A program on a pseudo-terminal of 100 columns; what it shows, as text."""

    def __init__(self, arguments, streams=("stdin", "stdout", "stderr"), env=None, cwd=None):
        self.master, slave = pty.openpty()
        fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 40, 100, 0, 0))
        others = {x: subprocess.DEVNULL for x in ("stdin", "stdout", "stderr") if x not in streams}
        self.child = start(
            *arguments,
            **{x: slave for x in streams},
            **others,
            env=env or environment(),
            cwd=cwd,
            start_new_session=True,
        )
        os.close(slave)
        self.text = ""

    def read(self, until=None):
        """Up to its end, or until a text was shown; what was shown so far."""
        deadline = time.monotonic() + TIMEOUT_S
        raw = self.text.encode("utf-8", "surrogateescape")
        while time.monotonic() < deadline:
            if not select.select([self.master], [], [], 1.0)[0]:
                continue
            try:
                piece = os.read(self.master, 65536)
            except OSError:  # the other end is closed
                piece = b""
            raw += piece
            self.text = raw.decode("utf-8", "surrogateescape")
            if piece == b"" or (until is not None and re.search(until, self.text)):
                break
        return self.text

    def close(self):
        status = self.child.wait(TIMEOUT_S)
        os.close(self.master)
        return status


def on_terminal(*arguments, **more):
    terminal = Terminal(arguments, **more)
    text = terminal.read()
    return terminal.close(), text


class Demo(Case):
    HOW = ("demo", EXAMPLES, "--tables", TABLES)

    def test_on_a_terminal(self):
        """Blocks of UTF-8 and a swatch in the colour that is printed beside it."""
        status, text = on_terminal(*self.HOW)
        self.assertEqual(status, 0)
        self.assertIn("\u2588", text)
        swatches = re.findall(r"\x1b\[48;2;(\d+);(\d+);(\d+)m +\x1b\[0m", text)
        printed = re.findall(r"sRGB (\d+) (\d+) (\d+) #", text)
        self.assertEqual(swatches, printed)
        self.assertEqual(len(swatches), 6)
        rest = re.sub(r"\x1b\[[0-9;]*m", "", text)
        self.assertNotIn(ESCAPE, rest)

    def test_piped(self):
        out = self.run_ok(*self.HOW).out
        self.assertTrue(out.isascii())
        self.assertNotIn(ESCAPE, out)
        self.assertIn("####", out)

    def test_without_colour(self):
        for change in ({"NO_COLOR": "1"}, {"TERM": "dumb"}, {"TERM": None}):
            status, text = on_terminal(*self.HOW, env=environment(**change))
            self.assertEqual(status, 0)
            self.assertNotIn(ESCAPE, text, change)
        status, text = on_terminal(*self.HOW, env=environment(NO_COLOR=""))
        self.assertIn(ESCAPE, text)

    def test_without_utf8(self):
        env = environment(LC_ALL="C", LANG="C")
        status, text = on_terminal(*self.HOW, env=env)
        self.assertEqual(status, 0)
        self.assertTrue(text.isascii())
        self.assertIn("####", text)

    def test_says_what_it_found(self):
        out = self.run_ok(*self.HOW, "--k", "4").out
        for name in ("very_light", "pale", "flushed", "intermediate", "brown", "dark"):
            self.assertIn(f"\n{name}\n  Cm_true", out)
        for text in (
            r"L\* \d",
            r"sRGB \d+ \d+ \d+ #[0-9A-F]{6}",
            r"ITA +-?\d",
            r"Cm 0\.\d+  Bm \d",
            r"distance \S+ by spectrum, dE00",
            r"time +read .* ms, colour .* ms, search .* ms",
            r"then     Cm",
        ):
            self.assertEqual(len(re.findall(text, out)), 6 if "Cm 0" not in text else 24, text)

    def test_answers_are_those_of_the_other_commands(self):
        out = self.run_ok(*self.HOW, "--k", "1").out
        table = os.path.join(TABLES, "table-two-layer.db")
        answers = self.run_ok("match", EXAMPLES, "--table", table, "--k", "1", "--json").json()
        rows = [int(x) for x in re.findall(r"; row (\d+) of table", out)]
        self.assertEqual(rows, [x["nearest"][0]["row"] for x in answers])
        colours = self.run_ok("convert", EXAMPLES, "--json").json()
        codes = [list(map(int, x)) for x in re.findall(r"sRGB (\d+) (\d+) (\d+) #", out)]
        self.assertEqual(codes, [x["sRGB"] for x in colours])
        classes = re.findall(r"degrees: (.*) \(del-bino", out)
        self.assertEqual(classes, [x["ITA_class"] for x in colours])

    def test_json_is_what_convert_and_match_say(self):
        table = os.path.join(TABLES, "table-two-layer.db")
        got = self.run_ok("demo", EXAMPLES, "--table", table, "--k", "2", "--json").json()
        colours = self.run_ok("convert", EXAMPLES, "--json").json()
        answers = self.run_ok("match", EXAMPLES, "--table", table, "--k", "2", "--json").json()
        for one, colour, answer in zip(got, colours, answers, strict=True):
            self.assertEqual({"id": one["id"], **one["colour"]}, colour)
            self.assertEqual({"id": one["id"], **one["match"]}, answer)

    def test_the_examples_are_near_their_truth(self):
        """Synthetic skins with known (Cm, Ch): melanin within a third, blood within a half."""
        rows = self.run_ok("match", EXAMPLES, "--tables", TABLES).rows()
        self.assertEqual(len(rows), 6)
        for row in rows:
            self.assertClose(float(row["Cm"]), float(row["Cm_true"]), relative=0.34, what=row["id"])
            self.assertClose(float(row["Ch"]), float(row["Ch_true"]), relative=0.5, what=row["id"])

    def test_examples_without_a_file(self):
        """In the source folder they are found; elsewhere it is said where to go."""
        self.run_ok("demo", "--tables", TABLES, cwd=ROOT)
        if not os.path.exists("/usr/local/share/skinspec/examples/skin.csv"):
            self.refused(1, "demo", "--tables", TABLES, cwd="/", says=("source folder", "FILE"))

    def test_what_it_does_not_take(self):
        text = spectra_csv([(("a", "sci"), [0.5] * 31)], before=("id", "specular"))
        path = self.file(text)
        self.refused(1, "demo", path, "--tables", TABLES, says=(f"{path}:2:3:", "skinspec match"))
        self.refused(2, "demo", "a", "b", says="one FILE")
        self.refused(2, "demo", "--k", "0", says="1..20")
        self.refused(1, "demo", EXAMPLES, "--table", "none", says=("'none'", "table build"))

    def test_paper_table(self):
        out = self.run_ok("demo", EXAMPLES, "--tables", TABLES, "--table", "paper").out
        self.assertEqual(len(re.findall(r"by rgb, dE00", out)), 6)


class Bars(Case):
    LARGE = ("--cm", "0.001:0.5:200", "--bm", "0:1:100", "--ch", "0.001:0.1:150")

    def test_long_builds_show_a_bar(self):
        """With time left, on one line; Ctrl-C on the terminal stops it."""
        folder = self.folder()
        path = os.path.join(folder, "t.db")
        command = ("table", "build", "--model", "two-layer", *self.LARGE, "--out", path)
        terminal = Terminal(command)
        bar = r"\rt \[#* *\] +\d+ %, \d+ s left"
        text = terminal.read(until=bar)
        self.assertRegex(text, bar)
        os.kill(terminal.child.pid, signal.SIGINT)
        text = terminal.read()
        self.assertEqual(terminal.close(), -signal.SIGINT)
        self.assertEqual(os.listdir(folder), [])
        self.assertTrue(text.endswith("\n"))
        self.assertEqual(text.count("\n"), 1)

    def test_a_bar_that_ends(self):
        folder = self.folder()
        grid = ("--cm", "0.001:0.5:200", "--bm", "0:1:50", "--ch", "0.001:0.1:50")
        path = os.path.join(folder, "t.db")
        for _ in range(5):  # what is over in a moment shows none: take more
            status, text = on_terminal(
                "table", "build", "--model", "two-layer", *grid, "--out", path, "--force"
            )
            self.assertEqual(status, 0)
            if "[" in text:
                break
            grid = (*grid[:5], grid[5].replace(":50", ":500"))
        self.assertRegex(text, r"\[#{30}\] 100 %, \d+\.\d s")
        percents = [int(x) for x in re.findall(r"(\d+) %", text)]
        self.assertEqual(percents, sorted(percents))
        status, text = on_terminal("table", "verify", path)
        self.assertEqual(status, 0)
        self.assertIn("verify [", text)

    def test_matching_a_file_shows_a_bar_only_beside_other_output(self):
        """Standard error on the terminal; results elsewhere."""
        row = spectra_csv([(("a", "sce"), [0.5] * 31)], before=("id", "specular"))
        text = row + row.splitlines(keepends=True)[1] * 10000
        command = ("match", self.file(text), "--tables", TABLES, "--threads", "1", "--refine")
        status, shown = on_terminal(*command, streams=("stderr",))
        self.assertEqual(status, 0)
        self.assertRegex(shown, r"\rmatch \[#{30}\] 100 %")
        status, shown = on_terminal(*command, streams=("stdout", "stderr"))
        self.assertEqual(status, 0)
        self.assertNotIn("match [", shown)


if __name__ == "__main__":
    main()
