"""simhost.py - build/simhost for a test: simulated instruments behind ttys of umockdev, and the
environment in which a program finds them."""

import os
import shutil
import subprocess
import unittest

from support import BUILD, environment

PROGRAM = os.path.join(BUILD, "simhost")
PRELOAD = "libumockdev-preload.so.0"


def drivers():
    """Names of those in skinspecd."""
    done = subprocess.run([os.path.join(BUILD, "skinspecd"), "--drivers"], stdout=subprocess.PIPE,
                          text=True, timeout=20, check=True)  # fmt: skip
    return [line.split()[0] for line in done.stdout.splitlines()]


def is_instrumented():
    """A sanitizer must be the first library of its program; so must umockdev's."""
    with open(os.path.join(BUILD, "skinspecd"), "rb") as program:
        text = program.read()
    return b"__asan_init" in text or b"__tsan_init" in text


class Simhost:
    """Programs started in its env must have ended before it does."""

    def __init__(self):
        if not os.path.exists(PROGRAM) or shutil.which("umockdev-wrapper") is None:
            raise unittest.SkipTest("build/simhost or umockdev is not there")
        if is_instrumented():
            raise unittest.SkipTest("a sanitizer's library and umockdev's want the same place")
        self.process = subprocess.Popen(
            ["umockdev-wrapper", PROGRAM],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            bufsize=1,
        )
        self.root = self.say("root")
        self.mocked = {"LD_PRELOAD": PRELOAD, "UMOCKDEV_DIR": self.root}
        self.env = environment(**self.mocked)

    def say(self, command):
        """What follows its "ok"."""
        self.process.stdin.write(command + "\n")
        answer = self.process.stdout.readline().strip()
        if not answer.startswith("ok"):
            raise AssertionError(f"simhost: {command}: {answer}")
        return answer[3:]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.stdin.write("quit\n")
        self.process.wait(20)
        self.process.stdin.close()
        self.process.stdout.close()
