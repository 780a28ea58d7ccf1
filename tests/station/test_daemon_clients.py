#!/usr/bin/env python3
"""test_daemon_clients.py - clients that flood, dawdle, swarm and die: the station stays up, the
others keep their answers, and the instrument finds its next holder."""

import contextlib
import json
import math
import os
import resource
import socket
import time

from child import Child, forever
from client import Client, Closed, Refused, Silent, read_line
from daemon import INSTRUMENTED, Case, Daemon, main, new_uuid, wait_for

SLACK = 10 if INSTRUMENTED else 1  # sanitizers are slow and keep freed memory
P99_S = 0.05 * SLACK
SLOW = "simulated:shot_ms=1500,charge_ms=0,calibrate_ms=0"


def p99_of_status(c, samples=400, pause_s=0.002):
    """Of the time that status.get takes."""
    took = []
    for _ in range(samples):
        begun = time.monotonic()
        c.call("status.get")
        took.append(time.monotonic() - begun)
        time.sleep(pause_s)
    return sorted(took)[math.ceil(0.99 * samples) - 1]


def requests_of(method, **params):
    return (
        json.dumps({"jsonrpc": "2.0", "id": "raw", "method": method, "params": params}).encode()
        + b"\n"
    )


class Floods(Case):
    def flood(self, line, seconds):
        """A child that sends the line as fast as it can and never reads; it says "sent" once it has
        begun, then how it ended: "dropped" or "still there"."""

        def run(say):
            with self.daemon.client("flood") as c:
                c.socket.setblocking(False)
                until, said = time.monotonic() + seconds, False
                while time.monotonic() < until:
                    try:
                        c.socket.send(line * 50)
                    except BlockingIOError:
                        time.sleep(0.001)
                    except (BrokenPipeError, ConnectionResetError):
                        return say("dropped")
                    if not said:
                        said = bool(say("sent"))
                return say("still there")

        return Child(run)

    def test_others_are_answered_while_one_floods(self):
        c = self.client()
        quiet = p99_of_status(c)
        for what, line in (
            ("replies it does not read", requests_of("rpc.describe")),
            ("small requests", requests_of("status.get")),
            ("bad lines", b"{}\n"),
            ("work", requests_of("table.list")),
        ):
            with self.subTest(what=what), self.flood(line, 30) as child:
                self.assertEqual(child.heard(), "sent")
                p99 = p99_of_status(c)
                print(f"p99 of status.get: {1e3 * quiet:.1f} ms, beside {what}: {1e3 * p99:.1f} ms")
                self.assertLess(p99, P99_S)

    def test_one_that_never_reads_is_dropped(self):
        with self.flood(requests_of("rpc.describe"), 30) as child:
            self.assertEqual(child.heard(), "sent")
            self.assertEqual(child.heard(), "dropped")

    def test_a_subscriber_that_never_reads(self):
        """It is dropped; nobody waits for it, and memory does not grow without limit."""
        with self.daemon.client() as deaf:
            deaf.call("events.subscribe", topics=["lease"])
            c = self.client()
            before = self.daemon.memory_kb()
            for _ in range(2000):
                c.call("instrument.release", lease=c.acquire(wait=True)["lease"])
            self.assertLess(p99_of_status(c, 200), P99_S)
            self.assertLess(self.daemon.memory_kb() - before, 16 * 1024 * SLACK)

    def test_a_byte_now_and_then(self):
        line = requests_of("status.get")
        slow, c = self.client(), self.client()
        for i in range(8):
            slow.send_raw(line[i : i + 1])
            self.assertLess(p99_of_status(c, 200), P99_S)
        slow.send_raw(line[8:])
        self.assertIn("result", slow.next_message())

    def test_100_megabytes_without_a_line_feed(self):
        c = self.client()
        before = self.daemon.memory_kb()
        with self.daemon.client() as endless:
            with self.assertRaises(Closed):
                for _ in range(100):
                    endless.send_raw(b"x" * (1 << 20))
            self.assertEqual(
                read_line(endless.next_line())["error"]["data"]["reason"], "line_too_long"
            )
        self.assertLess(self.daemon.memory_kb() - before, 4096 * SLACK)
        self.assertLess(p99_of_status(c, 200), P99_S)

    def test_come_and_go(self):
        c = self.client()
        before = self.daemon.descriptors()
        for _ in range(300):  # refused where the station has not yet seen others go
            with contextlib.suppress(Refused), self.daemon.connect():
                pass
        for _ in range(300):  # gone before the hello is read
            with Client(self.daemon.socket, hello=False):
                pass
        c.call("status.get")
        wait_for("all are gone", lambda: c.call("status.get")["clients"] == 1, 5)
        wait_for("no descriptor is left", lambda: self.daemon.descriptors() <= before, 5)


class Limits(Case):
    instruments = None

    def fill(self, daemon):
        """Connections until one is refused; they, and the refusal."""
        clients = []
        for _ in range(200):
            c = self.enterContext(daemon.connect(hello=False))
            first = c.next_message(5)
            if "error" in first:
                self.assertIsNone(first["id"])
                self.assertTrue(c.is_closed(5))
                return clients, first["error"]
            clients.append(c)
        self.fail("nobody is refused")

    def check_limit(self, options, most, reason):
        with Daemon(*options) as daemon:
            clients, error = self.fill(daemon)
            self.assertEqual((len(clients), error["data"]["reason"]), (most, reason))
            for c in clients:  # those inside go on
                self.assertEqual(c.open()["protocol"]["major"], 1)
            for _ in range(3):  # and there is room again for as many as leave
                clients.pop().close()
                wait_for("room", lambda: clients[0].call("status.get")["clients"] < most, 5)
                clients.append(self.enterContext(daemon.connect()))
                clients[-1].open()

    def test_one_client_too_many(self):
        """docs: root has one more place"""
        most = 5 + (os.getuid() == 0)
        self.check_limit(("--max-clients", "5"), most, "too_many_clients")

    def test_one_of_a_user_too_many(self):
        most = 5 + (os.getuid() == 0)
        self.check_limit(("--max-per-user", "5"), most, "too_many_for_user")

    def test_one_of_a_process_too_many(self):
        self.check_limit(("--max-per-process", "5"), 5, "too_many_for_process")

    def test_other_processes_are_not_to_blame(self):
        with Daemon("--max-per-process", "3") as daemon:
            here, _ = self.fill(daemon)  # one less where who asked for the start has not left yet

            def connect(say):
                with daemon.client() as c:
                    say(c.call("status.get")["clients"])

            with Child(connect) as child:
                self.assertGreaterEqual(len(here), 2)
                self.assertEqual(child.heard(), len(here) + 1)

    def test_descriptors_exhausted(self):
        def few():
            resource.setrlimit(resource.RLIMIT_NOFILE, (40, 40))

        options = [x for n in ("clients", "per-user", "per-process") for x in (f"--max-{n}", "64")]
        with Daemon(*options, before=few) as daemon:
            daemon.wait_for_table()
            daemon.wait_for_instrument()
            clients, error = self.fill(daemon)
            self.assertGreater(len(clients), 3)
            self.assertEqual(error["data"]["reason"], "too_many_clients")
            clients[0].open()
            before = daemon.cpu_ticks()
            time.sleep(1)
            self.assertLessEqual(daemon.cpu_ticks() - before, 10, "no busy waiting")
            self.assertEqual(clients[0].call("status.get")["store"], "ok")
            for _ in range(5):
                clients.pop().close()
            wait_for("room", lambda: self.can_open(daemon), 5)
            c = self.enterContext(daemon.client())
            lease = c.acquire()["lease"]
            c.calibrate(lease)
            self.assertEqual(c.measure(lease)["seq"], 1)

    @staticmethod
    def can_open(daemon):
        try:
            with daemon.connect(timeout_s=2) as c:
                return c.open() is not None
        except (Refused, Closed, Silent):
            return False

    def test_a_descriptor_sent_along_is_closed(self):
        """SCM_RIGHTS: nobody can fill the station's table with files of their own."""
        with Daemon() as daemon, daemon.client() as c:
            daemon.wait_for_table()
            before = daemon.descriptors()
            for _ in range(50):
                socket.send_fds(c.socket, [requests_of("status.get")], [0, 1, 2])
                self.assertIn("result", c.next_message())
            self.assertLess(daemon.descriptors(), before + 50)


class Holders(Case):
    """A client goes away with the instrument in its hands: cleanly, or killed."""

    instruments = (SLOW,)

    def setUp(self):
        self.watcher = self.client(name="watcher")
        self.watcher.call("events.subscribe", topics=["lease", "measurement"])
        self.last_seq = self.watcher.call("status.get")["last_seq"]

    def holder(self, then):
        """A child that takes the calibrated instrument, says the fence, and does then(c, lease, say)."""

        def run(say):
            with self.daemon.client("holder") as c:
                taken = c.acquire(wait=True)
                c.calibrate(taken["lease"])
                say(taken["fence"])
                then(c, taken["lease"], say)
                forever()

        return self.enterContext(Child(run))

    def goes(self, child, fence):
        """The child dies while another waits: the lease moves on, with a larger fence."""
        waiting = self.client(name="next")
        waiting.call("events.subscribe", topics=["lease"])
        asked = waiting.send(
            "instrument.acquire", instrument=self.instrument(), ttl_ms=60000, wait=True
        )
        self.assertEqual(self.place(waiting), 1)
        child.kill()
        freed = self.watcher.event("lease", "freed", fence=fence)
        self.assertEqual(freed["data"]["cause"], "disconnected")
        granted = waiting.wait(asked)
        self.assertGreater(granted["fence"], fence)
        return waiting, granted["lease"]

    def instrument(self):
        return self.watcher.call("instrument.list")["instruments"][0]["instrument"]

    @staticmethod
    def place(c):
        """In the queue, as the next event says."""
        return c.event("lease", "queued", connection=c.connection)["data"]["position"]

    def test_killed_before_the_shot(self):
        child = self.holder(lambda c, lease, say: None)
        waiting, lease = self.goes(child, child.heard())
        self.assertEqual(waiting.measure(lease)["seq"], self.last_seq + 1)

    def start(self, pace):
        uuid = new_uuid()

        def then(c, lease, say):
            c.send("measure.start", lease=lease, uuid=uuid, specular="sce", replicates=2, pace=pace)

        child = self.holder(then)
        return uuid, child, child.heard()

    def test_killed_during_the_shot(self):
        """Nothing is stored; the uuid is free for a retry, which is a measurement of its own."""
        uuid, child, fence = self.start("auto")
        self.watcher.event("measurement", "started", uuid=uuid)
        waiting, lease = self.goes(child, fence)
        cancelled = self.watcher.event("measurement", "cancelled", uuid=uuid)
        self.assertEqual(cancelled["data"]["cause"], "disconnected")
        self.assertEqual(self.watcher.call("status.get")["last_seq"], self.last_seq)
        record = waiting.measure(lease, uuid=uuid, replicates=2)
        self.assertGreater(record["fence"], fence)

    def test_killed_after_a_shot(self):
        """Between two shots that wait for the operator."""
        uuid, child, fence = self.start("prompt")
        self.watcher.event("measurement", "waiting", uuid=uuid)
        waiting, lease = self.goes(child, fence)
        cancelled = self.watcher.event("measurement", "cancelled", uuid=uuid)
        self.assertEqual(cancelled["data"]["cause"], "disconnected")
        self.assertEqual(waiting.measure(lease)["seq"], self.last_seq + 1)

    def test_killed_after_the_commit(self):
        """The reply was never read: a retry with the same uuid gets the record."""
        uuid, child, fence = self.start("auto")
        done = self.watcher.event("measurement", "done", uuid=uuid)
        waiting, lease = self.goes(child, fence)
        record = waiting.measure(lease, uuid=uuid, replicates=2)
        self.assertEqual((record["id"], record["fence"]), (done["data"]["id"], fence))
        self.assertEqual(waiting.call("status.get")["last_seq"], self.last_seq + 1)

    def test_one_that_waits_goes(self):
        holder, lease = self.ready()
        first, second = self.client(), self.client()
        asked = []
        for place, c in enumerate((first, second), 1):
            c.call("events.subscribe", topics=["lease"])
            asked.append(
                c.send("instrument.acquire", instrument=self.instrument(), ttl_ms=60000, wait=True)
            )
            self.assertEqual(self.place(c), place)
        with self.assertRaises(Refused) as caught:
            first.acquire(wait=True)
        self.assertEqual(caught.exception.reason, "lease_exists")
        first.close()
        self.assertEqual(self.place(second), 1)
        holder.call("instrument.release", lease=lease)
        self.assertTrue(second.wait(asked[1])["lease"])

    def test_one_that_waits_withdraws(self):
        """It stays, those behind it move up, and the lease passes it by."""
        holder, lease = self.ready()
        first, second = self.client(), self.client()
        name, asked = self.instrument(), []
        for place, c in enumerate((first, second), 1):
            c.call("events.subscribe", topics=["lease"])
            asked.append(c.send("instrument.acquire", instrument=name, ttl_ms=60000, wait=True))
            self.assertEqual(self.place(c), place)
        gone = first.send("instrument.withdraw", instrument=name)
        with self.refused("lease_withdrawn"):
            first.wait(asked[0])
        self.assertEqual(first.wait(gone), {"withdrawn": True})
        self.assertEqual(self.place(second), 1)
        for c in (first, holder, self.client()):
            with self.refused("lease_not_awaited"):
                c.call("instrument.withdraw", instrument=name)
        with self.refused("instrument_unknown"):
            second.call("instrument.withdraw", instrument="none")
        again = first.send("instrument.acquire", instrument=name, ttl_ms=60000, wait=True)
        holder.call("instrument.release", lease=lease)
        taken = second.wait(asked[1])["lease"]
        second.call("instrument.release", lease=taken)
        self.assertNotEqual(first.wait(again)["lease"], taken)

    def test_lease_expires_during_a_shot(self):
        """docs: the late result is kept and flagged, but not the answer; a retry gets it."""
        c, lease = self.ready()
        c.call("instrument.release", lease=lease)
        taken = c.acquire(ttl_ms=1000)
        uuid = new_uuid()
        with self.refused("lease_expired"):
            c.measure(taken["lease"], uuid=uuid)
        freed = self.watcher.event("lease", "freed", fence=taken["fence"])
        self.assertEqual(freed["data"]["cause"], "expired")
        wait_for(
            "the late record", lambda: c.call("status.get")["last_seq"] == self.last_seq + 1, 10
        )
        (late,) = c.call("record.list", since_seq=self.last_seq)["records"]
        self.assertEqual((late["uuid"], late["fence"]), (uuid, taken["fence"]))
        self.assertIn("lease_expired", late["flags"])
        self.assertEqual(c.measure(c.acquire()["lease"], uuid=uuid), late)


class Silence(Case):
    """What unsent_ms says: ten seconds, so it is in a class of its own."""

    def test_a_reader_that_stops_for_ten_seconds_is_dropped(self):
        c = self.client()
        with self.daemon.client() as deaf:
            deaf.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            for _ in range(8):  # less than unsent_bytes, more than the sockets hold
                deaf.send("rpc.describe")
            wait_for("it is dropped", lambda: c.call("status.get")["clients"] == 1, 15, 0.2)


if __name__ == "__main__":
    main()
