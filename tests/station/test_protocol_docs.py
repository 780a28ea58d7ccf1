#!/usr/bin/env python3
"""test_protocol_docs.py - docs/protocol.md is what the description makes, and complete."""

import json
import os
import re
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tests", "cli"))

import unittest  # noqa: E402

from support import main  # noqa: E402


def described(schema, path):
    """Every member without a description, by its path."""
    for name, member in schema.get("properties", {}).items():
        here = f"{path}.{name}"
        if "description" not in member and "$ref" not in member:
            yield here
        yield from described(member, here)
        yield from described(member.get("items", {}), here)


class ProtocolDocs(unittest.TestCase):
    def setUp(self):
        with open(os.path.join(ROOT, "src", "station", "protocol.schema.json"), encoding="ascii") as file:
            self.doc = json.load(file)

    def test_page_is_up_to_date(self):
        made = subprocess.run(
            [os.path.join(ROOT, "tools", "protocol-docs")], capture_output=True, text=True, check=True
        ).stdout
        with open(os.path.join(ROOT, "docs", "protocol.md"), encoding="utf-8") as file:
            self.assertEqual(file.read(), made, "run `make docs`")

    def test_every_member_is_described(self):
        lacking = []
        for name, m in self.doc["methods"].items():
            lacking += [*described(m["params"], name), *described(m["result"], name)]
        for name, schema in self.doc["$defs"].items():
            lacking += described(schema, name)
            if "description" not in schema:
                lacking.append(name)
        for topic in self.doc["events"].values():
            for name, event in topic.items():
                lacking += described(event["data"], name)
        self.assertEqual(lacking, [])

    def test_optional_members_of_what_we_send_say_when(self):
        lacking = []

        def look(schema, path):
            for name, member in schema.get("properties", {}).items():
                if name not in schema.get("required", []) and "when" not in member:
                    lacking.append(f"{path}.{name}")
                look(member, f"{path}.{name}")
                look(member.get("items", {}), f"{path}.{name}")

        for name, m in self.doc["methods"].items():
            look(m["result"], name)
        for name, schema in self.doc["$defs"].items():
            look(schema, name)
        self.assertEqual(lacking, [])

    def test_errors_are_listed(self):
        for name, m in self.doc["methods"].items():
            for reason in m["errors"]:
                self.assertIn(reason, self.doc["errors"], name)
            self.assertEqual(len(set(m["errors"])), len(m["errors"]), name)

    def test_what_needs_a_lease_carries_it(self):
        for name, m in self.doc["methods"].items():
            self.assertEqual(m["lease"], "lease" in m["params"].get("required", []), name)

    def test_what_an_instrument_says_is_listed(self):
        """What bench.c makes of a driver's errors, for all methods that ask the instrument."""
        with open(os.path.join(ROOT, "src", "station", "bench.c"), encoding="utf-8") as file:
            reasons = re.findall(r"\[DRIVER_\w+\] = REASON_(INSTRUMENT_\w+)", file.read())
        self.assertGreater(len(reasons), 5)
        for name in ("instrument.configure", "instrument.calibrate", "measure.start",
                     "check.take", "check.set"):  # fmt: skip
            for reason in reasons:
                self.assertIn(reason.lower(), self.doc["methods"][name]["errors"], name)

    def test_what_a_write_may_meet_is_listed(self):
        for name in ("instrument.calibrate", "measure.start", "check.take", "check.set",
                     "match.spectrum", "subject.add", "subject.forget", "store.begin_anew"):  # fmt: skip
            for reason in ("store_read_only", "store_full", "store_failed"):
                self.assertIn(reason, self.doc["methods"][name]["errors"], name)

    def test_who_waits_for_a_table_is_not_told_that_it_loads(self):
        """Only record.recompute, which wants one table of all there were, does not wait."""
        told = [name for name, m in self.doc["methods"].items() if "table_loading" in m["errors"]]
        self.assertEqual(told, ["record.recompute"])


if __name__ == "__main__":
    main()
