#!/usr/bin/env python3
"""test_daemon_store.py - a store that cannot be written for a time, that is damaged or gone:
what the station says, and that it goes on where it can."""

import contextlib
import os
import resource
import shutil
import sqlite3
import tempfile
import time
import unittest

from child import Child
from client import Refused
from daemon import SKINSPECD, Case, Daemon, main, wait_for

NOBODY = 65534
ROOT_ONLY = unittest.skipUnless(os.getuid() == 0, "only root can become somebody else")
WITHIN_S = 15  # it is tried every 5 s
PAGE = 4096
PRUNED_SQL = """
UPDATE client_uuid SET at_ms = 0;
CREATE TEMP TABLE copy AS SELECT * FROM measurement;
UPDATE copy SET seq = seq + 1000, id = '00000000-0000-7000-8000-000000000000';
INSERT INTO measurement SELECT * FROM copy;
"""


class Base(Case):
    instruments = None

    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="sk.", dir="/tmp")
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)

    def start(self, *options, **more):
        """A daemon, and a client of it."""
        self.daemon = self.enterContext(Daemon(*options, **more))
        self.file = os.path.join(self.daemon.state, "station.db")
        return self.client()

    def sql(self):
        """A connection of another program."""
        return self.enterContext(contextlib.closing(sqlite3.connect(self.file, timeout=0)))

    @staticmethod
    def stands(c, state):
        """Wait for a state of the store; what is said of it."""

        def look():
            status = c.call("status.get")
            return status if status["store"] == state else None

        return wait_for("the store is " + state, look, WITHIN_S).get("store_error", "")

    @staticmethod
    def metric(c, name):
        return next(m["value"] for m in c.call("metrics.get")["metrics"] if m["name"] == name)

    @staticmethod
    def measured(c):
        def is_open():
            return c.call("instrument.list")["instruments"][0]["state"] != "opening"

        wait_for("the instrument is open", is_open)
        lease = c.acquire(wait=True)["lease"]
        c.calibrate(lease)
        return c.measure(lease)


class ForATime(Base):
    def test_locked_by_another_program(self):
        c, other = self.start(), self.sql()
        other.execute("BEGIN IMMEDIATE")
        with self.assertRaises(Refused):
            c.call("subject.add", label="x")
        self.assertIn("tried again", self.stands(c, "read_only"))
        other.rollback()
        self.assertEqual(self.stands(c, "ok"), "")
        c.call("subject.add", label="x")

    def test_no_room_at_the_start(self):
        """A limit on the size of files, which is lifted from outside."""
        _, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
        c = self.start(before=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (1024, hard)))
        self.assertNotIn(c.call("status.get")["store"], ("ok", "damaged"))
        resource.prlimit(self.daemon.process.pid, resource.RLIMIT_FSIZE, (hard, hard))
        self.stands(c, "ok")
        c.call("subject.add", label="x")
        self.assertIn("station_id", c.call("status.get"))

    @ROOT_ONLY
    def test_folder_made_writable(self):
        with Child(lambda say: say(os.access(SKINSPECD, os.X_OK)), (NOBODY, [NOBODY])) as child:
            if not child.heard():
                self.skipTest("another account may not run the program where it is")
        state = os.path.join(self.folder, "state")
        os.mkdir(state, 0o555)
        os.chmod(self.folder, 0o777)
        more = {"user": NOBODY, "group": NOBODY, "extra_groups": []}
        c = self.start(state=state, socket=os.path.join(self.folder, "s"), **more)
        self.assertIn("make it writable", self.stands(c, "read_only"))
        os.chown(state, NOBODY, NOBODY)
        os.chmod(state, 0o700)
        self.stands(c, "ok")
        c.call("subject.add", label="x")

    def test_wal_above_a_small_limit(self):
        """Jobs of any kind count, and the file is cut when the reader has gone."""
        c, other = self.start("--wal-limit", "1"), self.sql()
        other.execute("BEGIN")
        other.execute("SELECT count(*) FROM subject").fetchall()
        for _ in range(80):
            c.call("subject.add", label="x", person={"notes": "y" * 4000})
        self.assertGreater(os.path.getsize(self.file + "-wal"), 1 << 20)
        self.assertIn("1 MB", self.stands(c, "full"))
        with self.refused("store_full"):
            c.call("subject.add", label="x")
        other.rollback()
        self.stands(c, "ok")
        self.assertLess(os.path.getsize(self.file + "-wal"), 1 << 20)
        c.call("subject.add", label="x")


class Gone(Base):
    def test_deleted(self):
        """Nothing is made in its place, and the WAL that is left is kept."""
        c = self.start()
        c.call("subject.add", label="x")
        os.unlink(self.file)
        with self.assertRaises(Refused):
            c.call("subject.add", label="x")
        wait_for("it says so", lambda: "restart" in c.call("status.get")["store_error"], WITHIN_S)
        for _ in range(2):
            with self.refused("store_read_only"):
                c.call("store.begin_anew")
        self.assertFalse(os.path.exists(self.file))
        self.assertEqual(c.call("status.get")["store"], "read_only")
        self.daemon.stop()
        self.assertFalse(os.path.exists(self.file))
        self.assertGreater(os.path.getsize(self.file + "-wal"), 0)


class Damage(Base):
    def spoilt(self):
        """A station whose file is damaged while it runs, by a reading found out; the bytes
        before, a client, the record."""
        c = self.start()
        record = self.measured(c)
        self.daemon.restart()
        c = self.client()
        wait_for("the newest is known", lambda: c.call("status.get")["last_seq"] == record["seq"])
        with open(self.file, "rb") as file:
            before = file.read()
        with open(self.file, "r+b") as file:
            file.seek(PAGE)
            file.write(b"\xa5" * (len(before) - PAGE))
        with self.assertRaises(Refused):
            c.call("record.get", id=record["id"])
        text = self.stands(c, "damaged")
        self.assertNotIn("was moved aside", text)
        self.assertEqual([x for x in os.listdir(self.daemon.state) if "damaged" in x], [])
        with self.refused("store_read_only"):
            c.call("subject.add", label="x")
        return before, c, record

    def test_met_by_a_reader(self):
        _, c, record = self.spoilt()
        self.assertEqual(c.call("status.get")["last_seq"], record["seq"])
        c.call("store.begin_anew")
        status = c.call("status.get")
        self.assertEqual((status["store"], status["last_seq"]), ("ok", 0))
        kept = [x for x in os.listdir(self.daemon.state) if ".damaged-" in x and x.endswith("Z")]
        self.assertEqual(len(kept), 1, os.listdir(self.daemon.state))
        for step in c.call("instrument.list")["instruments"][0]["calibration"]:
            self.assertTrue(step["due"])
        self.measured(c)

    def test_found_sound(self):
        """What was put right by hand is taken as it is."""
        before, c, record = self.spoilt()
        with open(self.file, "r+b") as file:
            file.write(before)
        with self.refused("store_not_damaged"):
            c.call("store.begin_anew")
        self.assertEqual(c.call("status.get")["store"], "ok")
        c.call("subject.add", label="x")
        self.assertEqual(c.call("record.get", id=record["id"]), record)


class Unsound(Base):
    """Found by store.verify alone: the file can be read and written."""

    def test_a_row_that_was_changed(self):
        c = self.start()
        record = self.measured(c)
        self.assertNotIn("store_sound", c.call("status.get"))
        watcher = self.client()
        watcher.call("events.subscribe", topics=["store"])
        self.assertTrue(c.call("store.verify")["sound"])
        self.assertEqual(watcher.event("store", "verified")["data"], {"sound": True})
        self.assertTrue(c.call("status.get")["store_sound"])
        with contextlib.closing(sqlite3.connect(self.file)) as db:
            db.executescript("DROP TRIGGER measurement_fixed; UPDATE measurement SET ITA = 0;")
        self.assertIn(record["id"], c.call("store.verify")["what"])
        self.assertEqual(watcher.event("store", "verified")["data"], {"sound": False})
        status = c.call("status.get")
        self.assertEqual((status["store"], status["store_sound"]), ("ok", False))
        self.daemon.restart()
        self.assertNotIn("store_sound", self.client().call("status.get"))


class Fences(Base):
    """docs: the number of a lease never comes again in a state folder, stored or not."""

    def takes(self, c):
        """The fence of a lease under which nothing is stored."""
        self.daemon.wait_for_instrument()
        taken = c.acquire()
        c.call("instrument.release", lease=taken["lease"])
        return taken["fence"]

    def test_after_a_kill(self):
        fences = [self.takes(self.start())]
        for _ in range(2):
            self.daemon.kill()
            self.daemon.start()
            fences.append(self.takes(self.client()))
        self.assertEqual(sorted(set(fences)), fences)

    def test_after_a_new_beginning(self):
        c = self.start()
        before = self.takes(c)
        self.daemon.stop()
        with open(self.file, "r+b") as file:
            file.seek(PAGE)
            file.write(b"\xa5" * 2 * PAGE)
        self.daemon.start()
        c = self.client()
        damaged = self.takes(c)
        self.assertEqual(c.call("status.get")["store"], "damaged")
        c.call("store.begin_anew")
        anew = self.takes(c)
        self.daemon.restart()
        after = self.takes(self.client())
        self.assertEqual(sorted({before, damaged, anew, after}), [before, damaged, anew, after])

    def test_above_the_records_of_an_older_program(self):
        """Which kept no number of its own."""
        c = self.start()
        record = self.measured(c)
        self.daemon.stop()
        os.truncate(os.path.join(self.daemon.state, "lock"), 0)
        self.daemon.start()
        self.assertGreater(self.takes(self.client()), record["fence"])

    @ROOT_ONLY
    def test_a_folder_that_cannot_be_written(self):
        """Nothing is stored; what is there is shown, and leases go on above it."""
        c = self.start()
        record, hello = self.measured(c), c.hello
        self.daemon.stop()
        with Child(lambda say: say(os.access(SKINSPECD, os.X_OK)), (NOBODY, [NOBODY])) as child:
            if not child.heard():
                self.skipTest("another account may not run the program where it is")
        state = os.path.join(self.folder, "state")
        os.mkdir(state)
        shutil.copy(self.file, state)
        os.chmod(os.path.join(state, "station.db"), 0o444)
        os.chmod(state, 0o555)
        os.chmod(self.folder, 0o777)
        more = {"user": NOBODY, "group": NOBODY, "extra_groups": []}
        c = self.start(state=state, socket=os.path.join(self.folder, "s"), **more)
        wait_for("it is read", lambda: c.call("status.get")["last_seq"] == record["seq"])
        status = c.call("status.get")
        self.assertEqual(status["store"], "read_only")
        self.assertEqual(status["station_id"], hello["station_id"])
        self.assertGreater(self.takes(c), record["fence"])


class Upkeep(Base):
    def test_after_the_start(self):
        """Old uuids go soon, not a day later; what the station does by itself is no job."""
        c = self.start()
        self.measured(c)
        self.daemon.stop()
        with contextlib.closing(sqlite3.connect(self.file)) as db:
            db.executescript(PRUNED_SQL)
        self.daemon.start()
        c, other = self.client(), self.sql()
        before = self.metric(c, "store_jobs"), self.metric(c, "store_commits")
        wait_for(
            "the uuid is dropped",
            lambda: other.execute("SELECT count(*) FROM client_uuid").fetchone() == (0,),
            WITHIN_S,
        )
        time.sleep(0.1)
        self.assertEqual((self.metric(c, "store_jobs"), self.metric(c, "store_commits")), before)


if __name__ == "__main__":
    main()
