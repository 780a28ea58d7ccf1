"""machine.py - what the figures were measured on, and what its disk takes to keep a write."""

import os
import platform
import subprocess
import time


def quantile(values, percent):
    """The smallest value that at least this many percent do not exceed."""
    ordered = sorted(values)
    return ordered[max(-(-len(ordered) * percent // 100) - 1, 0)]


def _said(*command):
    try:
        return subprocess.run(
            command, check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        ).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return ""


def processor():
    """Model, cores and kernel."""
    model = next(
        (
            line.split(":", 1)[1].strip()
            for line in _said("lscpu").splitlines()
            if line.strip().startswith("Model name")
        ),
        platform.machine(),
    )
    return f"{model}, {os.cpu_count()} cores, Linux {platform.release()}"


def disk(folder):
    """File system and device below a folder; whether it turns, as the kernel has it."""
    mounts = _said("findmnt", "-no", "FSTYPE,SOURCE", "-T", folder).splitlines()
    kind, source = mounts[-1].split(None, 1) if mounts else ("unknown", "unknown")
    device = os.path.realpath(f"/sys/class/block/{os.path.basename(source.strip())}")
    for block in (device, os.path.dirname(device)):  # a partition's disk is above it
        try:
            with open(f"{block}/queue/rotational", encoding="ascii") as file:
                return f"{kind} on {source.strip()}, rotational {file.read().strip()}"
        except OSError:
            pass
    return f"{kind} on {source.strip()}"


class Appending:
    """A file of its own in the folder, to which a block is appended and made to last."""

    def __init__(self, folder, size):
        self.path = os.path.join(folder, f"append-{size}")
        self.block = os.urandom(size)
        self.fd = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        os.close(self.fd)
        os.unlink(self.path)

    def took_us(self):
        begun = time.perf_counter_ns()
        os.write(self.fd, self.block)
        os.fdatasync(self.fd)
        return (time.perf_counter_ns() - begun) / 1e3


def append_us(folder, size, times=1000):
    """Microseconds of each of many appends."""
    with Appending(folder, size) as appending:
        return [appending.took_us() for _ in range(times)]


class Others:
    """Over a `with` block: the share of all cores, in percent, that went to what neither this
    program nor a program it has started and waited for did."""

    def __enter__(self):
        self._begun = self._ticks()
        self.percent = None
        return self

    def __exit__(self, *_):
        busy, all_, own = (now - then for now, then in zip(self._ticks(), self._begun))
        self.percent = 100 * max(busy - own, 0) / max(all_, 1)

    @staticmethod
    def _ticks():
        """Of all cores: busy, and busy or idle; and our own."""
        with open("/proc/stat", encoding="ascii") as file:
            ticks = [int(field) for field in file.readline().split()[1:9]]
        idle = ticks[3] + ticks[4]
        return sum(ticks) - idle, sum(ticks), sum(os.times()[:4]) * os.sysconf("SC_CLK_TCK")
