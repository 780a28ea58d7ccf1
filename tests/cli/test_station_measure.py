#!/usr/bin/env python3
"""test_station_measure.py - `skinspec measure` and `calibrate` through a real skinspecd, with a
person at a terminal and without, and what can go wrong on the way."""

import os
import signal
import time
import uuid

from station_case import FAST, StationCase, all_records
from support import TIMEOUT_S, Terminal, main, run

UUID = "[0-9a-f]{8}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{12}"
# The second shot takes a minute, all else nothing.
SLOW = "simulated:charge_ms=1,shot_ms=1,calibrate_ms=1,slow_ms=60000,fault=measure:2:slow"


class Measure(StationCase):
    """One instrument, calibrated."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        with cls.daemon.client() as c:
            c.calibrate(c.acquire()["lease"])

    def test_json_is_the_record(self):
        done = self.done("measure", "--json", "--site", "forearm", "--operator", "Ada")
        record = done.json()
        self.assertEqual(all_records(self.client(), record["seq"] - 1), [record])
        self.assertEqual((record["site"], record["operator"]), ("forearm", "Ada"))
        self.assertEqual((record["specular"], len(record["replicates"])), ("sce", 3))
        self.assertEqual(len(done.out.splitlines()), 1)
        self.assertIn("shot 1 of 3 taken", done.err)

    def test_for_a_person(self):
        """The numbers of the record, rounded here."""
        out = self.done("measure", "--site", "Stirn", "--operator", "Ada", "--replicates", 1).out
        r = all_records(self.client())[-1]
        m, (L, a, b), (R, G, B) = r["match"], r["Lab"], r["sRGB"]
        for text in (
            f"record {r['seq']}  {r['id']}\n",
            f"taken    {r['taken_at']} by Ada, skinspec simulated d/8 SIM-1, 8 mm, sce, 1 shot\n",
            "site     Stirn\n",
            f"colour   L* {L:.1f}  a* {a:.1f}  b* {b:.1f}   sRGB {R} {G} {B} #{R:02X}{G:02X}{B:02X}",
            f"ITA      {r['ITA']:.1f} degrees: ",
            f"skin     Cm {m['Cm']:.4f}  Bm {m['Bm']:.2f}  Ch {m['Ch']:.4f}   "
            f"melanin {100 * m['Cm']:.2f} %, blood {100 * m['Ch']:.2f} %\n",
            f"distance {m['distance']:.4g} by spectrum, dE00 {m['dE00']:.2f}, rms {m['rms']:.4f}; "
            "table two-layer\n",
            "beware   single: only one shot",
        ):
            self.assertIn(text, out)
        self.assertEqual(r["flags"], ["single"])
        self.assertIn("0.00 +----", out, "the spectrum is drawn")

    def test_the_swatch(self):
        """On a terminal with colours: the record's sRGB as background."""
        with self.terminal("measure") as person:
            status, shown = person.end()
        self.assertEqual(status, 0)
        self.assertNotIn("\033", shown, "TERM=dumb")
        with Terminal("measure", env=self.env(TERM="xterm-256color")) as person:
            shown = person.end()[1]
        R, G, B = all_records(self.client())[-1]["sRGB"]
        self.assertIn(f"\033[48;2;{R};{G};{B}m", shown)

    def test_a_uuid_measures_once(self):
        own = str(uuid.uuid4())
        first = self.done("measure", "--uuid", own, "--json").json()
        again = self.done("measure", "--uuid", own, "--json").json()
        self.assertEqual(first, again)
        self.assertEqual(first["uuid"], own)
        done = self.refuses(1, "measure", "--uuid", own, "--site", "cheek", says="(uuid_reused) - ")
        self.assertEqual(done.out, "")
        other = self.done("measure", "--json").json()
        self.assertNotEqual(other["uuid"], own)

    def test_how_it_is_matched(self):
        r = self.done("measure", "--by", "lab", "--table", "paper", "--json").json()
        self.assertEqual((r["match"]["by"], r["match"]["table"]), ("lab", "paper"))
        r = self.done("measure", "--specular", "sci", "--surface", 0.04, "--json").json()
        self.assertEqual((r["specular"], r["surface"]), ("sce", 0.04), "the mirror part is off")
        self.assertEqual(len(r["replicates_sci"]), 3)

    def test_whose_skin(self):
        subject = self.done("store", "add-subject", "--label", "P1").out.strip()
        r = self.done("measure", "--subject", subject, "--json").json()
        self.assertEqual(r["subject"], subject)
        self.assertIn(f"subject  {subject}\n", self.done("history", r["id"]).out)

    def test_what_the_station_refuses(self):
        """Its message, its reason, its hint; nothing is stored, the instrument is free."""
        before = len(all_records(self.client()))
        for options, reason in (
            (("--table", "none"), "table_unknown"),
            (("--subject", str(uuid.uuid4())), "subject_unknown"),
            (("--site", "x" * 256), "params_invalid"),
            (("--operator", "a\nb"), "params_invalid"),
        ):
            with self.subTest(options=options):
                done = self.refuses(1, "measure", *options, says=f"({reason}) - ")
                self.assertEqual(done.out, "")
                self.assertEqual(done.err.count("skinspec: "), 1, done.err)
        c = self.client()
        self.assertEqual(len(all_records(c)), before)
        self.assertFalse(c.call("instrument.list")["instruments"][0]["leased"])

    def test_usage(self):
        for options, says in (
            (("--specular", "sci"), "--surface"),
            (("--surface", "0.04"), "--specular sci"),
            (("--specular", "both"), "--specular: 'both'"),
            (("--surface", "0.2"), "--surface"),
            (("--replicates", "0"), "1..32"),
            (("--replicates", "33"), "1..32"),
            (("--pace", "quick"), "--pace: 'quick'"),
            (("--by", "nose"), "--by: 'nose'"),
            (("--uuid", "1234"), "--uuid: '1234' is no uuid"),
            (("--subject", "Bob"), "--subject: 'Bob' is no uuid"),
            (("forearm",), "'forearm' is not expected"),
        ):
            with self.subTest(options=options):
                self.refuses(2, "measure", *options, says=says)

    def test_somebody_else_has_it(self):
        """Refused, or waited for, as asked."""
        c = self.client()
        lease = c.acquire()["lease"]
        self.refuses(1, "measure", says=("(instrument_busy) - ", "with --wait"))
        self.refuses(1, "calibrate", says="(instrument_busy)")
        with self.start("measure", "--wait", "--json", stdout=-1, stderr=-1) as child:
            self.assertIn(b"place 1 in the queue", child.stderr.readline())
            self.assertIsNone(child.poll())
            c.call("instrument.release", lease=lease)
            out, err = child.communicate(timeout=TIMEOUT_S)
        self.assertEqual(child.returncode, 0, err)
        self.assertIn(b'"match"', out)

    def test_ctrl_c_in_the_queue(self):
        """Whoever gives up waiting leaves the queue."""
        c = self.client()
        c.acquire()
        with self.start("measure", "--wait", stdout=-1, stderr=-1) as child:
            child.stderr.readline()
            child.send_signal(signal.SIGINT)
            child.communicate(timeout=TIMEOUT_S)
        self.assertEqual(child.returncode, -signal.SIGINT)
        until = time.monotonic() + 10
        while c.call("instrument.list")["instruments"][0]["queue"] > 0:
            self.assertLess(time.monotonic(), until)


class Choosing(StationCase):
    instruments = (FAST + ",serial=A", FAST + ",serial=B")

    def test_which_of_several(self):
        names = [x["instrument"] for x in self.client().call("instrument.list")["instruments"]]
        self.assertEqual(len(set(names)), 2)
        for command in ("measure", "calibrate"):
            self.refuses(2, command, says=("--instrument NAME", *names))
            self.refuses(1, command, "--instrument", "none", says=("'none'", *names))
        self.done("calibrate", "--yes", "--instrument", names[1])
        r = self.done("measure", "--instrument", names[1], "--json").json()
        self.assertEqual(r["serial"], "B")
        self.refuses(1, "measure", "--instrument", names[0], says="skinspec calibrate")

    def test_a_station_without(self):
        with self.new_daemon(instruments=()) as daemon:
            self.refuses(1, "measure", says="none; skinspecd --instrument", daemon=daemon)
            self.assertIn("none; skinspecd", self.done("devices", daemon=daemon).out)


class Calibrate(StationCase):
    def test_a_person_is_guided(self):
        """Zero, then white; then nothing is due; then all by force."""
        with self.new_daemon() as daemon:
            due = self.client(daemon).call("instrument.list")["instruments"][0]["calibration"]
            with self.terminal("calibrate", daemon=daemon) as person:
                for step in due:
                    self.assertIn(
                        f"{step['step']}: {step['place']}", person.expect("then press Enter: ")
                    )
                    person.type("\n")
                    self.assertRegex(
                        person.expect(")\n"),
                        r"done, good until \d{4}-\d\d-\d\d \d\d:\d\d \((7 h 59|8 h 0) min\)",
                    )
                self.assertEqual(person.end()[0], 0)
            done = self.done("calibrate", daemon=daemon)
            self.assertEqual(done.out, "simulated: nothing is due\n")
            self.assertEqual(self.done("calibrate", "--json", daemon=daemon).json(), [])
            steps = self.done("calibrate", "--force", "--yes", "--json", daemon=daemon).json()
            self.assertEqual([x["step"] for x in steps], ["zero", "white"])
            self.assertNotEqual(steps[0]["calibration_id"], steps[1]["calibration_id"])
            self.assertEqual(
                self.done("calibrate", "--force", "--yes", daemon=daemon).out.count("done"), 2
            )

    def test_measure_guides_too(self):
        with self.new_daemon() as daemon:
            self.refuses(1, "measure", says="run 'skinspec calibrate' first", daemon=daemon)
            with self.terminal("measure", daemon=daemon) as person:
                person.expect("zero box")
                person.expect("then press Enter: ")
                person.type("\n")
                person.expect("white tile")
                person.expect("then press Enter: ")
                person.type("\n")
                status, shown = person.end()
            self.assertEqual(status, 0, shown)
            self.assertIn("record 1  ", shown)

    def test_nobody_to_ask(self):
        with self.new_daemon() as daemon:
            self.refuses(2, "calibrate", says=("no terminal", "--yes"), daemon=daemon)
            state = self.client(daemon).call("instrument.list")["instruments"][0]
            self.assertEqual((state["state"], state["leased"]), ("calibration_due", False))

    def test_what_is_misplaced_is_asked_for_again(self):
        """The second calibration finds black where white should lie."""
        instruments = (FAST + ",fault=calibrate:2:swapped",)
        with self.new_daemon(instruments=instruments) as daemon:
            with self.terminal("calibrate", daemon=daemon) as person:
                person.expect("then press Enter: ")
                person.type("\n")
                person.expect("white: ")
                person.expect("then press Enter: ")
                person.type("\n")
                person.expect("(calibration_implausible")
                person.expect("white: ")
                person.expect("then press Enter: ")
                person.type("\n")
                person.expect("done, good until")
                self.assertEqual(person.end()[0], 0)
        with self.new_daemon(instruments=instruments) as daemon:
            done = self.refuses(
                1, "calibrate", "--yes", says="(calibration_implausible", daemon=daemon
            )
            self.assertIn("zero: ", done.out)
            self.assertEqual(done.out.count("done"), 1)

    def test_the_person_gives_up(self):
        with self.new_daemon() as daemon:
            with self.terminal("calibrate", daemon=daemon) as person:
                person.expect("then press Enter: ")
                person.type("\x04")  # Ctrl-D
                status, shown = person.end()
            self.assertEqual(status, 1)
            self.assertIn("not calibrated: standard input has ended", shown)
            with self.terminal("calibrate", daemon=daemon) as person:
                person.expect("then press Enter: ")
                person.process.send_signal(signal.SIGINT)
                self.assertEqual(person.end()[0], -signal.SIGINT)
            with self.terminal("calibrate", daemon=daemon) as person:
                person.expect("then press Enter: ")
                daemon.kill()
                status, shown = person.end()
            self.assertEqual(status, 1)
            self.assertIn("the connection to the station ended", shown)

    def test_an_instrument_that_fails(self):
        with self.new_daemon(instruments=(FAST + ",fault=calibrate:1:lamp",)) as daemon:
            done = self.refuses(1, "calibrate", "--yes", says="(instrument_fault", daemon=daemon)
            self.assertNotIn("done", done.out)
            self.calibrated(daemon)


class Prompted(StationCase):
    def setUp(self):
        self.button = os.path.join(self.folder(), "button")
        with open(self.button, "wb"):
            pass
        self.own = self.new_daemon(instruments=(f"{FAST},button_file={self.button}",))
        self.enterContext(self.own)
        self.calibrated(self.own)

    def test_enter_and_the_button(self):
        with self.terminal("measure", "--pace", "prompt", daemon=self.own) as person:
            person.expect("shot 1 of 3 taken")
            person.expect("for shot 2 of 3 press Enter or the instrument's button\n")
            person.type("\n")
            person.expect("for shot 3 of 3 press Enter or the instrument's button\n")
            while person.process.poll() is None:  # the first may come before it is waited for
                os.utime(self.button)
                time.sleep(0.05)
            status, shown = person.end()
        self.assertEqual(status, 0, shown)
        self.assertEqual(len(all_records(self.client(self.own))[0]["replicates"]), 3)

    def test_lines_of_a_pipe(self):
        """Each line takes a shot; what is typed before counts in a pipe."""
        done = self.done("measure", "--pace", "prompt", "--json", daemon=self.own, stdin="\nwhat\n")
        self.assertEqual(len(done.json()["replicates"]), 3)

    def test_ctrl_c(self):
        """Nothing is stored, the instrument is free, and the signal takes its course."""
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            with self.terminal("measure", "--pace", "prompt", daemon=self.own) as person:
                person.expect("for shot 2 of 3")
                person.process.send_signal(number)
                status, shown = person.end()
            self.assertEqual(status, -number)
            self.assertIn("cancelled; nothing was stored", shown)
            c = self.client(self.own)
            self.assertEqual(all_records(c), [])
            self.assertFalse(c.call("instrument.list")["instruments"][0]["leased"])

    def test_the_lease_is_taken_away(self):
        """The station stops meanwhile: said, with the way to find out."""
        with self.terminal("measure", "--pace", "prompt", daemon=self.own) as person:
            person.expect("for shot 2 of 3")
            self.own.stop()
            status, shown = person.end()
        self.assertEqual(status, 1)
        self.assertRegex(shown, r"skinspec: .*(ended|cancelled|shutting_down)")


class Faults(StationCase):
    def failing(self, fault, reason, *options):
        """A fault at the second shot; the next measurement is a good one where it can be."""
        with self.new_daemon(instruments=(f"{FAST},fault=measure:2:{fault}",)) as daemon:
            self.calibrated(daemon)
            done = self.refuses(1, "measure", *options, says=f"({reason}", daemon=daemon)
            self.assertEqual(done.out, "")
            c = self.client(daemon)
            self.assertEqual(all_records(c), [])
            self.assertFalse(c.call("instrument.list")["instruments"][0]["leased"])
            return c.call("instrument.list")["instruments"][0]["state"]

    def test_faults_in_the_middle(self):
        for fault, reason in (
            ("all_zero", "measurement_failed"),
            ("lamp", "instrument_fault"),
            ("garbage", "instrument_protocol"),
            ("battery", "instrument_battery"),
        ):
            with self.subTest(fault=fault):
                self.failing(fault, reason)

    def test_unplugged(self):
        self.failing("gone", "instrument_gone")

    def test_ctrl_c_while_a_shot_is_taken(self):
        with self.new_daemon(instruments=(SLOW,)) as daemon:
            self.calibrated(daemon)
            with self.start("measure", daemon=daemon, stdout=-1, stderr=-1) as child:
                self.assertIn(b"shot 1 of 3 taken", child.stderr.readline())
                begun = time.monotonic()
                child.send_signal(signal.SIGINT)
                out, err = child.communicate(timeout=TIMEOUT_S)
            self.assertLess(time.monotonic() - begun, 10)
            self.assertEqual((child.returncode, out), (-signal.SIGINT, b""))
            self.assertIn(b"cancelled; nothing was stored", err)
            self.assertEqual(all_records(self.client(daemon)), [])

    def test_killed_while_a_shot_is_taken(self):
        """Neither Ctrl-C nor release: the end of the connection frees the instrument."""
        with self.new_daemon(instruments=(SLOW,)) as daemon:
            self.calibrated(daemon)
            with self.start("measure", daemon=daemon, stdout=-1, stderr=-1) as child:
                child.stderr.readline()
                child.kill()
                child.communicate(timeout=TIMEOUT_S)
            c = self.client(daemon)
            c.acquire(wait=True, timeout_s=20)

    def test_the_station_is_killed(self):
        with self.new_daemon(instruments=(SLOW,)) as daemon:
            self.calibrated(daemon)
            with self.start("measure", daemon=daemon, stdout=-1, stderr=-1) as child:
                child.stderr.readline()
                daemon.kill()
                err = child.communicate(timeout=TIMEOUT_S)[1].decode()
            self.assertEqual(child.returncode, 1)
            self.assertRegex(
                err, f"whether the measurement was stored is not known.*--uuid {UUID} "
            )

    def test_a_full_output(self):
        """The reading is stored, but the command has failed: it could not say so."""
        with self.new_daemon() as daemon, open("/dev/full", "wb") as full:
            self.calibrated(daemon)
            for options in ((), ("--json",)):
                with self.start(
                    "measure", *options, daemon=daemon, stdout=full, stderr=-1
                ) as child:
                    err = child.communicate(timeout=TIMEOUT_S)[1]
                self.assertEqual(child.returncode, 1)
                self.assertIn(b"cannot write the results: No space", err)
            self.assertEqual(len(all_records(self.client(daemon))), 2)


class Alone(StationCase):
    def test_without_a_station(self):
        for command in (("measure",), ("calibrate",)):
            done = run(*command, "--socket", os.path.join(self.folder(), "s"))
            self.assertEqual(done.status, 1)
            self.assertIn("no station answers", done.err)


if __name__ == "__main__":
    main()
