#!/usr/bin/env python3
"""test_station_check.py - `skinspec check`: a check tile, its reference, its history, and what is
said where one of them is not as it should be."""

import json

from station_case import StationCase
from support import main

STILL = "simulated:speed=instant,placement=0,noise=0,unit=0"
DRIFTING = STILL + ",drift=0.02"
BANDS = list(range(400, 701, 10))


def certificate(values=None, nm=BANDS, specular="sce", more=()):
    """The text of a file of one row."""
    names = ["id"] + (["specular"] if specular else []) + [name for name, _ in more]
    fields = ["cyan"] + ([specular] if specular else []) + [text for _, text in more]
    values = values or [0.5] * len(nm)
    return (",".join([*names, *map(str, nm)]) + "\n"
            + ",".join([*fields, *map(str, values)]) + "\n")  # fmt: skip


class CheckCase(StationCase):
    def fresh(self, instrument=STILL):
        """A daemon of the test's own, calibrated."""
        daemon = self.enterContext(self.new_daemon(instruments=(instrument,)))
        self.calibrated(daemon)
        return daemon

    def check(self, *options, daemon, status=0):
        """A check with the tile in place; what it prints."""
        done = self.skinspec("check", "--yes", *options, daemon=daemon)
        self.assertEqual(done.status, status, done.err)
        return done


class Morning(CheckCase):
    def test_a_day(self):
        daemon = self.fresh(DRIFTING)
        done = self.check("--reference", "--tile", "cyan", "--limit", 0.3, "--replicates", 1,
                          daemon=daemon)  # fmt: skip
        self.assertEqual(
            done.out,
            "tile     cyan: its reference is what skinspec simulated d/8 SIM-1 has measured "
            "through 8 mm just now\nlimit    a check passes up to dE00 0.3\n",
        )
        self.calibrated(daemon)
        self.done("calibrate", "--yes", "--force", daemon=daemon)
        passed = self.check("--replicates", 1, "--operator", "Ada", daemon=daemon).out
        self.assertIn("check    passed: dE00 0.00 from its reference, at most 0.3; rms 0.0000\n",
                      passed)  # fmt: skip
        self.assertIn("tile     cyan, skinspec simulated d/8 SIM-1, 8 mm, 1 shot\n", passed)
        self.assertNotIn("drift", passed)
        self.assertIn("check of tile cyan passed at ", self.done("devices", daemon=daemon).out)

        failed = self.check(daemon=daemon, status=1).out
        c = self.client(daemon)
        first, second = c.call("check.list")["checks"]
        self.assertIn(f"check    FAILED: dE00 {second['dE00']:.2f} from its reference", failed)
        self.assertIn("beware   records of this instrument through 8 mm are flagged 'drift'",
                      failed)  # fmt: skip
        self.assertEqual(first["operator"], "Ada")
        shown = self.done("devices", daemon=daemon).out
        self.assertIn("check of tile cyan FAILED at ", shown)
        record = self.done("measure", "--replicates", 1, daemon=daemon).out
        self.assertIn("beware   drift: the last check of the instrument against its tile failed",
                      record)  # fmt: skip

        lines = self.done("check", "--history", daemon=daemon).out.splitlines()
        self.assertEqual(lines[0].split(), ["SEQ", "TAKEN", "TILE", "SERIAL", "APERTURE", "dE00",
                                            "LIMIT", "RESULT"])  # fmt: skip
        for line, check, result in zip(lines[1:], (first, second), ("passed", "FAILED")):
            self.assertEqual(line.split(), [
                str(check["seq"]), check["taken_at"], "cyan", "SIM-1", "8", "mm",
                f"{check['dE00']:.2f}", "0.3", result])  # fmt: skip
        self.assertEqual(len(lines), 3)
        as_json = self.done("check", "--history", "--json", daemon=daemon).json()
        self.assertEqual(as_json, [first, second])
        self.assertEqual(
            self.done("check", "--history", "--tile", "other", "--json", daemon=daemon).json(), []
        )

    def test_json(self):
        daemon = self.fresh()
        tile = self.check("--reference", "--json", daemon=daemon).json()
        self.assertEqual((tile["tile"], tile["source"], tile["replicates"]), ("tile", "measured", 3))
        check = self.check("--json", daemon=daemon).json()
        c = self.client(daemon)
        self.assertEqual(c.call("check.list")["checks"], [check])
        self.assertEqual(check["reference_id"], tile["id"])

    def test_a_certificate(self):
        """No lease is wanted for it, and the limit alone is another matter."""
        daemon = self.fresh()
        path = self.file(certificate(), "certificate.csv")
        out = self.check("--reference", path, "--tile", "cyan", daemon=daemon).out
        self.assertEqual(
            out,
            "tile     cyan: its reference is the certificate, for every instrument through 8 mm\n"
            "limit    a check passes up to dE00 0.5\n",
        )
        check = self.check("--json", daemon=daemon, status=1).json()
        self.assertEqual(check["limit"], 0.5)
        out = self.done("check", "--limit", 20, daemon=daemon).out
        self.assertEqual(out, "tile     cyan: a check passes up to dE00 20 from here on\n")
        again = self.skinspec("check", "--yes", "--json", daemon=daemon).json()
        self.assertEqual((again["limit"], again["dE00"]), (20, check["dE00"]))

    def test_a_person(self):
        """Guided through the calibration, then the tile, then asked for no more."""
        with self.new_daemon(instruments=(STILL,)) as daemon:
            with self.terminal("check", "--reference", "--tile", "cyan", daemon=daemon) as person:
                for _ in ("zero", "white"):
                    person.expect("then press Enter: ")
                    person.type("\n")
                person.expect("put the port on the check tile 'cyan'")
                person.expect("then press Enter: ")
                person.type("\n")
                status, shown = person.end()
            self.assertEqual(status, 0, shown)
            with self.terminal("check", daemon=daemon) as person:
                person.expect("put the port on the check tile 'cyan'")
                person.expect("then press Enter: ")
                person.type("\n")
                status, shown = person.end()
            self.assertEqual(status, 0, shown)
            self.assertIn("check    passed", shown)


class Refusing(CheckCase):
    instruments = (STILL,)

    def test_before_there_is_one(self):
        daemon = self.fresh()
        self.refuses(1, "check", "--yes", daemon=daemon,
                     says=["no check tile has a reference yet", "--tile NAME --reference"])  # fmt: skip
        self.refuses(1, "check", "--yes", "--tile", "cyan", daemon=daemon,
                     says=["(reference_missing)", "'skinspec check --tile NAME --reference'"])  # fmt: skip
        self.refuses(1, "check", "--tile", "cyan", "--limit", 1, daemon=daemon,
                     says="(reference_missing)")  # fmt: skip
        self.assertEqual(self.done("check", "--history", "--json", daemon=daemon).json(), [])

    def test_several_tiles(self):
        daemon = self.fresh()
        for tile in ("cyan", "white"):
            self.check("--reference", "--tile", tile, daemon=daemon)
        self.refuses(2, "check", "--yes", daemon=daemon, says="the station knows cyan, white")
        self.check("--tile", "white", daemon=daemon)

    def test_another_port(self):
        daemon = self.fresh()
        self.check("--reference", "--tile", "cyan", daemon=daemon)
        with daemon.client() as c:
            lease = c.acquire(wait=True)["lease"]
            c.call("instrument.configure", lease=lease, aperture_mm=3)
            c.calibrate(lease)
        self.refuses(1, "check", "--yes", daemon=daemon, says=["through 3 mm", "reference_missing"])

    def test_not_calibrated_and_nobody_there(self):
        self.check_reference_by_file()
        self.refuses(1, "check", "--yes", "--tile", "by-file",
                     says="run 'skinspec calibrate' first")  # fmt: skip
        daemon = self.fresh()
        self.check("--reference", daemon=daemon)
        self.refuses(2, "check", daemon=daemon, says="--yes says that it lies under the port")

    def check_reference_by_file(self):
        self.done("check", "--reference", self.file(certificate(), "certificate.csv"), "--tile", "by-file")

    def test_bad_certificates(self):
        """Each is named by file, line and column, and nothing is set."""
        percent = [50.0] * len(BANDS)
        two = certificate() + certificate().splitlines()[1] + "\n"
        for what, text, says in (
            ("bands missing at the red end", certificate(nm=BANDS[:-2]),
             ["1:", "cover 400..700 nm", "400..680 by 10"]),
            ("by 20 nm", certificate(nm=BANDS[::2]), ["by 10, 5 or 1 nm", "400..700 by 20"]),
            ("a gap", certificate(nm=[n for n in BANDS if n != 550]), ["even step"]),
            ("in micrometres", certificate(nm=[n / 1000 for n in BANDS]), ["expected nanometres"]),
            ("SCI", certificate(specular="sci"), ["2:", "includes the mirror reflection"]),
            ("not said", certificate(specular=None), ["2:", "add a column 'specular'"]),
            ("percent", certificate(percent), ["2:", "percent"]),
            ("a value that is none", certificate([0.5] * 30 + ["x"]), ["2:"]),
            ("two of them", two, ["3:", "a second spectrum"]),
            ("none", certificate().splitlines()[0] + "\n", ["no spectrum"]),
            ("nothing at all", "", ["empty"]),
            ("another port", certificate(more=[("aperture_mm", "3")]),
             ["2:", "a port of 3 mm", "set to 8 mm"]),
            ("a port that is none", certificate(more=[("aperture_mm", "wide")]), ["is no number"]),
        ):  # fmt: skip
            with self.subTest(what=what):
                path = self.file(text, "bad.csv")
                done = self.refuses(1, "check", "--reference", path, "--tile", "bad",
                                    says=["bad.csv", *says])  # fmt: skip
                self.assertEqual(done.out, "")
        self.refuses(1, "check", "--reference", self.folder() + "/none.csv", "--tile", "bad",
                     says="No such file")  # fmt: skip
        tiles = [t["tile"] for t in self.client().call("check.list")["tiles"]]
        self.assertNotIn("bad", tiles)
        good = certificate(more=[("aperture_mm", "8"), ("lot", "17")])
        self.done("check", "--reference", self.file(good), "--tile", "with-port")

    def test_usage(self):
        for options, says in (
            (("--limit", "0"), "--limit"),
            (("--limit", "wide"), "--limit"),
            (("--tile", "a b"), "--tile"),
            (("--tile", "-a"), "--tile"),
            (("--tile", "a" * 64), "--tile"),
            (("--replicates", "33"), "--replicates"),
            (("certificate.csv",), "goes with --reference"),
            (("--reference", "a.csv", "b.csv"), ""),
            (("--history", "--reference"), "--history shows"),
            (("--history", "--limit", "1"), "--history shows"),
            (("--limit", "1", "--replicates", "2"), "nothing is measured"),
            (("--reference", "a.csv", "--replicates", "2"), "nothing is measured"),
        ):
            with self.subTest(options=options):
                self.refuses(2, "check", *options, says=says)
        self.refuses(1, "check", "--yes", "--tile", "x", "--instrument", "none",
                     says="there is no instrument 'none'")  # fmt: skip
        self.refuses(1, "check", "--history", "--instrument", "none", says="(instrument_unknown)")

    def test_help(self):
        shown = " ".join(self.done("check", "--help").out.split())
        for text in ("--reference", "--history", "the flag 'drift'", "skinspec check --tile cyan",
                     "Exit status 0 where it passed"):  # fmt: skip
            self.assertIn(text, shown)
        self.assertIn("check", self.done("--help").out)


class Watching(CheckCase):
    def test_events(self):
        daemon = self.fresh(DRIFTING)
        self.check("--reference", "--replicates", 1, "--limit", 0.3, daemon=daemon)
        self.check(daemon=daemon, status=1)
        seen = []
        with self.start("watch", "--since", 0, "--topics", "calibration", "--json", stdout=-1,
                        stderr=-1, daemon=daemon) as watch:  # fmt: skip
            while not seen or seen[-1]["type"] != "drift":
                seen.append(json.loads(watch.stdout.readline()))
            watch.terminate()
            watch.communicate(timeout=30)
        self.assertEqual([e["type"] for e in seen[-2:]], ["checked", "drift"])
        self.assertTrue(seen[-1]["data"]["drift"])


if __name__ == "__main__":
    main()
