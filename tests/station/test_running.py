#!/usr/bin/env python3
"""test_running.py - starting and stopping: folders and sockets that are not as they should be,
options, and the end."""

import contextlib
import hashlib
import os
import pwd
import shutil
import signal
import sqlite3
import stat
import tempfile
import time
import unittest

from child import Child
from client import Closed, Refused
from daemon import SKINSPECD, STOP_S, Case, Daemon, main, new_uuid

NOBODY = 65534
ROOT_ONLY = unittest.skipUnless(os.getuid() == 0, "only root can become somebody else")


class Base(Case):
    instruments = None

    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="sk.", dir="/tmp")
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)

    def path(self, name):
        return os.path.join(self.folder, name)

    def refuses_to_start(self, *options, says, status=1, **more):
        """It ends by itself, with a message that names the cause; its log."""
        with Daemon(*options, wait=False, **more) as daemon:
            self.assertEqual(daemon.ends(10), status, daemon.log())
            log = daemon.log()
            for text in [says] if isinstance(says, str) else says:
                self.assertIn(text, log)
            self.assertIn("skinspecd", log.splitlines()[0])
            return log


class State(Base):
    def test_folder_missing(self):
        says = [self.path("none"), "make the folder", "choose another"]
        self.refuses_to_start(state=self.path("none"), says=says)
        self.assertFalse(os.path.exists(self.path("none")))

    def test_a_file_in_its_place(self):
        with open(self.path("file"), "w", encoding="ascii") as file:
            file.write("kept")
        self.refuses_to_start(state=self.path("file"), says=[self.path("file"), "choose a folder"])
        with open(self.path("file"), encoding="ascii") as file:
            self.assertEqual(file.read(), "kept")

    def store(self, *sql):
        """A folder with a station.db that this SQL made or altered; the folder, hash of the file."""
        state = self.path("state")
        os.makedirs(state, 0o700, exist_ok=True)
        with contextlib.closing(sqlite3.connect(os.path.join(state, "station.db"))) as db:
            for statement in sql:
                db.execute(statement)
            db.commit()
        return state, self.hash_of(state)

    @staticmethod
    def hash_of(state):
        with open(os.path.join(state, "station.db"), "rb") as file:
            return hashlib.sha256(file.read()).hexdigest()

    def test_foreign_store(self):
        state, before = self.store("CREATE TABLE photo(name TEXT)", "INSERT INTO photo VALUES('x')")
        log = self.refuses_to_start(state=state, says=["station.db", "foreign", "move it"])
        self.assertNotIn("version", log)  # a photo album has none
        self.assertNotIn("unplugged", log)
        self.assertEqual(self.hash_of(state), before)
        self.assertIn("station.db", os.listdir(state))

    def made(self):
        """A store with a record in it; its folder and the record."""
        state = self.path("state")
        os.mkdir(state, 0o700)
        with Daemon(state=state) as daemon, daemon.client() as c:
            lease = c.acquire()["lease"]
            c.calibrate(lease)
            return state, c.measure(lease)

    def test_newer_store(self):
        state, _ = self.made()
        _, before = self.store("PRAGMA user_version = 999")
        self.refuses_to_start(state=state, says=["station.db", "newer"])
        self.assertEqual(self.hash_of(state), before)

    def test_second_daemon_on_the_same_state(self):
        with Daemon() as first:
            log = self.refuses_to_start(state=first.state, says=first.state)
            self.assertTrue("in use" in log or "another" in log, log)
            with first.client() as c:
                self.assertEqual(c.call("status.get")["store"], "ok")

    def test_damaged_store(self):
        """Kept and moved aside; the service is there and says so, until told to begin anew."""
        state, record = self.made()
        path = os.path.join(state, "station.db")
        with open(path, "r+b") as file:
            file.seek(4096)
            file.write(b"\xa5" * 8192)
        damaged = self.hash_of(state)
        with Daemon(state=state) as daemon, daemon.client() as c:
            status = c.call("status.get")
            self.assertEqual(status["store"], "damaged")
            self.assertTrue(status["store_error"])
            kept = [
                x for x in os.listdir(state) if "station.db" in x and self.same(state, x, damaged)
            ]
            self.assertEqual(len(kept), 1, os.listdir(state))
            lease = c.acquire()["lease"]
            with self.refused("store_read_only"):
                c.call("subject.add", label="x")
            with self.refused("store_read_only"):
                c.calibrate(lease)
            station = c.call("store.begin_anew")["station_id"]
            self.assertNotEqual(station, c.hello.get("station_id"))
            c.calibrate(lease)
            self.assertGreater(c.measure(lease)["seq"], record["seq"])
            self.assertEqual(c.call("status.get")["store"], "ok")
            self.assertEqual(len([x for x in os.listdir(state) if self.same(state, x, damaged)]), 1)

    @staticmethod
    def same(state, name, digest):
        path = os.path.join(state, name)
        if not os.path.isfile(path):
            return False
        with open(path, "rb") as file:
            return hashlib.sha256(file.read()).hexdigest() == digest

    @ROOT_ONLY
    def test_read_only_state(self):
        """What is there can be read; nothing new is taken, and the error says why."""
        state, record = self.made()
        if not os.access(SKINSPECD, os.X_OK) or not self.nobody_may_run():
            self.skipTest("another account may not run the program where it is")
        for name in os.listdir(state):
            os.chmod(os.path.join(state, name), 0o444)
        os.chmod(state, 0o555)
        os.chmod(self.folder, 0o777)
        more = {"user": NOBODY, "group": NOBODY, "extra_groups": []}
        with Daemon(state=state, socket=self.path("s"), **more) as daemon, daemon.client() as c:
            status = c.call("status.get")
            self.assertEqual(status["store"], "read_only")
            self.assertTrue(status["store_error"])
            self.assertEqual(c.call("record.get", id=record["id"]), record)
            with self.refused("store_read_only"):
                c.call("subject.add", label="x")

    @staticmethod
    def nobody_may_run():
        with Child(lambda say: say(os.access(SKINSPECD, os.X_OK)), (NOBODY, [NOBODY])) as child:
            return child.heard()


class Sockets(Base):
    def test_mode(self):
        with Daemon() as daemon:
            mode = os.stat(daemon.socket).st_mode
            self.assertTrue(stat.S_ISSOCK(mode))
            self.assertEqual(stat.S_IMODE(mode), 0o600)
            daemon.stop()
            self.assertFalse(os.path.lexists(daemon.socket), "it goes with the daemon")

    def test_mode_whatever_the_umask(self):
        with Daemon(before=lambda: os.umask(0)) as daemon:
            self.assertEqual(stat.S_IMODE(os.stat(daemon.socket).st_mode), 0o600)
            for name in os.listdir(daemon.state):
                mode = os.stat(os.path.join(daemon.state, name)).st_mode
                self.assertFalse(stat.S_IMODE(mode) & 0o007, f"{name}: others may not read it")

    def test_path_too_long(self):
        """expect: sun_path of unix(7) holds 107 characters"""
        path = self.path("s" * (108 - len(self.path(""))))
        self.assertEqual(len(path), 108)
        self.refuses_to_start(socket=path, says=["108", "107"])
        with Daemon(socket=path[:-1]):
            pass

    def test_folder_missing(self):
        says = [self.path("none"), "make its folder", "--socket"]
        log = self.refuses_to_start(socket=self.path("none/s"), says=says)
        self.assertNotIn("unplugged", log)  # nothing was: it never began

    def test_taken_by_a_living_daemon(self):
        with Daemon() as first:
            self.refuses_to_start(socket=first.socket, says=first.socket)
            with first.client() as c:
                self.assertEqual(c.call("status.get")["clients"], 1)

    def test_no_socket_there(self):
        """Neither a file nor a folder nor a link is ever deleted."""
        with open(self.path("file"), "w", encoding="ascii") as file:
            file.write("kept")
        os.mkdir(self.path("folder"))
        os.symlink(self.path("file"), self.path("link"))
        for name in ("file", "folder", "link"):
            with self.subTest(name=name):
                before = os.lstat(self.path(name))
                self.refuses_to_start(socket=self.path(name), says=self.path(name))
                after = os.lstat(self.path(name))
                self.assertEqual((before.st_ino, before.st_size), (after.st_ino, after.st_size))

    def test_left_by_a_killed_daemon(self):
        with Daemon() as daemon:
            with daemon.client() as c:
                c.call("subject.add", label="kept")
            daemon.kill()
            self.assertTrue(os.path.exists(daemon.socket))
            daemon.start()
            with daemon.client() as c:
                self.assertEqual([s["label"] for s in c.call("subject.list")["subjects"]], ["kept"])

    def test_replaced_under_its_feet(self):
        """A name that is another's by now is left alone at the end."""
        with Daemon() as daemon:
            os.unlink(daemon.socket)
            with open(daemon.socket, "w", encoding="ascii") as file:
                file.write("another's")
            daemon.stop()
            with open(daemon.socket, encoding="ascii") as file:
                self.assertEqual(file.read(), "another's")

    def test_environment_names_it(self):
        for name, value in (("SKINSPEC_SOCKET", self.path("a")), ("XDG_RUNTIME_DIR", self.folder)):
            with self.subTest(name=name):
                expected = value if name == "SKINSPEC_SOCKET" else self.path("skinspec.sock")
                daemon = Daemon(wait=False, env={name: value}, socket=expected)
                daemon.kill()  # it was told by the option; now without
                with contextlib.suppress(FileNotFoundError):
                    os.unlink(expected)
                at = daemon.command.index("--socket")
                del daemon.command[at : at + 2]
                with daemon:
                    daemon.start()


class Options(Base):
    def test_missing_user(self):
        self.refuses_to_start("--user", "no-such-user", says="no-such-user")

    @ROOT_ONLY
    def test_becomes_another_user(self):
        """Then everything it makes is that user's."""
        os.chmod(self.folder, 0o755)
        os.mkdir(self.path("state"), 0o700)
        os.mkdir(self.path("run"), 0o755)
        for name in ("state", "run"):
            os.chown(self.path(name), NOBODY, NOBODY)
        with Daemon(
            "--user", "nobody", "--verbose", state=self.path("state"), socket=self.path("run/s")
        ) as daemon:
            with daemon.client() as c:
                self.assertEqual(c.call("status.get")["store"], "ok")
            self.assertEqual(os.stat(daemon.socket).st_uid, NOBODY)
            self.assertEqual(os.stat(self.path("state/station.db")).st_uid, NOBODY)
            with open(f"/proc/{daemon.process.pid}/status", encoding="ascii") as file:
                fields = dict(line.split(":", 1) for line in file)
            self.assertEqual(fields["Uid"].split(), [str(NOBODY)] * 4)
            self.assertNotIn("0", fields["Groups"].split(), "no group of root's is left")
            self.assertIn("session of", daemon.log(), "verbose")

    def test_is_that_user_already(self):
        with Daemon("--user", pwd.getpwuid(os.getuid()).pw_name) as daemon, daemon.client() as c:
            self.assertEqual(c.call("status.get")["store"], "ok")

    @ROOT_ONLY
    def test_cannot_become_another_user(self):
        if not State.nobody_may_run():
            self.skipTest("another account may not run the program where it is")
        more = {"user": NOBODY, "group": NOBODY, "extra_groups": []}
        self.refuses_to_start("--user", "root", says="cannot become 'root'", **more)

    def test_usage(self):
        """docs: status 2"""
        for options, says in (
            (("--no-such-option",), "no-such-option"),
            (("--max-clients", "0"), "max-clients"),
            (("--max-clients", "many"), "max-clients"),
            (("--calibration-policy", "sometimes"), "calibration-policy"),
            (("--instrument", "no_such_driver"), "no_such_driver"),
            (("a-word",), "a-word"),
        ):
            with self.subTest(options=options):
                self.refuses_to_start(*options, says=says, status=2)


class Ending(Base):
    def test_idle(self):
        for number in (signal.SIGTERM, signal.SIGINT):
            with Daemon() as daemon, daemon.client() as c:
                daemon.process.send_signal(number)
                self.assertEqual(daemon.ends(2), 0, daemon.log())
                self.assertTrue(c.is_closed(2))

    def test_at_once_after_the_start(self):
        with Daemon() as daemon:
            daemon.stop()

    def test_while_measuring(self):
        slow = "simulated:shot_ms=60000,charge_ms=0,calibrate_ms=0"
        with Daemon(instruments=(slow,)) as daemon, daemon.client() as c:
            c.call("events.subscribe", topics=["measurement"])
            daemon.wait_for_instrument()
            lease = c.acquire()["lease"]
            c.calibrate(lease)
            uuid = new_uuid()
            asked = c.send(
                "measure.start", lease=lease, uuid=uuid, specular="sce", replicates=1, pace="auto"
            )
            c.event("measurement", "started")
            daemon.stop()
            with self.assertRaises((Refused, Closed)) as caught:
                c.wait(asked, 2)
            if isinstance(caught.exception, Refused):
                self.assertIn(caught.exception.reason, ("shutting_down", "measurement_cancelled"))
            daemon.start()
            with daemon.client() as again:
                self.assertEqual(again.call("record.list")["records"], [])

    def test_told_twice(self):
        """The second signal changes nothing: what is acknowledged is finished within the same time."""
        slow = "simulated:shot_ms=60000,charge_ms=0,calibrate_ms=0"
        with Daemon(instruments=(slow,)) as daemon, daemon.client() as c:
            for _ in range(3):
                daemon.process.send_signal(signal.SIGTERM)
            self.assertEqual(daemon.ends(STOP_S), 0, daemon.log())
            self.assertTrue(c.is_closed(2))

    def test_with_a_client_that_does_not_read(self):
        """It is not waited for longer than the second that the end may take."""
        with Daemon() as daemon, daemon.client() as c:
            for _ in range(40):
                c.send("rpc.describe")
            time.sleep(0.5)
            begun = time.monotonic()
            daemon.process.send_signal(signal.SIGTERM)
            self.assertEqual(daemon.ends(STOP_S), 0, daemon.log())
            self.assertGreater(time.monotonic() - begun, 0.9, "it had time to read")

    def test_with_work_in_hand(self):
        """What was answered is there after the next start."""
        with Daemon() as daemon:
            daemon.wait_for_table()
            with daemon.client() as c:
                asked = [c.send("subject.add", label=f"s{i}") for i in range(40)]
                daemon.stop()
                acknowledged = set()
                for request in asked:
                    with contextlib.suppress(Refused, Closed):
                        acknowledged.add(c.wait(request, 2)["id"])
            daemon.start()
            with daemon.client() as c:
                kept = {s["id"] for s in c.call("subject.list", limit=1000)["subjects"]}
            self.assertLessEqual(acknowledged, kept)

    def test_ignores_sighup_and_sigpipe(self):
        """A log that nobody reads, a terminal that goes: the daemon stays."""
        with Daemon() as daemon:
            daemon.process.send_signal(signal.SIGPIPE)
            time.sleep(0.2)
            with daemon.client() as c:
                self.assertEqual(c.call("status.get")["store"], "ok")


if __name__ == "__main__":
    main()
