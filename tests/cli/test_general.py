#!/usr/bin/env python3
"""test_general.py - what all commands have in common: help, exit statuses, broken outputs,
the locale, signals, and silence where there is no terminal."""

import os
import re
import signal
import subprocess
import time

from support import (
    EXAMPLES,
    ROOT,
    SKINSPEC,
    TABLES,
    TIMEOUT_S,
    TWO_LAYER,
    Case,
    build_table,
    environment,
    main,
    run,
    spectra_csv,
    start,
)

COMMANDS = (
    ("demo",),
    ("convert",),
    ("match",),
    ("table",),
    ("table", "build"),
    ("table", "info"),
    ("table", "verify"),
    ("reflectance",),
    ("coefficients",),
    ("dipole",),
    ("table2",),
)
TEXT = spectra_csv([(("a", "sce"), [0.5] * 31)], before=("id", "specular"))
SKIN = ("--cm", "0.03", "--bm", "0.7", "--ch", "0.01")

# One run of each command that prints results, with its input.
PRINTING = (
    (("convert", "-"), TEXT),
    (("convert", "-", "--json"), TEXT),
    (("convert", "-", "--ndjson"), TEXT),
    (("match", "-", "--table", TWO_LAYER), TEXT),
    (("match", "-", "--table", TWO_LAYER, "--json"), TEXT),
    (("table", "info", TWO_LAYER), ""),
    (("table", "info", TWO_LAYER, "--json"), ""),
    (("reflectance", *SKIN), ""),
    (("reflectance", *SKIN, "--json"), ""),
    (("coefficients", *SKIN), ""),
    (("coefficients", *SKIN, "--json"), ""),
    (("dipole", "--sigma-a", "0.1", "--sigma-s-prime", "1", "--r-mm", "0.5"), ""),
    (("dipole", "--sigma-a", "0.1", "--sigma-s-prime", "1", "--json"), ""),
    (("table2",), ""),
    (("table2", "--json"), ""),
    (("demo", EXAMPLES, "--tables", TABLES), ""),
)


class Help(Case):
    def test_every_command_helps(self):
        """To standard output, with an example or an explanation at its end."""
        for command in COMMANDS:
            with self.subTest(command=command):
                done = self.run_ok(*command, "--help")
                self.assertEqual(done.err, "")
                self.assertTrue(done.out.endswith("\n"))
                self.assertIn("Usage: skinspec " + command[0], done.out)
                self.assertGreater(len(done.out.splitlines()), 4)
                if len(command) == 1 and command[0] in (
                    "convert",
                    "match",
                    "reflectance",
                    "coefficients",
                    "dipole",
                ):
                    self.assertRegex(done.out, rf"Examples?:\s+skinspec {command[0]}")
                self.assertLessEqual(max(map(len, done.out.splitlines())), 80)

    def test_help_before_the_command(self):
        self.assertEqual(self.run_ok("help", "match").out, self.run_ok("match", "--help").out)

    def test_the_program_helps(self):
        done = self.run_ok("--help")
        self.assertEqual(done.err, "")
        for command in COMMANDS:
            self.assertIn(f"\n  {command[0]} ", done.out)
        self.assertEqual(self.run_ok("help").out, done.out)
        self.assertLessEqual(max(map(len, done.out.splitlines())), 100)

    def test_examples_in_the_help_work(self):
        """Those that need nothing but the checkout and its tables."""
        for command in ("convert", "match", "reflectance", "coefficients", "dipole"):
            text = self.run_ok(command, "--help").out
            text = text[re.search(r"Examples?:", text).end() :]
            for line in re.findall(r"skinspec .*", text):
                if "sci.csv" in line:
                    continue
                line = re.sub(r"(skinspec match [^|]*)", rf"\1 --tables '{TABLES}'", line)
                env = environment(PATH=f"{os.path.dirname(SKINSPEC)}:{os.environ['PATH']}")
                done = subprocess.run(
                    line,
                    shell=True,
                    cwd=ROOT,
                    env=env,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.PIPE,
                    timeout=TIMEOUT_S,
                    check=False,
                )
                self.assertEqual((done.returncode, done.stderr), (0, b""), line)
                self.assertGreater(len(done.stdout), 10)

    def test_version(self):
        with open(os.path.join(ROOT, "src", "base", "version.h"), encoding="utf-8") as f:
            version = re.search(r'SKINSPEC_VERSION "(.*)"', f.read()).group(1)
        for arguments in (("--version",), ("-V",), ("convert", "--version")):
            self.assertEqual(self.run_ok(*arguments).out, f"skinspec {version}\n")

    def test_no_command(self):
        done = run()
        self.assertEqual((done.status, done.out), (2, ""))
        self.assertIn("Usage: skinspec COMMAND", done.err)

    def test_unknown_command_or_option(self):
        for arguments in (("convrt",), ("--colour",), ("",), ("CONVERT", "-")):
            done = self.refused(2, *arguments, says=("skinspec --help", f"'{arguments[0]}'"))
            self.assertEqual(done.out, "")
        for command in COMMANDS:
            if command != ("table",):
                done = self.refused(2, *command, "--colour", says=("--colour", "--help"))
                self.assertEqual(done.out, "")


class Outputs(Case):
    def test_full_device(self):
        for arguments, stdin in PRINTING:
            with self.subTest(arguments=arguments), open("/dev/full", "wb") as full:
                done = subprocess.run(
                    [SKINSPEC, *arguments],
                    input=stdin.encode(),
                    stdout=full,
                    stderr=subprocess.PIPE,
                    env=environment(),
                    timeout=TIMEOUT_S,
                    check=False,
                )
                self.assertEqual(done.returncode, 1)
                self.assertRegex(
                    done.stderr.decode(), "^skinspec: cannot write the results: .*space"
                )
                self.assertEqual(len(done.stderr.splitlines()), 1)

    def test_closed_output(self):
        """`>&-`: nowhere to write to is a failure too."""
        for arguments, stdin in PRINTING[:2]:
            done = subprocess.run(
                ["sh", "-c", '"$0" "$@" >&-', SKINSPEC, *arguments],
                input=stdin.encode(),
                stderr=subprocess.PIPE,
                env=environment(),
                timeout=TIMEOUT_S,
                check=False,
            )
            self.assertEqual(done.returncode, 1)
            self.assertIn(b"cannot write the results", done.stderr)

    def test_a_reader_that_leaves(self):
        """As `| head -n 1` does: the program ends, with nothing on standard error."""
        row = TEXT.splitlines(keepends=True)[1]
        path = self.file(TEXT + row * 20000)
        table = build_table(self.folder(), "--cm", "0.1", "--bm", "0.5", "--ch", "0.01")
        for command in (
            ("convert", path),
            ("convert", path, "--json"),
            ("match", path, "--table", table),
        ):
            with start(*command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as child:
                first = child.stdout.readline()
                child.stdout.close()
                err = child.stderr.read()
                child.wait(TIMEOUT_S)
            self.assertGreater(len(first), 1)
            self.assertEqual(err, b"", command)
            self.assertIn(child.returncode, (-signal.SIGPIPE, 1))

    def test_the_locale_changes_no_number(self):
        for arguments, stdin in PRINTING:
            if arguments[0] == "demo":  # prints times
                continue
            outs = set()
            for locale in ("C", "de_DE.UTF-8", "de_DE@euro", "tr_TR.UTF-8", "no_SUCH.locale"):
                env = environment(LC_ALL=locale, LANG=locale, LC_NUMERIC=locale)
                outs.add(self.run_ok(*arguments, stdin=stdin, env=env).out)
            self.assertEqual(len(outs), 1, arguments)

    def test_silent_where_there_is_no_terminal(self):
        """Neither bars nor escapes in logs, however long it takes."""
        grid = ("--cm", "0.001:0.5:100", "--bm", "0:1:40", "--ch", "0.001:0.1:50")
        path = os.path.join(self.folder(), "t.db")
        done = self.run_ok("table", "build", "--model", "paper", *grid, "--out", path)
        self.assertEqual(done.err, f"skinspec: table 't' of 200000 rows is made: {path}\n")
        self.assertEqual(self.run_ok("table", "verify", path).err, "")
        rows = self.file(TEXT + TEXT.splitlines(keepends=True)[1] * 2000)
        self.assertEqual(self.run_ok("match", rows, "--table", path).err, "")

    def test_good_runs_say_nothing_on_standard_error(self):
        for arguments, stdin in PRINTING:
            self.assertEqual(self.run_ok(*arguments, stdin=stdin).err, "", arguments)

    def test_json_numbers_read_back_the_same(self):
        """Up to 17 digits: the double that JSON gives is the one that plain text gives."""
        medium = ("--sigma-a", "0.3", "--sigma-s-prime", "1.7", "--r-mm", "0.7")
        plain = dict(line.split()[:2] for line in self.run_ok("dipole", *medium).out.splitlines())
        for name, x in self.run_ok("dipole", *medium, "--json").json().items():
            self.assertEqual(float(plain[name]), x)


class Interrupts(Case):
    def test_waiting_for_input(self):
        """Ctrl-C while reading a pipe: ended by the signal; `match` says how far it came."""
        for command in (("convert", "-"), ("match", "-", "--table", TWO_LAYER)):
            with start(
                *command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE
            ) as child:
                child.stdin.write(TEXT.encode())
                child.stdin.flush()
                for _ in range(2 if command[0] == "match" else 0):
                    child.stdout.readline()  # the columns' names, the answer
                time.sleep(0.3)
                child.send_signal(signal.SIGINT)
                child.wait(TIMEOUT_S)
                self.assertEqual(child.returncode, -signal.SIGINT, command)
                said = child.stderr.read()
                stopped = "" if command[0] == "convert" else "skinspec: stopped after 1 rows; .*\n"
                self.assertRegex(said.decode(), f"^{stopped}$")

    def test_busy_with_a_pipe_that_never_ends(self):
        """The signal is heeded between batches, not only while waiting."""
        row = TEXT.splitlines(keepends=True)[1].encode()
        with start(
            "match",
            "-",
            "--table",
            TWO_LAYER,
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
        ) as child:
            child.stdin.write(TEXT.encode())
            signalled = False
            deadline = time.monotonic() + 60
            try:
                for i in range(10**9):
                    child.stdin.write(row * 50)
                    if i == 50:
                        child.send_signal(signal.SIGINT)
                        signalled = True
                    if time.monotonic() > deadline:
                        break
            except BrokenPipeError:
                pass
            ended = time.monotonic() < deadline
            child.kill()
            try:
                child.stdin.close()
            except BrokenPipeError:
                pass
        self.assertTrue(signalled and ended)
        self.assertEqual(child.returncode, -signal.SIGINT)


if __name__ == "__main__":
    main()
