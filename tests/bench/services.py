"""services.py - what is put under load: the station, the baseline, and redis.

Each is a process of its own in a folder of its own, ended with the `with` block.
`rate(seconds)` is what one run gave: answers a second, and latencies in microseconds.
"""

import csv
import json
import os
import shutil
import subprocess
import sys
import tempfile

_TESTS = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, os.path.join(_TESTS, "station"))

import environment  # noqa: E402
from daemon import BUILD, ROOT, Daemon, wait_for  # noqa: E402

CONNECTIONS = 32
LOAD = os.path.join(BUILD, "bench", "load")
_ENDS_S = 20


def _fresh(folder):
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder, 0o700)


def _run_load(socket, queries, seconds, connections):
    done = subprocess.run(
        [LOAD, socket, queries, str(seconds), str(connections)],
        check=True,
        stdout=subprocess.PIPE,
        timeout=seconds + 60,
    )
    return json.loads(done.stdout)


def _socket_folder():
    """With a short name, as sockets want it."""
    return tempfile.mkdtemp(prefix="sk.", dir="/tmp")


class Station:
    """skinspecd as the tests start it, its state in the folder."""

    name = "skinspecd"

    def __init__(self, folder, queries):
        _fresh(folder)
        self.folder, self.queries, self.answered = folder, queries, 0
        self.daemon = Daemon("--max-per-process", str(CONNECTIONS + 16), state=folder)

    def __enter__(self):
        self.daemon.wait_for_table()
        self.daemon.wait_for_instrument()
        return self

    def rate(self, seconds, connections=CONNECTIONS):
        begun = self.daemon.cpu_ticks()
        result = _run_load(self.daemon.socket, self.queries, seconds, connections)
        result["cpu_us"] = (self.daemon.cpu_ticks() - begun) * 1e4 / result["answered"]
        result["group"] = self._group()
        self.answered += result["answered"]
        return result

    def _group(self):
        """Records to a commit, on average."""
        with self.daemon.client() as client:
            metrics = client.call("metrics.get")["metrics"]
        value = {metric["name"]: metric["value"] for metric in metrics}
        return value["store_jobs"] / max(value["store_commits"], 1)

    def check(self):
        """What was answered is stored, and the chain is whole."""
        with self.daemon.client() as client:
            report = client.call("store.verify", timeout_s=120)
        if not report["sound"] or report["records"] != self.answered:
            raise AssertionError(f"{self.answered} were answered, not so stored: {report}")

    def __exit__(self, *_):
        self.daemon.kill()
        self.daemon.remove()
        shutil.rmtree(self.folder, ignore_errors=True)


class _Other:
    """Another program in the folder, its socket in one with a short name, as sockets want it."""

    def __init__(self, folder):
        _fresh(folder)
        self.folder = folder
        self.socket = os.path.join(_socket_folder(), "s")
        self.process = None

    def _start(self, *command):
        self.process = subprocess.Popen(command, stdout=subprocess.DEVNULL)

    def _answers(self):
        raise NotImplementedError

    def __enter__(self):
        try:
            wait_for(f"{self.name} answers", self._answers)
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait(_ENDS_S)
        shutil.rmtree(os.path.dirname(self.socket), ignore_errors=True)
        shutil.rmtree(self.folder, ignore_errors=True)


class Baseline(_Other):
    """baseline.py on a store that skinspecd has made."""

    name = "baseline"

    def __init__(self, folder, queries):
        super().__init__(folder)
        self.queries, self.answered = queries, 0
        self.file = os.path.join(folder, "station.db")
        with Daemon(state=folder, instruments=()):
            wait_for("the store", lambda: os.path.exists(self.file))
        program = os.path.join(_TESTS, "bench", "baseline.py")
        self._start(environment.PYTHON, "-B", program, self.socket, self.file)

    def _answers(self):
        return os.path.exists(self.socket)

    def rate(self, seconds):
        result = _run_load(self.socket, self.queries, seconds, CONNECTIONS)
        self.answered += result["answered"]
        return result

    def check(self):
        """By the reference, which shares nothing with it: it writes what it claims."""
        reference = os.path.join(ROOT, "tests", "reference", "audit_chain.py")
        said = subprocess.run(
            [sys.executable, reference, self.file], check=True, stdout=subprocess.PIPE, text=True
        ).stdout
        if f"rows {self.answered + 1}\n" not in said:  # the first: that the store was made
            raise AssertionError(f"baseline: {self.answered} were answered, but {said}")


class Redis(_Other):
    """SET of 400 bytes by redis-benchmark; every write is on the disk before its answer."""

    name = "redis"

    def __init__(self, folder):
        super().__init__(folder)
        self._start(
            "redis-server", "--port", "0", "--unixsocket", self.socket, "--dir", folder,
            "--save", "", "--appendonly", "yes", "--appendfsync", "always",
            "--auto-aof-rewrite-percentage", "0",
        )  # fmt: skip

    def _answers(self):
        return self._benchmark(1, 1) > 0

    def _benchmark(self, requests, connections=CONNECTIONS):
        """SETs a second; 0 where nothing answers."""
        done = subprocess.run(
            ["redis-benchmark", "-s", self.socket, "-c", str(connections), "-n", str(requests),
             "-d", "400", "-r", "1000000", "-t", "set", "--csv"],
            check=False, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
        )  # fmt: skip
        for row in csv.reader(done.stdout.splitlines()):
            if row[:1] == ["SET"]:
                return float(row[1])
        return 0

    def rate(self, seconds):
        warming_up = 4000
        first = self._benchmark(warming_up)
        return {"per_s": self._benchmark(max(int(first * seconds), warming_up))}

    def check(self):
        """It is not ours to check."""


def can_run_baseline():
    return environment.python_with("uvloop", "orjson") is not None


def can_run_redis():
    return environment.has("redis")
