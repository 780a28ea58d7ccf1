#!/usr/bin/env python3
"""make_captures.py - the captures that are shipped, made anew: a station that records measures
simulated instruments at mocked ports.

    python3 -B tests/station/make_captures.py FOLDER [KIND...]

FOLDER gets one of each kind that is named, else of all; they belong into drivers/*/captures.
The station has no table: a match depends on a table's bits, and so on the build that made it."""

import os
import shutil
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

from daemon import ROOT, Daemon, new_uuid, wait_for  # noqa: E402
from testbed import Testbed  # noqa: E402

TILE = os.path.join(ROOT, "drivers", "ocean_ooi", "captures", "tile-simulated.csv")
CHARGED_S = 1  # a flash charges after a shot: a press before would be in vain
COMPARED = (
    "compared: by skinspec replay, how each step ended, and of each record the spectra, XYZ, Lab, sRGB,",
    "  ITA and flags, bit for bit; the station had no table, so that there is no match; times (a",
    "  tenth of what is told of real ones) are not compared",
)


class Kind:
    def __init__(self, kind, file, node, options, instrument, done, under=None):
        self.kind, self.file, self.node = kind, file, node
        self.options, self.instrument, self.done = options, instrument, done
        self.under = under or {}  # what a person puts there before a step


HANDHELD = "calibrated, three shots, and two of which the second is by the button"
KINDS = (
    Kind("cm700d", "cm700d.capture", "ttyACM0", "serial=70012345,operator=1,delays=0.1",
         "km_ascii:/dev/ttyACM0", HANDHELD),
    Kind("cm2600d", "cm2600d.capture", "ttyUSB0", "serial=70012345,operator=1,delays=0.1",
         "km_ascii:/dev/ttyUSB0", HANDHELD),
    Kind("sp62", "sp62.capture", "ttyUSB0", "serial=007654,operator_ms=200,delays=0.1",
         "xrite_rci:/dev/ttyUSB0", HANDHELD, {"white": "place white", "skin": "place skin"}),
    Kind("usb2000", "usb2000-simulated.txt", "001/004", "noise=0,lamp=0.07,delays=0.1",
         f"ocean_ooi:usb,tile={TILE},port_mm=8", "calibrated, one shot each of three skins",
         {"zero": "place black", "white": "place white", "skin": "place skin"}),
)  # fmt: skip
SKINS = (75, 55, 30)  # lightness, before the spectrometer


def measure_by_button(bed, kind, client, lease):
    uuid = new_uuid()
    client.call("events.subscribe", topics=["measurement"])
    asked = client.send("measure.start", lease=lease, uuid=uuid, specular="sce", replicates=2,
                        pace="prompt")  # fmt: skip
    client.event("measurement", "waiting", uuid=uuid)
    if "operator_ms" not in kind.options:
        time.sleep(CHARGED_S)
        bed.act("one", "press")
    client.wait(asked)


def hold_session(bed, kind, client):
    def place(what):
        if what in kind.under:
            bed.act("one", kind.under[what])

    lease = client.acquire()["lease"]
    for step in ("zero", "white"):
        place(step)
        client.call("instrument.calibrate", 60, lease=lease, step=step)
    place("skin")
    if kind.kind == "usb2000":
        for lightness in SKINS:
            bed.act("one", f"lightness {lightness}")
            client.measure(lease)
        return
    client.measure(lease, replicates=3)
    measure_by_button(bed, kind, client, lease)


def write_heading(path, kind):
    """Behind the date: by whom, what was done, what a replay compares."""
    with open(path, encoding="ascii") as file:
        lines = file.readlines()
    at = next(i for i, line in enumerate(lines) if line.startswith("# date: ")) + 1
    notes = (f"by: the wire simulator {kind.kind}, at a mocked port", f"done: {kind.done}",
             "simulated, not seen on hardware", *COMPARED)  # fmt: skip
    lines[at:at] = [f"# {note}\n" for note in notes]
    with open(path, "w", encoding="ascii") as file:
        file.writelines(lines)


def make(kind, folder):
    path = os.path.join(folder, kind.file)
    with Testbed() as bed:
        bed.plug(kind.kind, "one", kind.node, kind.options)
        with Daemon("--record", path, "--table", "none", instruments=(kind.instrument,), env=bed.env()) as daemon:
            with daemon.client() as client:
                wait_for("the instrument", lambda: client.call("instrument.list")["instruments"])
                daemon.wait_for_instrument()
                hold_session(bed, kind, client)
    write_heading(path, kind)
    os.chmod(path, 0o644)
    return path


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    if shutil.which("umockdev-wrapper") is None:
        sys.exit("make_captures.py: umockdev is not there: make need-test installs it")
    folder = sys.argv[1]
    os.makedirs(folder, exist_ok=True)
    for kind in KINDS:
        if kind.kind in sys.argv[2:] or len(sys.argv) == 2:
            print(make(kind, folder))


if __name__ == "__main__":
    main()
