#!/usr/bin/env python3
"""test_daemon_refusals.py - everything that is wrong with a line, with a request and with
what it asks for: the reason, and a connection that goes on (or is closed, where
docs/protocol.md says so).

That code, retryable and hint belong to the reason is checked for every error on the
way: daemon.py holds each message to protocol.schema.json.
"""

import json
import time

from client import Closed
from daemon import Case, Refused, main, new_uuid

OPEN = {"major": 1, "client": "a test"}


def request(method, params=None, **more):
    """A request as a line."""
    whole = {"jsonrpc": "2.0", "id": "by hand", "method": method}
    if params is not None:
        whole["params"] = params
    return json.dumps({**whole, **more})


def raw(params, method="subject.add"):
    """A request whose params are given as text."""
    return f'{{"jsonrpc":"2.0","id":"by hand","method":"{method}","params":{params}}}'


# (what, line, reason, id that comes back).  None: the id could not be read.
LINES = [
    ("blanks", b"   ", "json_invalid", None),
    ("a word", b"hello", "json_invalid", None),
    ("cut short", b'{"jsonrpc":"2.0","id":1', "json_invalid", None),
    ("single quotes", b"{'jsonrpc':'2.0'}", "json_invalid", None),
    ("a comma too many", b'{"jsonrpc":"2.0","id":1,"method":"status.get",}', "json_invalid", None),
    ("a comment", b'{"jsonrpc":"2.0",/**/"id":1,"method":"status.get"}', "json_invalid", None),
    ("two objects", (request("status.get") * 2).encode(), "json_invalid", None),
    ("something after it", (request("status.get") + " x").encode(), "json_invalid", None),
    ("a byte order mark", b"\xef\xbb\xbf" + request("status.get").encode(), "json_invalid", None),
    ("NaN", raw('{"label":NaN}').encode(), "json_invalid", None),
    ("Infinity", raw('{"label":-Infinity}').encode(), "json_invalid", None),
    ("a leading zero", raw('{"label":01}').encode(), "json_invalid", None),
    ("a hexadecimal number", raw('{"label":0x10}').encode(), "json_invalid", None),
    ("a bare control character", raw('{"label":"a\x01b"}').encode(), "json_invalid", None),
    ("a lone surrogate", raw('{"label":"\\ud800"}').encode(), "json_invalid", None),
    ("an unknown escape", raw('{"label":"\\x41"}').encode(), "json_invalid", None),
    ("Latin-1", raw('{"label":"Zoë"}').encode("latin-1"), "utf8_invalid", None),
    ("an overlong slash", raw('{"label":"_"}').encode().replace(b"_", b"\xc0\xaf"), "utf8_invalid", None),
    ("a UTF-8 surrogate", raw('{"label":"_"}').encode().replace(b"_", b"\xed\xa0\x80"), "utf8_invalid", None),
    ("beyond Unicode", raw('{"label":"_"}').encode().replace(b"_", b"\xf5\x80\x80\x80"), "utf8_invalid", None),
    ("a NUL", raw('{"label":"a\0b"}').encode(), "nul_refused", None),
    ("an escaped NUL", raw('{"label":"a\\u0000b"}').encode(), "nul_refused", None),
    ("an escaped NUL in a name", raw('{"\\u0000label":"a"}').encode(), "nul_refused", None),
    ("a member twice", raw('{"label":"a","label":"b"}').encode(), "duplicate_member", None),
    ("twice, escaped", raw('{"label":"a","\\u006cabel":"b"}').encode(), "duplicate_member", None),
    ("the method twice", request("status.get")[:-1].encode() + b',"method":"x"}', "duplicate_member", None),
    ("17 levels", raw("[" * 16 + "]" * 16).encode(), "too_deep", None),
    ("10 000 levels", b"[" * 10000 + b"]" * 10000, "too_deep", None),
    ("10 000 objects", b'{"a":' * 10000 + b"1" + b"}" * 10000, "too_deep", None),
    ("129 members", raw(json.dumps({f"m{i}": 0 for i in range(129)})).encode(), "too_many_members", None),
    ("1e400", raw('{"label":1e400}').encode(), "number_range", None),
    ("-1e999999", raw('{"label":-1e999999}').encode(), "number_range", None),
    ("64 digits", raw('{"label":' + "1" * 64 + "}").encode(), "number_range", None),
    ("a batch", f"[{request('status.get')}]".encode(), "batch_refused", None),
    ("an empty batch", b"[]", "batch_refused", None),
    ("a number", b"42", "request_invalid", None),
    ("a string", b'"status.get"', "request_invalid", None),
    ("null", b"null", "request_invalid", None),
    ("an empty object", b"{}", "id_missing", None),
    ("no jsonrpc", b'{"id":1,"method":"status.get"}', "request_invalid", 1),
    ("version 1.0", b'{"jsonrpc":"1.0","id":1,"method":"status.get"}', "request_invalid", 1),
    ("no method", b'{"jsonrpc":"2.0","id":1}', "request_invalid", 1),
    ("a method that is a number", request(7).encode(), "request_invalid", "by hand"),
    ("params as an array", request("subject.add", ["x"]).encode(), "params_invalid", "by hand"),
    ("params null", b'{"jsonrpc":"2.0","id":1,"method":"status.get","params":null}', "params_invalid", 1),
    ("another member", request("status.get", extra=1).encode(), "request_invalid", "by hand"),
    ("a member in capitals", b'{"jsonrpc":"2.0","ID":1,"method":"status.get"}', None, None),
    ("no id", b'{"jsonrpc":"2.0","method":"status.get"}', "id_missing", None),
    ("id null", request("status.get", id=None).encode(), "id_invalid", None),
    ("id true", request("status.get", id=True).encode(), "id_invalid", None),
    ("id 1.5", request("status.get", id=1.5).encode(), "id_invalid", None),
    ("id 2^53", request("status.get", id=2**53).encode(), "id_invalid", None),
    ("id of 65 bytes", request("status.get", id="x" * 65).encode(), "id_invalid", None),
    ("id an object", request("status.get", id={}).encode(), "id_invalid", None),
    ("no such method", request("measure.stop").encode(), "method_unknown", "by hand"),
    ("a method in capitals", request("Status.get").encode(), "method_unknown", "by hand"),
    ("an empty method", request("").encode(), "method_unknown", "by hand"),
    ("a method of the station's", request("hello").encode(), "method_unknown", "by hand"),
    ("a method like a path", request("../status.get").encode(), "method_unknown", "by hand"),
    ("an id that is a string", request("measure.stop", id="a-1").encode(), "method_unknown", "a-1"),
    ("the largest id", request("measure.stop", id=2**53 - 1).encode(), "method_unknown", 2**53 - 1),
]  # fmt: skip

SPECTRUM = {"first_nm": 400, "step_nm": 10, "values": [0.3] * 31}


def skin(**more):
    return {
        "spectrum": {**SPECTRUM, **more.pop("spectrum", {})},
        "specular": "sce",
        "store": False,
        **more,
    }


# (what, method, params, reason, path): nothing but a session is there.
REQUESTS = [
    ("an unknown member", "subject.add", {"lable": "x"}, "params_invalid", "/params"),
    ("a member in capitals", "subject.add", {"Label": "x"}, "params_invalid", "/params"),
    ("params where none are taken", "status.get", {"verbose": True}, "params_invalid", "/params"),
    ("a member missing", "record.get", {}, "params_invalid", "/params"),
    ("null for absent", "subject.add", {"label": None}, "params_invalid", "/params/label"),
    ("a number for text", "subject.add", {"label": 7}, "params_invalid", "/params/label"),
    ("no uuid", "record.get", {"id": "7"}, "params_invalid", "/params/id"),
    ("SQL for a uuid", "record.get", {"id": "' OR 1=1 --"}, "params_invalid", "/params/id"),
    ("a uuid with more behind", "record.get", {"id": new_uuid() + "0"}, "params_invalid", "/params/id"),
    ("control characters in a label", "subject.add", {"label": "a\x1b[31m"}, "params_invalid", "/params/label"),
    ("a line feed in a label", "subject.add", {"label": "a\nb"}, "params_invalid", "/params/label"),
    ("DEL in a label", "subject.add", {"label": "a\x7fb"}, "params_invalid", "/params/label"),
    ("an empty label", "subject.add", {"label": ""}, "params_invalid", "/params/label"),
    ("a label of 256 bytes", "subject.add", {"label": "x" * 256}, "params_invalid", "/params/label"),
    ("128 letters of two bytes", "subject.add", {"label": "ë" * 128}, "params_invalid", "/params/label"),
    ("notes of 4096 bytes", "subject.add", {"person": {"notes": "n" * 4096}}, "params_invalid", "/params/person/notes"),
    ("a bell in the notes", "subject.add", {"person": {"notes": "a\x07"}}, "params_invalid", "/params/person/notes"),
    ("born too late", "subject.add", {"person": {"birth_year": 2201}}, "params_invalid", "/params/person/birth_year"),
    ("half a year", "subject.add", {"person": {"birth_year": 1980.5}}, "params_invalid", "/params/person/birth_year"),
    ("a person's unknown member", "subject.add", {"person": {"nmae": "x"}}, "params_invalid", "/params/person"),
    ("no topic", "events.subscribe", {"topics": []}, "params_invalid", "/params/topics"),
    ("an unknown topic", "events.subscribe", {"topics": ["lease", "weather"]}, "params_invalid", "/params/topics/1"),
    ("a negative number", "events.subscribe", {"topics": ["lease"], "since_seq": -1}, "params_invalid", "/params/since_seq"),
    ("a number of 2^53", "record.list", {"since_seq": 2**53}, "params_invalid", "/params/since_seq"),
    ("limit 0", "record.list", {"limit": 0}, "params_invalid", "/params/limit"),
    ("limit 1001", "record.list", {"limit": 1001}, "params_invalid", "/params/limit"),
    ("an unknown format", "record.export", {"format": "xls"}, "params_invalid", "/params/format"),
    ("a table like a path", "table.info", {"table": "../../etc/passwd"}, "params_invalid", "/params/table"),
    ("a table like an option", "table.info", {"table": "-x"}, "params_invalid", "/params/table"),
    ("an unknown table", "table.info", {"table": "none"}, "table_unknown", None),
    ("k 0", "match.spectrum", skin(k=0), "params_invalid", "/params/k"),
    ("an unknown way", "match.spectrum", skin(by="dE76"), "params_invalid", "/params/by"),
    ("specular in capitals", "match.spectrum", skin(specular="SCE"), "params_invalid", "/params/specular"),
    ("store as a number", "match.spectrum", skin(store=1), "params_invalid", "/params/store"),
    ("percent", "match.spectrum", skin(spectrum={"values": [30.0] * 31}), "params_invalid", "/params/spectrum/values/0"),
    ("a negative value", "match.spectrum", skin(spectrum={"values": [0.3, -0.1]}), "params_invalid", "/params/spectrum/values/1"),
    ("no values", "match.spectrum", skin(spectrum={"values": []}), "params_invalid", "/params/spectrum/values"),
    ("1025 values", "match.spectrum", skin(spectrum={"values": [0.3] * 1025}), "params_invalid", "/params/spectrum/values"),
    ("a step of 0", "match.spectrum", skin(spectrum={"step_nm": 0}), "params_invalid", "/params/spectrum/step_nm"),
    ("far infrared", "match.spectrum", skin(spectrum={"first_nm": 2501}), "params_invalid", "/params/spectrum/first_nm"),
    ("too few bands", "match.spectrum", skin(spectrum={"values": [0.3] * 9}), "spectrum_unsuitable", None),
    ("sci without surface", "match.spectrum", skin(specular="sci"), "surface_needed", None),
    ("a surface of a fifth", "match.spectrum", skin(specular="sci", surface=0.2), "params_invalid", "/params/surface"),
    ("an unknown record", "record.get", {"id": new_uuid()}, "record_unknown", None),
    ("an unknown subject", "subject.forget", {"id": new_uuid()}, "subject_unknown", None),
    ("an unknown instrument", "instrument.acquire", {"instrument": "none", "ttl_ms": 1000, "wait": False}, "instrument_unknown", None),
    ("a lease of a second less", "instrument.acquire", {"instrument": "simulated", "ttl_ms": 999, "wait": False}, "params_invalid", "/params/ttl_ms"),
    ("a lease without end", "instrument.acquire", {"instrument": "simulated", "ttl_ms": 600001, "wait": False}, "params_invalid", "/params/ttl_ms"),
    ("a lease nobody gave", "instrument.renew", {"lease": "abc", "ttl_ms": 1000}, "lease_unknown", None),
    ("a second session", "session.open", OPEN, "session_exists", None),
]  # fmt: skip


class Lines(Case):
    def test_bad_lines(self):
        """Each before a session and within one; the connection answers the next request."""
        before, within = self.enterContext(self.daemon.connect()), self.client()
        for what, line, reason, request_id in LINES:
            for c in (before, within):
                with self.subTest(what=what, session=c is within):
                    c.send_line(line)
                    reply = c.next_message()
                    data = reply["error"]["data"]
                    # Which of two faults is told first is the station's choice in this one.
                    self.assertIn(
                        data["reason"], [reason] if reason else ["id_missing", "request_invalid"]
                    )
                    self.assertEqual(reply["id"], request_id)
                    c.send_line(request("no.such", id="next"))
                    self.assertEqual(c.next_message()["id"], "next")

    def test_lines_end_in_any_way(self):
        c = self.client()
        for end in (b"\n", b"\r\n", b" \n", b"\t\r\n", b"\n\n\r\n"):  # an empty line is nothing
            c.send_raw(request("status.get").encode() + end)
            self.assertIn("result", c.next_message())

    def test_what_is_allowed_at_the_limits(self):
        c = self.client()
        line = request("subject.add", {"label": "x"})
        c.send_line(line + " " * (65536 - len(line)))
        self.assertIn("result", c.next_message())
        c.send_line(
            raw(
                json.dumps(
                    {"label": "ë" * 127, "person": {"notes": "n" * 4095, "birth_year": 2200}}
                )
            )
        )
        self.assertIn("result", c.next_message())
        c.send_line(request("status.get", id="x" * 64))
        self.assertEqual(c.next_message()["id"], "x" * 64)
        c.send_line(request("status.get", id=-(2**53 - 1)))
        self.assertEqual(c.next_message()["id"], -(2**53 - 1))

    def test_line_too_long_is_answered_and_closed(self):
        for what, data in (
            ("by one byte", b'"' + b"x" * 65535 + b'"\n'),
            (
                "100 kB of notes",
                raw(json.dumps({"person": {"notes": "n" * 100000}})).encode() + b"\n",
            ),
            ("without end", b"x" * 70000),
        ):
            with self.subTest(what=what), self.daemon.client() as c:
                c.send_raw(data)
                reply = c.next_message()
                self.assertEqual(
                    (reply["error"]["data"]["reason"], reply["id"]), ("line_too_long", None)
                )
                self.assertTrue(c.is_closed(5))

    def test_little_of_the_text_comes_back(self):
        """At most 64 bytes, and nothing that a terminal obeys."""
        c = self.client()
        for method in ("x" * 60000, "\x1b[2J\x1b]0;owned\x07" * 20, "\u202e\u2028" * 1000):
            c.send_line(request(method))
            message = c.next_message()["error"]["message"]
            self.assertLess(len(message.encode()), 200)
            self.assertFalse([x for x in message if ord(x) < 32 or ord(x) == 127], repr(message))


class Requests(Case):
    def test_bad_requests(self):
        c = self.client()
        for what, method, params, reason, path in REQUESTS:
            with self.subTest(what=what):
                with self.assertRaises(Refused) as caught:
                    c.call(method, **params)
                self.assertEqual(caught.exception.reason, reason, str(caught.exception))
                if path is not None:
                    self.assertEqual(caught.exception.path, path)
                self.assertEqual(c.call("status.get")["store"], "ok")
        self.assertEqual(c.call("record.list")["records"], [])
        self.assertEqual(c.call("subject.list")["subjects"], [])

    def test_nothing_without_a_session(self):
        described = self.client().call("rpc.describe")["schema"]["methods"]
        c = self.enterContext(self.daemon.connect())
        for method in described:
            if method not in ("session.open", "session.close"):
                with self.subTest(method=method), self.assertRaises(Refused) as caught:
                    c.call(method, **self.some_params(method))
                self.assertEqual(caught.exception.reason, "session_needed")
        self.assertEqual(c.open()["protocol"]["major"], 1)

    @staticmethod
    def some_params(method):
        """Valid where a method must have some."""
        uuid, lease = new_uuid(), {"lease": "abc"}
        return {
            "check.take": {**lease, "uuid": uuid, "tile": "white"},
            "check.set": {"uuid": uuid, "tile": "white", "limit": 1},
            "instrument.acquire": {"instrument": "simulated", "ttl_ms": 1000, "wait": False},
            "instrument.withdraw": {"instrument": "simulated"},
            "instrument.renew": {**lease, "ttl_ms": 1000},
            "instrument.release": lease,
            "instrument.configure": {**lease, "grid": 0},
            "instrument.calibrate": {**lease, "step": "zero"},
            "measure.start": {
                **lease,
                "uuid": uuid,
                "specular": "sce",
                "replicates": 1,
                "pace": "auto",
            },
            "measure.next": {**lease, "uuid": uuid},
            "measure.cancel": {**lease, "uuid": uuid},
            "match.spectrum": skin(),
            "record.get": {"id": uuid},
            "record.recompute": {"id": uuid},
            "record.export": {"format": "csv"},
            "subject.forget": {"id": uuid},
            "events.subscribe": {"topics": ["lease"]},
        }.get(method, {})

    def test_methods_of_a_lease_without_one(self):
        holder, lease = self.ready()
        c = self.client()
        leased = [m for m in ("instrument.renew", "instrument.release", "instrument.configure",
                              "instrument.calibrate", "measure.start", "measure.next", "measure.cancel",
                              "check.take", "check.set")]  # fmt: skip
        for method in leased:
            for what, name in (("nobody's", "abc"), ("another client's", lease)):
                with self.subTest(method=method, lease=what), self.refused("lease_unknown"):
                    c.call(method, **{**self.some_params(method), "lease": name})
        with self.refused("instrument_busy"):
            c.acquire()
        with self.refused("lease_exists"):
            holder.acquire()
        self.assertEqual(len(holder.measure(lease)["replicates"]), 1)  # it is the holder's still

    def test_methods_of_a_lease_that_expired(self):
        c, _ = self.ready()
        c.call("instrument.release", lease=_)
        c.call("events.subscribe", topics=["lease"])
        lease = c.acquire(ttl_ms=1000)["lease"]
        self.assertEqual(c.event("lease", "freed")["data"]["cause"], "expired")
        for method in ("instrument.renew", "instrument.calibrate", "measure.start"):
            with self.subTest(method=method), self.refused("lease_expired"):
                c.call(method, **{**self.some_params(method), "lease": lease})

    def test_use_renews_a_lease(self):
        c, lease = self.ready()
        c.call("instrument.release", lease=lease)
        lease = c.acquire(ttl_ms=3000)["lease"]
        for _ in range(4):
            time.sleep(1.0)
            c.call("instrument.renew", lease=lease, ttl_ms=3000)
        for _ in range(3):
            time.sleep(1.0)
            c.measure(lease)

    def test_versions(self):
        for major, reason in (
            (2, "protocol_version"),
            (0, "protocol_version"),
            (-1, "params_invalid"),
        ):
            with self.subTest(major=major), self.daemon.connect() as c:
                with self.refused(reason):
                    c.call("session.open", major=major, client="a test")
                self.assertEqual(c.open()["protocol"], {"major": 1, "minor": 0})
        for client in ("", "a\nb", "x" * 64):
            with self.subTest(client=client), self.daemon.connect() as c:
                with self.refused("params_invalid"):
                    c.call("session.open", major=1, client=client)

    def test_too_many_requests_at_once(self):
        """Each is answered, if only with a refusal."""
        c, lease = self.ready()
        ids = [c.send("match.spectrum", **skin(by="lab", k=10)) for _ in range(300)]
        reasons = set()
        for i in ids:
            try:
                c.wait(i)
            except Refused as refused:
                reasons.add(refused.reason)
        self.assertLessEqual(reasons, {"too_many_requests"})
        self.assertTrue(c.measure(lease)["id"])

    def test_half_a_line_and_gone(self):
        for data in (b"", b'{"jsonrpc"', b"x" * 60000):
            with self.daemon.connect() as c:
                c.send_raw(data)
        self.assertEqual(self.client().call("status.get")["store"], "ok")

    def test_all_in_one_write(self):
        """Requests may come in one piece, or byte by byte."""
        c = self.enterContext(self.daemon.connect())
        lines = request("session.open", OPEN) + "\n" + request("status.get", id=2) + "\n"
        c.send_raw(lines.encode())
        self.assertEqual({c.next_message()["id"] for _ in range(2)}, {"by hand", 2})
        for byte in request("status.get", id=3).encode() + b"\n":
            c.send_raw(bytes([byte]))
        self.assertEqual(c.next_message()["id"], 3)

    def test_what_came_before_the_end_is_answered(self):
        """A client that shuts its writing side down still gets its replies."""
        c = self.client()
        c.send_line(request("status.get", id=5))
        c.socket.shutdown(1)
        try:
            self.assertEqual(c.next_message()["id"], 5)
        except Closed:
            self.fail("closed without the reply")


if __name__ == "__main__":
    main()
