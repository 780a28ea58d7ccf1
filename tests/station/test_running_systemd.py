#!/usr/bin/env python3
"""test_running_systemd.py - the daemon as a service: systemd's side of the bargain, who may do
what, and what it costs while nobody wants anything."""

import grp
import os
import shutil
import socket
import stat
import sys
import tempfile
import time
import unittest

from child import Child
from client import Client, Refused
from daemon import INSTRUMENTED, Case, Daemon, main, new_uuid

NOBODY = 65534

# Hands over a listening socket as systemd does: as descriptor 3, to the process of this number.
LAUNCHER = """
import os, sys
os.dup2(int(sys.argv[1]), 3)
os.environ.update(LISTEN_FDS="1", LISTEN_PID=str(os.getpid()))
os.execv(sys.argv[2], sys.argv[2:])
"""


class Activated(Daemon):
    """A daemon whose socket is there before it is, and stays."""

    def __init__(self, *options, mode=0o600, **more):
        self.mode, self.listening = mode, None
        super().__init__(*options, **more)

    def start(self, wait=True):
        if self.listening is None:
            self.listening = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
            self.listening.bind(self.socket)
            os.chmod(self.socket, self.mode)
            self.listening.listen(16)
            fd = self.listening.fileno()
            self.more["pass_fds"] = (fd,)
            command = [self.socket + ".not-used" if x == self.socket else x for x in self.command]
            self.command = [sys.executable, "-c", LAUNCHER, str(fd), *command]
        super().start(wait)

    def remove(self):
        self.listening.close()
        super().remove()


class Systemd(Case):
    instruments = None

    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="sk.", dir="/tmp")
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)

    def test_socket_activation(self):
        with Activated(mode=0o666) as daemon:
            with daemon.client() as c:
                self.assertEqual(c.call("status.get")["store"], "ok")
            self.assertEqual(
                stat.S_IMODE(os.stat(daemon.socket).st_mode), 0o666, "as it was handed over"
            )
            self.assertFalse(os.path.exists(daemon.socket + ".not-used"))
            daemon.stop()
            self.assertTrue(os.path.exists(daemon.socket), "systemd's, not ours to remove")

    def test_nobody_is_refused_while_it_restarts(self):
        """Those who come meanwhile are served afterwards."""
        with Activated() as daemon:
            daemon.stop()
            early = [self.enterContext(Client(daemon.socket, hello=False)) for _ in range(5)]
            daemon.start()
            for c in early:
                self.assertEqual(c.next_message()["method"], "hello")
                self.assertTrue(c.open())

    def notified(self, notify, until):
        """What has been told to systemd, until a message has this in it."""
        heard = ""
        while until not in heard:
            heard += notify.recv(4096).decode() + "\n"
        return heard

    def test_ready_watchdog_stopping(self):
        notify = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.addCleanup(notify.close)
        notify.settimeout(10)
        notify.bind(os.path.join(self.folder, "notify"))
        env = {"NOTIFY_SOCKET": os.path.join(self.folder, "notify"), "WATCHDOG_USEC": "1000000"}
        with Daemon(env=env, wait=False) as daemon:
            self.notified(notify, "READY=1")
            with daemon.client():  # ready means that the socket answers
                pass
            begun = time.monotonic()
            for _ in range(3):
                self.notified(notify, "WATCHDOG=1")
            self.assertLess(time.monotonic() - begun, 3, "at least once a second")
            daemon.stop()
            self.notified(notify, "STOPPING=1")


@unittest.skipUnless(os.getuid() == 0, "only root can become somebody else")
class Rights(Case):
    """Groups that every Debian has stand in for skinspec's own."""

    GROUPS = {"kiosk": "games", "clinic": "audio", "admin": "video"}

    @classmethod
    def setUpClass(cls):
        gids = {right: grp.getgrnam(name).gr_gid for right, name in cls.GROUPS.items()}
        cls.gids = {**gids, "nobody": NOBODY}
        options = [x for right, name in cls.GROUPS.items() for x in (f"--{right}-group", name)]
        cls.daemon = cls.enterClassContext(Activated(*options, mode=0o666))
        os.chmod(cls.daemon.folder, 0o755)
        cls.daemon.wait_for_table()
        with cls.daemon.client() as c:
            lease = c.acquire()["lease"]
            c.calibrate(lease)
            cls.record = c.measure(lease)

    def as_member(self, right, *calls, supplementary=True):
        """In a process of another user in that group: what session.open says, then for each call
        (method, params) "ok" or the reason it was refused for."""

        def run(say):
            try:
                with self.daemon.connect() as c:
                    say(c.open()["right"])
                    for method, params in calls:
                        try:
                            c.call(method, **params)
                            say("ok")
                        except Refused as refused:
                            say(refused.reason)
            except Refused as refused:
                say(refused.reason)

        gids = [NOBODY, self.gids[right]] if supplementary else [self.gids[right]]
        with Child(run, (NOBODY, gids)) as child:
            opened = child.heard()
            return opened, [child.heard() for _ in calls] if opened != "right_needed" else []

    def test_right_by_group(self):
        for right in self.GROUPS:
            for supplementary in (True, False):
                with self.subTest(right=right, supplementary=supplementary):
                    self.assertEqual(
                        self.as_member(right, supplementary=supplementary), (right, [])
                    )

    def test_a_stranger_is_refused(self):
        self.assertEqual(self.as_member("nobody"), ("right_needed", []))

    def test_what_each_may_do(self):
        subject = {"label": "of a test"}
        grey = {"first_nm": 400, "step_nm": 10, "values": [0.5] * 31}
        tile = {"uuid": new_uuid(), "tile": "grey", "spectrum": grey, "specular": "sce"}
        calls = [
            ("status.get", {}, "kiosk"),
            ("record.list", {}, "kiosk"),
            ("check.list", {}, "kiosk"),
            ("check.set", {**tile, "aperture_mm": 8}, "clinic"),
            ("subject.add", subject, "clinic"),
            ("subject.list", {}, "clinic"),
            ("record.export", {"format": "csv"}, "clinic"),
            ("record.get", {"id": self.record["id"]}, "clinic"),
            ("store.verify", {}, "admin"),
        ]
        order = ["kiosk", "clinic", "admin"]
        for right in order:
            _, got = self.as_member(right, *((method, params) for method, params, _ in calls))
            for (method, _, needed), answer in zip(calls, got):
                refusal = "record_unknown" if method == "record.get" else "right_needed"
                may = order.index(right) >= order.index(needed)
                with self.subTest(right=right, method=method):
                    self.assertEqual(answer, "ok" if may else refusal)

    def test_a_kiosk_gets_nothing_by_a_foreign_uuid(self):
        """Events tell uuids to all: they must not open the record, nor let it be corrected."""
        again = {"uuid": self.record["uuid"], "specular": "sce", "replicates": 1, "pace": "auto"}
        mine = {**again, "uuid": new_uuid(), "corrects": self.record["id"]}
        calls = [
            ("measure.start", {**request, "lease": "no-lease"}) for request in (again, mine)
        ]
        self.assertEqual(self.as_member("kiosk", *calls)[1], ["uuid_reused", "record_unknown"])
        self.assertEqual(self.as_member("clinic", *calls)[1], ["ok", "lease_unknown"])

    def test_a_kiosk_sees_what_it_measured(self):
        def run(say):
            with self.daemon.client() as c:
                lease = c.acquire(wait=True)["lease"]
                mine = c.measure(lease)
                say([mine["id"], [r["id"] for r in c.call("record.list")["records"]]])

        with Child(run, (NOBODY, [NOBODY, self.gids["kiosk"]])) as child:
            mine, listed = child.heard()
        self.assertIn(mine, listed)
        self.assertNotIn(self.record["id"], listed)


class Standing(Case):
    instruments = None

    @unittest.skipIf(INSTRUMENTED, "limits are for the program as it is used")
    def test_idle_costs_nothing(self):
        """expect: at most one tick of 10 ms in 5 s; 40 MB"""
        with Daemon() as daemon, daemon.client() as c:
            daemon.wait_for_table()
            daemon.wait_for_instrument()
            c.call("events.subscribe", topics=["lease", "instrument"])
            time.sleep(1)
            before = daemon.cpu_ticks()
            time.sleep(5)
            ticks, resident = daemon.cpu_ticks() - before, daemon.memory_kb()
            print(f"idle for 5 s: {ticks} ticks, {resident / 1024:.1f} MB resident")
            self.assertLessEqual(ticks, 1)
            self.assertLess(resident, 40 * 1024)


if __name__ == "__main__":
    main()
