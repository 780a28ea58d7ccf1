#!/usr/bin/env python3
"""test_instrument_wires.py - what comes over each instrument's wire damaged, late, twice or as nonsense,
through the running daemon: the right value or a clear error, never a wrong record, and all is well after it.

expect: each reading of the same skin is the one before it but for ten times the noise;
docs/protocol.md (reasons); tests/sim/faults.h and ocean.h (what each fault is)."""

import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

from daemon import Refused, main  # noqa: E402
from instruments import EACH, SP62, USB2000, CM700d, WithInstruments  # noqa: E402

# A spectrum that comes twice, to the last digit, is refused as the shot before: a little noise.
NOISE = {"cm700d": "noise=0.0002", "sp62": "noise=0.0002", "usb2000": "noise=0"}
SAME = 0.002
PATIENCE_S = 60
# All of it takes two minutes of waiting: where only instruments are tested (tools/run-faults says so).
ALL = bool(os.environ.get("PLUGS"))
REPLIES = (1, 2, 3, 4) if ALL else (2,)
REASONS = {"instrument_fault", "instrument_timeout", "measurement_failed", "instrument_gone",
           "instrument_protocol", "measurement_implausible", "calibration_due"}  # fmt: skip

# Of the first replies to a measurement, and of all kinds of replies that carry a spectrum.  Late is
# one that the driver has given up, after its 5 to 15 s.
LATE = {
    "serial": ["late on 2", "delay 300 on 1", "delay 300 on 4"] if ALL else ["delay 300 on 4"],
    "usb": ["stale", "delay 300", "hang", "twice"],
}
SLOW = {"serial": ["slow 100 on 1", "slow 3 on 3"] + ["slow 100 on 2", "slow 3 on 4"] * ALL}
DAMAGED = {
    "serial": [f"{what} on {n}" for n in REPLIES for what in
               ["garbage 40", "xor 2 64", "reply ER99"] + ["truncated 3", "longer 60", "twice"] * ALL],
    "usb": ["sync", "truncate 100", "truncate 512", "overlong 64", "short", "twice", "stall 82"],
}  # fmt: skip
NONSENSE = {
    "serial": [f"{what} from 1" for what in
               ("bands 30", "bands 0", "bands 45", "zero", "over", "negative", "text", "swapped")],
    "usb": ["lamp"],
}  # fmt: skip


class Wires(WithInstruments):
    def values(self, client, lease):
        return client.wait(self.start_measuring(client, lease)[0], PATIENCE_S)["spectrum"]["values"]

    def each_fault(self, kind, faults):
        unit = kind(self)
        client, lease = self.ready_with(unit, NOISE[unit.kind])
        truth, stored = self.values(client, lease), 1
        refused = 0
        for fault in faults["serial" if unit.serial_fault else "usb"]:
            with self.subTest(kind=unit.kind, fault=fault):
                unit.act(f"fault {fault}")
                try:
                    told = self.values(client, lease)
                    stored += 1
                    self.same(told, truth)
                except Refused as error:
                    refused += 1
                    self.assertIn(error.reason, REASONS)
                    self.assertGreater(len(error.message), 15)
                unit.act("fault none")
                lease = self.well_again(unit, client, lease)
                self.same(self.values(client, lease), truth)
                stored += 1
                self.assertEqual(client.call("status.get")["last_seq"], stored)
        self.daemon.stop()
        return refused

    def same(self, told, truth):
        self.assertEqual(len(told), len(truth))
        for got, expected in zip(told, truth):
            self.assertAlmostEqual(got, expected, delta=SAME)

    def well_again(self, unit, client, lease):
        """What the fault may have left: a calibration that is due."""
        if self.listed(client, unit.name)["state"] == "calibration_due":
            unit.calibrate(client, lease)
        return lease

    def test_late_or_never(self):
        for kind in EACH:
            self.each_fault(kind, LATE)

    def test_slow(self):
        for kind in (CM700d, SP62):
            self.each_fault(kind, SLOW)

    def test_damaged(self):
        for kind in EACH:
            self.each_fault(kind, DAMAGED)

    def test_nonsense(self):
        """Of values that cannot be, none is stored."""
        for kind in (CM700d, SP62, USB2000):
            tried = NONSENSE["usb" if kind is USB2000 else "serial"]
            self.assertEqual(self.each_fault(kind, NONSENSE), len(tried), kind.kind)


if __name__ == "__main__":
    main()
