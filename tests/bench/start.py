"""start.py - how soon the station is there, and what it takes when nobody asks."""

import os
import shutil
import statistics
import sys
import time

_TESTS = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, os.path.join(_TESTS, "station"))

from asking import asked_us, fresh, line  # noqa: E402
from client import Client, Closed  # noqa: E402
from daemon import TABLES, Daemon  # noqa: E402
from places import DISK  # noqa: E402
from report import heading, row  # noqa: E402

STARTS = 10
REST_S = 10
STATUS_MS, MATCH_MS = 50, 500
IDLE_PERCENT = 0.05  # prints as 0.0
RESIDENT_MB = 40

# ---- starting -----------------------------------------------------------------------------


def _forget_pages(folder):
    """As after a while: files of the folder have to come from the disk again."""
    for name in os.listdir(folder):
        with open(os.path.join(folder, name), "rb") as file:
            os.fdatasync(file.fileno())
            os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)


def _first_connection(socket):
    while True:
        try:
            return Client(socket)
        except (FileNotFoundError, ConnectionRefusedError, Closed):
            time.sleep(0.0005)


def _first_answers_ms(daemon, spectrum):
    """Of one start, from before exec: status.get, and match.spectrum."""
    begun = time.perf_counter_ns()
    daemon.start(wait=False)
    with _first_connection(daemon.socket) as client:
        asked_us(client, line(1, "session.open", major=1, client="bench"))
        asked_us(client, b'{"jsonrpc":"2.0","id":2,"method":"status.get"}')
        status = (time.perf_counter_ns() - begun) / 1e6
        match = line(3, "match.spectrum", spectrum=spectrum, specular="sce", store=False)
        asked_us(client, match)
        return status, (time.perf_counter_ns() - begun) / 1e6


def starts_ms(folder, spectrum, times):
    """Lists of both, the files of the station's folders read from the disk each time."""
    fresh(folder)
    status, match = [], []
    with Daemon(state=folder, instruments=("simulated",)) as daemon:
        for _ in range(times):
            daemon.stop()
            _forget_pages(folder)
            _forget_pages(TABLES)
            one = _first_answers_ms(daemon, spectrum)
            status.append(one[0])
            match.append(one[1])
    shutil.rmtree(folder)
    return status, match


# ---- at rest --------------------------------------------------------------------------------


def _ran_ns(pid):
    """CPU time of all threads: first field of schedstat."""
    total = 0
    for task in os.listdir(f"/proc/{pid}/task"):
        with open(f"/proc/{pid}/task/{task}/schedstat", encoding="ascii") as file:
            total += int(file.read().split()[0])
    return total


def rest(folder, spectrum, seconds):
    """After a match, with a client connected and an instrument open: percent of one core, and
    resident megabytes."""
    fresh(folder)
    with Daemon(state=folder, instruments=("simulated",)) as daemon:
        daemon.wait_for_table()
        daemon.wait_for_instrument()
        with daemon.client() as client:
            client.call("match.spectrum", spectrum=spectrum, specular="sce", store=True)
            megabytes = daemon.memory_kb() * 1024 / 1e6
            time.sleep(1)
            begun = _ran_ns(daemon.process.pid)
            time.sleep(seconds)
            percent = (_ran_ns(daemon.process.pid) - begun) / seconds / 1e7
    shutil.rmtree(folder)
    return percent, megabytes


def show():
    folder = os.path.join(DISK, "start")
    spectrum = {"first_nm": 400, "step_nm": 10, "values": [0.2 + 0.01 * i for i in range(31)]}
    status, match = (statistics.median(x) for x in starts_ms(folder, spectrum, STARTS))
    heading(f"from exec, median of {STARTS}")
    row("first status.get answered", f"{status:.1f} ms", f"<= {STATUS_MS} ms", status <= STATUS_MS)
    row("first match.spectrum answered", f"{match:.1f} ms", f"<= {MATCH_MS} ms", match <= MATCH_MS)
    percent, megabytes = rest(folder, spectrum, REST_S)
    heading("after a match, at rest")
    row(f"of one core in {REST_S} s", f"{percent:.2f} %", "0.0 %", percent < IDLE_PERCENT)
    row("resident", f"{megabytes:.1f} MB", f"<= {RESIDENT_MB} MB", megabytes <= RESIDENT_MB)
