#!/usr/bin/env python3
"""test_examples.py - what documents show works: docs/examples and the README's lines."""

import os
import re
import shutil
import subprocess
import sys
import tempfile

from daemon import ROOT, Case, main

EXAMPLES = os.path.join(ROOT, "docs", "examples")
# What both programs print in the end.
ANSWER = (
    r"record [0-9a-f-]{36}\nL\* \d\d\.\d\d  a\* -?\d+\.\d\d  b\* -?\d+\.\d\d  ITA -?\d+\.\d degrees\n"
    r"Cm 0\.\d{4}  Bm [01]\.\d\d  Ch 0\.\d{4}\n"
)


class Examples(Case):
    def run_here(self, *command, status=0, **changes):
        done = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=60,
            env={**os.environ, "SKINSPEC_SOCKET": self.daemon.socket, **changes},
            check=False,
        )
        self.assertEqual(done.returncode, status, done.stderr)
        return done

    def program(self):
        """client.c, compiled as its first lines say."""
        folder = tempfile.mkdtemp(prefix="sk.", dir="/tmp")
        self.addCleanup(shutil.rmtree, folder, ignore_errors=True)
        flags = subprocess.run(
            ["pkg-config", "--cflags", "--libs", "libcjson"],
            capture_output=True,
            text=True,
            check=True,
        ).stdout.split()
        program = os.path.join(folder, "client")
        source = os.path.join(EXAMPLES, "client.c")
        compiler = os.environ.get("CC", "cc")
        self.run_here(compiler, "-Wall", "-Wextra", "-Werror", source, *flags, "-o", program)
        return program

    def measures(self, *command):
        """It leaves one record more, of three shots, and prints it."""
        with self.daemon.client() as c:
            before = c.call("status.get")["last_seq"]
            printed = self.run_here(*command).stdout
            self.assertRegex(printed, ANSWER)
            (record,) = c.call("record.list", since_seq=before)["records"]
            self.assertIn(f"record {record['id']}\n", printed)
            self.assertEqual(len(record["replicates"]), 3)

    def fails(self, *command):
        done = self.run_here(*command, status=1, SKINSPEC_SOCKET="/nowhere/s")
        self.assertTrue(done.stderr)

    def test_python(self):
        self.measures(sys.executable, os.path.join(EXAMPLES, "client.py"))

    def test_c(self):
        program = self.program()
        self.measures(program)
        self.measures(program, self.daemon.socket)
        self.fails(program)

    def test_readme(self):
        with open(os.path.join(ROOT, "README.md"), encoding="utf-8") as file:
            shown = re.search(r"^```python\n(.*?)^```", file.read(), re.M | re.S)
        self.assertIsNotNone(shown, "README.md shows no Python")
        printed = self.run_here(sys.executable, "-c", shown.group(1)).stdout
        self.assertTrue(printed.strip())


if __name__ == "__main__":
    main()
