#!/usr/bin/env python3
"""test_every_driver.py - what each driver of the registry has to have beside its code: the contract suite run on it, a row
in docs/drivers.md, and a udev rule for each of its USB numbers."""

import glob
import os
import re
import subprocess
import sys
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tests", "cli"))

from support import BUILD, main  # noqa: E402


def read(*path):
    with open(os.path.join(ROOT, *path), encoding="utf-8") as file:
        return file.read()


class EveryDriver(unittest.TestCase):
    def setUp(self):
        self.drivers = re.findall(r"^ +DRIVER\((\w+)\)", read("drivers", "registry.c"), re.MULTILINE)
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

    def test_may_open_what_it_finds(self):
        """`skinspecd --drivers` tells `NAME VID:PID BUS, ...`; * is any product."""
        done = subprocess.run([os.path.join(BUILD, "skinspecd"), "--drivers"], stdout=subprocess.PIPE,
                              text=True, timeout=20, check=True)  # fmt: skip
        told = {line.split()[0]: line for line in done.stdout.splitlines()}
        self.assertEqual(sorted(told), sorted(self.drivers))
        rules = set()
        for rule in read("systemd", "60-skinspec.rules").splitlines():
            vid = re.search(r'ATTRS\{idVendor\}=="(\w+)"', rule)
            pid = re.search(r'ATTRS\{idProduct\}=="([\w|]+)"', rule)
            name = re.search(r'ENV\{SKINSPEC_INSTRUMENT\}="(\w+)"', rule)
            if vid and name:
                rules |= {(name[1], vid[1], x) for x in (pid[1].split("|") if pid else ["*"])}
        matches = {(name, *x) for name, line in told.items()
                   for x in re.findall(r"\b([0-9a-f]{4}):([0-9a-f]{4}|\*)", line)}  # fmt: skip
        self.assertGreaterEqual(len(matches), 5)
        self.assertEqual(matches, rules, "USB numbers of the drivers, and of 60-skinspec.rules")

    def test_has_a_folder_of_its_name(self):
        folders = [x for x in os.listdir(os.path.join(ROOT, "drivers")) if x != "link"
                   and os.path.isdir(os.path.join(ROOT, "drivers", x))]  # fmt: skip
        self.assertEqual(sorted(self.drivers), sorted(folders))


if __name__ == "__main__":
    main()
