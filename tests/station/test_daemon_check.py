#!/usr/bin/env python3
"""test_daemon_check.py - check tiles: references, checks, and the flag of an instrument that has
drifted.

The instrument is simulated and sees a tile as it sees a skin; `drift` makes its level rise with
each shot since the calibration, and `spectra` puts another tile under its port.  Expected
differences are of grey tiles whose lightness is told apart by arithmetic of its own."""

import math
import os
import tempfile

from client import Refused, new_uuid
from daemon import Case, Daemon, main

# Nothing is by chance, so that shots differ by what a test wants alone.
STILL = "simulated:speed=instant,placement=0,noise=0,unit=0"
# Two hundredths more with each shot: about half a unit of lightness for a skin.
DRIFTING = STILL + ",drift=0.02"
NM = list(range(400, 701, 10))


def grey(R):
    return {"first_nm": 400, "step_nm": 10, "values": [R] * len(NM)}


def lightness(R):
    """L* of a grey: CIE 15 above 0.008856."""
    return 116 * R ** (1 / 3) - 16


def difference(R1, R2):
    """CIEDE2000 of two greys: dL'/S_L, as a and b are 0 (CIE 142, with kL = 1)."""
    L1, L2 = lightness(R1), lightness(R2)
    middle = ((L1 + L2) / 2 - 50) ** 2
    return abs(L1 - L2) / (1 + 0.015 * middle / math.sqrt(20 + middle))


class CheckCase(Case):
    instruments = None

    def daemon_of(self, *instruments, options=()):
        daemon = self.enterContext(Daemon(*options, instruments=instruments or (STILL,)))
        daemon.wait_for_table()
        daemon.wait_for_instrument()
        self.daemon = daemon
        return daemon

    def greys(self, *R, replicates=1):
        """An instrument that sees grey tiles of these reflectances, one after the other."""
        file = os.path.join(self.enterContext(tempfile.TemporaryDirectory(dir="/tmp")), "g.csv")
        with open(file, "w", encoding="ascii") as out:
            out.write("id,specular," + ",".join(str(nm) for nm in range(360, 741, 10)) + "\n")
            for i, one in enumerate(R):
                out.write(f"g{i},sce," + ",".join([repr(one)] * 39) + "\n")
        return f"{STILL},replicates={replicates},spectra={file}"

    def take(self, c, lease, tile="white", **more):
        return c.call("check.take", lease=lease, uuid=new_uuid(), tile=tile,
                      **{"replicates": 1, **more})  # fmt: skip

    def set(self, c, tile="white", **more):
        return c.call("check.set", uuid=new_uuid(), tile=tile, **more)

    def shown(self, c, at=0):
        return c.call("instrument.list")["instruments"][at].get("check")


class Comparing(CheckCase):
    def test_a_certificate_and_the_difference(self):
        """expect: greys by arithmetic."""
        self.daemon_of(self.greys(0.5, 0.51, 0.52))
        c, lease = self.ready(operator="Ada")
        set_ = self.set(c, spectrum=grey(0.5), specular="sce", aperture_mm=8)
        self.assertEqual((set_["source"], set_["limit"], set_["aperture_mm"]),
                         ("certificate", 0.5, 8))  # fmt: skip
        self.assertEqual(set_["spectrum"], grey(0.5))
        self.assertIn("Ada", set_["who"])
        for R, passed in ((0.5, True), (0.51, True), (0.52, False)):
            check = self.take(c, lease)
            self.assertAlmostEqual(check["dE00"], difference(0.5, R), 6)
            self.assertAlmostEqual(check["rms"], R - 0.5, 9)
            self.assertEqual(check["passed"], passed, check)
            self.assertEqual((check["operator"], check["serial"]), ("Ada", "SIM-1"))
            self.assertEqual((check["reference_id"], check["limit"]), (set_["id"], 0.5))

    def test_a_measured_reference_is_its_own(self):
        self.daemon_of(STILL)
        c, lease = self.ready()
        set_ = self.set(c, lease=lease, limit=0.25, replicates=2)
        self.assertEqual((set_["source"], set_["replicates"], set_["serial"]),
                         ("measured", 2, "SIM-1"))  # fmt: skip
        check = self.take(c, lease, replicates=3)
        self.assertAlmostEqual(check["dE00"], 0, 12)
        self.assertAlmostEqual(check["rms"], 0, 12)
        self.assertTrue(check["passed"])
        self.assertEqual((check["limit"], check["replicates"], check["seq"]), (0.25, 3, 1))
        self.assertEqual(check["calibration_id"], set_["calibration_id"])

    def test_the_limit_alone(self):
        """The reference stays; a check is judged by the limit that holds when it is taken."""
        self.daemon_of(self.greys(0.5, 0.52))
        c, lease = self.ready()
        reference = self.set(c, lease=lease, replicates=1)
        failed = self.take(c, lease)
        self.assertFalse(failed["passed"])
        limit = self.set(c, limit=5)
        self.assertEqual((limit["source"], limit["limit"]), ("limit", 5))
        self.assertNotIn("spectrum", limit)
        self.take(c, lease)  # the first grey again
        passed = self.take(c, lease)
        self.assertAlmostEqual(passed["dE00"], failed["dE00"], 12)
        self.assertEqual((passed["passed"], passed["limit"]), (True, 5))
        self.assertEqual(passed["reference_id"], reference["id"])
        self.assertEqual(c.call("check.list")["tiles"], [{"tile": "white", "limit": 5}])


class Drifting(CheckCase):
    def drifted(self, c, lease):
        """A reference, and a check that fails."""
        self.set(c, lease=lease, replicates=1, limit=0.3)
        check = self.take(c, lease, replicates=3)
        self.assertFalse(check["passed"], check)
        return check

    def flags(self, c, lease):
        return c.measure(lease, replicates=3)["flags"]

    def test_from_fail_to_pass(self):
        self.daemon_of(DRIFTING)
        c, lease = self.ready()
        c.call("events.subscribe", topics=["calibration"])
        self.assertNotIn("drift", self.flags(c, lease))
        c.calibrate(lease)
        self.set(c, lease=lease, replicates=1, limit=0.3)
        self.assertIsNone(self.shown(c))
        check = self.take(c, lease, replicates=3)
        self.assertFalse(check["passed"])
        event = c.event("calibration", "checked")["data"]
        self.assertEqual((event["id"], event["passed"]), (check["id"], False))
        self.assertEqual((event["dE00"], event["limit"]), (check["dE00"], 0.3))
        self.assertTrue(c.event("calibration", "drift")["data"]["drift"])
        shown = {x: check[x] for x in ("tile", "taken_at", "dE00", "limit", "passed")}
        self.assertEqual(self.shown(c), shown)

        self.assertIn("drift", self.flags(c, lease))
        c.calibrate(lease)  # this mends it, but nobody has seen that yet
        self.assertIn("drift", self.flags(c, lease))
        stored = c.call("record.list")["records"]
        self.assertEqual(["drift" in r["flags"] for r in stored], [False, True, True])

        c.calibrate(lease)
        passed = self.take(c, lease)
        self.assertTrue(passed["passed"], passed)
        self.assertFalse(c.event("calibration", "drift")["data"]["drift"])
        self.assertNotIn("drift", self.flags(c, lease))
        self.assertTrue(self.shown(c)["passed"])

    def test_after_a_restart(self):
        daemon = self.daemon_of(DRIFTING)
        c, lease = self.ready()
        failed = self.drifted(c, lease)
        c.close()
        daemon.restart()
        daemon.wait_for_instrument()
        c, lease = self.ready()
        self.assertEqual(self.shown(c)["taken_at"], failed["taken_at"])
        self.assertIn("drift", self.flags(c, lease))
        c.calibrate(lease)
        self.assertTrue(self.take(c, lease)["passed"])
        c.close()
        daemon.restart()
        daemon.wait_for_instrument()
        c, lease = self.ready()
        self.assertNotIn("drift", self.flags(c, lease))

    def test_another_port(self):
        """Neither its references nor its checks are those of the first."""
        self.daemon_of(DRIFTING)
        c, lease = self.ready()
        self.drifted(c, lease)
        c.call("instrument.configure", lease=lease, aperture_mm=3)
        c.calibrate(lease)
        self.assertIsNone(self.shown(c))
        self.assertNotIn("drift", self.flags(c, lease))
        with self.assertRaises(Refused) as caught:
            self.take(c, lease)
        self.assertEqual(caught.exception.reason, "reference_missing")
        self.assertIn("through 3 mm", caught.exception.message)
        c.calibrate(lease)
        self.set(c, lease=lease, replicates=1)
        c.calibrate(lease)
        self.assertTrue(self.take(c, lease)["passed"])
        c.call("instrument.configure", lease=lease, aperture_mm=8)
        c.calibrate(lease)
        self.assertIn("drift", self.flags(c, lease), "a check through 3 mm says nothing of 8 mm")

    def test_another_instrument(self):
        self.daemon_of(DRIFTING + ",serial=A", DRIFTING + ",serial=B")
        with self.daemon.client() as waiting:
            for name in ("simulated", "simulated-2"):
                waiting.acquire(name)
        c = self.client()
        a, b = c.acquire("simulated")["lease"], c.acquire("simulated-2")["lease"]
        c.calibrate(a)
        c.calibrate(b)
        self.drifted(c, a)
        self.assertIn("drift", self.flags(c, a))
        self.assertNotIn("drift", self.flags(c, b))
        with self.refused("reference_missing"):  # a measured one is the instrument's own
            self.take(c, b)
        a_check = self.shown(c)
        self.assertIsNone(self.shown(c, 1))
        c.calibrate(b)
        self.set(c, lease=b, replicates=1)
        c.calibrate(b)
        self.assertTrue(self.take(c, b)["passed"])
        self.assertEqual(self.shown(c), a_check)
        self.assertIn("drift", self.flags(c, a))
        for name, serials in (("simulated", ["A"]), ("simulated-2", ["B"])):
            listed = c.call("check.list", instrument=name)["checks"]
            self.assertEqual([x["serial"] for x in listed], serials)

    def test_another_tile_that_passes(self):
        """What one tile shows, another cannot clear."""
        self.daemon_of(DRIFTING)
        c, lease = self.ready()
        self.drifted(c, lease)
        self.set(c, tile="other", lease=lease, replicates=1, limit=5)
        self.assertTrue(self.take(c, lease, tile="other")["passed"])
        self.assertIn("drift", self.flags(c, lease))
        self.assertEqual(self.shown(c)["tile"], "white")
        c.calibrate(lease)
        self.take(c, lease)
        self.assertNotIn("drift", self.flags(c, lease))
        self.assertEqual(self.shown(c)["tile"], "white", "the newest")

    def test_a_new_reference_alone_clears_nothing(self):
        self.daemon_of(DRIFTING)
        c, lease = self.ready()
        self.drifted(c, lease)
        self.set(c, lease=lease, replicates=1, limit=5)
        self.assertIn("drift", self.flags(c, lease))
        self.assertTrue(self.take(c, lease)["passed"])
        self.assertNotIn("drift", self.flags(c, lease))

    def test_a_spectrum_that_a_client_sent(self):
        """No instrument of the station measured it."""
        self.daemon_of(DRIFTING)
        c, lease = self.ready()
        self.drifted(c, lease)
        kept = c.call("match.spectrum", spectrum=grey(0.4), specular="sce", store=True)
        record = c.call("record.get", id=kept["record"]["id"])
        self.assertNotIn("drift", record["flags"])


class Asking(CheckCase):
    def test_a_retry(self):
        daemon = self.daemon_of(DRIFTING)
        c, lease = self.ready()
        uuid = new_uuid()
        setting = {"uuid": new_uuid(), "tile": "white", "lease": lease, "replicates": 1}
        first = c.call("check.set", **setting)
        self.assertEqual(c.call("check.set", **setting), first)
        check = c.call("check.take", lease=lease, uuid=uuid, tile="white", replicates=2)
        again = c.call("check.take", lease=lease, uuid=uuid.upper(), tile="white", replicates=2)
        self.assertEqual(again, check)
        for more in ({"tile": "other", "replicates": 2}, {"tile": "white", "replicates": 3}):
            with self.refused("uuid_reused"):
                c.call("check.take", lease=lease, uuid=uuid, **more)
        with self.refused("uuid_reused"):
            c.call("check.set", **{**setting, "limit": 3})
        limit = {"uuid": new_uuid(), "tile": "white", "limit": 3}
        c.call("check.set", **limit)
        with self.refused("uuid_reused"):
            c.call("check.set", **limit, lease=lease)
        c.close()
        daemon.restart()
        c = self.client()
        again = c.call("check.take", lease="of-before", uuid=uuid, tile="white", replicates=2)
        self.assertEqual(again, check)
        self.assertEqual(c.call("check.set", **{**setting, "lease": "of-before"}), first)
        self.assertEqual(c.call("check.list")["checks"], [check])

    def test_refused(self):
        self.daemon_of(STILL)
        c = self.client()
        with self.refused("lease_unknown"):
            self.take(c, "none")
        lease = c.acquire()["lease"]
        with self.assertRaises(Refused) as caught:
            self.take(c, lease)
        self.assertEqual(caught.exception.reason, "reference_missing")
        self.assertIn("skinspec check --tile NAME --reference", caught.exception.hint)
        with self.refused("calibration_due"):
            self.set(c, lease=lease)
        certificate = {"spectrum": grey(0.5), "specular": "sce", "aperture_mm": 8}
        self.set(c, **certificate)
        with self.refused("calibration_due"):
            self.take(c, lease)
        with self.refused("reference_missing"):
            self.set(c, tile="unheard-of", limit=1)
        short = {"first_nm": 420, "step_nm": 10, "values": [0.5] * 29}
        wide = {"first_nm": 400, "step_nm": 20, "values": [0.5] * 16}
        for spectrum in (short, wide):
            with self.refused("spectrum_unsuitable"):
                self.set(c, **{**certificate, "spectrum": spectrum})
        for params in (
            {},
            {"lease": lease, **certificate},
            {"spectrum": grey(0.5)},
            {"spectrum": grey(0.5), "specular": "sci", "aperture_mm": 8},
            {"spectrum": grey(50), "specular": "sce", "aperture_mm": 8},
            {"spectrum": grey(0.5), "specular": "sce"},
            {"specular": "sce", "limit": 1},
            {"aperture_mm": 8, "limit": 1},
            {"replicates": 2, "limit": 1},
            {"limit": 0},
            {"limit": 21},
        ):
            with self.subTest(params=params), self.refused("params_invalid"):
                self.set(c, **params)
        for tile in ("", "a b", "-x", "x" * 64):
            with self.subTest(tile=tile), self.refused("params_invalid"):
                self.take(c, lease, tile=tile)
        with self.refused("params_invalid"):  # whoever measures does not choose the limit
            self.take(c, lease, limit=5)
        self.assertEqual(c.call("check.list")["checks"], [])
        with self.refused("instrument_unknown"):
            c.call("check.list", instrument="none")

    def test_rights(self):
        """A kiosk checks and lists; references and limits are for the clinic."""
        described = self.daemon_of(STILL).client().call("rpc.describe")["schema"]
        rights = {m: described["methods"][m]["right"] for m in
                  ("check.take", "check.list", "check.set")}  # fmt: skip
        self.assertEqual(rights, {"check.take": "kiosk", "check.list": "kiosk",
                                  "check.set": "clinic"})  # fmt: skip

    def test_pages(self):
        self.daemon_of(STILL)
        c, lease = self.ready()
        for tile in ("b", "a"):
            self.set(c, tile=tile, lease=lease, replicates=1)
        checks = [self.take(c, lease, tile="ab"[i % 2]) for i in range(5)]
        page = c.call("check.list", limit=2)
        self.assertEqual([t["tile"] for t in page["tiles"]], ["a", "b"])
        self.assertEqual((page["checks"], page["more"]), (checks[:2], True))
        page = c.call("check.list", since_seq=page["next_seq"])
        self.assertEqual((page["checks"], page["more"]), (checks[2:], False))
        self.assertEqual(c.call("check.list", tile="b")["checks"], checks[1::2])
        self.assertEqual(c.call("check.list", tile="c")["checks"], [])
        self.assertTrue(c.call("store.verify", timeout_s=60)["sound"])

    def test_who_goes(self):
        """A lease that ends during the shots: nothing is stored, the instrument is free."""
        self.daemon_of("simulated:speed=1,calibrate_ms=1,charge_ms=1,shot_ms=300")
        c, lease = self.ready()
        self.set(c, lease=lease, replicates=1)
        c.call("events.subscribe", topics=["instrument"])
        asked = c.send("check.take", lease=lease, uuid=new_uuid(), tile="white", replicates=5)
        c.event("instrument", "state", state="measuring")
        c.call("instrument.release", lease=lease)
        with self.refused("measurement_cancelled"):
            c.wait(asked)
        self.assertEqual(c.call("check.list")["checks"], [])
        self.assertNotEqual(c.call("instrument.list")["instruments"][0]["state"], "measuring")

    def test_an_instrument_that_fails(self):
        self.daemon_of(STILL + ",fault=measure:2:silence,fault=measure:4:all_zero")
        c, lease = self.ready()
        self.set(c, lease=lease, replicates=1)
        with self.refused("instrument_timeout"):
            self.take(c, lease)
        self.assertTrue(self.take(c, lease)["passed"])
        with self.refused("measurement_failed"):
            self.take(c, lease)
        self.assertEqual(len(c.call("check.list")["checks"]), 1)

    def unfit(self, c, ask, token, says):
        """Refused by name, and nothing is stored."""
        before = c.call("check.list")
        with self.assertRaises(Refused) as caught:
            ask()
        self.assertEqual(caught.exception.reason, "check_unfit")
        self.assertTrue(caught.exception.retryable)
        self.assertRegex(caught.exception.message, rf"\b{token}: .*{says}")
        self.assertEqual(c.call("check.list"), before)

    def test_a_weak_lamp(self):
        """A mean with a weak flash in it is neither a check nor a reference."""
        self.daemon_of(STILL + ",fault=measure:2:weak_lamp,fault=measure:8:weak_lamp")
        c, lease = self.ready()
        says = "charge the battery .* then check again"
        self.unfit(c, lambda: self.set(c, lease=lease, replicates=3), "lamp_weak", says)
        self.set(c, lease=lease, replicates=3)
        self.unfit(c, lambda: self.take(c, lease, replicates=3), "lamp_weak", says)
        self.assertTrue(self.take(c, lease, replicates=3)["passed"])
        self.assertIsNotNone(self.shown(c))

    def test_shots_that_differ(self):
        """Two by 0.042 about their mean, and one of three by 0.03: skin keeps 0.0165 and 0.0255."""
        self.daemon_of(self.greys(0.5, 0.5, 0.56, 0.5, 0.5, 0.53, 0.5))
        c, lease = self.ready()
        self.set(c, lease=lease, replicates=1)
        says = "clean the tile .* then check again"
        self.unfit(c, lambda: self.take(c, lease, replicates=2), "spread", says)
        self.unfit(c, lambda: self.take(c, lease, replicates=3), "outlier", says)
        self.assertTrue(self.take(c, lease)["passed"])


if __name__ == "__main__":
    main()
