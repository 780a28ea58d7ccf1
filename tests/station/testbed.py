"""testbed.py - simulated instruments that are plugged into a daemon's machine and pulled out.

build/simhost holds them in a testbed of umockdev; a daemon that is started with env() sees no
other devices.  See tests/sim/README.md."""

import os
import queue
import subprocess
import threading

from daemon import BUILD

SIMHOST = os.path.join(BUILD, "simhost")
ANSWER_S = 30


class Testbed:
    __test__ = False  # no test, for whoever looks for them by name

    def __init__(self):
        self.process = subprocess.Popen(
            ["umockdev-wrapper", SIMHOST],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        self._answers = queue.Queue()
        self._said = []
        for stream, take in ((self.process.stdout, self._answers.put),
                             (self.process.stderr, self._said.append)):  # fmt: skip
            threading.Thread(target=self._read, args=(stream, take), daemon=True).start()
        self.root = self.order("root")

    @staticmethod
    def _read(stream, take):
        for line in stream:
            take(line.rstrip("\n"))

    def order(self, text):
        """What stands behind `ok`."""
        self.process.stdin.write(text + "\n")
        self.process.stdin.flush()
        answer = self._answers.get(timeout=ANSWER_S)
        if answer.split(" ")[0] != "ok":
            raise AssertionError(f"{text}: {answer}; {' '.join(self._said[-5:])}")
        return answer[3:]

    def plug(self, kind, name, node, options=""):
        self.order(f"plug {kind} {name} {node} {options}".rstrip())

    def unplug(self, name):
        self.order(f"unplug {name}")

    def act(self, name, action):
        self.order(f"act {name} {action}")

    def env(self):
        """For the daemon: its devices are those in here."""
        preload = ["libumockdev-preload.so.0", os.environ.get("LD_PRELOAD", "")]
        asan = os.environ.get("ASAN_OPTIONS", "")
        return {
            "LD_PRELOAD": " ".join(x for x in preload if x),
            "UMOCKDEV_DIR": self.root,
            # The preload library comes before libasan: both redirect, in the right order.
            "ASAN_OPTIONS": ":".join(x for x in (asan, "verify_asan_link_order=0") if x),
        }

    def close(self):
        """After the daemon has ended: it would be aborted."""
        if self.process.poll() is None:
            self.process.stdin.close()
            try:
                self.process.wait(20)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait(10)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
