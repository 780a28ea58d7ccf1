#!/usr/bin/env python3
"""test_toy_station.py - a station with a TOY-1: found by udev, or named by its port; calibrated, measured."""

import os
import sys

ROOT = os.path.abspath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../.."))
sys.path.insert(0, os.path.join(ROOT, "tests", "station"))

from daemon import main  # noqa: E402
from testbed import OnTestbed  # noqa: E402


class Toy(OnTestbed):
    def measures(self, client, name):
        self.wait_for_state(client, name, "calibration_due")
        lease = client.acquire(name)["lease"]
        client.calibrate(lease)
        record = client.measure(lease, replicates=2)
        self.assertEqual(record["serial"], "00042")
        self.assertEqual(record["specular"], "sce")
        self.assertEqual([len(x["values"]) for x in record["replicates"]], [31, 31])
        self.assertGreater(record["Lab"][0], 40)  # skin of L* 65 or so, not black nor white
        self.assertLess(record["Lab"][0], 80)

    def test_found_by_udev(self):
        c = self.start("auto")
        self.assertEqual(self.states(c), {})
        self.bed.plug("toy", "one", "ttyACM0", "serial=00042,delays=0")
        self.measures(c, "toy-00042")
        self.bed.unplug("one")
        self.wait_for_state(c, "toy-00042", "gone")

    def test_named_by_its_port(self):
        self.bed.plug("toy", "one", "ttyACM3", "serial=00042,delays=0")
        self.measures(self.start("toy:/dev/ttyACM3"), "toy")


if __name__ == "__main__":
    main()
