"""run.py - the product's figures, each beside its bar.

    BUILD=build python3 -B tests/bench/run.py [--peers] [SECTION ...]

Sections are those of SECTIONS below, each a module with a show(); without a name all of them.
--peers: what is compared with is put there first if it is missing (environment.py), and without a
name those that compare are run; else peers that are not there are left out with a message.  BENCH_DIR
is a folder on the disk to measure (in BUILD by default).  Every program runs alone and in turns
with the others, and the median of the rounds counts; still, other work on the machine shows in the
figures: "others" is the share of all cores that it took.
"""

import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import batch  # noqa: E402
import clients  # noqa: E402
import de2000  # noqa: E402
import drivers  # noqa: E402
import environment  # noqa: E402
import growth  # noqa: E402
import inversion  # noqa: E402
import latency  # noqa: E402
import machine  # noqa: E402
import maps  # noqa: E402
import match  # noqa: E402
import planner  # noqa: E402
import search  # noqa: E402
import start  # noqa: E402
import tables  # noqa: E402
import throughput  # noqa: E402
import transport  # noqa: E402
from places import BENCH, DISK, MEMORY  # noqa: E402
from report import row  # noqa: E402

SECTIONS = {
    "throughput": throughput,
    "clients": clients,
    "latency": latency,
    "drivers": drivers,
    "start": start,
    "inversion": inversion,
    "batch": batch,
    "transport": transport,
    "planner": planner,
    "map": maps,
    "match": match,
    "search": search,
    "de2000": de2000,
    "tables": tables,
    "growth": growth,
}
WITH_PEERS = ["search", "tables", "inversion", "transport", "throughput"]


def show_machine():
    load = " ".join(f"{x:.1f}" for x in os.getloadavg())
    print(f"{machine.processor()}; load {load}")
    for name, folder in (("disk", DISK), ("tmpfs", MEMORY)):
        print(f"{name}: {machine.disk(folder)}")
        for size in (400, 4096):
            took = machine.append_us(folder, size)
            p50, p99 = (machine.quantile(took, percent) for percent in (50, 99))
            row(f"append {size} bytes + fdatasync, median and p99", f"{p50:.1f} {p99:.1f} us")


def main():
    asked = sys.argv[1:]
    peers = asked[:1] == ["--peers"]
    asked = asked[peers:] or (WITH_PEERS if peers else list(SECTIONS))
    if not set(asked) <= set(SECTIONS):
        sys.exit(f"usage: run.py [--peers] [{'] ['.join(SECTIONS)}]")
    os.makedirs(BENCH, exist_ok=True)
    os.makedirs(DISK, exist_ok=True)
    if peers:
        environment.fetch()
    show_machine()
    for name in asked:
        SECTIONS[name].show()


if __name__ == "__main__":
    main()
