#!/usr/bin/env python3
"""test_daemon_session.py - a client that is no code of ours measures, goes away and comes back.

Every message is held to protocol.schema.json on the way (daemon.py).  Expected colours
are worked out in Python from the record's spectrum and XYZ.
"""

import contextlib
import math
import os

from client import Refused, Silent
from daemon import Case, main, new_uuid
from support import TWO_LAYER, Table, lab, linear_srgb, srgb_code

# CIE 15:2018, table of D65 and the 10 degree observer: white with Y = 100
WHITE = (94.811, 100.0, 107.304)


def mean(spectra):
    return [sum(values) / len(values) for values in zip(*(s["values"] for s in spectra))]


class FirstSession(Case):
    def test_from_connection_to_record(self):
        c = self.enterContext(self.daemon.connect())
        self.assertEqual(c.hello["protocol"], {"major": 1, "minor": 0})
        opened = c.open("by hand", operator="Ada Löfgren")
        self.assertEqual(opened["protocol"], c.hello["protocol"])
        self.assertEqual(opened["right"], "admin")  # the account the station runs under
        subscribed = c.call(
            "events.subscribe",
            topics=["instrument", "calibration", "lease", "measurement", "store"],
        )
        self.assertEqual(subscribed["boot"], c.hello["boot"])

        (instrument,) = c.call("instrument.list")["instruments"]
        self.assertEqual((instrument["driver"], instrument["leased"]), ("simulated", False))
        taken = c.acquire(instrument["instrument"])
        lease = taken["lease"]
        granted = c.event("lease", "granted", instrument=instrument["instrument"])
        self.assertEqual(granted["data"]["fence"], taken["fence"])
        self.assertEqual(granted["data"]["connection"], opened["connection"])
        self.assertTrue(0 < taken["expires_in_ms"] <= 60000)

        self.calibrated(c, lease)
        uuid = new_uuid()
        record = c.measure(lease, uuid=uuid, replicates=3, site="forearm")
        self.assertEqual(record["uuid"], uuid)
        self.assertEqual((record["operator"], record["site"]), ("Ada Löfgren", "forearm"))
        self.assertEqual((record["fence"], record["aperture_mm"]), (taken["fence"], 8))
        self.assertEqual(record["serial"], "SIM-1")
        self.assertEqual(len(record["replicates"]), 3)
        self.colours_of(record)
        self.events_of(c, record, 3)

        self.assertEqual(c.call("record.get", id=record["id"]), record)
        listed = c.call("record.list", since_seq=record["seq"] - 1)
        self.assertEqual(listed, {"records": [record], "next_seq": record["seq"], "more": False})

    def calibrated(self, c, lease):
        """Zero, then white; a shot before is refused, and so is white before zero."""
        with self.refused("calibration_due"):
            c.measure(lease)
        with self.refused("calibration_order"):
            c.call("instrument.calibrate", lease=lease, step="white")
        zero, white = c.call("instrument.list")["instruments"][0]["calibration"]
        self.assertEqual((zero["step"], zero["due"], white["due"]), ("zero", True, True))
        self.assertTrue(zero["place"] and white["place"])
        for step in ("zero", "white"):
            done = c.call("instrument.calibrate", lease=lease, step=step)
            self.assertEqual(done["step"], step)
            event = c.event("calibration", "done", step=step)
            self.assertEqual(event["data"]["calibration_id"], done["calibration_id"])
        self.assertEqual([x["due"] for x in done["calibration"]], [False, False])
        (instrument,) = c.call("instrument.list")["instruments"]
        self.assertEqual(instrument["state"], "ready")
        self.assertTrue(instrument["leased"])

    def colours_of(self, record):
        """expect: the means, CIE 15 for Lab, IEC 61966-2-1 for sRGB, Chardon 1991 for ITA."""
        for got, expected in zip(record["spectrum"]["values"], mean(record["replicates"])):
            self.assertAlmostEqual(got, expected, 12)
        L, a, b = record["Lab"]
        for got, expected in zip(record["Lab"], lab(record["XYZ"], WHITE)):
            self.assertAlmostEqual(got, expected, 2)
        self.assertAlmostEqual(record["ITA"], math.degrees(math.atan2(L - 50, b)), 9)
        codes = srgb_code(linear_srgb(record["XYZ"], WHITE))
        for got, expected in zip(record["sRGB"], codes):
            self.assertLessEqual(abs(got - expected), 1)

    def events_of(self, c, record, shots):
        started = c.event("measurement", "started", uuid=record["uuid"])
        self.assertEqual(started["data"]["replicates"], shots)
        seqs = [started["seq"]]
        for shot in range(1, shots + 1):
            event = c.event("measurement", "shot", shot=shot)
            self.assertEqual(event["data"]["replicates"], shots)
            seqs.append(event["seq"])
        done = c.event("measurement", "done", uuid=record["uuid"])
        self.assertEqual((done["data"]["id"], done["data"]["seq"]), (record["id"], record["seq"]))
        seqs.append(done["seq"])
        self.assertEqual(seqs, sorted(seqs))
        c.event("store", "record", id=record["id"], seq=record["seq"])


class Measuring(Case):
    def test_match_is_the_nearest_row(self):
        """expect: every row of the table compared in Python."""
        c, lease = self.ready()
        record = c.measure(lease)
        table = Table(TWO_LAYER)
        values = record["spectrum"]["values"]
        self.assertEqual(len(values), 31)  # the table's bands as well

        def squares(row):
            return sum((x - y) ** 2 for x, y in zip(values, row["spectrum"]))

        best = min(table.rows, key=squares)
        match = record["match"]
        self.assertEqual(
            [match["Cm"], match["Bm"], match["Ch"]], [best["Cm"], best["Bm"], best["Ch"]]
        )
        self.assertAlmostEqual(match["rms"], math.sqrt(squares(best) / 31), 9)
        self.assertEqual(match["distance"], match["rms"])
        self.assertEqual((match["by"], match["table"]), ("spectrum", "two-layer"))
        self.assertEqual(match["table_sha256"], table.meta["content_sha256"])

    def test_retry_gives_the_same_record(self):
        c, lease = self.ready()
        uuid = new_uuid()
        record = c.measure(lease, uuid=uuid, replicates=2, site="cheek")
        before = c.call("status.get")["last_seq"]
        self.assertEqual(c.measure(lease, uuid=uuid, replicates=2, site="cheek"), record)
        self.assertEqual(c.measure(lease, uuid=uuid.upper(), replicates=2, site="cheek"), record)
        for other in ({"replicates": 3}, {"site": "brow"}, {"pace": "prompt"}, {"by": "lab"}):
            with self.subTest(other=other), self.refused("uuid_reused"):
                c.measure(lease, **{"uuid": uuid, "replicates": 2, "site": "cheek", **other})
        c.close()  # the lease has gone with the connection: the uuid comes first
        other, _ = self.ready()
        self.assertEqual(other.measure(lease, uuid=uuid, replicates=2, site="cheek"), record)
        self.assertEqual(other.call("status.get")["last_seq"], before)

    def test_sci(self):
        c, lease = self.ready()
        with self.refused("surface_needed"):
            c.measure(lease, specular="sci")
        record = c.measure(lease, specular="sci", surface=0.04, replicates=2)
        self.assertEqual((record["specular"], record["surface"]), ("sce", 0.04))
        for got, sci in zip(record["spectrum"]["values"], mean(record["replicates_sci"])):
            self.assertAlmostEqual(got, sci - 0.04, 12)

    def test_correction(self):
        c, lease = self.ready()
        wrong = c.measure(lease, site="left arm")
        right = c.measure(lease, site="right arm", corrects=wrong["id"])
        self.assertEqual(right["corrects"], wrong["id"])
        self.assertNotIn("corrects", c.call("record.get", id=wrong["id"]))
        with self.refused("record_unknown"):
            c.measure(lease, corrects=new_uuid())


class Retries(Case):
    ROUNDS = 60  # in one of five a retry is looked up while the first is being stored

    def test_many_at_once(self):
        """docs: the same parameters give the same record, or wait for the one that runs (a few
        of them may).  What else they name is looked up as well, which takes its time."""
        c, lease = self.ready()
        wanted = {"specular": "sce", "replicates": 1, "pace": "auto"}
        wanted["corrects"] = c.measure(lease, replicates=32)["id"]
        wanted["subject"] = c.call("subject.add", label="x")["id"]
        for _ in range(self.ROUNDS):
            wanted["uuid"] = new_uuid()
            told = set()
            for asked in [c.send("measure.start", lease=lease, **wanted) for _ in range(60)]:
                try:
                    told.add(c.wait(asked)["id"])
                except Refused as refused:
                    self.assertEqual(refused.reason, "measurement_running")
            self.assertEqual(len(told), 1)


class Prompted(Case):
    def start(self, c, lease, replicates=3):
        """A measurement with pace prompt; uuid and request."""
        c.call("events.subscribe", topics=["measurement"])
        uuid = new_uuid()
        return uuid, c.send(
            "measure.start",
            lease=lease,
            uuid=uuid,
            specular="sce",
            replicates=replicates,
            pace="prompt",
        )

    def test_each_further_shot_waits(self):
        c, lease = self.ready()
        uuid, started = self.start(c, lease)
        for shot in (2, 3):
            waiting = c.event("measurement", "waiting", uuid=uuid)["data"]
            self.assertEqual((waiting["shot"], waiting["replicates"]), (shot, 3))
            self.assertTrue(waiting["prompt"])
            begun = c.call("measure.next", lease=lease, uuid=uuid)
            self.assertEqual(begun, {"uuid": uuid, "shot": shot, "replicates": 3})
        record = c.wait(started)
        self.assertEqual(len(record["replicates"]), 3)
        with self.refused("measurement_unknown"):
            c.call("measure.next", lease=lease, uuid=uuid)

    def test_cancel_stores_nothing(self):
        c, lease = self.ready()
        before = c.call("status.get")["last_seq"]
        uuid, started = self.start(c, lease)
        c.event("measurement", "waiting", uuid=uuid)
        with self.refused("measurement_running"):
            c.measure(lease)
        with self.refused("measurement_unknown"):
            c.call("measure.cancel", lease=lease, uuid=new_uuid())
        ended = c.call("measure.cancel", lease=lease, uuid=uuid)
        self.assertEqual(ended, {"uuid": uuid, "stored": False, "discarded": 1})
        with self.refused("measurement_cancelled"):
            c.wait(started)
        self.assertEqual(c.event("measurement", "cancelled", uuid=uuid)["data"]["cause"], "asked")
        self.assertEqual(c.call("status.get")["last_seq"], before)
        self.assertEqual(c.measure(lease)["seq"], before + 1)  # and the instrument is free again

    def test_release_cancels(self):
        c, lease = self.ready()
        uuid, started = self.start(c, lease)
        c.event("measurement", "waiting", uuid=uuid)
        self.assertEqual(c.call("instrument.release", lease=lease), {"released": True})
        with self.refused("measurement_cancelled"):
            c.wait(started)
        self.assertEqual(
            c.event("measurement", "cancelled", uuid=uuid)["data"]["cause"], "released"
        )

    def test_a_retry_waits_for_the_running_one(self):
        c, lease = self.ready()
        uuid, started = self.start(c, lease, replicates=2)
        again = c.send(
            "measure.start", lease=lease, uuid=uuid, specular="sce", replicates=2, pace="prompt"
        )
        c.event("measurement", "waiting", uuid=uuid)
        c.call("measure.next", lease=lease, uuid=uuid)
        self.assertEqual(c.wait(started), c.wait(again))

    def test_the_button_takes_the_next_shot(self):
        c, lease = self.ready()
        uuid, started = self.start(c, lease, replicates=2)
        c.event("measurement", "waiting", uuid=uuid)
        record = None
        while record is None:  # a press counts from the moment the station looks for one
            os.utime(self.button)
            with contextlib.suppress(Silent):
                record = c.wait(started, 0.2)
        self.assertEqual(len(record["replicates"]), 2)

    @classmethod
    def setUpClass(cls):
        cls.button = f"/tmp/sk-button.{os.getpid()}"
        with open(cls.button, "w", encoding="ascii"):
            pass
        cls.addClassCleanup(os.unlink, cls.button)
        cls.instruments = (f"simulated:speed=instant,button_file={cls.button}",)
        super().setUpClass()


class Events(Case):
    TOPICS = ["instrument", "calibration", "lease", "measurement", "store"]

    def take_turns(self, c, times):
        """Two events each: granted and freed."""
        for _ in range(times):
            c.call("instrument.release", lease=c.acquire(wait=True)["lease"])

    def seqs(self, c):
        """Numbers of the events that have come."""
        c.call("status.get")
        return [m["params"]["seq"] for m in c.events if m["method"] == "event"]

    def test_resume_inside_the_ring(self):
        c = self.client()
        last = c.call("events.subscribe", topics=self.TOPICS)["event_seq"]
        self.take_turns(c, 3)
        heard = self.seqs(c)
        self.assertEqual(heard, list(range(last + 1, last + 7)))
        c.close()
        other = self.client()
        self.take_turns(other, 5)
        back = self.client()
        subscribed = back.call("events.subscribe", topics=self.TOPICS, since_seq=heard[-1])
        self.assertEqual((subscribed["resumed"], subscribed["boot"]), (True, c.hello["boot"]))
        self.assertEqual(self.seqs(back), list(range(heard[-1] + 1, subscribed["event_seq"] + 1)))
        self.assertFalse([m for m in back.events if m["method"] == "events.lost"])

    def test_resume_at_the_newest(self):
        c = self.client()
        newest = c.call("status.get")["event_seq"]
        subscribed = c.call("events.subscribe", topics=["lease"], since_seq=newest)
        self.assertEqual(
            subscribed, {"boot": c.hello["boot"], "event_seq": newest, "resumed": True}
        )

    def test_only_the_topics_asked_for(self):
        c = self.client()
        c.call("events.subscribe", topics=["measurement"])
        self.take_turns(c, 1)
        self.assertEqual(self.seqs(c), [])
        c.call("events.subscribe", topics=["lease"])  # replaces the first
        self.take_turns(c, 1)
        self.assertEqual({m["params"]["topic"] for m in c.events}, {"lease"})

    def lost_since(self, c, since_seq):
        subscribed = c.call("events.subscribe", topics=self.TOPICS, since_seq=since_seq)
        self.assertFalse(subscribed["resumed"])
        lost = c.lost()
        self.assertEqual(lost["since_seq"], since_seq)
        self.assertEqual(lost["snapshot"]["boot"], c.hello["boot"])
        self.take_turns(c, 1)
        self.assertEqual(lost["next_seq"], self.seqs(c)[0])  # "the next event that will come"

    def test_resume_outside_the_ring(self):
        c = self.client()
        since = c.call("status.get")["event_seq"]
        self.take_turns(c, c.hello["limits"]["events"] // 2 + 1)
        self.lost_since(c, since)

    def test_number_of_another_boot(self):
        c = self.client()
        self.lost_since(c, c.call("status.get")["event_seq"] + 1000)

    def test_a_new_boot_counts_anew(self):
        with self.daemon.client() as c:
            boot, newest = c.hello["boot"], c.call("status.get")["event_seq"]
        self.daemon.restart()
        self.daemon.wait_for_table()
        c = self.client()
        self.assertNotEqual(c.hello["boot"], boot)
        self.assertLess(c.call("status.get")["event_seq"], max(newest, 50))


class AfterARestart(Case):
    def test_what_was_acknowledged_is_there(self):
        c, lease = self.ready()
        kept = [c.measure(lease) for _ in range(3)]
        station, fence = c.hello["station_id"], kept[0]["fence"]
        c.close()
        self.daemon.restart()
        back = self.client()
        self.assertEqual(back.hello["station_id"], station)
        listed = back.call("record.list", since_seq=kept[0]["seq"] - 1)["records"]
        self.assertEqual(listed, kept)
        self.daemon.wait_for_instrument()
        taken = back.acquire()
        self.assertGreater(taken["fence"], fence)
        for step in back.call("instrument.list")["instruments"][0]["calibration"]:
            self.assertTrue(step["due"], step)  # connected anew
            self.assertIn(step["cause"], ("reconnected", "instrument", "earlier_step"))
        self.assertTrue(back.call("store.verify")["sound"])


if __name__ == "__main__":
    main()
