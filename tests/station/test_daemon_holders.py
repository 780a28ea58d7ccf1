"""Holders of one instrument, one after the other: the next has no say in the last one's reading."""

import threading
import time

from client import Refused
from daemon import STOP_S, Case, Daemon, main, new_uuid, wait_for

# A shot that outlives the shortest lease.
SLOW = "simulated:shot_ms=1600,charge_ms=0,calibrate_ms=0"


class Holders(Case):
    instruments = (SLOW,)

    def expire_during_a_shot(self):
        """The client, the uuid and the parameters of a shot whose lease has just expired."""
        c, lease = self.ready()
        c.call("instrument.release", lease=lease)
        lease = c.acquire(ttl_ms=1000)["lease"]
        c.call("events.subscribe", topics=["lease", "measurement", "store"])
        wanted = {"lease": lease, "uuid": new_uuid(), "specular": "sce", "replicates": 1, "pace": "auto"}
        asked = c.send("measure.start", **wanted)
        c.event("lease", "freed", cause="expired")
        return c, wanted, asked

    def stored(self, c, wanted, asked):
        with self.assertRaises(Refused) as caught:
            c.wait(asked)
        self.assertEqual(caught.exception.reason, "lease_expired")
        record = c.call("measure.start", **wanted)
        self.assertIn("lease_expired", record["flags"])

    def test_release_by_the_next(self):
        c, wanted, asked = self.expire_during_a_shot()
        following = self.client()
        lease = following.acquire()["lease"]
        following.call("instrument.release", lease=lease)
        self.stored(c, wanted, asked)

    def test_the_next_goes(self):
        c, wanted, asked = self.expire_during_a_shot()
        following = self.client()
        following.acquire()
        following.close()
        self.stored(c, wanted, asked)

    def test_cancel_by_the_next(self):
        c, wanted, asked = self.expire_during_a_shot()
        following = self.client()
        lease = following.acquire()["lease"]
        with self.refused("measurement_unknown"):
            following.call("measure.cancel", lease=lease, uuid=wanted["uuid"])
        self.stored(c, wanted, asked)

    def test_the_next_waits_for_the_shot(self):
        """Not measurement_running: nobody could end it."""
        c, wanted, asked = self.expire_during_a_shot()
        following = self.client()
        lease = following.acquire()["lease"]
        self.assertGreater(following.measure(lease)["fence"], 0)
        self.stored(c, wanted, asked)


class Several(Case):
    instruments = ("simulated", "simulated", "simulated")

    def test_leases_that_expired_on_one_client(self):
        """Each is known as expired, not the last one alone."""
        c = self.client()
        names = [x["instrument"] for x in c.call("instrument.list")["instruments"]]
        self.assertEqual(len(set(names)), 3)
        c.call("events.subscribe", topics=["lease"])
        leases = [c.acquire(name, ttl_ms=1000)["lease"] for name in names]
        for name in names:
            c.event("lease", "freed", instrument=name, cause="expired")
        for lease in leases:
            with self.subTest(lease=lease), self.refused("lease_expired"):
                c.call("instrument.renew", lease=lease, ttl_ms=1000)
        with self.refused("lease_unknown"):
            self.client().call("instrument.renew", lease=leases[0], ttl_ms=1000)


class Stopping(Case):
    """SIGTERM: within 2 s (docs/architecture.md), held with a margin of ten, where the work would take
    a minute; and everybody is answered."""

    instruments = None

    def stop_while(self, daemon, method, **params):
        c = daemon.client()
        self.addCleanup(c.close)
        if "lease" in params:
            params["lease"] = c.acquire()["lease"]
        asked = c.send(method, **params)
        time.sleep(0.2)
        begun = time.monotonic()
        stopper = threading.Thread(target=daemon.stop)
        stopper.start()
        with self.assertRaises(Refused) as caught:
            c.wait(asked)
        stopper.join()
        self.assertLess(time.monotonic() - begun, STOP_S)
        return caught.exception.reason

    def test_while_calibrating(self):
        with Daemon(instruments=("simulated:calibrate_ms=60000",)) as daemon:
            daemon.wait_for_instrument()
            self.stop_while(daemon, "instrument.calibrate", lease=None, step="zero")

    def test_while_waiting_in_the_queue(self):
        with Daemon() as daemon:
            daemon.wait_for_instrument()
            with daemon.client() as holder:
                holder.acquire()
                reason = self.stop_while(
                    daemon, "instrument.acquire", instrument="simulated", ttl_ms=60000, wait=True
                )
            self.assertEqual(reason, "shutting_down")

    def test_while_measuring(self):
        with Daemon(instruments=("simulated:shot_ms=60000,calibrate_ms=0",)) as daemon:
            daemon.wait_for_instrument()
            with daemon.client() as c:
                c.calibrate(c.acquire()["lease"])
            reason = self.stop_while(
                daemon, "measure.start", lease=None, uuid=new_uuid(), specular="sce", replicates=1, pace="auto"
            )
            self.assertEqual(reason, "shutting_down")

    def test_with_instruments_that_do_not_answer(self):
        silent = ("simulated:fault=open:1+:silence",) * 4
        with Daemon(instruments=silent) as daemon:
            wait_for("an answer", lambda: daemon.client().close() is None)
            begun = time.monotonic()
            daemon.stop()
            self.assertLess(time.monotonic() - begun, STOP_S)

    def test_while_long_matches_wait(self):
        """Each takes a millisecond or more: those that wait are not done first."""
        with Daemon() as daemon:
            daemon.wait_for_table()
            values = [0.02 + 0.03 * i for i in range(31)]
            clients = [daemon.client() for _ in range(10)]
            for c in clients:
                self.addCleanup(c.close)
                for _ in range(60):
                    c.send(
                        "match.spectrum",
                        spectrum={"first_nm": 400, "step_nm": 10, "values": values},
                        specular="sce", by="de2000", k=33, store=False,
                    )
            begun = time.monotonic()
            daemon.stop()
            self.assertLess(time.monotonic() - begun, STOP_S)


if __name__ == "__main__":
    main()
