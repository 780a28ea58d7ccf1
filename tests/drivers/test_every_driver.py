#!/usr/bin/env python3
"""test_every_driver.py - what each driver of the registry has to have beside its code: the contract suite run on it, and
a row in docs/drivers.md."""

import glob
import os
import re
import sys
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tests", "cli"))

from support import main  # noqa: E402


def read(*path):
    with open(os.path.join(ROOT, *path), encoding="utf-8") as file:
        return file.read()


class EveryDriver(unittest.TestCase):
    def setUp(self):
        self.drivers = re.findall(r"&(\w+)_driver,", read("drivers", "registry.c"))
        self.assertGreaterEqual(len(self.drivers), 4)

    def test_is_under_contract(self):
        programs = glob.glob(os.path.join(ROOT, "tests/drivers/test_*_contract.c"))
        programs += glob.glob(os.path.join(ROOT, "drivers/*/tests/test_*_contract.c"))
        texts = [read(path) for path in programs]
        for name in self.drivers:
            self.assertTrue(
                any(f".driver = &{name}_driver," in text and "contract_main(" in text
                    for text in texts),
                f"{name}: no test_{name}_contract.c runs the suite on it",
            )  # fmt: skip

    def test_is_in_the_docs(self):
        for name in self.drivers:
            self.assertIn(f"| `{name}` |", read("docs", "drivers.md"), name)

    def test_has_a_folder_of_its_name(self):
        folders = [x for x in os.listdir(os.path.join(ROOT, "drivers")) if x != "link"
                   and os.path.isdir(os.path.join(ROOT, "drivers", x))]  # fmt: skip
        self.assertEqual(sorted(self.drivers), sorted(folders))


if __name__ == "__main__":
    main()
