"""daemon.py - skinspecd as a process of a test's own, and the case that uses one.

Its socket and its state are in a private folder with a short name, which goes with it.
Only processes started here are ended here.
"""

import contextlib
import ctypes
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

_HERE = os.path.dirname(os.path.abspath(__file__))
for _folder in (_HERE, os.path.join(os.path.dirname(_HERE), "cli")):
    if _folder not in sys.path:
        sys.path.insert(0, _folder)

import shapes  # noqa: E402
from client import Client, Closed, Refused, Silent, new_uuid  # noqa: E402,F401
from support import BUILD, ROOT, TABLES, main  # noqa: E402,F401

SKINSPECD = os.path.join(BUILD, "skinspecd")

# Sanitizers and coverage slow the program, and the first keep freed memory.
with open(SKINSPECD, "rb") as _program:
    _bytes = _program.read()
    INSTRUMENTED = any(x in _bytes for x in (b"__asan_init", b"__tsan_init", b"__gcov_"))

FAST = "simulated:speed=instant"
START_S = 120 if INSTRUMENTED else 30
PR_SET_PDEATHSIG = 1  # prctl(2)
_libc = ctypes.CDLL(None)
STOP_S = 20  # docs: 2; ten times that, on whatever machine

Client.check = staticmethod(shapes.check)


def wait_for(what, condition, timeout_s=START_S, every_s=0.02):
    """The first true value of condition()."""
    until = time.monotonic() + timeout_s
    while True:
        value = condition()
        if value:
            return value
        if time.monotonic() > until:
            raise AssertionError(f"{what}: not within {timeout_s} s")
        time.sleep(every_s)


class Daemon:
    """skinspecd, started at once.  state, socket: paths where not the usual ones of the private
    folder; before: called in the child; more: for Popen."""

    def __init__(self, *options, instruments=(FAST,), state=None, socket=None, tables=TABLES,
                 wait=True, env=None, before=None, **more):  # fmt: skip
        self.folder = tempfile.mkdtemp(prefix="sk.", dir="/tmp")
        self.state = state or os.path.join(self.folder, "state")
        self.socket = socket or os.path.join(self.folder, "s")
        self.stderr = os.path.join(self.folder, "stderr")
        if state is None:
            os.mkdir(self.state, 0o700)
        self.command = [SKINSPECD, "--socket", self.socket, "--state", self.state]
        self.command += ["--tables", tables]
        for instrument in instruments:
            self.command += ["--instrument", instrument]
        self.command += options
        self.env, self.before, self.more, self.process = env, before, more, None
        try:
            self.start(wait)
        except BaseException:
            self.kill()
            self.remove()
            raise

    def _before(self):
        """In the child: it ends when the test does, however that ends."""
        _libc.prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        if self.before is not None:
            self.before()

    # ---- its life -----------------------------------------------------------------------

    def start(self, wait=True):
        with open(self.stderr, "ab") as stderr:
            self.process = subprocess.Popen(
                self.command,
                stdin=subprocess.DEVNULL,
                stderr=stderr,
                env=environment(self.env or {}),
                preexec_fn=self._before,
                **self.more,
            )
        if wait:
            wait_for("the daemon answers and knows its store", self._answers)

    def _answers(self):
        if self.process.poll() is not None:
            raise AssertionError(f"skinspecd ended with {self.process.returncode}: {self.log()}")
        try:
            with self.client(timeout_s=START_S) as c:
                return c.call("status.get")["store"] != "opening"
        except (FileNotFoundError, ConnectionRefusedError, PermissionError):
            return False

    def stop(self):
        """SIGTERM, and the end as it should be: in time, with status 0."""
        begun = time.monotonic()
        self.process.send_signal(signal.SIGTERM)
        try:
            status = self.process.wait(STOP_S + 10)
        except subprocess.TimeoutExpired:
            self.kill()
            raise AssertionError("skinspecd does not end on SIGTERM: " + self.log()) from None
        took_s = time.monotonic() - begun
        if status != 0 or took_s > STOP_S:
            raise AssertionError(f"ended with {status} after {took_s:.2f} s: {self.log()}")

    def ends(self, timeout_s=START_S):
        """Wait until it has ended by itself; its status."""
        return self.process.wait(timeout_s)

    def kill(self):
        if self.process is not None and self.process.poll() is None:
            self.process.kill()
            self.process.wait(10)

    def restart(self):
        self.stop()
        self.start()

    def remove(self):
        shutil.rmtree(self.folder, ignore_errors=True)

    def __enter__(self):
        return self

    def __exit__(self, kind, *_):
        try:
            if kind is None and self.process.poll() is None:
                self.stop()
        finally:
            self.kill()
            self.remove()

    # ---- what tests ask of it -----------------------------------------------------------

    def log(self):
        """All it wrote to standard error."""
        with open(self.stderr, encoding="utf-8", errors="replace") as file:
            return file.read()

    def memory_kb(self):
        """Resident."""
        with open(f"/proc/{self.process.pid}/status", encoding="ascii") as file:
            return next(int(line.split()[1]) for line in file if line.startswith("VmRSS"))

    def cpu_ticks(self):
        """Of user and system time, 10 ms each: fields 14 and 15 of proc(5)."""
        with open(f"/proc/{self.process.pid}/stat", encoding="ascii") as file:
            fields = file.read().rsplit(")", 1)[1].split()
        return int(fields[11]) + int(fields[12])

    def descriptors(self):
        return len(os.listdir(f"/proc/{self.process.pid}/fd"))

    def connect(self, **more):
        """A client without a session."""
        return Client(self.socket, **more)

    def client(self, name="a test", operator=None, **more):
        """A client with a session."""
        client = Client(self.socket, **more)
        client.open(name, **({"operator": operator} if operator else {}))
        return client

    def wait_for_table(self):
        with self.client() as c:
            wait_for("the table", lambda: c.call("status.get")["table"] == "ready")

    def wait_for_instrument(self):
        """Until the first instrument was opened."""
        with self.client() as c:
            wait_for(
                "the instrument",
                lambda: c.call("instrument.list")["instruments"][0]["state"] != "opening",
            )


def environment(changes):
    """The caller's environment without what would change where things are."""
    env = dict(os.environ, LC_ALL="C.UTF-8")
    for name in ("SKINSPEC_SOCKET", "SKINSPEC_STATE", "STATE_DIRECTORY", "XDG_RUNTIME_DIR",
                 "NOTIFY_SOCKET", "LISTEN_FDS", "LISTEN_PID", "WATCHDOG_USEC", "WATCHDOG_PID"):  # fmt: skip
        env.pop(name, None)
    env.update(changes)
    return env


class Case(unittest.TestCase):
    """Tests with a daemon each class shares; a class that sets `instruments` None starts its own."""

    maxDiff = 2000
    instruments = (FAST,)
    options = ()

    @classmethod
    def setUpClass(cls):
        cls.daemon = None
        if cls.instruments is not None:
            cls.daemon = cls.enterClassContext(Daemon(*cls.options, instruments=cls.instruments))
            cls.daemon.wait_for_table()
            cls.daemon.wait_for_instrument()

    def client(self, **more):
        """A client with a session, closed with the test."""
        return self.enterContext(self.daemon.client(**more))

    def ready(self, **more):
        """A client that holds the calibrated instrument, and the lease."""
        c = self.client(**more)
        lease = c.acquire(wait=True)["lease"]
        due = [x["due"] for x in c.call("instrument.list")["instruments"][0]["calibration"]]
        if any(due):
            c.calibrate(lease)
        return c, lease

    @contextlib.contextmanager
    def refused(self, reason):
        """What is in the block is refused for this reason."""
        with self.assertRaises(Refused) as caught:
            yield
        self.assertEqual(caught.exception.reason, reason, str(caught.exception))
