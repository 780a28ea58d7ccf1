"""Options of skinspecd that cannot be: status 2, one line that says what is wanted, nothing made."""

import os
import subprocess
import tempfile
import unittest

from daemon import BUILD, main

PROGRAM = os.path.join(BUILD, "skinspecd")

# options -> a word of the message
WRONG = (
    (["--instrument", "no-such"], "no driver"),
    (["--instrument", "no-such:serial=1"], "simulated"),
    (["--instrument", "simulated"] * 17, "at most 16"),
    (["--max-clients", "0"], "1 to 4096"),
    (["--max-clients", "many"], "1 to 4096"),
    (["--max-per-user", "-1"], "1 to 4096"),
    (["--max-per-process", "5000"], "1 to 4096"),
    (["--wal-limit", "0"], "1 to 4096"),
    (["--calibration-hours", "-1"], "0 to 100000"),
    (["--calibration-hours", "nan"], "0 to 100000"),
    (["--calibration-policy", "shout"], "block or warn"),
    (["--socket", ""], "path"),
    (["--state", "x" * 600], "path"),
    (["--record", "capture"], "wants an instrument"),
    (["--record", "capture", "--instrument", "simulated"], "has no wire"),
    (["--record", "capture", "--instrument", "auto"], "more than one could come"),
    (["--record", "capture", *["--instrument", "simulated"] * 2], "more than one could come"),
    (["--no-such-option"], "unrecognized"),
    (["skin.csv"], "nothing to do"),
)


class Settings(unittest.TestCase):
    def run_with(self, *options, **environment):
        with tempfile.TemporaryDirectory() as folder:
            done = subprocess.run(
                [PROGRAM, *options], cwd=folder, capture_output=True, text=True, timeout=20, check=False,
                env={**os.environ, **environment},
            )
            self.assertEqual(os.listdir(folder), [])
        return done

    def test_what_cannot_be(self):
        for options, word in WRONG:
            with self.subTest(options=options):
                done = self.run_with(*options)
                self.assertEqual(done.returncode, 2)
                self.assertIn(word, done.stderr)

    def test_drivers(self):
        """A line each, for programs."""
        done = self.run_with("--drivers")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        lines = done.stdout.splitlines()
        self.assertIn("simulated", lines)
        for line in lines:
            self.assertRegex(line, r"^[a-z_]+( [0-9a-f]{4}:([0-9a-f]{4}|\*) (tty|usb))*$")

    def test_help_and_version(self):
        shown = self.run_with("--help")
        self.assertEqual((shown.returncode, shown.stderr), (0, ""))
        for option in ("--socket", "--state", "--instrument", "--wal-limit", "simulated"):
            self.assertIn(option, shown.stdout)
        self.assertRegex(self.run_with("--version").stdout, r"^skinspecd \d+\.\d+\.\d+\n$")

    def test_paths_of_the_environment_that_are_too_long(self):
        """Not cut: that would be another place.  An option makes up for it."""
        long = "/nowhere/" + "x" * 600
        for variable in ("STATE_DIRECTORY", "SKINSPEC_SOCKET", "XDG_RUNTIME_DIR"):
            with self.subTest(variable=variable):
                usual = {"STATE_DIRECTORY": "/nowhere/state", "SKINSPEC_SOCKET": ""}
                done = self.run_with(**{**usual, variable: long})
                self.assertEqual(done.returncode, 2)
                self.assertIn(variable + " is too long", done.stderr)
        done = self.run_with("--state", "/nowhere/state", STATE_DIRECTORY=long)
        self.assertEqual(done.returncode, 1)
        self.assertIn("/nowhere/state", done.stderr)

    def test_paths_from_the_environment(self):
        """Without options: the folder systemd made, the socket of the runtime folder."""
        done = self.run_with(STATE_DIRECTORY="/nowhere/state", XDG_RUNTIME_DIR="/nowhere/run")
        self.assertEqual(done.returncode, 1)
        self.assertIn("/nowhere/state", done.stderr)


if __name__ == "__main__":
    main()
