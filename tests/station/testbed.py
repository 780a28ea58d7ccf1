"""testbed.py - simulated instruments that are plugged into a daemon's machine and pulled out.

build/simhost holds them in a testbed of umockdev; a daemon that is started with env() sees no
other devices.  See tests/sim/README.md.  OnTestbed is the case for tests of that kind."""

import os
import queue
import shutil
import subprocess
import tempfile
import threading
import time

from daemon import BUILD, Case, Daemon, wait_for

SIMHOST = os.path.join(BUILD, "simhost")
ANSWER_S = 30
NOBODY = 65534


def asan_options():
    """The preload library comes before libasan: both redirect, in the right order."""
    given = os.environ.get("ASAN_OPTIONS", "")
    return ":".join(x for x in (given, "verify_asan_link_order=0") if x)


class Testbed:
    __test__ = False  # no test, for whoever looks for them by name

    def __init__(self):
        self.process = subprocess.Popen(
            ["umockdev-wrapper", SIMHOST],
            env={**os.environ, "ASAN_OPTIONS": asan_options()},
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
        return {
            "LD_PRELOAD": " ".join(x for x in preload if x),
            "UMOCKDEV_DIR": self.root,
            "ASAN_OPTIONS": asan_options(),
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


class OnTestbed(Case):
    """A testbed of its own for each test."""

    instruments = None

    def setUp(self):
        self.bed = self.enterContext(Testbed())

    def start(self, *instruments, **more):
        self.daemon = self.enterContext(
            Daemon(instruments=instruments or ("auto",), env=self.bed.env(), **more)
        )
        return self.client()

    def folder(self):
        """One for the test's own files."""
        if not hasattr(self, "_folder"):
            self._folder = tempfile.mkdtemp(prefix="sk.", dir="/tmp")
            self.addCleanup(shutil.rmtree, self._folder, ignore_errors=True)
        return self._folder

    def as_nobody(self):
        """Root may open everything."""
        if os.geteuid() != 0:
            return {}
        folder = tempfile.mkdtemp(prefix="sk.", dir="/tmp")
        self.addCleanup(shutil.rmtree, folder, ignore_errors=True)
        for path, folders, files in os.walk(self.bed.root):  # umockdev's own sockets are in there
            os.chmod(path, 0o777)
            for name in files if "/ioctl" in path else ():
                os.chmod(os.path.join(path, name), 0o666)
        os.chown(folder, NOBODY, NOBODY)
        return {"state": folder, "socket": os.path.join(folder, "s"),
                "user": NOBODY, "group": NOBODY, "extra_groups": []}  # fmt: skip

    def left_open(self):
        """The daemon's descriptors but sockets and station.db's.  umockdev's preload library connects a socket in
        open() of a device, and keeps it where the node has just gone; the daemon itself has one a client.
        Its threads open station.db when they first have to do with it."""
        folder = f"/proc/{self.daemon.process.pid}/fd"
        paths = [os.readlink(os.path.join(folder, x)) for x in os.listdir(folder)]
        return len([x for x in paths if not x.startswith("socket:") and "/station.db" not in x])

    @staticmethod
    def states(client):
        return {x["instrument"]: x["state"]
                for x in client.call("instrument.list")["instruments"]}  # fmt: skip

    def wait_for_state(self, client, name, state, within_s=20):
        began = time.monotonic()
        try:
            wait_for(f"{name} {state}", lambda: self.states(client).get(name) == state, within_s)
        except AssertionError as error:
            raise AssertionError(f"{error}; {self.states(client)}; {self.daemon.log()}") from None
        return time.monotonic() - began
