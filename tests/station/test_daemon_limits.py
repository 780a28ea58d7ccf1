#!/usr/bin/env python3
"""test_daemon_limits.py - what one client can take from the others: the queue of the reader, a
turn of the loop, the last descriptor; and what it still gets after its own last word."""

import grp
import json
import os
import resource
import shutil
import signal
import socket
import time
import unittest

from child import Child
from daemon import SKINSPECD, Case, Closed, Daemon, main, new_uuid, wait_for
from support import PAPER

NOBODY = 65534
ROOT_ONLY = unittest.skipUnless(os.getuid() == 0, "only root can become somebody else")
SKIN = {"first_nm": 400, "step_nm": 10, "values": [0.2 + 0.01 * i for i in range(31)]}
STORED = {"spectrum": SKIN, "specular": "sce", "store": True}


def line_of(request_id, method, **params):
    request = {"jsonrpc": "2.0", "id": request_id, "method": method, "params": params}
    return json.dumps(request).encode() + b"\n"


class Turns(Case):
    def test_long_matches_do_not_hold_up_the_reader(self):
        """A look at the store comes long before the matches that were asked for earlier."""
        c, others = self.client(), [self.client() for _ in range(8)]
        match = {"spectrum": SKIN, "specular": "sce", "store": False, "refine": "skin"}
        c.call("match.spectrum", **match)
        begun = time.monotonic()
        asked = [(x, [x.send("match.spectrum", **match) for _ in range(40)]) for x in others]
        for other in others:
            other.call("status.get")  # the matches before it are taken in
        c.call("record.list")
        listed_s = time.monotonic() - begun
        for other, requests in asked:
            for request in requests:
                other.wait(request)
        matched_s = time.monotonic() - begun
        print(f"record.list after {listed_s:.3f} s, all matches after {matched_s:.3f} s")
        self.assertLess(listed_s, 0.75 * matched_s)

    def served_before(self, line, lines, method):
        """How many of the lines of one client are served before another, that spoke later, is."""
        c, other = self.client(), self.client()
        before = self.count(method, other.call("metrics.get"))
        os.kill(self.daemon.process.pid, signal.SIGSTOP)
        try:  # so that both find the station listening at the same time
            os.waitid(os.P_PID, self.daemon.process.pid, os.WSTOPPED)
            c.send_raw(line * lines)
            asked = other.send("metrics.get")
        finally:
            os.kill(self.daemon.process.pid, signal.SIGCONT)
        served = self.count(method, other.wait(asked)) - before
        while lines > 0:  # the rest is not to be counted next time
            lines -= "id" in c.next_message()
        return served

    @staticmethod
    def count(method, metrics):
        name = "requests_" + method.replace(".", "_")
        return next(m["value"] for m in metrics["metrics"] if m["name"] == name)

    def test_a_turn_is_eight_lines(self):
        """Two where both became readable in the same round of the loop."""
        line = line_of("again", "status.get")
        for _ in range(4):
            self.assertLessEqual(self.served_before(line, 200, "status.get"), 16)

    def test_subscribing_ends_the_turn(self):
        """All that is kept may have to be sent again for each."""
        line = line_of("again", "events.subscribe", topics=["lease"], since_seq=0)
        for _ in range(4):
            self.assertLessEqual(self.served_before(line, 8, "events.subscribe"), 2)


class LastWords(Case):
    """A client that closes its half of the connection, as `nc` does at the end of its input."""

    def replies(self, c):
        """Ids of all that still comes, until the station closes."""
        ids = []
        with self.assertRaises(Closed):
            while True:
                ids.append(c.next_message().get("id"))
        return ids

    def test_all_that_was_asked_is_answered(self):
        """Even what takes until another lets go of the instrument."""
        holder, lease = self.ready()
        c = self.client()
        c.send_raw(
            line_of("later", "instrument.acquire", instrument="simulated", ttl_ms=1000, wait=True)
            + line_of("listed", "record.list")
            + b"".join(line_of(f"{i}", "status.get") for i in range(20))
            + b'{"half a line'
        )
        c.socket.shutdown(socket.SHUT_WR)
        early = [c.next_message()["id"] for _ in range(21)]
        self.assertCountEqual(early, ["listed", *map(str, range(20))])
        holder.call("instrument.release", lease=lease)
        self.assertEqual(self.replies(c), ["later"])

    def test_nothing_asked(self):
        c = self.client()
        c.socket.shutdown(socket.SHUT_WR)
        self.assertEqual(self.replies(c), [])

    def test_one_that_has_gone_altogether(self):
        """It holds nothing, though an answer is still owed to it."""
        holder, lease = self.ready()
        c = self.client()
        waits = self.daemon.client()
        waits.send("instrument.acquire", instrument="simulated", ttl_ms=60000, wait=True)
        instrument = lambda: c.call("instrument.list")["instruments"][0]  # noqa: E731
        wait_for("it waits", lambda: instrument()["queue"] == 1)
        waits.socket.shutdown(socket.SHUT_WR)
        c.call("status.get")
        self.assertEqual(instrument()["queue"], 1)
        waits.close()
        wait_for("it has gone", lambda: instrument()["queue"] == 0, 2)
        holder.call("instrument.release", lease=lease)


class Descriptors(Case):
    instruments = None

    def test_not_one_is_left(self):
        """Who knocks then waits, and the station does not spin meanwhile."""
        with Daemon() as daemon:
            daemon.wait_for_table()
            daemon.wait_for_instrument()
            limits = resource.prlimit(daemon.process.pid, resource.RLIMIT_NOFILE)
            resource.prlimit(daemon.process.pid, resource.RLIMIT_NOFILE, (3, limits[1]))
            c = self.enterContext(daemon.connect(hello=False))
            before = daemon.cpu_ticks()
            time.sleep(0.5)
            self.assertLessEqual(daemon.cpu_ticks() - before, 5)
            resource.prlimit(daemon.process.pid, resource.RLIMIT_NOFILE, limits)
            self.assertEqual(c.next_message(5)["method"], "hello")
            self.assertEqual(c.open()["right"], "admin")


class Retries(Case):
    """match.spectrum with a uuid that is stored already."""

    instruments = None

    def test_the_table_is_gone(self):
        with Daemon() as daemon:
            table = os.path.join(daemon.state, "tables", "table-mine.db")
            os.makedirs(os.path.dirname(table), exist_ok=True)
            shutil.copy(PAPER, table)
            daemon.restart()
            uuid = new_uuid()
            with daemon.client() as c:
                first = c.call("match.spectrum", table="mine", by="rgb", uuid=uuid, **STORED)
            os.remove(table)
            daemon.restart()
            with daemon.client() as c:
                again = c.call("match.spectrum", table="mine", by="rgb", uuid=uuid, **STORED)
                self.assertEqual(again, first)
                with self.refused("table_unknown"):
                    c.call("match.spectrum", table="mine", by="rgb", uuid=new_uuid(), **STORED)
                with self.refused("uuid_reused"):
                    c.call("match.spectrum", table="mine", by="lab", uuid=uuid, **STORED)

    @ROOT_ONLY
    def test_nothing_can_be_stored_any_more(self):
        if not self.nobody_may_run():
            self.skipTest("another account may not run the program where it is")
        with Daemon() as daemon:
            uuid = new_uuid()
            with daemon.client() as c:
                first = c.call("match.spectrum", uuid=uuid, **STORED)
            daemon.stop()
            for name in os.listdir(daemon.state):
                os.chmod(os.path.join(daemon.state, name), 0o444)
            os.chmod(daemon.state, 0o555)
            os.chmod(daemon.folder, 0o777)
            daemon.more = {"user": NOBODY, "group": NOBODY, "extra_groups": []}
            daemon.start()
            with daemon.client() as c:
                self.assertEqual(c.call("status.get")["store"], "read_only")
                self.assertEqual(c.call("match.spectrum", uuid=uuid, **STORED), first)
                with self.refused("store_read_only"):
                    c.call("match.spectrum", uuid=new_uuid(), **STORED)

    @staticmethod
    def nobody_may_run():
        with Child(lambda say: say(os.access(SKINSPECD, os.X_OK)), (NOBODY, [NOBODY])) as child:
            return child.heard()

    @ROOT_ONLY
    def test_a_kiosk_does_not_get_what_another_stored(self):
        """Not by the very same request either: the uuid is not its own."""
        group = grp.getgrnam("games")  # every Debian has it
        with Daemon("--kiosk-group", group.gr_name) as daemon:
            daemon.wait_for_table()
            os.chmod(daemon.socket, 0o666)
            os.chmod(daemon.folder, 0o755)
            theirs = new_uuid()
            with daemon.client() as c:
                c.call("match.spectrum", uuid=theirs, **STORED)

            def run(say):
                with daemon.connect() as c:
                    say(c.open()["right"])
                    mine = new_uuid()
                    first = c.call("match.spectrum", uuid=mine, **STORED)
                    say(first == c.call("match.spectrum", uuid=mine, **STORED))
                    asked = c.send("match.spectrum", uuid=theirs, **STORED)
                    message = c.next_message()
                    say([asked, message["id"], message["error"]["data"]["reason"]])

            with Child(run, (NOBODY, [group.gr_gid])) as child:
                self.assertEqual(child.heard(), "kiosk")
                self.assertTrue(child.heard())
                asked, answered, reason = child.heard()
                self.assertEqual((answered, reason), (asked, "uuid_reused"))

    def test_asked_twice_at_once(self):
        """The second is not on record yet when it is looked for: the writer finds it."""
        with Daemon() as daemon, daemon.client() as c:
            daemon.wait_for_table()
            for _ in range(20):
                uuid = new_uuid()
                asked = [c.send("match.spectrum", uuid=uuid, **STORED) for _ in range(4)]
                first, *others = [c.wait(request) for request in asked]
                for other in others:
                    self.assertEqual(other, first)


if __name__ == "__main__":
    main()
