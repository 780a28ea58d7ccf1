"""latency.py - what the drivers and the station add to a measurement; how soon it is there; what
it idles at."""

import json
import os
import shutil
import subprocess
import sys
import time

_TESTS = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, os.path.join(_TESTS, "station"))

from client import Client, Closed, new_uuid  # noqa: E402
from daemon import BUILD, TABLES, Daemon, wait_for  # noqa: E402
from machine import Appending  # noqa: E402
from simhost import Simhost  # noqa: E402

# No charging, no battery that runs empty, no calibration that runs out.
_TIRELESS = "charge_ms=0,calibrate_ms=0,drain=0,calibration_shots=1000000"
# The address, and the instrument's own time.  The driver waits for a shot by poll(), which
# takes at least as long as asked for.
WAITING = f"simulated:{_TIRELESS},shot_ms=20", 20
INSTANT = f"simulated:{_TIRELESS},speed=instant", 0
# Behind a tty of simhost, where somebody places what a calibration wants.
SERIAL = "km_ascii:/dev/ttyACM0", 0
SERIAL_OPTIONS = "delays=0,operator=1"


def _fresh(folder):
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder, 0o700)


def _line(number, method, **params):
    request = {"jsonrpc": "2.0", "id": number, "method": method, "params": params}
    return json.dumps(request).encode()


def _asked_us(client, line):
    """From the request's first byte to the last of its answer."""
    begun = time.perf_counter_ns()
    client.send_line(line)
    answer = client.next_line()
    took = (time.perf_counter_ns() - begun) / 1e3
    if b'"result"' not in answer[:64]:
        raise AssertionError(answer)
    return took


def drivers_us(times):
    """Of each driver's simulators: a name, what the driver took for each reading beyond the
    simulator's own time, and that time.  tests/bench/drivers.c says how."""
    program = os.path.join(BUILD, "bench", "drivers")
    done = subprocess.run(
        [program, str(times)], check=True, stdout=subprocess.PIPE, text=True, timeout=60
    )
    found = [json.loads(line) for line in done.stdout.splitlines()]
    return [(one["name"], one["added_us"], one["instrument_us"]) for one in found]


def serial_us(folder, times):
    """measuring_us() of a simulated CM-700d that takes no time, on a mocked tty."""
    with Simhost() as host:
        host.say(f"plug cm700d one ttyACM0 {SERIAL_OPTIONS}")
        return measuring_us(folder, SERIAL, times, env=host.mocked)


def measuring_us(folder, instrument, times, env=None):
    """Of each measure.start: what it took beyond the instrument's own time; and of appends of
    4 KiB to the same disk between them."""
    address, own_ms = instrument
    _fresh(folder)
    added, bare = [], []
    with Daemon(instruments=(address,), state=folder, env=env) as daemon:
        daemon.wait_for_table()
        with daemon.client() as client:
            wait_for("it is found", lambda: client.call("instrument.list")["instruments"])
        daemon.wait_for_instrument()
        with daemon.client() as client, Appending(folder, 4096) as appending:
            lease = client.acquire(ttl_ms=600000)["lease"]
            client.calibrate(lease)
            for i in range(times):
                line = _line(
                    1000 + i, "measure.start", lease=lease, uuid=new_uuid(),
                    specular="sce", replicates=1, pace="auto",
                )  # fmt: skip
                added.append(_asked_us(client, line) - 1e3 * own_ms)
                bare.append(appending.took_us())
            listed = client.call("record.list", limit=1)["records"]
            if client.call("status.get")["last_seq"] != times or len(listed) != 1:
                raise AssertionError("not every measurement was stored")
    shutil.rmtree(folder)
    return added, bare


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
        _asked_us(client, _line(1, "session.open", major=1, client="bench"))
        _asked_us(client, b'{"jsonrpc":"2.0","id":2,"method":"status.get"}')
        status = (time.perf_counter_ns() - begun) / 1e6
        match = _line(3, "match.spectrum", spectrum=spectrum, specular="sce", store=False)
        _asked_us(client, match)
        return status, (time.perf_counter_ns() - begun) / 1e6


def starts_ms(folder, spectrum, times):
    """Lists of both, the files of the station's folders read from the disk each time."""
    _fresh(folder)
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
    _fresh(folder)
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
