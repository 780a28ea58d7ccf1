#!/usr/bin/env python3
"""test_station_connection.py - finding the station, and stations that are none, speak
otherwise, refuse, or go away.  A scripted stand-in (fake_station.py) does what the real daemon
never should."""

import os
import signal
import subprocess
import time
import uuid

from fake_station import HELLO, SESSION, FakeStation
from support import SKINSPEC, TIMEOUT_S, Case, Terminal, environment, main, run, start

INSTRUMENT = {
    "instrument": "one",
    "driver": "simulated",
    "state": "ready",
    "maker": "M",
    "model": "X",
    "has_button": True,
    "leased": False,
    "queue": 0,
    "calibration": [],
}
RECORD = {
    "id": "018f2c3a-5b6d-7e8f-9a0b-1c2d3e4f5a6b",
    "seq": 7,
    "taken_at": "2031-05-06T07:08:09.123Z",
    "operator": "Ada",
    "instrument": "M X",
    "serial": "S1",
    "specular": "sce",
    "aperture_mm": 8,
    "surface": 0.04,
    "replicates": [],
    "replicates_sci": [{"first_nm": 400, "step_nm": 100, "values": [0.2, 0.3, 0.4, 0.5]}] * 2,
    "spectrum": {"first_nm": 400, "step_nm": 100, "values": [0.16, 0.26, 0.36, 0.46]},
    "illuminant": "D65",
    "observer": "10",
    "subject": "018f2c3a-5b6d-4e8f-9a0b-1c2d3e4f5a6b",
    "site": "forearm",
    "flags": ["spread", "flag_of_tomorrow"],
    "corrects": "018f2c3a-5b6d-7e8f-9a0b-1c2d3e4f5a6a",
}
LEASE = {"lease": "L", "fence": 1, "expires_in_ms": 60000}
SUBSCRIBED = {"boot": HELLO["boot"], "event_seq": 0, "resumed": True}


def begin(peer, instrument=None, lease=None):
    """What `measure` does before it starts; the uuid of measure.start and its id."""
    instruments = {"instruments": [dict(INSTRUMENT, **(instrument or {}))]}
    peer.open()
    peer.answer("instrument.list", instruments)
    peer.answer("events.subscribe", SUBSCRIBED)
    peer.answer("instrument.acquire", lease or LEASE)
    peer.answer("instrument.list", instruments)
    number, params = peer.request("measure.start")
    return params["uuid"], number


class Finding(Case):
    def test_nobody_there(self):
        folder = self.folder()
        done = self.refused(1, "status", "--socket", os.path.join(folder, "no"))
        self.assertEqual(done.out, "")
        for text in (folder + "/no: No such file", "skinspecd --socket", "systemctl start"):
            self.assertIn(text, done.err)
        self.assertEqual(len(done.err.splitlines()), 1)

    def test_the_usual_places_are_tried_and_named(self):
        folder = self.folder()
        done = self.refused(1, "devices", env=environment(XDG_RUNTIME_DIR=folder))
        self.assertIn(f"{folder}/skinspec.sock: No such", done.err)
        self.assertIn("/run/skinspec/skinspecd.sock: ", done.err)

    def test_a_place_that_was_said_is_the_only_one(self):
        folder = self.folder()
        env = environment(SKINSPEC_SOCKET=folder + "/said", XDG_RUNTIME_DIR=folder)
        done = self.refused(1, "devices", env=env)
        self.assertIn(folder + "/said", done.err)
        self.assertNotIn("skinspec.sock", done.err)
        done = self.refused(1, "devices", "--socket", folder + "/option", env=env)
        self.assertIn(folder + "/option", done.err)
        self.assertNotIn(folder + "/said", done.err)

    def test_the_first_that_answers(self):
        """$XDG_RUNTIME_DIR/skinspec.sock, or what SKINSPEC_SOCKET says."""

        def script(peer):
            peer.open()
            peer.answer("instrument.list", {"instruments": []})

        with FakeStation(script) as fake:
            os.symlink(fake.socket, os.path.join(fake.folder, "skinspec.sock"))
            done = self.run_ok("devices", env=environment(XDG_RUNTIME_DIR=fake.folder))
            self.assertIn("none; skinspecd --instrument", done.out)
        with FakeStation(script) as fake:
            self.run_ok("devices", env=environment(SKINSPEC_SOCKET=fake.socket))

    def test_what_is_no_socket(self):
        for path, says in (
            (self.file("x"), "Connection refused"),
            ("/tmp/" + 120 * "x", "name too long"),
            (self.folder(), "Connection refused"),
        ):
            self.refused(1, "status", "--socket", path, says=says)

    def test_a_socket_of_others(self):
        if os.geteuid() != 0:
            self.skipTest("needs root, to be somebody who may not")
        folder = self.folder()
        os.chmod(folder, 0o700)
        done = subprocess.run(
            [SKINSPEC, "status", "--socket", folder + "/s"],
            user=65534,
            stderr=subprocess.PIPE,
            env=environment(),
            timeout=TIMEOUT_S,
            check=False,
        )
        if b"skinspec" not in done.stderr:
            self.skipTest("the program itself is not reachable for nobody")
        self.assertIn(b"add you to the group", done.stderr)


class Hello(Case):
    def greeted(self, greeting, says):
        def script(peer):
            peer.send(greeting)
            peer.until_closed()

        with FakeStation(script) as fake:
            done = self.refused(1, "status", "--socket", fake.socket, says=says)
            self.assertEqual(done.out, "")
            self.assertEqual(len(done.err.splitlines()), 1)

    def test_others_that_listen(self):
        none = "not the protocol of a skinspec station"
        self.greeted(b"SSH-2.0-OpenSSH_9.2\r\n", none)
        self.greeted(b"{}\n", none)
        self.greeted(b'{"jsonrpc":"2.0","method":"welcome","params":{}}\n', none)
        self.greeted(b"\xff\xfe\n", none)

    def test_one_that_says_nothing(self):
        begun = time.monotonic()
        self.greeted(b"", "no hello within 5 s")
        self.assertLess(time.monotonic() - begun, 15)

    def test_another_major_version(self):
        greeting = dict(HELLO, protocol={"major": 2, "minor": 3})
        self.greeted(
            {"jsonrpc": "2.0", "method": "hello", "params": greeting}, ("a fake", "2", "1")
        )

    def test_refused_at_the_door(self):
        error = {
            "code": -32000,
            "message": "as many clients as it takes",
            "data": {"reason": "too_many_clients", "hint": "Wait.", "retryable": True},
        }
        self.greeted(
            {"jsonrpc": "2.0", "id": None, "error": error},
            "skinspec: as many clients as it takes (too_many_clients) - Wait.\n",
        )

    def test_a_session_that_is_refused(self):
        def script(peer):
            peer.notify("hello", HELLO)
            number, params = peer.request("session.open")
            assert params["major"] == 1 and params["client"] == "skinspec", params
            peer.refuse(number, "shutting_down", "the station is stopping", "Later.")

        with FakeStation(script) as fake:
            says = "the station is stopping (shutting_down) - Later."
            self.refused(1, "status", "--socket", fake.socket, says=says)


class Replies(Case):
    def status(self, script, *more):
        def whole(peer):
            peer.open()
            script(peer)

        with FakeStation(whole) as fake:
            return run("devices", "--socket", fake.socket, *more)

    def test_what_comes_between_and_what_is_new(self):
        """Events, replies to nobody and members of later versions do not disturb."""

        def script(peer):
            number, _ = peer.request("instrument.list")
            peer.notify("news.of_tomorrow", {"a": 1})
            peer.event(1, "store", "record", id="x", seq=1)
            peer.reply(4711, {"other": True})
            peer.reply(number, {"instruments": [dict(INSTRUMENT, new=[1])], "new": {}})

        done = self.status(script, "--json")
        self.assertEqual((done.status, done.err), (0, ""))
        self.assertEqual(done.json()[0]["new"], [1])

    def test_a_refusal_of_the_instrument(self):
        def script(peer):
            number, _ = peer.request("instrument.list")
            peer.refuse(
                number, "instrument_fault", "the lamp is dead", "Repair.", device_code="ER27"
            )

        done = self.status(script)
        self.assertEqual(done.status, 1)
        self.assertEqual(
            done.err,
            "skinspec: the lamp is dead (instrument_fault, instrument says ER27) - Repair.\n",
        )

    def test_a_refusal_of_the_line_itself(self):
        def script(peer):
            peer.request("instrument.list")
            error = {
                "code": -32700,
                "message": "no JSON",
                "data": {"reason": "json_invalid", "hint": "?"},
            }
            peer.send({"jsonrpc": "2.0", "id": None, "error": error})

        done = self.status(script)
        self.assertEqual((done.status, done.err), (1, "skinspec: no JSON (json_invalid) - ?\n"))

    def test_the_station_goes_away(self):
        for last in (b"", b'{"jsonrpc":"2.0","id":2,"res'):

            def script(peer, last=last):
                peer.request("instrument.list")
                peer.send(last)

            done = self.status(script)
            self.assertEqual(done.status, 1)
            self.assertIn("the connection to the station ended", done.err)

    def test_no_protocol(self):
        """Beyond the protocol's line, and a line that is no JSON."""
        for last in (b'{"a":"' + b"x" * (1 << 20), b"}{\n"):

            def script(peer, last=last):
                peer.request("instrument.list")
                peer.send(last)
                peer.until_closed()

            done = self.status(script)
            self.assertEqual(done.status, 1)
            self.assertIn("not the protocol", done.err)

    def test_the_longest_line(self):
        """1 MiB, line feed included, in pieces."""

        def script(peer):
            number, _ = peer.request("instrument.list")
            head = b'{"jsonrpc":"2.0","id":%d,"result":{"instruments":[],"x":"' % number
            line = head + b"x" * ((1 << 20) - len(head) - 4) + b'"}}\n'
            assert len(line) == 1 << 20
            for at in range(0, len(line), 100000):
                peer.send(line[at : at + 100000])

        self.assertEqual(self.status(script, "--json").json(), [])

    def test_text_that_is_no_utf8(self):
        def script(peer):
            peer.notify("hello", HELLO)
            peer.until_closed()

        with FakeStation(script) as fake:
            name = os.fsdecode(b"\xff")
            says = "session.open: a text is not UTF-8"
            self.refused(1, "measure", "--socket", fake.socket, "--operator", name, says=says)

    def test_text_that_is_too_long(self):
        """It is not sent, and what to do is said."""

        def script(peer):
            peer.notify("hello", HELLO)
            peer.until_closed()

        with FakeStation(script) as fake:
            says = "session.open: a request takes at most 65536 bytes in all: shorten the texts in it"
            options = ("--socket", fake.socket, "--operator", "x" * 100000)
            self.refused(1, "measure", *options, says=says)


class Refusals(Case):
    """Each request of each command refused, and no station at all: status 1, and the reason on
    one line."""

    REQUESTS = (
        (("devices",), (), "instrument.list"),
        (("status",), (), "status.get"),
        (("calibrate",), (), "instrument.list"),
        (("calibrate",), ("list",), "instrument.acquire"),
        (("calibrate",), ("list", "acquire"), "instrument.list"),
        (("measure",), (), "instrument.list"),
        (("measure",), ("list",), "events.subscribe"),
        (("watch",), (), "events.subscribe"),
        (("history",), (), "status.get"),
        (("history", "--since", "1"), (), "record.list"),
        (("history", RECORD["id"]), (), "record.get"),
        (("history", RECORD["id"], "--recompute"), (), "record.recompute"),
        (("export",), (), "record.export"),
        (("export", "--limit", "1"), (), "record.list"),
        (("store", "verify"), (), "store.verify"),
        (("store", "begin-anew", "--yes"), (), "store.begin_anew"),
        (("store", "subjects"), (), "subject.list"),
        (("store", "add-subject"), (), "subject.add"),
        (("store", "forget-subject", RECORD["id"], "--yes"), (), "subject.forget"),
    )
    BEFORE = {
        "list": ("instrument.list", {"instruments": [INSTRUMENT]}),
        "acquire": ("instrument.acquire", LEASE),
    }

    def test_refused(self):
        for command, before, method in self.REQUESTS:

            def script(peer, before=before, method=method):
                peer.open()
                for step in before:
                    peer.answer(*self.BEFORE[step])
                number, _ = peer.request(method)
                peer.refuse(number, "right_needed", "this user may not do that", "Ask.")
                peer.until_closed()

            with self.subTest(command=command, method=method), FakeStation(script) as fake:
                done = run(*command, "--socket", fake.socket)
                self.assertEqual(done.status, 1)
                self.assertEqual(
                    done.err, "skinspec: this user may not do that (right_needed) - Ask.\n"
                )

    def test_no_station(self):
        path = os.path.join(self.folder(), "s")
        for command in {x[0] for x in self.REQUESTS}:
            done = run(*command, "--socket", path)
            self.assertEqual((done.status, done.out), (1, ""), command)
            self.assertIn("no station answers", done.err)

    def test_a_file_that_cannot_be_finished(self):
        """The second page is refused: no file, no part of one."""

        def script(peer):
            peer.open()
            number, params = peer.request("record.export")
            self.assertEqual(params, {"format": "csv"})
            peer.reply(number, {"text": "a,b\n", "next_seq": 5, "until_seq": 9, "more": True})
            number, params = peer.request("record.export")
            self.assertEqual(params, {"format": "csv", "since_seq": 5, "until_seq": 9})
            peer.refuse(number, "store_failed")

        folder = self.folder()
        with FakeStation(script) as fake:
            done = run("export", "--out", folder + "/x", "--socket", fake.socket)
        self.assertEqual((done.status, done.out), (1, ""))
        self.assertIn("(store_failed)", done.err)
        self.assertEqual(os.listdir(folder), [])


class Showing(Case):
    def shown(self, method, result, *command):
        def script(peer):
            peer.open()
            peer.answer(method, result)

        with FakeStation(script) as fake:
            return self.run_ok(*command, "--socket", fake.socket).out

    def test_an_instrument_that_is_charged(self):
        state = {"step": "zero", "due": False, "expires_in_s": 3 * 86400 + 2 * 3600 + 5}
        due = {"step": "white", "due": True, "cause": "of_tomorrow", "place": "the tile"}
        out = self.shown(
            "instrument.list",
            {"instruments": [dict(INSTRUMENT, charging=True, calibration=[state, due])]},
            "devices",
        )
        self.assertIn("  the flash is charging\n", out)
        self.assertIn("  zero is good for 3 days 2 h\n", out)
        self.assertIn("  white is due (of_tomorrow): the tile\n", out)

    def test_a_record_that_comes_out_otherwise(self):
        match = {"Cm": 0.1, "Bm": 0.5, "Ch": 0.02, "L": 50, "a": 9, "b": 15, "distance": 0.5,
                 "by": "rgb", "table": "paper", "table_sha256": "0" * 64, "flags": []}  # fmt: skip
        out = self.shown(
            "record.recompute",
            {
                "id": RECORD["id"],
                "same_bits": False,
                "difference": 1.25e-9,
                "stored": match,
                "recomputed": dict(match, Cm=0.2),
            },
            *("history", RECORD["id"], "--recompute"),
        )
        self.assertIn("the largest relative difference of a number is 1.25e-09\n", out)
        self.assertIn("Cm 0.1000", out)
        self.assertIn("Cm 0.2000", out)
        self.assertIn("distance 0.5 by rgb; table paper\n", out)

    def test_what_is_not_erased_yet(self):
        out = self.shown(
            "subject.forget",
            {"id": RECORD["id"], "erased": False},
            *("store", "forget-subject", RECORD["id"], "--yes"),
        )
        self.assertIn("the last bytes go when", out)


class Measuring(Case):
    def test_the_queue_and_the_lease(self):
        """The place in the queue is told; a lease that lasts 300 ms is renewed meanwhile."""
        renewed = []

        def script(peer):
            instruments = {"instruments": [INSTRUMENT]}
            peer.open()
            peer.answer("instrument.list", instruments)
            self.assertEqual(
                sorted(peer.answer("events.subscribe", SUBSCRIBED)["topics"]),
                ["lease", "measurement"],
            )
            number, params = peer.request("instrument.acquire")
            self.assertTrue(params["wait"])
            peer.event(0, "lease", "queued", instrument="one", connection=4, position=1)
            peer.event(1, "lease", "queued", instrument="one", connection=5, position=2)
            peer.event(2, "lease", "granted", instrument="one", fence=3)
            peer.reply(number, dict(LEASE, expires_in_ms=300))
            peer.answer("instrument.list", instruments)
            start_id, params = peer.request("measure.start")
            peer.event(3, "measurement", "shot", uuid="another's", shot=9, replicates=9, flags=[])
            peer.event(
                4, "measurement", "shot", uuid=params["uuid"], shot=1, replicates=3, flags=["x"]
            )
            for _ in range(3):
                number, params = peer.request("instrument.renew")
                renewed.append(params)
                peer.reply(number, LEASE)
            peer.reply(start_id, RECORD)
            self.assertEqual(peer.answer("instrument.release", {"released": True}), {"lease": "L"})

        with FakeStation(script) as fake:
            done = self.run_ok("measure", "--wait", "--json", "--socket", fake.socket)
        self.assertEqual(done.json(), RECORD)
        self.assertEqual(done.err.count("in the queue"), 1, "another's place is its own affair")
        self.assertIn("place 2 in the queue", done.err)
        self.assertIn("shot 1 of 3 taken: x", done.err)
        self.assertNotIn("9 of 9", done.err)
        self.assertEqual(renewed, [{"lease": "L", "ttl_ms": 60000}] * 3)

    def test_what_is_asked_for(self):
        asked = {}

        def script(peer):
            instruments = {"instruments": [INSTRUMENT]}
            peer.notify("hello", HELLO)
            asked["session"] = peer.answer("session.open", SESSION)
            peer.answer("instrument.list", instruments)
            peer.answer("events.subscribe", SUBSCRIBED)
            asked["acquire"] = peer.answer("instrument.acquire", LEASE)
            peer.answer("instrument.list", instruments)
            asked["start"] = peer.answer("measure.start", RECORD)
            peer.answer("instrument.release", {"released": True})

        own, subject = str(uuid.uuid4()), str(uuid.uuid4())
        with FakeStation(script) as fake:
            self.run_ok(
                *("measure", "--instrument", "one", "--replicates", 5, "--pace", "prompt"),
                *(
                    "--specular",
                    "sci",
                    "--surface",
                    0.045,
                    "--subject",
                    subject,
                    "--site",
                    "Stirn ü",
                ),
                *("--by", "rgb-float", "--table", "paper", "--operator", "Ada", "--uuid", own),
                *("--socket", fake.socket),
            )
        self.assertEqual(asked["session"]["operator"], "Ada")
        self.assertEqual(asked["acquire"], {"instrument": "one", "ttl_ms": 60000, "wait": False})
        self.assertEqual(
            asked["start"],
            {
                "lease": "L",
                "uuid": own,
                "specular": "sci",
                "surface": 0.045,
                "replicates": 5,
                "pace": "prompt",
                "subject": subject,
                "site": "Stirn ü",
                "table": "paper",
                "by": "rgb-float",
            },
        )

    def test_the_station_goes_in_between(self):
        """Whether it was stored is not known; the same uuid finds out."""
        started = []

        def script(peer):
            started.append(begin(peer)[0])

        with FakeStation(script) as fake:
            done = self.refused(1, "measure", "--socket", fake.socket)
        self.assertIn("the connection to the station ended", done.err)
        self.assertIn(f"--uuid {started[0]}", done.err)

    def test_ctrl_c_after_the_last_shot(self):
        """The record was on its way: it is shown, and it is said that it was stored."""

        def script(peer):
            own, number = begin(peer)
            peer.event(1, "measurement", "shot", uuid=own, shot=1, replicates=1, flags=[])
            cancel, params = peer.request("measure.cancel")
            self.assertEqual(params, {"lease": "L", "uuid": own})
            peer.refuse(cancel, "measurement_unknown")
            peer.reply(number, RECORD)
            peer.answer("instrument.release", {"released": True})

        with FakeStation(script) as fake, start(
            "measure", "--json", "--socket", fake.socket, stdout=-1, stderr=-1
        ) as child:
            self.assertIn(b"shot 1", child.stderr.readline())
            child.send_signal(signal.SIGINT)
            out, err = child.communicate(timeout=TIMEOUT_S)
        self.assertEqual(child.returncode, 0)
        self.assertIn(b'"seq":7', out)
        self.assertIn(b"it was stored before it could be cancelled", err)

    def test_ctrl_c_twice(self):
        """The second does not wait for a station that hangs."""

        def script(peer):
            own, _ = begin(peer)
            peer.event(1, "measurement", "shot", uuid=own, shot=1, replicates=1, flags=[])
            peer.request("measure.cancel")
            peer.event(2, "measurement", "shot", uuid=own, shot=1, replicates=1, flags=[])
            peer.answer("instrument.release", {"released": True})

        with FakeStation(script) as fake, start(
            "measure", "--socket", fake.socket, stdout=-1, stderr=-1
        ) as child:
            child.stderr.readline()
            child.send_signal(signal.SIGINT)
            child.stderr.readline()
            child.send_signal(signal.SIGTERM)
            err = child.communicate(timeout=TIMEOUT_S)[1]
        self.assertEqual(child.returncode, -signal.SIGTERM)
        self.assertIn(b"whether the measurement was stored is not known", err)

    def test_enter_that_comes_too_late(self):
        """The button was quicker: no complaint."""

        def script(peer):
            own, number = begin(peer)
            peer.event(1, "measurement", "waiting", uuid=own, shot=2, replicates=2, prompt="Lift")
            late, _ = peer.request("measure.next")
            peer.refuse(late, "measurement_not_waiting", "too late")
            peer.event(2, "measurement", "shot", uuid=own, shot=2, replicates=2, flags=[])
            peer.reply(number, RECORD)
            peer.answer("instrument.release", {"released": True})

        with FakeStation(script) as fake, Terminal(
            "measure", "--pace", "prompt", "--socket", fake.socket
        ) as person:
            person.expect("Lift; for shot 2 of 2 press Enter or the instrument's button\n")
            person.type("\n")
            status, shown = person.end()
        self.assertEqual(status, 0)
        self.assertNotIn("too late", shown)

    def test_a_prompt_with_nobody_to_answer(self):
        """No more input, and no button: cancelled.  With a button it goes on."""
        for button in (False, True):

            def script(peer, button=button):
                own, number = begin(peer, {"has_button": button})
                peer.event(1, "measurement", "waiting", uuid=own, shot=2, replicates=2, prompt="")
                if button:
                    peer.event(2, "measurement", "shot", uuid=own, shot=2, replicates=2, flags=[])
                    peer.reply(number, RECORD)
                else:
                    cancel, _ = peer.request("measure.cancel")
                    peer.reply(cancel, {"uuid": own, "stored": False, "discarded": 1})
                    peer.refuse(number, "measurement_cancelled")
                peer.answer("instrument.release", {"released": True})

            with FakeStation(script) as fake:
                done = run("measure", "--pace", "prompt", "--socket", fake.socket)
            self.assertEqual(done.status, 0 if button else 1, done.err)
            if not button:
                self.assertIn("standard input has ended", done.err)
                self.assertIn("cancelled; nothing was stored", done.err)

    def test_a_record_for_a_person(self):
        """Every member is shown; what is absent is not."""

        def script(peer):
            _, number = begin(peer)
            peer.reply(number, RECORD)
            peer.answer("instrument.release", {"released": True})

        with FakeStation(script) as fake:
            done = self.run_ok("measure", "--socket", fake.socket)
        for text in (
            "record 7  " + RECORD["id"],
            "taken    2031-05-06T07:08:09.123Z by Ada, M X S1, 8 mm, sce (sci less 0.04), 2 shots",
            "site     forearm",
            "subject  " + RECORD["subject"],
            "corrects " + RECORD["corrects"],
            "match    none",
            "beware   spread: the shots differ more than skin does",
            "beware   flag_of_tomorrow\n",
        ):
            self.assertIn(text, done.out)
        self.assertNotIn("ITA", done.out)

    def test_a_record_that_is_none(self):
        def script(peer):
            _, number = begin(peer)
            peer.reply(number, dict(RECORD, spectrum={"first_nm": 400}))
            peer.answer("instrument.release", {"released": True})

        with FakeStation(script) as fake:
            self.refused(1, "measure", "--socket", fake.socket, says="cannot read")


class Watching(Case):
    def test_lost_events_and_the_end(self):
        def script(peer):
            peer.open()
            params = peer.answer("events.subscribe", dict(SUBSCRIBED, resumed=False))
            self.assertEqual(params["since_seq"], 3)
            snapshot = {"store": "full", "table": "ready", "last_seq": 41}
            peer.notify("events.lost", {"since_seq": 3, "next_seq": 90, "snapshot": snapshot})
            peer.notify("news.of_tomorrow", {})
            peer.event(90, "calibration", "due", instrument="one",
                       calibration={"step": "zero", "due": True, "cause": "never", "place": "box"})  # fmt: skip

        for json in (False, True):
            with FakeStation(script) as fake:
                done = run("watch", "--since", "3", "--socket", fake.socket, *["--json"] * json)
            self.assertEqual(done.status, 1, "the station went away")
            self.assertIn("the connection to the station ended", done.err)
            if json:
                lost, event = done.ndjson()
                self.assertEqual(lost["lost"]["next_seq"], 90)
                self.assertEqual((event["seq"], event["type"]), (90, "due"))
            else:
                lost, event = done.out.splitlines()
                self.assertIn("after 3 and before 90 are lost; now: store full, table ready", lost)
                self.assertEqual(
                    event, "    90  calibration/due  instrument one  step zero  due  cause never"
                    "  place box"
                )  # fmt: skip


if __name__ == "__main__":
    main()
