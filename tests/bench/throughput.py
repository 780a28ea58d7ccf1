"""throughput.py - match.spectrum, matched and stored, beside the baseline and redis."""

import os
import statistics
import tempfile

import machine
import queries
import services
from places import BENCH, DISK, MEMORY, ROUNDS, TABLE
from rates import COLUMNS, HEADINGS, show_rate
from report import heading, row

SECONDS = 4
SLOW_DISK_US = 300  # a bare fdatasync from here on: more is to be gained
TIMES_BASELINE_SLOW, TIMES_BASELINE = 10, 4
SHARE_OF_REDIS = 50


def measure(folder, lines, kinds):
    """Median rates by name, one after the other, ROUNDS times; and the median of appends to
    the disk in between, microseconds: a disk that others use changes from minute to minute."""
    results, appends = {kind.name: [] for kind in kinds}, []
    for _ in range(ROUNDS):
        for kind in kinds:
            appends += machine.append_us(folder, 400, 200)
            where = os.path.join(folder, kind.name)
            with machine.Others() as others:
                with kind(where) if kind is services.Redis else kind(where, lines) as service:
                    result = service.rate(SECONDS)
                    service.check()
            results[kind.name].append({**result, "others": others.percent})
    print(COLUMNS.format(*HEADINGS))
    rate = {name: show_rate(name, result) for name, result in results.items()}
    return rate, statistics.median(appends)


def compare(rate, append_us):
    """Each ratio beside its bar."""
    bar = TIMES_BASELINE_SLOW if append_us >= SLOW_DISK_US else TIMES_BASELINE
    row("append 400 bytes + fdatasync in between, median", f"{append_us:.1f} us")
    if "baseline" in rate:
        times = rate["skinspecd"] / rate["baseline"]
        row("times the baseline", f"{times:.1f}", f">= {bar}", times >= bar)
    if "redis" in rate:
        share = 100 * rate["skinspecd"] / rate["redis"]
        row("of redis", f"{share:.0f} %", f">= {SHARE_OF_REDIS} %", share >= SHARE_OF_REDIS)


def show():
    """match.spectrum, matched and stored."""
    plain, with_uuid = os.path.join(BENCH, "plain"), os.path.join(BENCH, "uuid")
    queries.write(plain, TABLE)
    queries.write(with_uuid, TABLE, with_uuid=True)
    ours = [services.Station] + [services.Baseline] * services.can_run_baseline()
    redis = [services.Redis] * services.can_run_redis()
    with tempfile.TemporaryDirectory(prefix="skinspec-bench.", dir=MEMORY) as memory:
        for what, folder, lines, kinds in (
            ("disk", DISK, plain, ours + redis),
            ("disk, with uuids", DISK, with_uuid, ours),
            ("tmpfs", memory, plain, ours),
        ):
            heading(f"matched and stored, {services.CONNECTIONS} connections, {what}: "
                    f"median of {ROUNDS} times {SECONDS} s")  # fmt: skip
            compare(*measure(folder, lines, kinds))
