#!/usr/bin/env python3
"""test_kill.py - the short form of tests/soak/kill.py, and whether its look at station.db sees
what would be wrong.

    SKINSPEC_KILLS   how often (50; under sanitizers 12)
    SKINSPEC_SEED    of what is by chance (1)
"""

import contextlib
import os
import shutil
import sqlite3
import sys
import tempfile

_TESTS = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, os.path.join(_TESTS, "soak"))

import station_file  # noqa: E402
from daemon import INSTRUMENTED, Case, main  # noqa: E402
from kill import Killing  # noqa: E402

KILLS = int(os.environ.get("SKINSPEC_KILLS", 12 if INSTRUMENTED else 50))
SEED = int(os.environ.get("SKINSPEC_SEED", 1))


class Kill(Case):
    instruments = None

    def test_what_was_acknowledged_is_there_once(self):
        killing = Killing(SEED)
        print(killing.run(KILLS))
        later = KILLS - killing.moments["start"]
        self.assertGreater(killing.with_records, later // 3, "kills came too early to tell")
        self.assertGreater(len(killing.ledger.records), KILLS)


# Without the triggers, as somebody with a hex editor.
TAMPERED = (
    ("a record is gone", "DELETE FROM measurement WHERE seq = 2", "seq has gaps"),
    ("the last one is gone", "DELETE FROM measurement WHERE seq = 3", "1 of 3 acknowledged"),
    ("a value", "UPDATE measurement SET L = L + 1e-9 WHERE seq = 1", "seq 1: L are not as told"),
    ("a match", "UPDATE match SET result = '{}' WHERE measurement = 1", "seq 1: result"),
    ("a match is gone", "DELETE FROM match WHERE measurement = 1", "seq 1: result"),
    ("a second one of a uuid", "UPDATE measurement SET uuid = (SELECT uuid FROM measurement "
     "WHERE seq = 1) WHERE seq = 2", "1 uuids are there twice"),
    ("ids out of order", "UPDATE measurement SET id = 'f' || substr(id, 2) WHERE seq = 1",
     "ids do not rise"),
    ("a fence twice", "UPDATE measurement SET operator = 'x', fence = 1 WHERE seq = 2",
     "were given twice"),
    ("a calibration", "DELETE FROM calibration WHERE step = 'zero'", "calibrations are missing"),
    ("a subject", "DELETE FROM subject", "is missing"),
    ("a person", "DELETE FROM subject_person", "the person of subject"),
    ("an audit row", "DELETE FROM audit WHERE id = 3", "audit_chain.py: wrong"),
    ("a reference", "UPDATE measurement SET site = 99", "foreign_key_check"),
)  # fmt: skip


class Look(Case):
    """station_file.check() on a store of three records that somebody has altered."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.ledger = station_file.Ledger()
        with cls.daemon.client(operator="Ada") as c:
            subject = c.call("subject.add", person={"name": "Person-" + "0" * 32})["id"]
            cls.ledger.subjects[subject] = True
            lease = c.acquire()["lease"]
            for step in ("zero", "white"):
                done = c.call("instrument.calibrate", lease=lease, step=step)
                cls.ledger.calibrations.add(done["calibration_id"])
            for _ in range(3):
                cls.record = c.measure(lease, subject=subject)
                cls.ledger.record(cls.record)

    def altered(self, sql):
        """A copy of the state folder on which this SQL was run."""
        state = tempfile.mkdtemp(prefix="sk.", dir="/tmp")
        self.addCleanup(shutil.rmtree, state)
        for name in ("station.db", "station.db-wal"):
            shutil.copy(os.path.join(self.daemon.state, name), state)
        with contextlib.closing(sqlite3.connect(os.path.join(state, "station.db"))) as db:
            triggers = db.execute("SELECT name FROM sqlite_schema WHERE type = 'trigger'")
            for (trigger,) in triggers.fetchall():
                db.execute(f"DROP TRIGGER {trigger}")
            db.executescript(sql)
        return state

    def test_sound(self):
        self.assertEqual(station_file.check(self.altered(""), self.ledger)[0], 3)

    def test_altered(self):
        for what, sql, says in TAMPERED:
            with self.subTest(what=what):
                with self.assertRaises(AssertionError) as caught:
                    station_file.check(self.altered(sql), self.ledger)
                self.assertIn(says, str(caught.exception))

    def disagrees(self, says, **more):
        """A ledger with this in it does not agree with the file."""
        ledger = station_file.Ledger()
        vars(ledger).update(more)
        with self.assertRaises(AssertionError) as caught:
            station_file.check(self.altered(""), ledger)
        self.assertIn(says, str(caught.exception))

    def test_what_must_not_be_there(self):
        self.disagrees("1 names that were erased", erased={"Person-" + "0" * 32})
        self.disagrees("1 cancelled measurements were stored", cancelled={self.record["uuid"]})

    def told_without_a_match(self, sql):
        """What is wrong, where the last record was told without a match."""
        ledger = station_file.Ledger()
        ledger.record({name: value for name, value in self.record.items() if name != "match"})
        with self.assertRaises(AssertionError) as caught:
            station_file.check(self.altered(sql), ledger)
        self.assertIn("made without a match: ['20", str(caught.exception))
        return str(caught.exception)

    def test_told_without_a_match(self):
        """Whether that may be is not the ledger's to say; the file must agree."""
        self.assertIn("seq 3: result are not as told", self.told_without_a_match(""))
        sql = "DELETE FROM match WHERE measurement = 3"
        self.assertNotIn("as told", self.told_without_a_match(sql))

    def test_told_otherwise(self):
        """The same uuid, another answer."""
        self.ledger.record(self.record)
        with self.assertRaises(AssertionError):
            self.ledger.record({**self.record, "seq": self.record["seq"] + 1})


if __name__ == "__main__":
    main()
