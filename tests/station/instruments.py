"""instruments.py - one unit of each driver's instrument in a testbed, and what a test does with it.

What a person would do with tile and trap is done here; a fault is one of tests/sim (faults.h,
ocean.h)."""

import math
import os
import time

from client import new_uuid
from daemon import INSTRUMENTED, Refused, Silent
from testbed import OnTestbed

LISTENS_S = 2 if INSTRUMENTED else 0.3  # until a command that was sent has come to it


class Unit:
    """One on the testbed: `name` is what the station calls it."""

    def __init__(self, case, nth=0):
        self.case, self.bed, self.nth = case, case.bed, nth
        self.as_told = f"{self.label}{nth}"

    # ---- where it is ---------------------------------------------------------------------

    def plug(self, place=None, options=None):
        place = place or self.place(0)
        if options is None:
            self.bed.plug(self.kind, self.as_told, place)
        else:
            self.bed.plug(self.kind, self.as_told, place, options)

    def come(self, *more, place=None):
        """For the first time; of an option that is given twice the last counts."""
        self.plug(place, ",".join((*self.options, *more)))

    def unplug(self):
        self.bed.unplug(self.as_told)

    def act(self, action):
        self.bed.act(self.as_told, action)

    # ---- what a person does --------------------------------------------------------------

    def calibrate(self, client, lease):
        for step, under in (("zero", "black"), ("white", "white")):
            self.act(f"place {under}")
            client.call("instrument.calibrate", lease=lease, step=step)
        self.act("place skin")


class CM700d(Unit):
    label, kind, driver = "cm", "cm700d", "km_ascii"
    options = ("serial=00012345", "operator=1", "delays=0")
    name = "km_ascii-00012345"
    serial_fault = True  # faults.h; else ocean.h

    def place(self, turn):
        return f"ttyACM{turn}"

    def instrument(self):
        return "auto"


class SP62(Unit):
    """Behind an adaptor that looks like any other: its port is configured, and stays."""

    label, kind, driver = "sp", "sp62", "xrite_rci"
    options = ("serial=4711", "delays=0")
    name = "xrite_rci"
    serial_fault = True

    def place(self, turn):
        return "ttyUSB0"

    def instrument(self):
        return "xrite_rci:/dev/ttyUSB0"

    def calibrate(self, client, lease, places=("white", "black")):
        """Its display asks for white, then black; each is pressed for."""
        for _ in range(3):
            asked = client.send("instrument.calibrate", lease=lease, step="zero")
            for under in places:
                time.sleep(LISTENS_S)
                self.act(f"place {under}")
                self.act("press")
            if self.followed(client, asked):
                break
        self.act("place white")
        client.call("instrument.calibrate", lease=lease, step="white")
        self.act("place skin")

    def followed(self, client, asked):
        """False where the first press came before the display asked: it fails then, and is repeated."""
        try:
            client.wait(asked, 5)
            return True
        except Silent:
            self.act("press")
        try:
            client.wait(asked, 5)
        except Refused:
            pass
        return False


class USB2000(Unit):
    label, kind, driver = "oc", "usb2000", "ocean_ooi"
    options = ("serial=USB2P1", "delays=0")
    name = "ocean_ooi"
    serial_fault = False

    def place(self, turn):
        return f"001/{4 + turn:03d}"

    def instrument(self):
        return f"ocean_ooi:usb,tile={write_tile(self.case)},port_mm=8"


EACH = (CM700d, SP62, USB2000)


def tile_rows(first_nm=380, last_nm=720, step_nm=10, without=()):
    """The simulator's white as its description has it: 0.975 less a bell of 0.05 at 360 nm."""
    nms = [nm for nm in range(first_nm, last_nm + 1, step_nm) if nm not in without]
    return nms, [0.975 - 0.05 * math.exp(-0.5 * ((nm - 360) / 40) ** 2) for nm in nms]


def write_tile(case, nms=None, values=None, specular="sce", name="tile.csv"):
    """Its path, in the daemon's testbed's lifetime."""
    path = os.path.join(case.folder(), name)
    if nms is None:
        nms, values = tile_rows()
    with open(path, "w", encoding="ascii") as file:
        file.write("id,specular," + ",".join(str(nm) for nm in nms) + "\n")
        file.write(f"WS-1,{specular}," + ",".join(f"{x:.6f}" for x in values) + "\n")
    return path


class WithInstruments(OnTestbed):
    """A station with one of them."""

    def start_with(self, unit, *options, come=True, **more):
        """A client; the unit is plugged in and opened."""
        if come:
            unit.come(*options)
        client = self.start(unit.instrument(), **more)
        self.wait_for_state(client, unit.name, "calibration_due")
        return client

    def ready_with(self, unit, *options, **more):
        """A client that holds it calibrated, and the lease."""
        client = self.start_with(unit, *options, **more)
        lease = client.acquire(unit.name)["lease"]
        unit.calibrate(client, lease)
        return client, lease

    @staticmethod
    def listed(client, name):
        (one,) = [x for x in client.call("instrument.list")["instruments"] if x["instrument"] == name]
        return one

    @staticmethod
    def start_measuring(client, lease, **more):
        """The request's number and the uuid."""
        uuid = new_uuid()
        wanted = {"lease": lease, "uuid": uuid, "specular": "sce", "replicates": 1, "pace": "auto"}
        return client.send("measure.start", **{**wanted, **more}), uuid
