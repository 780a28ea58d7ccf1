#!/usr/bin/env python3
"""test_station_watch.py - `skinspec watch`, `status` and `devices` through a real skinspecd, and
what all commands of the station have in common: help, --json, usage."""

import json
import os
import re
import signal
import subprocess

from station_case import FAST, Daemon, StationCase
from support import ROOT, SKINSPEC, TABLES, TIMEOUT_S, Case, environment, main, run

COMMANDS = (
    ("measure",),
    ("calibrate",),
    ("devices",),
    ("status",),
    ("watch",),
    ("history",),
    ("export",),
    ("store",),
    ("store", "verify"),
    ("store", "begin-anew"),
    ("store", "subjects"),
    ("store", "add-subject"),
    ("store", "forget-subject"),
)


class Watch(StationCase):
    def watching(self, *options, **more):
        """A watch that misses nothing from here on, however late it subscribes."""
        before = self.client().call("status.get")["event_seq"]
        return self.start("watch", "--since", before, *options, stdout=-1, stderr=-1, **more)

    def test_events_as_they_come(self):
        with self.watching("--json") as child:
            self.done("calibrate", "--force", "--yes")
            record = self.done("measure", "--replicates", 1, "--site", "x", "--json").json()
            events = []
            while ("store", "record") not in [(x["topic"], x["type"]) for x in events]:
                events.append(json.loads(child.stdout.readline()))
            child.send_signal(signal.SIGINT)
            err = child.communicate(timeout=TIMEOUT_S)[1]
        self.assertEqual((child.returncode, err), (0, b""))
        seqs = [x["seq"] for x in events]
        self.assertEqual(seqs, list(range(seqs[0], seqs[0] + len(seqs))), "none is left out")
        kinds = [(x["topic"], x["type"]) for x in events]
        for kind in (
            ("lease", "granted"),
            ("calibration", "done"),
            ("lease", "freed"),
            ("measurement", "started"),
            ("measurement", "shot"),
            ("measurement", "done"),
        ):
            self.assertIn(kind, kinds)
        self.assertEqual(events[-1]["data"], {"id": record["id"], "seq": record["seq"]})

    def test_for_a_person(self):
        with self.watching("--topics", "store,calibration") as child:
            self.done("calibrate", "--force", "--yes")
            (record,) = self.store(1)
            lines = []
            while "store/record" not in "".join(lines):
                lines.append(child.stdout.readline().decode())
            child.send_signal(signal.SIGTERM)
            child.communicate(timeout=TIMEOUT_S)
        self.assertEqual(child.returncode, 0)
        self.assertRegex(
            lines[-1], rf"^ +\d+  store/record  id {record['id']}  seq {record['seq']}\n$"
        )
        self.assertNotIn("lease/", "".join(lines))
        self.assertRegex("".join(lines), r"calibration/done  instrument simulated  step zero\n")

    def test_from_before(self):
        """--since: what the station still has, before what comes."""
        (newest,) = self.store(3)[-1:]
        events, c = [], self.client()
        c.call("events.subscribe", topics=["store"], since_seq=0)
        while not events or events[-1]["data"].get("id") != newest["id"]:
            events.append(c.event("store", "record"))
        with self.start(
            "watch", "--json", "--topics", "store", "--since", events[0]["seq"] - 1, stdout=-1
        ) as child:
            seen = [json.loads(child.stdout.readline()) for _ in events]
            child.terminate()
            child.communicate(timeout=TIMEOUT_S)
        self.assertGreaterEqual(len(events), 3)
        self.assertEqual(seen, events)

    def test_lost(self):
        """A number that was never given out."""
        with self.start("watch", "--json", "--since", 10**6, stdout=-1) as child:
            lost = json.loads(child.stdout.readline())["lost"]
            child.terminate()
            child.communicate(timeout=TIMEOUT_S)
        self.assertEqual(lost["since_seq"], 10**6)
        self.assertIn("instruments", lost["snapshot"])

    def test_the_station_stops(self):
        with self.new_daemon(instruments=()) as daemon:
            self.store(1, daemon)
            with self.start("watch", "--since", 0, daemon=daemon, stdout=-1, stderr=-1) as child:
                child.stdout.readline()
                daemon.stop()
                err = child.communicate(timeout=TIMEOUT_S)[1]
        self.assertEqual(child.returncode, 1)
        self.assertIn(b"the connection to the station ended", err)

    def test_a_full_output(self):
        with open("/dev/full", "wb") as full:
            with self.start("watch", "--since", 0, stdout=full, stderr=-1) as child:
                err = child.communicate(timeout=TIMEOUT_S)[1]
        self.assertEqual(child.returncode, 1)
        self.assertIn(b"cannot write the results: No space", err)

    def test_ignored_signals_stay_ignored(self):
        """As under nohup: SIGHUP changes nothing."""
        child = subprocess.Popen(
            ["sh", "-c", 'trap "" HUP; exec "$0" watch --json', SKINSPEC],
            env=self.env(),
            stdout=subprocess.PIPE,
        )
        with child, self.daemon.client() as c:
            while c.call("status.get")["clients"] < 2:
                pass
            child.send_signal(signal.SIGHUP)
            self.done("calibrate", "--force", "--yes")
            self.assertIn(b'"topic"', child.stdout.readline())
            child.send_signal(signal.SIGINT)
            child.communicate(timeout=TIMEOUT_S)
        self.assertEqual(child.returncode, 0)

    def test_usage(self):
        for options, says in (
            (("--topics", "store,weather"), "'weather' is none of"),
            (("--topics", ","), "which"),
            (("--since", "x"), "--since"),
            (("store",), "not expected"),
        ):
            self.refuses(2, "watch", *options, says=says)


class Standing(StationCase):
    """status and devices."""

    def test_json_is_what_the_station_says(self):
        c = self.client()
        got = self.done("status", "--json").json()
        said = c.call("status.get")
        for name in ("uptime_s", "time", "clients"):
            self.assertIn(name, got)
            del got[name], said[name]
        self.assertEqual(got, said)
        self.assertEqual(self.done("devices", "--json").json(), said["instruments"])
        self.assertEqual(self.done("devices", "--ndjson").ndjson(), said["instruments"])

    def test_for_a_person(self):
        self.store(1)
        status = self.client().call("status.get")
        out = self.done("status").out
        for text in (
            f"station   {status['server']}, up 0 min, id {status['station_id']}\n",
            "store     ok\n",
            "table     ready\n",
            f"records   last {status['last_seq']}\n",
            "you as admin\n",
        ):
            self.assertIn(text, out)
        instrument = status["instruments"][0]
        devices = self.done("devices").out
        self.assertTrue(out.endswith(devices), "status ends with the instruments")
        for name in ("instrument", "state", "model", "serial", "geometry"):
            self.assertIn(instrument[name], devices)
        for step in instrument["calibration"]:
            self.assertIn(f"{step['step']} is due (none on record): {step['place']}\n", devices)
        self.assertIn("8 mm", devices)
        self.assertIn(f"{instrument['battery_percent']} %", devices)

    def test_in_use_and_calibrated(self):
        with self.new_daemon() as daemon:
            c = self.client(daemon)
            lease = c.acquire(ttl_ms=600000)["lease"]
            c.calibrate(lease)
            other = self.client(daemon)
            other.send("instrument.acquire", instrument="simulated", ttl_ms=1000, wait=True)
            while c.call("instrument.list")["instruments"][0]["queue"] == 0:
                pass
            out = self.done("devices", daemon=daemon).out
            self.assertRegex(out, r"in use for up to (9|10) min, 1 waiting\n")
            self.assertRegex(out, r"zero is good for (7 h 59|8 h 0) min\n")
            c.call("instrument.renew", lease=lease, ttl_ms=20000)
            self.assertRegex(
                self.done("devices", daemon=daemon).out, r"in use for up to (19|20) s, 1"
            )

    def test_an_instrument_that_cannot_be_opened(self):
        with self.new_daemon(instruments=(FAST + ",fault=open:1+:no_permission",)) as daemon:
            error = self.client(daemon).call("instrument.list")["instruments"][0]["error"]
            self.assertGreater(len(error), 10)
            out = self.done("devices", daemon=daemon).out
            self.assertIn(error + "\n", out)
            self.refuses(1, "calibrate", "--yes", says=error, daemon=daemon)

    def test_without_a_table(self):
        """What is wrong and which command helps; exit status 0: the station has answered."""
        with Daemon(instruments=(), tables=self.folder(), cwd="/") as daemon:
            with daemon.client() as c:
                while c.call("status.get")["table"] == "loading":
                    pass
            out = self.done("status", daemon=daemon).out
        self.assertRegex(out, r"\ntable     missing: .*skinspec table build")


class Common(Case):
    def test_every_command_helps(self):
        for command in COMMANDS:
            with self.subTest(command=command):
                done = self.run_ok(*command, "--help")
                self.assertEqual(done.err, "")
                self.assertIn("Usage: skinspec " + command[0], done.out)
                self.assertLessEqual(max(map(len, done.out.splitlines())), 80)
                if command != ("store",):
                    self.assertRegex(done.out, rf"Examples?:\s+skinspec {' '.join(command)}")
                    self.assertIn("--json", done.out)
                    self.assertIn("--socket=PATH", done.out)
                    self.refused(2, *command, "--colour", says=("--colour", "--help"))
        for command in COMMANDS:
            self.assertIn(f"\n  {command[0]} ", self.run_ok("--help").out)

    def test_help_that_cannot_be_written(self):
        for command in ((), ("store",), ("table",), ("measure",), ("match",)):
            for option in ("--help", "--version") if command == () else ("--help",):
                with self.subTest(command=command), open("/dev/full", "wb") as full:
                    done = subprocess.run(
                        [SKINSPEC, *command, option],
                        stdout=full,
                        stderr=subprocess.PIPE,
                        env=environment(),
                        timeout=TIMEOUT_S,
                        check=False,
                    )
                    self.assertEqual(done.returncode, 1)
                    self.assertEqual(
                        done.stderr,
                        b"skinspec: cannot write the results: No space left on device\n",
                    )

    def test_every_flag_has_words(self):
        """Of the station's checks (but those that refuse a shot), matches and instruments: as
        their sources list them."""
        names = set()
        for path, begin, end in (
            ("src/station/quality.c", "flags[QUALITY_FLAGS]", "};"),
            ("src/match/match.c", "match_flag_name", ";"),
            ("drivers/driver.c", "driver_warning_name", ";"),
        ):
            with open(os.path.join(ROOT, path), encoding="utf-8") as f:
                text = f.read()
            text = text[text.index(begin) :]
            text = text[text.index("{") : text.index(end, text.index("{"))]
            found = re.findall(r'"([A-Za-z_]+)"', text)
            self.assertGreaterEqual(len(found), 4, path)
            names.update(found)
        refused = {"wrong_bands", "not_finite", "out_of_range", "all_zero", "white_black_swapped"}
        with open(os.path.join(ROOT, "src/cli/record_out.c"), encoding="utf-8") as f:
            known = set(re.findall(r'\{ "([A-Za-z_]+)",', f.read()))
        self.assertEqual(names - refused - known, set())


if __name__ == "__main__":
    main()
