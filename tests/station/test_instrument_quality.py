#!/usr/bin/env python3
"""test_instrument_quality.py - the flags of the quality gate on records of each driver's instrument,
and what is refused, through the running daemon.

expect: src/station/quality.h (what each flag means, and from where on); tests/sim/under_port.h and
ocean.h (what lies under the port)."""

import os
import sys
import tempfile
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

from client import new_uuid  # noqa: E402
from daemon import Case, Daemon, main  # noqa: E402
from instruments import EACH, WithInstruments  # noqa: E402

# L* of the skin at each shot -> flags of the record, flags that it must not have.  The simulated skin
# keeps the shape of its spectrum, so that a* falls as L* does, by a ninth of 9 or more from 74 to 60.
SHOTS = (
    ((65,), {"single"}, {"spread", "outlier", "redness_falls"}),
    ((65, 65, 65), set(), {"single", "spread", "outlier", "redness_falls"}),
    ((62, 70), {"spread"}, {"single", "outlier", "redness_falls"}),
    ((65, 65, 55), {"outlier"}, {"single", "spread", "redness_falls"}),
    ((74, 67, 60), {"spread", "redness_falls"}, {"single", "outlier"}),
)
DARK = {"cm700d": "instrument_protocol", "sp62": "measurement_failed", "usb2000": "measurement_failed"}
OPTIONS = {"cm700d": ("operator=0",), "sp62": (), "usb2000": ("lightness=65",)}  # nobody lends a hand


def prompted(case, client, lease, before):
    """The record of as many shots as there are functions in `before`, each called before its shot."""
    before[0]()
    uuid, n = new_uuid(), len(before)
    wanted = {"lease": lease, "uuid": uuid, "specular": "sce", "replicates": n, "pace": "prompt"}
    asked = client.send("measure.start", **wanted)
    for place in before[1:]:
        prompt = client.event("measurement", "waiting", uuid=uuid)["data"]["prompt"]
        case.assertTrue(prompt)
        place()
        client.call("measure.next", lease=lease, uuid=uuid)
    return client.wait(asked)


class EachDriver(WithInstruments):
    def each(self, check, *options):
        """check(unit, client, lease) with a calibrated unit of each, and what the client subscribed to."""
        for kind in EACH:
            with self.subTest(kind=kind.kind):
                unit = kind(self)
                unit.come(*OPTIONS[unit.kind])
                self.daemon = self.enterContext(
                    Daemon(*options, instruments=(unit.instrument(),), env=self.bed.env())
                )
                c = self.client()
                self.wait_for_state(c, unit.name, "calibration_due")
                lease = c.acquire(unit.name)["lease"]
                unit.calibrate(c, lease)
                c.call("events.subscribe", topics=["measurement"])
                try:
                    check(unit, c, lease)
                finally:
                    self.daemon.stop()

    def test_replicates(self):
        def check(unit, c, lease):
            for shots, there, absent in SHOTS:
                with self.subTest(shots=shots):
                    before = [lambda x=x: unit.act(f"lightness {x}") for x in shots]
                    flags = set(prompted(self, c, lease, before)["flags"])
                    self.assertLessEqual(there, flags)
                    self.assertFalse(absent & flags, flags)

        self.each(check)

    def test_nothing_under_the_port(self):
        """Noise about 0; the simulated CM-700d tells it with a minus, which no description has."""

        def check(unit, c, lease):
            unit.act("place black")
            with self.refused(DARK[unit.kind]):
                c.measure(lease)
            unit.act("place skin")
            self.assertEqual(c.measure(lease)["seq"], 1)

        self.each(check)

    def test_drift(self):
        """The skin stands for a tile, which gets darker; then it is as it was."""

        def check(unit, c, lease):
            tile = {"lease": lease, "tile": "t", "replicates": 2}
            unit.act("lightness 65")
            c.call("check.set", uuid=new_uuid(), **tile)
            for lightness, drifted in ((65, False), (58, True), (65, False)):
                unit.act(f"lightness {lightness}")
                took = c.call("check.take", uuid=new_uuid(), **tile)
                self.assertEqual(took["passed"], not drifted, took)
                self.assertEqual("drift" in c.measure(lease)["flags"], drifted)

        self.each(check)

    def test_an_old_calibration(self):
        """--calibration-policy: warns after 0.36 s."""

        def check(_, c, lease):
            time.sleep(0.5)
            self.assertIn("calibration_old", c.measure(lease)["flags"])

        self.each(check, "--calibration-hours", "0.0001", "--calibration-policy", "warn")


class Simulated(Case):
    """The same replicates of an instrument that plays a file."""

    instruments = None

    def playing(self, shots):
        """Skins without noise, one a shot: red rises, as under_port.c has it."""
        path = os.path.join(self.enterContext(tempfile.TemporaryDirectory(dir="/tmp")), "skins.csv")
        bands = range(400, 701, 10)
        with open(path, "w", encoding="ascii") as file:
            print("specular", *bands, sep=",", file=file)
            for lightness in shots:
                Y = ((lightness + 16) / 116) ** 3
                print("sce", *(f"{Y * (nm / 555) ** 2:.5f}" for nm in bands), sep=",", file=file)
        return f"simulated:speed=instant,noise=0,placement=0,spectra={path}"

    def test_replicates(self):
        for shots, there, absent in SHOTS:
            with self.subTest(shots=shots):
                self.daemon = self.enterContext(Daemon(instruments=(self.playing(shots),)))
                c, lease = self.ready()
                flags = set(c.measure(lease, replicates=len(shots))["flags"])
                self.assertLessEqual(there, flags)
                self.assertFalse(absent & flags, flags)
                self.daemon.stop()


if __name__ == "__main__":
    main()
