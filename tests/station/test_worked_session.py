#!/usr/bin/env python3
"""test_worked_session.py - the session that docs/protocol.md shows, played line by line.

What stands behind `<` is compared with what the station says, member by member: all of it, but
where a text or an object is cut short with `...`, and what is another in each run. Numbers are those
of any machine to 1e-10 of themselves.
"""

import json
import math
import os
import re

from daemon import Case, main
from support import ROOT

NUMBERS_OF_A_RUN = {"connection", "event_seq", "uptime_s"}


def lines_of_page():
    """(mark, line) of the section "A session"."""
    with open(os.path.join(ROOT, "docs", "protocol.md"), encoding="utf-8") as file:
        section = file.read().split("## A session", 1)[1].split("\n## ", 1)[0]
    return re.findall(r"^([<>]) (\{.*\})$", section, re.M)


def shown(line):
    """The message of a documented line; an object that is cut short has a member "..."."""
    return json.loads(line.replace(",...}", ',"...":true}'))


def differences(expected, got, path=""):
    if isinstance(expected, dict) and isinstance(got, dict):
        members = expected.keys() - {"..."}
        if members != got.keys() and ("..." not in expected or not members <= got.keys()):
            yield f"{path}: {sorted(members)} shown, {sorted(got)} said"
        for name in members & got.keys():
            if name not in NUMBERS_OF_A_RUN:
                yield from differences(expected[name], got[name], f"{path}.{name}")
            elif not isinstance(got[name], (int, float)):
                yield f"{path}.{name}: {got[name]!r} is no number"
    elif isinstance(expected, str) and expected.endswith("..."):
        if not isinstance(got, str):
            yield f"{path}: {got!r} is no text"
    elif isinstance(expected, float) and isinstance(got, (int, float)):
        if not math.isclose(expected, got, rel_tol=1e-10):
            yield f"{path}: {expected!r} shown, {got!r} said"
    elif isinstance(expected, list) and isinstance(got, list) and len(expected) == len(got):
        for i, (x, y) in enumerate(zip(expected, got)):
            yield from differences(x, y, f"{path}[{i}]")
    elif expected != got:
        yield f"{path}: {expected!r} shown, {got!r} said"


class WorkedSession(Case):
    def test_as_the_page_shows_it(self):
        lines = lines_of_page()
        self.assertEqual(lines[0][0], "<", "the station speaks first")
        c = self.enterContext(self.daemon.connect(hello=False))
        shows = [following[0] == "<" for following in lines[1:]] + [False]
        lease, played = "LEASE", 0
        for (mark, line), reply_is_shown in zip(lines, shows):
            with self.subTest(line=line[:80]):
                if mark == "<":
                    self.assertEqual(list(differences(shown(line), c.next_message())), [])
                    continue
                c.send_line(line.replace("LEASE", lease))
                played += 1
                if not reply_is_shown:
                    reply = c.next_message()
                    self.assertEqual(reply["id"], json.loads(line)["id"])
                    self.assertIn("result", reply)
                    lease = reply["result"].get("lease", lease)
        self.assertGreater(played, 8)

    def test_a_difference_is_seen(self):
        """The comparison itself: what it passes over, and nothing else."""
        line = '{"a":"3e1f...","event_seq":6,"c":{"d":1,...},"x":[0.5,2]}'
        said = {"a": "3e1f5b6d", "event_seq": 9, "c": {"d": 1, "e": 2}, "x": [0.5 + 1e-12, 2]}
        self.assertEqual(list(differences(shown(line), said)), [])
        for change in ({"a": 1}, {"c": {"e": 2}}, {"c": {"d": 2}}, {"more": 1}, {"event_seq": "9"},
                       {"x": [0.5 + 1e-9, 2]}, {"x": [0.5]}):
            self.assertEqual(len(list(differences(shown(line), {**said, **change}))), 1, change)


if __name__ == "__main__":
    main()
